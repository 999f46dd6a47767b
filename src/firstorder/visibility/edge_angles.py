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

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder.conventions import Frame
from firstorder.errors import check_finite, check_not_negative, check_positive, nan_unless
from firstorder.fields.jet import Jet
from firstorder.typing import as_float

# A number, an array that broadcasts with the others, or a point as a tuple.
Numbers: TypeAlias = ArrayLike | Sequence
PLACE = Frame(("x", "y"))


class EdgeAngle(eqx.Module):
    """An edge angle and its derivatives along a motion of the receiver.

    Attributes:
        value: local angle of the edge, counter-clockwise from the normal, in (-pi, pi] [rad].
        alpha_x: first derivative [rad/m].
        alpha_xx: second derivative [rad/m^2].
        distance: D, from the receiver to the point where the ray touches the blocker [m].
    """

    value: Float[Array, "*b"]
    alpha_x: Float[Array, "*b"]
    alpha_xx: Float[Array, "*b"]
    distance: Float[Array, "*b"]


def point_edge_angle(
    point: Numbers,
    position: Numbers = (0.0, 0.0),
    n: Numbers = 0.0,
    *,
    radius: Numbers = 0.0,
    side: Numbers = 1.0,
    kappa: Numbers = 0.0,
    kappa_x: Numbers = 0.0,
) -> EdgeAngle:
    """The edge angle of a corner, or of a round blocker whose point of tangency is known.

    With D the distance and `rho = side radius`,

        alpha_x  = cos(alpha) / D - kappa
        alpha_xx = -2 sin(alpha) cos(alpha) / D^2 + kappa sin(alpha) / D
                   - rho cos(alpha)^2 / D^3 - kappa_x

    where x is arc length along the receiver and `kappa = dn/dx` its curvature (positive in a
    valley). At `kappa = 0` this is a translation along the tangent; `edge_angle_under_rotation`
    gives a turn on the spot. The angle itself is differentiable in every argument by autodiff, but
    for a point given by number a round blocker's slide is in `alpha_xx` alone: `circle_edge_angle`
    finds its own point.

    Valid when: D > 0. At D = 0 there is no angle, and all four are NaN, with zero derivatives.

    Args:
        point: where the ray meets the edge [m].
        position: of the receiver [m].
        n: angle of the receiver's normal, counter-clockwise from +y [rad].
        radius: of the blocker's curvature at the point, zero for a corner or a segment's end [m].
        side: +1 if the blocker covers angles above alpha (R07's sgn), -1 if below.
        kappa: curvature dn/dx of the receiver [rad/m].
        kappa_x: its derivative along the receiver [rad/m^2].

    Raises:
        ValueError: if a number is not finite or a radius is negative.

    Reference: R07 §6.2, eq. 36 and App. D; the second derivative is ours.

    Example:
        >>> from firstorder.visibility import point_edge_angle
        >>> a = point_edge_angle((0.0, 2.0), position=(2.0, 0.0))  # up to the left, at 45 degrees
        >>> print(round(float(a.value), 4), round(float(a.alpha_x), 4))
        0.7854 0.25
    """
    _checked(point=point, position=position, n=n, kappa=kappa, kappa_x=kappa_x)
    check_not_negative("radius", radius)
    rho, kappa = as_float(side) * as_float(radius), as_float(kappa)
    across, up, D, there = _local(point, position, n)
    s, c = -across / D, up / D
    first = c / D - kappa
    bend = -2.0 * s * c / D**2 + kappa * s / D - rho * c**2 / D**3 - as_float(kappa_x)
    return _guarded(there, jnp.arctan2(-across, up), first, bend, D)


