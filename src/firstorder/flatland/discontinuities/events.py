"""Visual events: places where irradiance on a receiver, or a derivative of it, jumps.

Seen from a receiver, a near edge and a far one move at different speeds, `cos(theta) / r` each.
Where they are in line the far edge comes out behind the near one: E goes on, and E' jumps by

    J = sigma dL cos^2(theta) (1 / r_near - 1 / r_far)

`dL` is the change of radiance across the far edge, counter-clockwise, without the near blocker, and
`sigma = 1` if that blocker covers larger angles than its edge, -1 if smaller. A point light behind
a near edge makes E itself jump. On a receiver that bends, an edge that rises over the horizon makes
E'' jump by `kappa |kappa| dL`, and a point light E' by `|kappa| I / r`. A pointwise Hessian knows
of none of these; `extrapolation_error` is what they add to a cached record's error.

All of it is found on the host from concrete scenes; positions and jumps are closed forms.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_index, check_not_negative, is_concrete
from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.discontinuities._critical_lines import (
    LIGHT,
    Breaks,
    LineEnds,
    critical_lines,
)
from firstorder.flatland.discontinuities._event_table import IrradianceJumps, VisualEvents, joined
from firstorder.flatland.discontinuities._queries import (
    batched,
    extent,
    frames,
    on_line,
    radiance_on_host,
    trace,
)
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Segments
from firstorder.numerics._host import double_precision, with_floats
from firstorder.scene._bands import check_one_band


def visual_events(
    scene: Scene, radiance: Radiance | None = None, breaks: Breaks = (), hidden: bool = False
) -> VisualEvents:
    """All visual events on all receivers of a scene.

    Valid for: opaque shapes with both sides diffuse or emitting; light of the environment is not
    counted in `dL`. Two events that coincide are two rows, and their jumps add; an edge exactly
    behind two others in one line is judged by the nearer pair. All is found in double precision and
    told in the scene's.

    Args:
        scene: concrete shapes and lights.
        radiance: what surfaces send out, as for `irradiance`; their emission if left out.
        breaks: places (shape, parameter) at which that radiance jumps along a surface.
        hidden: also give the lines on which something stands between the edges.

    Raises:
        ValueError: if the scene is traced.

    Example:
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.flatland.discontinuities import visual_events
        >>> floor = primitive(Segments((-2.0, 0.0), (2.0, 0.0)), name="floor")
        >>> lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
        >>> blocker = primitive(Segments((0.2, 0.5), (-0.2, 0.5)))
        >>> found = visual_events(Scene.of(floor, lamp, blocker))
        >>> rows = (found.receiver == 0) & found.visible & (found.jump_E1 != 0)
        >>> (-2.0 + 4.0 * found.s[rows]).round(6).tolist()
        [-0.9, -0.1, 0.1, 0.9]
    """
    if not is_concrete(scene):
        raise ValueError("Argument `scene` must be concrete, but is traced.")
    with double_precision():
        table = _events(with_floats(scene, np.float64), radiance, breaks)
    table = table if hidden else table.take(table.visible)
    return VisualEvents(**with_floats(vars(table), scene.material.emission.dtype))


def _events(scene: Scene, radiance: Radiance | None, breaks: Breaks) -> VisualEvents:
    """All visual events, the hidden ones too, by receiver and place."""
    a, b = critical_lines(scene, breaks)
    near, far = LineEnds.stack([a, b]), LineEnds.stack([b, a])
    ordered = near.shape != LIGHT
    near, far = near.take(ordered), far.take(ordered)
    check_one_band("scene", scene)
    ask = radiance_on_host(scene, radiance)
    parts = [_aligned(scene, near, far, ask), _rising(scene, near, far, ask)]
    table = joined(parts)
    return table.take(np.lexsort((table.s, table.receiver)))


def jumps_on(
    scene: Scene,
    index: int,
    radiance: Radiance | None = None,
    breaks: Breaks = (),
    front: bool = True,
) -> IrradianceJumps:
    """The jumps on one side of one shape, towards growing s, those at one place added up.

    Args:
        scene: concrete shapes and lights.
        index: number of the receiver's shape.
        radiance: what surfaces send out; their emission if left out.
        breaks: places (shape, parameter) at which that radiance jumps.
        front: which side of the shape receives.

    Raises:
        ValueError: if the scene is traced, or has no shape of this number.
        TypeError: if the number is no integer.

    Example:
        >>> from firstorder.flatland import PointLights, Scene, Segments, primitive
        >>> from firstorder.flatland.discontinuities import jumps_on
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> blocker = primitive(Segments((0.0, 0.5), (-2.0, 0.5)))
        >>> jumps = jumps_on(Scene.of(floor, blocker, points=PointLights((0.0, 1.0), 1.0)), 0)
        >>> jumps.s.tolist(), jumps.jump_E.tolist()
        ([0.5], [1.0])
    """
    table = visual_events(scene, radiance, breaks)
    check_index("index", index, scene.count)
    table = table.take((table.receiver == index) & (table.front == front))
    jumps = np.stack([table.jump_E, table.jump_E1, table.jump_E2])
    live = np.any(jumps != 0.0, axis=0)
    s, jumps = table.s[live], jumps[:, live]
    if not len(s):
        return IrradianceJumps(s, *jumps)
    same = np.concatenate([[0], np.cumsum(np.diff(s) > 1e3 * np.finfo(s.dtype).eps)])
    place = np.array([s[same == k][0] for k in range(same[-1] + 1)])
    summed = [np.bincount(same, weights=row) for row in jumps]
    return IrradianceJumps(place, *summed)


def extrapolation_error(jump_E, jump_E1, distance, radius):
    """Total error that jumps add to a linear extrapolation from a record, to one side of it.

    `|J_0| (R - a)_+ + |J_1| (R - a)_+^2 / 2`: what lies beyond a jump at the distance a is off by
    `J_0 + J_1 (x - a)`, whatever the record knows. It adds to the pointwise estimate from E''.

    Args:
        jump_E: jump of E [W/m].
        jump_E1: jump of E' [W/m^2].
        distance: from the record to the event, a [m].
        radius: of the record, R [m].

    Raises:
        ValueError: if a distance or a radius is negative.

    Example:
        >>> from firstorder.flatland.discontinuities import extrapolation_error
        >>> float(extrapolation_error(0.0, 2.0, 0.5, 1.5))
        1.0
    """
    check_not_negative("distance", distance)
    check_not_negative("radius", radius)
    over = jnp.maximum(jnp.asarray(radius) - distance, 0.0)
    return jnp.abs(jump_E) * over + 0.5 * jnp.abs(jump_E1) * over**2


def _aside(size: float, places: Float[np.ndarray, "n 2"]) -> float:
    """How far beside an edge rays pass it: more than its coordinates are rounded by [m]."""
    eps = float(np.finfo(places.dtype).eps)
    return max(size * eps**0.7, 16.0 * eps * np.abs(places).max(initial=0.0))


# --- two edges in line ---------------------------------------------------------------------------


def _aligned(scene: Scene, near: LineEnds, far: LineEnds, ask) -> VisualEvents:
    """Receivers that see the far edge exactly behind the near one."""
    size, eps = extent(scene), np.finfo(near.point.dtype).eps
    step, aside = size * eps**0.25, _aside(size, near.point)
    way = far.point - near.point
    length = np.linalg.norm(way, axis=1)
    u = way / length[:, None]
    up = np.stack([-u[:, 1], u[:, 0]], -1)  # towards larger angles
    # One side of the near edge must be open and the other blocked.
    before = near.point - step * u
    probe = [trace(scene, before + side * aside * up, u).t for side in (1.0, -1.0)]
    shut = [t < 2.0 * step for t in probe]
    silhouette = shut[0] != shut[1]
    open_t = np.where(shut[0], probe[1], probe[0])
    sigma = np.where(shut[0], 1.0, -1.0)
    # The open side reaches the far edge, or grazes a curve there early, by less than the step.
    clear = silhouette & (open_t > length)
    edge_on = (near.shape == far.shape) & ~near.tangent & ~far.tangent & _straight(scene, near)
    # Backwards from the near edge, on the open side, to the receiver.
    back = trace(scene, before - sigma[:, None] * aside * up, -u)
    hit = back.number >= 0
    exact = _receive(scene, back, near.point, u)
    jumps = _jumps(scene, near, far, u, sigma, exact, ask, step)
    flat = _edge_on(scene, near, far, u, up, exact, ask, (step, aside))
    clear = np.where(edge_on, flat.clear, clear)
    ok = hit & (exact.cos > 1e3 * eps)
    rows = np.flatnonzero(ok & (silhouette | edge_on))
    kind = np.where(
        far.shape == LIGHT,
        "shadow",
        np.select(
            [edge_on, near.tangent & far.tangent, near.tangent | far.tangent],
            ["edge-on", "two tangents", "point and tangent"],
            "two points",
        ),
    )
    J = [np.where(edge_on, e, j) * clear for j, e in zip(jumps, flat.jumps, strict=True)]
    J[0] = J[0] * np.where(exact.front, 1.0, -1.0)
    J[2] = J[2] * np.where(exact.front, 1.0, -1.0)
    table = VisualEvents(back.number, exact.s, exact.front, kind, near, far, clear, *J)
    return table.take(rows)


class _Exact(NamedTuple):
    """A receiver on a critical line."""

    s: np.ndarray
    front: np.ndarray
    cos: np.ndarray
    r: np.ndarray  # to the near edge
    kappa: np.ndarray
    tangent: np.ndarray  # of the side that receives, so that its normal is counter-clockwise
    normal: np.ndarray
    position: np.ndarray


def _receive(scene: Scene, hits, point, u) -> _Exact:
    """The receiver on the line itself, not on the one beside it that found it."""
    index = np.maximum(hits.number, 0)
    r, s, frame = batched(on_line, scene, index, point, -u)
    missed = ~np.isfinite(r)
    s = np.where(missed, hits.s, s)
    if missed.any():  # the line leaves the shape by its very end
        frame = batched(frames, scene, index, s)
    position, normal = np.asarray(frame.position), np.asarray(frame.normal)
    facing = np.sum(u * normal, -1)
    front = facing > 0.0
    turn = np.where(front, 1.0, -1.0)
    return _Exact(
        s,
        front,
        np.abs(facing),
        np.linalg.norm(position - point, axis=1),
        turn * np.asarray(frame.kappa),
        turn[:, None] * np.asarray(frame.tangent),
        turn[:, None] * normal,
        position,
    )


def _jumps(scene: Scene, near: LineEnds, far: LineEnds, u, sigma, at: _Exact, ask, step):
    """Jumps of E, E' and E'' where the far edge comes out behind the near one."""
    light = far.shape == LIGHT
    r_far = np.linalg.norm(far.point - at.position, axis=1)
    gap = _closer(at.r, r_far)
    dL = _across(scene, near, far, u, ask, step)
    first = np.where(light, 0.0, sigma * dL * at.cos**2 * gap)
    # A point light comes into view whole: E = I n.p / |p|^2 and its two derivatives.
    number = np.where(light, far.s, 0).astype(int)
    power = np.asarray(scene.points.intensity)
    power = power[number] if len(power) else np.zeros(len(far))
    p = far.point - at.position
    E, E1, E2 = _point_irradiance(p, at.tangent, at.normal, at.kappa)
    shown = np.where(light, sigma * power, 0.0)
    return shown * E, first + shown * E1, shown * E2


