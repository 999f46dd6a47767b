"""Integrals over azimuth of the light at a receiver, slice by slice (R07).

    B   = int dphi int T(w) V(w) |sin(theta)| dtheta                                (R07 eq. 47, 49)
    B_x = int dphi int T_x V |sin(theta)| dtheta                                    interior
        + int dphi sum_j sgn_j T(alpha_j) alpha_x |sin(alpha_j)|                    boundary

A slice is half of a great circle over the pole: phi in [0, pi), theta in [-pi/2, pi/2], so that a
blocker overhead is no special case. In a slice every convex blocker covers one interval of theta,
whose ends lie where the slice meets its silhouette; the intervals are merged. The integral over phi
is split wherever that changes its form (`_critical_azimuths`), with nodes that cancel the inverse
square roots at the ends.

The derivative of the sum is that of B, with shadow edges. Beside it stands the gradient by R07's
formulas, interior and boundary apart. Second derivatives lack those of edges that lie in one slice,
such as the upright ones of a box on the floor. The contour integrals of `irradiance` have them and
need fewer nodes; this route takes any light and any lobe.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import check_count, nan_unless
from firstorder._display import Module
from firstorder.conventions import azimuth_axes, polar
from firstorder.numerics._compiled import compiled
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._vectors import cross, dot, settled
from firstorder.scene._arguments import check_asked_one
from firstorder.space.azimuthal._critical_azimuths import (
    STEEP,
    Part,
    folded,
    is_known,
    nodes_between,
    parts,
    rounding,
)
from firstorder.space.azimuthal._integrands import (
    Cosine,
    Transport,
    Uniform,
    Varying,
    check_transport,
)
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.typing import as_float
from firstorder.visibility._intervals import signed_edges, visible_gaps
from firstorder.visibility.elevation import crease_elevation
from firstorder.visibility.gradients import SplitDerivative

FAR = 1e18
EDGE_NODES = 16  # on what is seen of an edge that lies in one slice


class AzimuthalIntegral(Module):
    """An integral over azimuth of the light at a receiver, with its gradient.

    Attributes:
        value: B.
        gradient: B_x, B_y along the receiver's tangents, interior and boundary apart.
    """

    value: Float[Array, ""]
    gradient: SplitDerivative


class _Slice(Module):
    """Angular intervals that blockers cover in a vertical slice.

    Attributes:
        low, high: ends of the intervals of theta [rad]; empty where a blocker is not met.
        points: the touched points, those of the lower ends first, in the receiver's frame [m].
        tangents: of the silhouettes there.
        phi: azimuth [rad].
    """

    low: Float[Array, " n"]
    high: Float[Array, " n"]
    points: Float[Array, "m 3"]
    tangents: Float[Array, "m 3"]
    phi: Float[Array, ""]


@compiled
@with_errors("nodes")
def visibility_by_azimuth(
    scene: Scene, at: Receiver, *, nodes: int = 24, most: int = 64, with_error: bool = False
) -> AzimuthalIntegral:
    """Net visibility, the solid angle of the sky that a receiver sees, with its gradient [sr].

    Valid when: the receiver is outside of all closed shapes (else NaN) and lies flat or on a
    surface of shape operator `at.S`, with which its horizon turns; a traced number of either that
    is none gives NaN. On an inner wall that `Receiver.on` names the sky is seen through the wall,
    as by `net_visibility`. Edges along the normal, which (48) leaves out, are added in the gradient
    of a flat receiver, and are missing in second derivatives.

    Args:
        scene: the blockers.
        at: the receiver, one.
        nodes: Gauss-Legendre nodes between two events.
        most: panels between events; NaN if there are more.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: if `nodes` or `most` is not positive.

    Reference: R07 §7.2, eqs. 47 and 48.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Scene, receiver, sphere, primitive
        >>> from firstorder.space.azimuthal import visibility_by_azimuth
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
        >>> B = visibility_by_azimuth(scene, receiver((0.0, 0.0, 0.0)))
        >>> print(round(float(1.0 - B.value / (2.0 * jnp.pi)), 6))  # 1 - cos(30 degrees)
        0.133975
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    return _integrated(scene, at, Uniform(), nodes, most)