def circle_edge_angle(
    center: Numbers,
    radius: Numbers,
    side: Numbers = 1.0,
    position: Numbers = (0.0, 0.0),
    n: Numbers = 0.0,
    *,
    kappa: Numbers = 0.0,
    kappa_x: Numbers = 0.0,
) -> EdgeAngle:
    """The edge angle of a circle: that of the ray that touches it.

    Valid when: the receiver is outside the circle. On it or inside there is no tangent, and all
    four are NaN, with zero derivatives.

    Args:
        center: of the circle [m].
        radius: of the circle [m].
        side: +1 for the edge with the circle above it (its lower end), -1 for its upper end.
        position: of the receiver [m].
        n: angle of the receiver's normal [rad].
        kappa: curvature dn/dx of the receiver [rad/m].
        kappa_x: its derivative along the receiver [rad/m^2].

    Raises:
        ValueError: if a number is not finite or a radius is not positive.

    Reference: R07 App. D.

    Example:
        >>> from firstorder.visibility import circle_edge_angle
        >>> low, high = (circle_edge_angle((0.0, 2.0), 1.0, side) for side in (1.0, -1.0))
        >>> print(round(float(low.value), 4), round(float(high.value), 4))
        -0.5236 0.5236
    """
    _checked(center=center, position=position, n=n, kappa=kappa, kappa_x=kappa_x)
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
    found = point_edge_angle(
        touch, (0.0, 0.0), n, radius=jnp.abs(r), side=side, kappa=kappa, kappa_x=kappa_x
    )
    ok = outside & (r > 0)
    return EdgeAngle(*(nan_unless(ok, a) for a in _leaves(found)))


def edge_angle_under_rotation(alpha: EdgeAngle) -> EdgeAngle:
    """Edge angle when the receiver turns on the spot: the angle falls as fast.

    `dalpha/dn = -1`, and no second derivative.

    Example:
        >>> from firstorder.visibility import point_edge_angle, edge_angle_under_rotation
        >>> edge_angle_under_rotation(point_edge_angle((0.0, 2.0))).alpha_x.item()
        -1.0
    """
    still = 0.0 * jnp.nan_to_num(alpha.value)
    ok = jnp.isfinite(alpha.value)
    return EdgeAngle(
        alpha.value, nan_unless(ok, still - 1.0), nan_unless(ok, still), alpha.distance
    )


def edge_angle_jet(
    point: Numbers,
    position: Numbers = (0.0, 0.0),
    *,
    radius: Numbers = 0.0,
    side: Numbers = 1.0,
) -> Jet:
    """World angle of an edge as a jet in the receiver's position: for motion in any direction.

    With u the unit vector along the ray and l the one to its left,

        gradient = -l / D,   hessian = -(u l^T + l u^T) / D^2 - rho l l^T / D^3.

    Along any path q(s) of the receiver, `omega_s = g . q'` and
    `omega_ss = q' . H q' + g . q''`.

    Args:
        point: where the ray meets the edge [m].
        position: of the receiver [m].
        radius: of the blocker's curvature there, zero for a corner [m].
        side: +1 if the blocker covers angles above, -1 if below.

    Raises:
        ValueError: if a number is not finite or a radius is negative.

    Example:
        >>> from firstorder.visibility import edge_angle_jet
        >>> edge_angle_jet((0.0, 2.0)).gradient[0].item()  # by cos(alpha) / D
        0.5
    """
    _checked(point=point, position=position)
    check_not_negative("radius", radius)
    rho = as_float(side) * as_float(radius)
    across, up, D, there = _local(point, position, 0.0)
    u = jnp.stack([across, up], -1) / D
    left = jnp.stack([-u[1], u[0]])
    bend = -(jnp.outer(u, left) + jnp.outer(left, u)) / D**2 - rho * jnp.outer(left, left) / D**3
    leaves = (jnp.arctan2(-across, up), -left / D, bend)
    return Jet(*(nan_unless(there, a) for a in leaves), PLACE)


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


def _leaves(alpha: EdgeAngle) -> tuple[Array, Array, Array, Array]:
    return alpha.value, alpha.alpha_x, alpha.alpha_xx, alpha.distance


def _guarded(there, *leaves: Array) -> EdgeAngle:
    shape = jnp.broadcast_shapes(*(a.shape for a in leaves))
    return EdgeAngle(*(nan_unless(there, jnp.broadcast_to(a, shape)) for a in leaves))