def _point_irradiance(p, tangent, normal, kappa):
    """Irradiance of a unit point light at `p` from the receiver, and two arc-length derivatives.

    With `a = n.p`, `b = t.p`, `q = |p|^2`: `da/dx = -kappa b`, `db/dx = kappa a - 1`,
    `dq/dx = -2 b`. The derivative of the curvature, which enters E'' for other than circles, is
    left out; it multiplies `-b / q`.
    """
    a, b, q = np.sum(normal * p, -1), np.sum(tangent * p, -1), np.sum(p * p, -1)
    q = np.where(q > 0.0, q, 1.0)
    E1 = -kappa * b / q + 2.0 * a * b / q**2
    turn = kappa * a - 1.0
    E2 = (
        -kappa * turn / q
        - 2.0 * kappa * b**2 / q**2
        + (-2.0 * kappa * b**2 + 2.0 * a * turn) / q**2
        + 8.0 * a * b**2 / q**3
    )
    return a / q, E1, E2


def _closer(near, far):
    """`1 / near - 1 / far`, 0 for lines that meet no receiver."""
    ok = (near > 0.0) & (far > 0.0)
    return np.where(ok, 1.0 / np.where(ok, near, 1.0) - 1.0 / np.where(ok, far, 1.0), 0.0)


def _across(scene: Scene, near: LineEnds, far: LineEnds, u, ask, step):
    """Change of the seen radiance across the far edge, from clockwise to counter-clockwise."""
    tilt = 1e-3 * step / extent(scene)
    up = np.stack([-u[:, 1], u[:, 0]], -1)
    sides = []
    for sign in (1.0, -1.0):
        ray = u + sign * tilt * up
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        hits = trace(scene, near.point + step * u, ray)
        sides.append(_sent(scene, hits, near.point + step * u, u, far, ask))
    return sides[0] - sides[1]