@compiled
@with_errors("nodes")
def irradiance_by_azimuth(
    scene: Scene, at: Receiver, *, nodes: int = 24, most: int = 64, with_error: bool = False
) -> AzimuthalIntegral:
    """Irradiance from a sky of radiance one behind blockers, with its gradient.

    The same as `visibility_by_azimuth` with the cosine; its arguments mean the same.

    Raises:
        ValueError: for a row of receivers, and as `visibility_by_azimuth`.

    Example:
        >>> from firstorder.space import Scene, receiver, sphere, primitive
        >>> from firstorder.space.azimuthal import irradiance_by_azimuth
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
        >>> E = irradiance_by_azimuth(scene, receiver((0.0, 0.0, 0.0)))
        >>> print(round(float(E.value), 4))  # pi (1 - sin(30 degrees)^2)
        2.3562
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    return _integrated(scene, at, Cosine(), nodes, most)


@compiled
@with_errors("nodes", "inner")
def transport_by_azimuth(
    scene: Scene,
    at: Receiver,
    *,
    transport: Transport,
    nodes: int = 24,
    inner: int = 16,
    most: int = 64,
    with_error: bool = False,
) -> AzimuthalIntegral:
    """Light behind blockers under any transport, with its gradient.

    `transport(at, w)` is radiance times lobe times cosine for light from the direction w of the
    receiver's frame, a unit vector. An environment is `lambda at, w: L(at.axes @ w) * w[2]`; light
    that varies in space looks at `at.position`; a glossy surface at `at.axes` and its eye.

    Valid when: transport is smooth in w over the hemisphere, and in the receiver. On a curved
    receiver the interior part holds the turn of its frame.

    Args:
        scene: the blockers; they are dark.
        at: the receiver, one.
        transport: T, of one receiver and one direction.
        nodes: in azimuth, between two events.
        inner: in polar angle, on each visible piece, cut at the pole.
        most: panels between events; NaN if there are more.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        TypeError: if `transport` is no function.
        ValueError: if a count is not positive, or `transport` gives anything but a real number.

    Reference: R07 §7.3, eq. 49, and the text after it.

    Example:
        >>> from firstorder.space import Scene, receiver, sphere, primitive
        >>> from firstorder.space.azimuthal import transport_by_azimuth
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
        >>> def lit(at, w):  # brighter to the right, and farther along
        ...     return w[2] * (1.0 + 0.5 * (at.axes @ w)[0] + at.position[0])
        >>> B = transport_by_azimuth(scene, receiver((0.0, 0.0, 0.0)), transport=lit)
        >>> print(round(float(B.value), 4), round(float(B.gradient.interior[0]), 4))
        2.3562 2.3562
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    check_count("inner", inner)
    check_transport(transport, at)
    return _integrated(scene, at, Varying(transport, at, inner), nodes, most)


def _sliced(found: list[Part], base: Float[Array, ""], lag: Float[Array, ""]) -> _Slice:
    """Angular intervals that all blockers cover in the slice at azimuth `base + lag`."""
    phi = base + lag
    ends = [settled(_ends(part, base, lag)) for part in found]
    dtype = phi.dtype
    empty = (jnp.zeros((0, 3), dtype),) * 4
    p_low, k_low, p_high, k_high = (
        jnp.concatenate(a) for a in zip(empty, *(e[:4] for e in ends), strict=True)
    )
    met = jnp.concatenate([jnp.zeros((0,), bool), *(e[4] for e in ends)])
    along = azimuth_axes(phi)[0]
    near = (p / power_of_two(p)[:, None] for p in (p_low, p_high))  # the derivative has squares
    low, high = (jnp.arctan2(p @ along, p[:, 2]) for p in near)
    # From the lower end up to the upper one, on the turn on which the middle lies in (-pi, pi].
    rise = jax.lax.stop_gradient(high - low)
    high = high - 2.0 * np.pi * jnp.floor(rise / (2.0 * np.pi))
    turn = 2.0 * np.pi * jnp.round(jax.lax.stop_gradient(0.5 * (low + high)) / (2.0 * np.pi))
    low, high = jnp.where(met, low - turn, 0.0), jnp.where(met, high - turn, 0.0)
    return _Slice(
        low, high, jnp.concatenate([p_low, p_high]), jnp.concatenate([k_low, k_high]), phi
    )


