"""Jets of flatland as six numbers, and lights that give them without arrays."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from firstorder.conventions import FLATLAND, Frame
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.typing import Array, Ray, Scalar


class Entries(NamedTuple):
    """A flatland jet as six numbers (or six arrays), which fuse where matrices would not."""

    value: Array
    x: Array
    theta: Array
    xx: Array
    x_theta: Array
    theta_theta: Array

    def __add__(self, other: "Entries") -> "Entries":  # pyright: ignore
        """Sum of two functions."""
        return Entries(*(a + b for a, b in zip(self, other, strict=True)))

    def scaled(self, a) -> "Entries":
        """The function times a constant."""
        return Entries(*(a * e for e in self))

    def times(self, g: "Entries") -> "Entries":
        """Product of two functions: Leibniz' rule."""
        f = self
        return Entries(
            f.value * g.value,
            f.x * g.value + f.value * g.x,
            f.theta * g.value + f.value * g.theta,
            f.xx * g.value + 2.0 * f.x * g.x + f.value * g.xx,
            f.x_theta * g.value + f.x * g.theta + f.theta * g.x + f.value * g.x_theta,
            f.theta_theta * g.value + 2.0 * f.theta * g.theta + f.value * g.theta_theta,
        )

    def turned(self, n: "Normal", turn: float, look: float) -> "Entries":
        """`h(x, theta) = f(x, turn n(x) + look theta - t)` from the entries of f there.

        With `turn, look = 2, -1` this is R07 (68), and R07 (25), (29), (69) follow.
        """
        f, c = self, turn * n.x
        return Entries(
            f.value,
            f.x + c * f.theta,
            look * f.theta,
            f.xx + 2.0 * c * f.x_theta + c * c * f.theta_theta + turn * n.xx * f.theta,
            look * (f.x_theta + c * f.theta_theta),
            look * look * f.theta_theta,
        )

    def jet(self, frame: Frame) -> Jet:
        """Jet with gradient and Hessian as arrays."""
        mixed = self.x_theta
        rows = [jnp.stack([self.xx, mixed], -1), jnp.stack([mixed, self.theta_theta], -1)]
        gradient = jnp.stack([self.x, self.theta], -1)
        return Jet(self.value, gradient, jnp.stack(rows, -2), frame)


class Normal(NamedTuple):
    """The normal's angle at a point and its derivatives along the surface: n, n_x, n_xx."""

    value: Array
    x: Array
    xx: Array


class FlatlandLight(Field):
    """Flatland light from two callables: radiance, and the six entries of its jet.

    Args:
        value: maps (x, theta) to radiance.
        derivatives: maps (x, theta) to `L, L_x, L_theta, L_xx, L_xtheta, L_thetatheta`.
        frame: names of the coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport import FlatlandLight
        >>> zero, one = jnp.array(0.0), jnp.array(1.0)
        >>> L = FlatlandLight(lambda x, t: x * t, lambda x, t: (x * t, t, x, zero, one, zero))
        >>> L.jet(jnp.array([2.0, 3.0])).gradient[0].item()
        3.0
    """

    function: Callable = eqx.field(static=True)
    derivatives: Callable = eqx.field(static=True)
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def at(self, u: Ray) -> Scalar:
        """The radiance."""
        return self.function(u[0], u[1])

    def jet(self, u: Ray) -> Jet:
        """The entries, as arrays."""
        return Entries(*self.derivatives(u[0], u[1])).jet(self.frame)


def entries_of(light: Field, x: Scalar, theta: Scalar) -> Entries:
    """Entries of a flatland field's jet; a `FlatlandLight` gives them without arrays."""
    if isinstance(light, FlatlandLight):
        return Entries(*light.derivatives(x, theta))
    return unpacked(light.jet(jnp.stack([x, theta])))


def value_of(light: Field, x: Scalar, theta: Scalar) -> Scalar:
    """Radiance of any flatland field; of a `FlatlandLight` without a detour over arrays."""
    return (
        light.function(x, theta)
        if isinstance(light, FlatlandLight)
        else light.at(jnp.stack([x, theta]))
    )


def unpacked(jet: Jet) -> Entries:
    """The six numbers of a jet."""
    g, H = jet.gradient, jet.hessian
    return Entries(jet.value, g[0], g[1], H[0, 0], H[0, 1], H[1, 1])
