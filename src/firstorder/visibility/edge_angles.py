"""Edge angles of blockers, and their derivatives when the receiver moves.

Angles are counter-clockwise from the receiver's normal (conventions, Flatland). In that convention
R07 (36) is right as printed, `dalpha/dx = +cos(alpha) / D`; measured towards +x, as in R07's 3D
part and J12, every odd derivative changes its sign.

The first derivative knows nothing of the blocker but the point that is seen. The second one does:
on a round blocker that point slides along the ray, by its radius of curvature times the turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_not_negative,
    check_positive,
    nan_unless,
)
from firstorder._display import Module
from firstorder.typing import as_float

# A number, an array that broadcasts with the others, or a point as a tuple.
Numbers: TypeAlias = ArrayLike | Sequence


class EdgeAngle(Module):
    """An edge as a receiver in the plane sees it: its angle, and how that moves with the receiver.

    The one record of an edge that a receiver sees, of a corner, a limb, a border between two rays
    or a step of visibility; a row of edges has a leading axis.

    Attributes:
        value: local angle of the edge, counter-clockwise from the normal, in (-pi, pi] [rad].
        gradient: its derivatives by k freedoms of the receiver. Of those that are made here: steps
            along its tangent and along its normal [rad/m], and a turn of the normal.
        hessian: its second derivatives by them.
        jump: of what is seen, below less above the edge. Of visibility that is R07's sign: +1 if
            the blocker covers the angles above, -1 if those below, 0 for an edge that is hidden.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import EdgeAngle
        >>> edge = EdgeAngle(jnp.array(0.2), jnp.array([0.5]), jnp.zeros((1, 1)), jnp.array(1.0))
        >>> edge.first.item()
        0.5
    """

    value: Float[Array, "*b"]
    gradient: Float[Array, "*b k"]
    hessian: Float[Array, "*b k k"]
    jump: Float[Array, "*b"]

    def along(self, kappa: ArrayLike = 0.0, kappa_x: ArrayLike = 0.0) -> EdgeAngle:
        """The edge by arc length x along a receiver of curvature `kappa = dn/dx`, with k = 1.

            alpha_x  = cos(alpha) / D - kappa
            alpha_xx = -2 sin(alpha) cos(alpha) / D^2 + kappa sin(alpha) / D
                       - rho cos(alpha)^2 / D^3 - kappa_x

        Args:
            kappa: positive in a valley [rad/m].
            kappa_x: its derivative along the receiver [rad/m^2].

        Raises:
            ValueError: if a number is not finite, or the derivatives are not by all three motions
                of the receiver, as those along a curve are not.
        """
        _checked(kappa=kappa, kappa_x=kappa_x)
        if self.gradient.shape[-1] != 3:
            raise ValueError(
                f"There are derivatives by {self.gradient.shape[-1]} freedoms: only an edge by "
                "all three motions of the receiver can follow a curve."
            )
        k, change, g, H = as_float(kappa), as_float(kappa_x), self.gradient, self.hessian
        first = g[..., 0] + k * g[..., 2]
        turned = 2.0 * k * H[..., 0, 2] + k**2 * H[..., 2, 2]
        second = H[..., 0, 0] + turned + k * g[..., 1] + change * g[..., 2]
        value, jump = (jnp.broadcast_to(a, first.shape) for a in (self.value, self.jump))
        return EdgeAngle(value, first[..., None], second[..., None, None], jump)

    @property
    def distance(self) -> Float[Array, "*b"]:
        """D, from the receiver to the point of the edge, of edges by all three freedoms [m]."""
        x, y, _ = jnp.moveaxis(self.gradient, -1, 0)
        return 1.0 / jnp.sqrt(x * x + y * y)

    @property
    def first(self) -> Float[Array, "*b"]:
        """The derivative by the only freedom, as after `along`."""
        return self.gradient[..., self._only]

    @property
    def second(self) -> Float[Array, "*b"]:
        """The second derivative by the only freedom."""
        return self.hessian[..., self._only, self._only]

    @property
    def _only(self) -> int:
        if self.gradient.shape[-1] != 1:
            raise ValueError(
                f"There is one derivative for each of {self.gradient.shape[-1]} freedoms: ask for "
                "`gradient` and `hessian`, or follow the receiver with `along`."
            )
        return 0


def edge_at(
    angle: ArrayLike, inverse: ArrayLike, jump: ArrayLike, bend: ArrayLike = 0.0
) -> EdgeAngle:
    """An edge whose angle and distance are known, by the receiver's two steps and its turn.

    With `w = 1 / D`, `e = (cos a, sin a)` and `u = (-sin a, cos a)`, the ray,

        gradient = (w e, -1),   hessian by the steps = w^2 (e u^T + u e^T) + bend e e^T,

    and nothing more by the turn. All are numbers, or arrays that broadcast.

    Args:
        angle: local, counter-clockwise [rad].
        inverse: one over the distance of the point that is the edge, 0 for one far away [1/m].
        jump: of what is seen, below less above.
        bend: of a limb that slides on a round blocker of radius R, `+R / D^3` if the blocker is
            below and `-R / D^3` if it is above; 0 for a fixed point [1/m^2].

    Reference: R07 eq. 36; J12 eqs. 46, 50 (with the sign corrected).

    Example:
        >>> from firstorder.visibility import edge_at
        >>> edge_at(0.0, 0.5, 1.0).gradient.tolist()
        [0.5, 0.0, -1.0]
    """
    angle, inverse, jump, bend = map(as_float, (angle, inverse, jump, bend))
    return _edge(angle, jnp.sin(angle), jnp.cos(angle), inverse, bend, jump)


def _edge(angle, s, c, w, bend, jump) -> EdgeAngle:
    shape = jnp.broadcast_shapes(*(a.shape for a in (angle, s, c, w, bend, jump)))
    angle, s, c, w, bend, jump = (jnp.broadcast_to(a, shape) for a in (angle, s, c, w, bend, jump))
    zero = jnp.zeros_like(angle)
    slide = -2.0 * w**2 * s * c
    xx, yy = slide + bend * c**2, -slide + bend * s**2
    xy = w**2 * (c**2 - s**2) + bend * c * s
    rows = ((xx, xy, zero), (xy, yy, zero), (zero, zero, zero))
    gradient = jnp.stack([w * c, w * s, zero - 1.0], -1)
    return EdgeAngle(angle, gradient, jnp.stack([jnp.stack(r, -1) for r in rows], -2), jump)


def point_edge_angle(
    point: Numbers,
    position: Numbers = (0.0, 0.0),
    n: Numbers = 0.0,
    *,
    radius: Numbers = 0.0,
    side: Numbers = 1.0,
) -> EdgeAngle:
    """The edge angle of a corner, or of a round blocker whose point of tangency is known.

    Its derivatives are those of `edge_at` with D the distance and `bend = -side radius / D^3`; by
    arc length along a receiver, straight or curved, they follow with `EdgeAngle.along`. The angle
    itself is differentiable in every argument by autodiff, but for a point given by number a round
    blocker's slide is in `hessian` alone: `circle_edge_angle` finds its own point.

    Valid when: D > 0. At D = 0 there is no angle, and all of it is NaN, with zero derivatives.

    Args:
        point: where the ray meets the edge [m].
        position: of the receiver [m].
        n: angle of the receiver's normal, counter-clockwise from +y [rad].
        radius: of the blocker's curvature at the point, zero for a corner or a segment's end [m].
        side: +1 if the blocker covers angles above alpha (R07's sgn), -1 if below.

    Raises:
        ValueError: if a number is not finite, a point has not two coordinates, or a radius is
            negative.

    Reference: R07 §6.2, eq. 36 and App. D; the second derivative is ours.

    Example:
        >>> from firstorder.visibility import point_edge_angle
        >>> a = point_edge_angle((0.0, 2.0), position=(2.0, 0.0))  # up to the left, at 45 degrees
        >>> print(round(float(a.value), 4), round(float(a.along().first), 4))
        0.7854 0.25
    """
    _checked(point=point, position=position, n=n)
    point, position = as_float(point), as_float(position)
    check_coordinates("point", point, 2)
    check_coordinates("position", position, 2)
    check_not_negative("radius", radius)
    side, radius = as_float(side), as_float(radius)
    across, up, D, there = _local(point, position, n)
    bend = -side * radius / D**3
    found = _edge(jnp.arctan2(-across, up), -across / D, up / D, 1.0 / D, bend, side)
    return _nan_unless(there & (radius >= 0), found)


def circle_edge_angle(
    center: Numbers,
    radius: Numbers,
    side: Numbers = 1.0,
    position: Numbers = (0.0, 0.0),
    n: Numbers = 0.0,
) -> EdgeAngle:
    """The edge angle of a circle: that of the ray that touches it.

    Valid when: the receiver is outside the circle. On it or inside there is no tangent, and all
    of it is NaN, with zero derivatives.

    Args:
        center: of the circle [m].
        radius: of the circle [m].
        side: +1 for the edge with the circle above it (its lower end), -1 for its upper end.
        position: of the receiver [m].
        n: angle of the receiver's normal [rad].

    Raises:
        ValueError: if a number is not finite, a point has not two coordinates, or a radius is not
            positive.

    Reference: R07 App. D.

    Example:
        >>> from firstorder.visibility import circle_edge_angle
        >>> low, high = (circle_edge_angle((0.0, 2.0), 1.0, side) for side in (1.0, -1.0))
        >>> print(round(float(low.value), 4), round(float(high.value), 4))
        -0.5236 0.5236
    """
    _checked(center=center, position=position, n=n)
    center, position = as_float(center), as_float(position)
    check_coordinates("center", center, 2)
    check_coordinates("position", position, 2)
    check_positive("radius", radius)
    r, side = as_float(radius), as_float(side)
    w = as_float(center) - as_float(position)
    square = jnp.sum(w**2, -1)
    outside = square > r**2
    D2 = jnp.where(outside, square - r**2, 1.0)
    share = jnp.sqrt(D2) / jnp.where(outside, square, 1.0)
    touch = share[..., None] * (
        jnp.sqrt(D2)[..., None] * w - (side * r)[..., None] * jnp.stack([-w[..., 1], w[..., 0]], -1)
    )
    touch = jnp.where(outside[..., None], touch, jnp.array([0.0, 1.0], w.dtype))
    found = point_edge_angle(touch, (0.0, 0.0), n, radius=jnp.abs(r), side=side)
    return _nan_unless(outside & (r > 0), found)


# --- small change --------------------------------------------------------------------------------


def _checked(**arguments) -> None:
    for name, x in arguments.items():
        check_finite(name, x)


def _local(point, position, n):
    """The point in the receiver's frame, its distance, and whether it is away from the receiver.

    Where it is not, the unit point above stands in, so that derivatives stay finite.
    """
    w, n = as_float(point) - as_float(position), as_float(n)
    c, s = jnp.cos(n), jnp.sin(n)
    across, up = c * w[..., 0] + s * w[..., 1], c * w[..., 1] - s * w[..., 0]
    there = (across != 0.0) | (up != 0.0)
    across, up = jnp.where(there, across, 0.0), jnp.where(there, up, 1.0)
    return across, up, jnp.sqrt(across * across + up * up), there


def _nan_unless(ok, edge: EdgeAngle) -> EdgeAngle:
    """The edge where there is one; its jump, which is no number of the edge's, stays."""
    leaves = (
        nan_unless(ok.reshape(ok.shape + (1,) * (leaf.ndim - edge.value.ndim)), leaf)
        for leaf in (edge.value, edge.gradient, edge.hessian)
    )
    return EdgeAngle(*leaves, edge.jump)