def _integrated(scene: Scene, at: Receiver, T, nodes: int, most: int) -> AzimuthalIntegral:
    check_count("nodes", nodes)
    check_count("most", most)
    found = settled(parts(scene, at))
    dtype = at.position.dtype
    blur = rounding(found, at)
    where = settled(nodes_between(found, nodes, most, dtype, blur))

    def one(base, lag):
        cut = settled(_sliced(found, base, lag))
        value, rate = T.inside(cut.low, cut.high, cut.phi)
        return value, rate, _edge_rate(cut, T, at)

    values, inside, moving = jax.vmap(one)(where.base, where.lag)
    sound = ~scene.inside(at.position, at.on) & is_known(scene, at)
    value, interior = (nan_unless(sound, where.weight @ a) for a in (values, inside))
    turned, opened = _in_one_slice(found, T, at, where.events, blur)
    boundary = nan_unless(sound, where.edge_weight @ moving) + turned
    return AzimuthalIntegral(value + opened, SplitDerivative(interior, boundary))


def _edge_rate(cut: _Slice, T, at: Receiver) -> Float[Array, "2"]:
    """Contribution of moving edges in one slice: R07 (48) and (49)."""
    angle, sign = signed_edges(cut.low, cut.high)
    shown = sign != 0.0
    up = jnp.asarray([0.0, 0.0, 1.0], angle.dtype)
    across = azimuth_axes(cut.phi)[1]
    points = jnp.where(shown[:, None], cut.points, up)
    tangents = jnp.where(shown[:, None], cut.tangents, across)
    rate = crease_elevation(points, tangents, jnp.broadcast_to(cut.phi, angle.shape), at.S).gradient
    light = T.edge(polar(angle, cut.phi)) * jnp.abs(jnp.sin(angle))
    # Where a slice grazes a blocker the rate is infinite, on a panel without length.
    fine = shown[:, None] & jnp.isfinite(rate)
    return jnp.sum(jnp.where(fine, (sign * light)[:, None] * jnp.where(fine, rate, 0.0), 0.0), 0)


def _in_one_slice(
    found: list[Part], T, at: Receiver, events: Float[Array, " m"], blur
) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """Contribution of edges that lie in one slice, whole, which (48) leaves out.

    The point of such an edge at the distance D turns by `-(e_phi . dm) / (D |sin(theta)|)` about
    the normal, dm the receiver's way against it. What the edge hides of its slice, behind all other
    blockers, comes into view or leaves it by that angle.

    Returns:
        The gradient, and a zero. The nodes turn such an edge as a whole, with its event; the
        derivative of the zero is what its points turn by beyond that.
    """
    dtype = found[0].scale.dtype if found else None
    total, zero, first = jnp.zeros(2, dtype), jnp.zeros((), dtype), 0
    for part in found:
        line, n = part.straight, part.straight.live.shape[0]
        rows = first + jnp.broadcast_to(jnp.arange(n)[:, None], line.live.shape)
        first += n
        if line.live.size:
            add = jax.vmap(lambda *edge: _turned(found, T, at.S, events, blur, *edge))
            p, q = (a.reshape(-1, 3) for a in (line.start, line.end))
            turned, opened = add(p, q, part.units[0].ravel(), line.live.ravel(), rows.ravel())
            total, zero = total + jnp.sum(turned, 0), zero + jnp.sum(opened)
    return total, zero - jax.lax.stop_gradient(zero)