def _sent(scene: Scene, hits, origin, u, far: LineEnds, ask):
    """Radiance of what a ray beside the line meets, moved onto the line."""
    index = np.maximum(hits.number, 0)
    t, s, _ = batched(on_line, scene, index, origin, u)
    s = np.where(np.isfinite(t), s, hits.s)
    # Where the far edge lies on what is met, it is the edge's own place, from the side of the ray.
    own = hits.number == far.shape
    inward = np.sign(np.mod(hits.s - far.s + 0.5, 1.0) - 0.5)
    nudge = np.where(far.tangent, 0.0, 64.0 * np.finfo(s.dtype).eps * inward)
    s = np.where(own, np.clip(far.s + nudge, 0.0, 1.0), s)
    near_end = np.abs(t - np.linalg.norm(far.point - origin, axis=1)) < 1e-6 * extent(scene)
    s = np.where(~own & near_end, hits.s, s)  # another shape that ends at the same corner
    L = ask(index, s, hits.front, u)
    return np.where(hits.number >= 0, L, 0.0)


# --- a segment seen edge-on ----------------------------------------------------------------------


class _Flat(NamedTuple):
    clear: np.ndarray
    jumps: list


def _edge_on(scene, near: LineEnds, far: LineEnds, u, up, at: _Exact, ask, steps) -> _Flat:
    """A segment in line with the receiver: each open side shows it in place of what is behind."""
    step, aside = steps
    length = np.linalg.norm(far.point - near.point, axis=1)
    gap = _closer(at.r, np.linalg.norm(far.point - at.position, axis=1))
    total, clear = np.zeros(len(u)), np.zeros(len(u), bool)
    normal = batched(frames, scene, np.maximum(near.shape, 0), np.full(len(u), 0.5)).normal
    for side in (1.0, -1.0):
        # Past the segment on this side, to what stands where it ends or crosses, or beyond.
        met = trace(scene, near.point - step * u + side * aside * up, u)
        free = met.t > length + 0.5 * step
        beyond = np.where(met.number >= 0, ask(np.maximum(met.number, 0), met.s, met.front, u), 0.0)
        front = np.sum(side * up * normal, -1) > 0.0
        L = ask(np.maximum(near.shape, 0), np.full(len(u), 0.5), front, u)
        total = total + np.where(free, L - beyond, 0.0)
        clear |= free
    first = at.cos**2 * gap * total
    return _Flat(clear, [np.zeros(len(u)), first, np.zeros(len(u))])


