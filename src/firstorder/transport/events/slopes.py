"""Slopes and angles: the two names of a direction, `v = tan(theta)`."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp

from firstorder.conventions import Frame, slope
from firstorder.laws.base import Law
from firstorder.laws.warp import Map, Warp
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Array, Ray


def v_D_theta(theta: Array) -> Array:
    """`dv / d theta = 1 + tan(theta)^2`.

    Args:
        theta: angles, an array of any shape [rad].

    Returns:
        An array of that shape [1/rad].

    Reference: D05 §2.1, §3.3.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport import v_D_theta
        >>> round(v_D_theta(jnp.array(0.25 * jnp.pi)).item(), 12)
        2.0
    """
    return 1.0 + jnp.tan(theta) ** 2


def theta_D_v(v: Array) -> Array:
    """`d theta / dv = 1 / (1 + v^2)`.

    Args:
        v: slopes, an array of any shape.

    Returns:
        An array of that shape [rad].

    Reference: D05 §2.1, §3.3.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport import theta_D_v
        >>> theta_D_v(jnp.array(1.0)).item()
        0.5
    """
    return 1.0 / (1.0 + v**2)


class ToSlope(Event):
    """Light relabelled from angles to slopes: `l(x, v) = L(x, arctan(v))`.

    Radiance is a value and not a density, so no Jacobian enters; it enters where directions are
    integrated, `d theta = dv / (1 + v^2)`. A warp: the spectrum is refused, and passes through the
    linearised event; at v = 0 that is the identity (`v = theta`), wrong by v^3 / 3.

    Reference: D05 §2.1 and Figs. 3, 8.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import ToAngle, ToSlope
        >>> L = gaussian((0.0, 0.2), (1.0, 0.5))
        >>> round((ToSlope() >> ToAngle())(L)(0.3, 0.7).item() - L(0.3, 0.7).item(), 15)
        0.0
    """

    def law(self, frame: Frame) -> Law:
        """The warp of the one direction."""
        require_frame(frame.coordinates == ("x", "theta"), self, frame, "light in x and theta")
        return Warp(_Arctangent(), dataclasses.replace(frame, coordinates=("x", "v")))


class ToAngle(Event):
    """Light relabelled from slopes to angles: `L(x, theta) = l(x, tan(theta))`.

    Valid for |theta| < pi / 2: a slope knows no rays from below the line, and NaN answers for
    them. To reflect such light, take it from above the line only (`AboveLine`, or
    `surface.reflect(light, above=True)`). On |theta| <= a the
    linearisation `v = theta` misplaces rays by `tan(a) - a`, about a^3 / 3.

    Reference: D05 §2.1, §4 and Figs. 3, 8.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import ToAngle
        >>> l = gaussian((0.0, 1.0), (1.0, 0.5), frame=FLATLAND_SLOPE)
        >>> round(ToAngle()(l)(0.0, 0.7853981633974483).item(), 12)
        1.0
    """

    def law(self, frame: Frame) -> Law:
        """The warp of the one direction."""
        require_frame(frame.coordinates == ("x", "v"), self, frame, "light in x and v")
        return Warp(_Tangent(), dataclasses.replace(frame, coordinates=("x", "theta")))


class _Arctangent(Map):
    """`(x, arctan(v))`."""

    def __call__(self, u: Ray) -> Ray:
        """The angle of a slope."""
        return jnp.stack([u[0], jnp.arctan(u[1])])

    def derivatives(self, u: Ray):
        """`1 / (1 + v^2)` and `-2 v / (1 + v^2)^2`."""
        first = theta_D_v(u[1])
        return self(u), *_along_direction(u, first, -2.0 * u[1] * first**2)


class _Tangent(Map):
    """`(x, tan(theta))`."""

    def __call__(self, u: Ray) -> Ray:
        """The slope of an angle."""
        return jnp.stack([u[0], slope(u[1])])

    def derivatives(self, u: Ray):
        """`1 + tan^2` and `2 tan (1 + tan^2)`."""
        first = v_D_theta(u[1])
        return self(u), *_along_direction(u, first, 2.0 * jnp.tan(u[1]) * first)


def _along_direction(u: Ray, first: Array, second: Array):
    """First and second derivatives of a map that moves the direction alone."""
    J = jnp.eye(2, dtype=u.dtype).at[1, 1].set(first)
    return J, jnp.zeros((2, 2, 2), u.dtype).at[1, 1, 1].set(second)