def _turned(
    found: list[Part], T, S, events, blur, p, q, unit, live, row
) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """The share of one edge from p to q, in a unit, of the shape in a row of the slices.

    Returns:
        The gradient, and what the edge turns by beyond its event, weighted with the light.
    """
    near = blur * jnp.max(jnp.abs(jnp.stack([p, q])))
    widths = [jnp.max(jnp.abs(a[:2])) for a in (p, q)]
    wide = jnp.maximum(*widths)
    # As far as this it turns on a panel that the nodes leave out.
    least = STEEP * blur * widths[0] * widths[1] + near * wide
    there = live & (wide > near) & (jnp.abs(p[0] * q[1] - p[1] * q[0]) <= least)
    x, y = jnp.where(widths[0] < widths[1], q, p)[:2]
    phi = folded(jnp.arctan2(jnp.where(there, y, 0.0), jnp.where(there, x, 1.0)))[0]
    along, across = (e[:2] for e in azimuth_axes(phi))
    (x, z), (flat, top) = ((a[:2] @ along, a[2]) for a in (p, q))
    moment = x * top - z * flat
    there &= moment != 0.0
    one, two = (jnp.arctan2(*jnp.where(there, jnp.stack(a), 1.0)) for a in ((x, z), (flat, top)))
    two = two - 2.0 * np.pi * jnp.round(jax.lax.stop_gradient((two - one) / (2.0 * np.pi)))
    cut = settled(_sliced(found, phi, jnp.zeros_like(phi)))
    gaps = visible_gaps(cut.low.at[row].set(0.0), cut.high.at[row].set(0.0))
    start, stop = (jnp.clip(a, jnp.minimum(one, two), jnp.maximum(one, two)) for a in gaps)
    t, weight = (jnp.asarray(a, p.dtype) for a in gauss_legendre(EDGE_NODES))
    half = 0.5 * (stop - start)[:, None]
    theta = (start[:, None] + half * (1.0 + t)).ravel()
    light = (half * weight).ravel() * T.edge(polar(theta, phi))
    size = jnp.where(there, jnp.abs(moment), 1.0)
    sine, cosine = jnp.sin(theta), jnp.cos(theta)
    signed = sine * (top - z) - cosine * (flat - x)  # moment / D
    hidden = light @ jnp.abs(signed) / size / unit
    bent = light @ cosine
    # The shape lies on the side of p x q. A curved receiver's frame turns as it moves.
    side = jnp.where(there, jnp.sign(across @ cross(p, q)[:2]), 0.0)
    turned = -side * (hidden * across - bent * (as_float(S) @ across))
    # Points of the edge move across the slice, the nodes with the event that the edge is.
    still = jax.lax.stop_gradient
    share = (x * cosine - z * sine) / jnp.where(signed == 0.0, 1.0, signed)
    moved = side * light * jnp.abs(signed) / size
    moved, share, across, turn = still((moved, share, across, side * (light @ sine)))
    way = (1.0 - share) * (across @ p[:2]) + share * (across @ q[:2])
    event = events[jnp.argmin(jnp.abs(jnp.sin(still(events - phi))))]
    opened = moved @ way - turn * event
    return turned, opened


# --- where a slice meets a silhouette ------------------------------------------------------------