def _straight(scene: Scene, edges: LineEnds):
    """Whether each edge belongs to a segment."""
    count = sum(g.count for g in scene.groups if isinstance(g, Segments))
    return (edges.shape >= 0) & (edges.shape < count)


# --- an edge on the horizon ----------------------------------------------------------------------


def _rising(scene: Scene, near: LineEnds, far: LineEnds, ask) -> VisualEvents:
    """Lines tangent to a receiver: on it the far edge rises or sets."""
    rows = np.flatnonzero(near.tangent)
    near, far = near.take(rows), far.take(rows)
    size, eps = extent(scene), np.finfo(near.point.dtype).eps
    step, aside = size * eps**0.25, _aside(size, near.point)
    way = far.point - near.point
    length = np.linalg.norm(way, axis=1)
    u = way / length[:, None]
    frame = batched(frames, scene, np.maximum(near.shape, 0), near.s)
    kappa, normal = frame.kappa, frame.normal
    # The side that bends away sees along the tangent; the hollow side is behind itself.
    front = kappa < 0.0
    lift = np.where(front, 1.0, -1.0)[:, None] * normal
    start = near.point + step * u
    clear = trace(scene, start + aside * lift, u).t > length - step - 4.0 * np.sqrt(size * aside)
    light = far.shape == LIGHT
    dL = _across(scene, near, far, u, ask, step)
    number = np.where(light, far.s, 0).astype(int)
    power = np.asarray(scene.points.intensity)
    power = power[number] if len(power) else np.zeros(len(far))
    bend = np.where(front, kappa, -kappa)  # as the receiving side sees it: never a valley
    first = np.where(light, np.abs(kappa) * power / length, 0.0) * clear
    second = np.where(light, 0.0, bend * np.abs(bend) * dL) * clear
    second = second * np.where(front, 1.0, -1.0)
    kind = np.where(light, "dusk", "horizon")
    return VisualEvents(
        near.shape, near.s, front, kind, near, far, clear, np.zeros(len(near)), first, second
    )