def _ends(part: Part, base, lag) -> tuple[Array, Array, Array, Array, Bool[Array, " n"]]:
    """Points and tangents at the lower and upper ends of what each shape covers; is it met?

    Silhouettes run with the shape to their left, `p x k`; so k . e_phi is negative at lower ends.
    """
    phi = base + lag
    v = azimuth_axes(phi)[1]
    if part.normal is not None:
        return _plane_ends(part.normal, v)
    points, slopes, lower, upper = [], [], [], []
    for p, k, low, high in (_line_hits(part, v), _arc_hits(part, v, base, lag)):
        points.append(p)
        slopes.append(k)
        lower.append(low)
        upper.append(high)
    p, k, low, high = (jnp.concatenate(a, 1) for a in (points, slopes, lower, upper))
    at_low, at_high = jnp.argmax(low, 1), jnp.argmax(high, 1)

    def chosen(a, which):
        return jnp.take_along_axis(a, which[:, None, None], 1)[:, 0]

    met = jnp.any(low, 1) & jnp.any(high, 1)
    up = jnp.asarray([0.0, 0.0, 1.0], phi.dtype)
    out = [
        jnp.where(met[:, None], chosen(a, which), instead)
        for a, which, instead in (
            (p, at_low, up),
            (k, at_low, v),
            (p, at_high, up),
            (k, at_high, v),
        )
    ]
    return out[0], out[1], out[2], out[3], met


def _line_hits(part: Part, v):
    """Hits of the slice with segments: by the sign of their ends, so that corners agree."""
    line = part.straight
    a, b = line.start @ v, line.end @ v
    meets = line.live & ((a > 0.0) != (b > 0.0))
    t = jnp.where(meets, a, 0.0) / jnp.where(meets, a - b, 1.0)
    k = line.end - line.start
    p = part.units[0][..., None] * (line.start + t[..., None] * k)
    return p, k, meets & (b < a), meets & (b > a)


def _arc_hits(part: Part, v, base, lag):
    """Hits of the slice with arcs: A + B cos t + C sin t = 0, twice.

    The root of B^2 + C^2 - A^2 is taken from the azimuths at which it vanishes, so that it is
    right to rounding beside them.
    """
    arc = part.curved
    A, B, C = (dot(a, v) for a in (arc.center, arc.a, arc.b))
    scale = B * B + C * C
    # Differences to the base are exact where it is one of the two.
    gap = [(base - part.tangent[..., i]) + lag for i in (0, 1)]
    square = jnp.where(part.split, -part.scale * jnp.sin(gap[1]) * jnp.sin(gap[0]), scale - A * A)
    meets = arc.live & (square > 0.0) & (scale > 0.0)
    root = jnp.where(meets, jnp.sqrt(jnp.where(meets, square, 1.0)), 0.0)
    scale = jnp.where(meets, scale, 1.0)
    hits = []
    for side in (1.0, -1.0):  # the velocity's v is -side root: the first is the lower end
        cos, sin = (-A * B - side * C * root) / scale, (-A * C + side * B * root) / scale
        t = jax.lax.stop_gradient(jnp.arctan2(sin, cos))
        t = t - 2.0 * np.pi * jnp.floor((t - arc.first) / (2.0 * np.pi))
        inside = meets & (t < jax.lax.stop_gradient(arc.last))
        p = arc.center + arc.a * cos[..., None] + arc.b * sin[..., None]
        k = arc.b * cos[..., None] - arc.a * sin[..., None]
        hits.append((part.units[1][..., None] * p, k, inside))
    (p, k, low), (q, m, high) = hits
    never = jnp.zeros_like(low)
    return (
        jnp.concatenate([p, q], 1),
        jnp.concatenate([k, m], 1),
        jnp.concatenate([low, never], 1),
        jnp.concatenate([never, high], 1),
    )


def _plane_ends(normal: Float[Array, "n 3"], v):
    """A plane without end covers half a turn, and its edge does not move; one of no normal none."""
    e = jnp.stack([v[1], -v[0], v[2]])
    up, rise = normal[:, 2], normal @ e
    level = (rise == 0.0) & (up == 0.0)
    rise = jnp.where(level, 1.0, rise)
    # n . w = sin(theta - theta0) is negative below theta0 = atan2(-n_z, n . e).
    w = -up[:, None] * e + rise[:, None] * jnp.asarray([0.0, 0.0, 1.0], e.dtype)
    k = jnp.broadcast_to(cross(normal, w), w.shape)
    return -FAR * w, -k, FAR * w, k, ~level
