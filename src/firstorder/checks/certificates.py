"""A proof, for one receiver, of how far flatland's irradiance is from the exact one.

With `y = sin(theta)` irradiance is `E = int L dy` over [-1, 1], and L jumps at silhouettes alone.
Every silhouette is put into an interval of y that surely holds it. Between these intervals one ray
finds the one shape that is seen; inside of them, which is hardly anywhere, it may be any.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder._display import in_print
from firstorder.checks._enclosures import (
    Met,
    Round,
    Silhouettes,
    Straight,
    hits,
    round_of,
    silhouettes,
    straight_of,
)
from firstorder.checks._interval import (
    Interval,
    choose,
    cross,
    dot,
    exact,
    hull,
    square,
    total,
    turned,
)
from firstorder.checks._meetings import Meetings, meetings
from firstorder.flatland.direct_lighting import irradiance
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Segments
from firstorder.flatland.skies import ConstantSky
from firstorder.flatland.visible import Receiver
from firstorder.numerics._compiled import compiled
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._bands import by_band
from firstorder.scene._intersect import ranks, tie
from firstorder.scene._primitives import BACK, FRONT


class Certificate(NamedTuple):
    """A proved bound on the error of irradiance at a receiver.

    Attributes:
        error: bound on its absolute error, in each band if there are any [W/m]; infinity if
            nothing is known, NaN where irradiance is.
        certified: whether the order of what is seen is proved. False within rounding of a visual
            event, where the bound holds, but derivatives jump.
    """

    error: Float[Array, "*bands"]
    certified: Bool[Array, "*bands"]

    __repr__ = in_print


def certified(scene: Scene, at: Receiver) -> Certificate:
    """A bound on the error of `flatland.irradiance` at a receiver, proved by interval arithmetic.

    With `y = sin(theta) = (normal x u) / |u|` of the way u to a silhouette, `E = int L dy`; each y
    is put into an interval by operations that move both ends outwards by `eps` of themselves, since
    sums, products, quotients and roots err by `eps / 2` and sines and cosines by up to `4 eps`.
    Between two such intervals L is that of the shape whose interval of distances, on one ray, lies
    before those of all others (any that may be first, if there is none); inside of one it is that
    of either neighbour, and where intervals of different places overlap it is any of the scene.
    `E` lies in the sum of these L times their widths, and the error is at most the distance from
    what `irradiance` returns to the farther end of that sum.

    The bound counts every error of `irradiance`, whatever its cause. It holds at visual events too,
    where E is continuous; that its derivatives jump there is said by `certified`.

    Valid for: segments, circles and arcs under a black or a constant sky, with point lights, as
    their numbers describe them exactly, without underflow. A receiver with `on` lies on its shape
    exactly, and one that lies on a shape to rounding without it is not certified. Of segments that
    exactly lie on one line the one is seen that `Scene.of` says; other surfaces within its share
    of a distance are in doubt. The receiver may be traced, the shapes not: build the scene outside
    of `jit`.

    Args:
        scene: shapes and lights.
        at: one receiver; use `jax.vmap` for many.

    Returns:
        The bound, and whether the order of silhouettes is proved.

    Raises:
        ValueError: for a row of receivers, traced shapes, ellipses or curves, or another sky.
        TypeError: if one of them is something else, or of the other world.

    Reference: J12 eq. 16 for the sum.

    Example:
        >>> from firstorder.checks import certified
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.library import scene_b
        >>> proof = certified(scene_b(), Receiver((0.3, 0.0), 0.0))
        >>> proof.certified.item(), proof.error.item() < 1e-5  # single precision
        (True, True)
        >>> in_line = Receiver((-0.1, 0.0), 0.0)  # with an end of the lamp and one of the blocker
        >>> certified(scene_b(), in_line).certified.item()
        False
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    _check_scene(scene)
    return _certificate(scene, at, _meetings(scene))


# --- before any receiver --------------------------------------------------------------------------


def _check_scene(scene: Scene) -> None:
    """Refuses what no proof is known for."""
    if not is_concrete(scene.groups):
        raise ValueError(
            "Argument `scene` must be concrete, but is traced: build it outside of `jit`, since "
            "the host decides which of its shapes cross."
        )
    for group in scene.groups:
        if not isinstance(group, (Segments, Circles, Arcs)):
            raise ValueError(
                "Argument `scene` must hold segments, circles and arcs alone, but holds "
                f"{type(group).__name__}."
            )
    if not (scene.environment is None or isinstance(scene.environment, ConstantSky)):
        raise ValueError(
            "Argument `scene` must have a black or a constant sky, but has a "
            f"{type(scene.environment).__name__}: its integral is by quadrature."
        )


def _meetings(scene: Scene) -> Meetings:
    """Pairs of its shapes that may meet."""
    lines = [g for g in scene.groups if isinstance(g, Segments)]
    rings = [g for g in scene.groups if not isinstance(g, Segments)]

    def joined(groups, name, empty):
        return np.concatenate([empty, *(np.asarray(getattr(g, name), float) for g in groups)])

    rows = np.zeros((0, 2))
    return meetings(
        joined(lines, "start", rows),
        joined(lines, "end", rows),
        joined(rings, "center", rows),
        joined(rings, "radius", np.zeros(0)),
    )


# --- the bound ------------------------------------------------------------------------------------


class _World(NamedTuple):
    """Shapes, receiver and light as the rays of one receiver need them, in one precision.

    Attributes:
        emission: front and back of each shape [W/(m rad)].
        sky: its radiance.
    """

    lines: Straight
    rings: Round
    pairs: Meetings
    p: Float[Array, "2"]
    normal: Interval
    on: Int[Array, ""]
    emission: Float[Array, "n 2"]
    sky: Float[Array, ""]


@compiled
@by_band()
def _certificate(scene: Scene, at: Receiver, pairs: Meetings) -> Certificate:
    """The bound for one band."""
    scene, at = jax.lax.stop_gradient((scene, at))
    dtype = jnp.result_type(at.position, at.n, *jax.tree.leaves(scene))
    emission = scene.material.emission.astype(dtype)
    sky = jnp.zeros((), dtype)
    if isinstance(scene.environment, ConstantSky):
        sky = scene.environment.radiance.astype(dtype)
    world = _World(
        straight_of(scene, dtype),
        round_of(scene, dtype),
        pairs,
        at.position.astype(dtype),
        turned(exact(at.n.astype(dtype))),
        at.on,
        emission,
        sky,
    )
    seen, proved = _seen_light(world)
    E, lit = irradiance(scene, at), jnp.asarray(True)
    for position, intensity in zip(scene.points.position, scene.points.intensity, strict=True):
        one, sure = _point_light(world, position.astype(dtype), intensity.astype(dtype))
        seen, lit = seen + one, lit & sure
    gap = jnp.maximum((exact(E) - seen).hi, (seen - exact(E)).hi)
    gap = jnp.where(jnp.isnan(gap), jnp.inf, jnp.maximum(gap, 0.0))
    error = jnp.where(jnp.isnan(E), jnp.nan, gap)
    return Certificate(error, proved & lit & jnp.isfinite(error))


class _Heights(NamedTuple):
    """Silhouettes over y = sin(theta), in the order of their lower ends.

    Attributes:
        y: where each is.
        way: to each.
        above: whether it is surely above the horizon.
        place: of each, if it is known exactly.
        lost: whether one may be the receiver itself, seen everywhere.
    """

    y: Interval
    way: Interval
    above: Bool[Array, " m"]
    place: Float[Array, "m 2"]
    lost: Bool[Array, ""]


def _height(world: _World, way: Interval) -> tuple[Interval, Interval]:
    """The sine of the angle of a way, and its component along the normal.

    What may lie on the horizon may lie anywhere beyond; the receiver itself is everywhere.
    """
    normal = jax.tree.map(lambda end: jnp.broadcast_to(end, way.lo.shape), world.normal)
    side, up = cross(normal, way), dot(normal, way)
    y = (side / square(way).sqrt()).within(-1.0, 1.0)
    low = ~up.positive
    lo = jnp.where(jnp.isnan(y.lo) | (low & ~side.positive), -1.0, y.lo)
    hi = jnp.where(jnp.isnan(y.hi) | (low & ~side.negative), 1.0, y.hi)
    return Interval(lo, hi), up


def _heights(world: _World, found: Silhouettes) -> _Heights:
    """All silhouettes that may be above the horizon; the others are put to its end."""
    y, up = _height(world, found.way)
    there = found.valid & ~up.negative
    y = choose(there, y, exact(jnp.ones_like(y.lo)))
    lost = jnp.any((y.lo == -1.0) & (y.hi == 1.0))
    order = jnp.argsort(y.lo)
    above = (there & up.positive)[order]
    return _Heights(y[order], found.way[order], above, found.place[order], lost)


def _seen_light(world: _World) -> tuple[Interval, Bool[Array, ""]]:
    """The light of shapes and sky, and whether the order of what is seen is proved."""
    found = silhouettes(world.lines, world.rings, world.pairs, world.p, world.on)
    at = _heights(world, found)
    edge = jnp.ones(1, at.y.lo.dtype)
    start = jnp.concatenate([-edge, jax.lax.cummax(at.y.hi)])
    end = jnp.concatenate([at.y.lo, edge])
    apart = end > start
    L, sure, inside = jax.vmap(lambda a, b: _gap(world, a, b))(start, end)
    lit = choose(apart, L, exact(jnp.zeros_like(start)))
    wide = choose(apart, exact(end) - exact(start), exact(jnp.zeros_like(start)))
    within, in_line = _clusters(world, at, apart, L)
    covered = exact(start[1:]) - exact(jnp.maximum(start[:-1], at.y.lo))
    covered = covered.within(0.0, jnp.inf)
    parts = lit * wide, within * covered
    terms = Interval(*(jnp.concatenate([getattr(a, e) for a in parts]) for e in ("lo", "hi")))
    return total(terms), ~in_line & ~at.lost & jnp.all(sure | ~(apart & inside))


def _gap(world: _World, start, end) -> tuple[Interval, Bool[Array, ""], Bool[Array, ""]]:
    """Radiance between two heights without a silhouette between them, by one ray.

    Returns:
        Radiance, whether it is one number, and whether the ray is surely above the horizon.
    """
    y = 0.5 * (start + end)
    normal = 0.5 * (world.normal.lo + world.normal.hi)
    up = jnp.sqrt(jnp.maximum((1.0 - y) * (1.0 + y), 0.0))
    d = exact(jnp.stack([normal[0] * up - normal[1] * y, normal[1] * up + normal[0] * y]))
    there, above = _height(world, d)
    between = (there.lo > start) & (there.hi < end) & above.positive
    L, sure = _first(world, hits(world.lines, world.rings, world.p, d, world.on))
    return choose(between, L, _any(world)), between & sure, above.positive


def _any(world: _World) -> Interval:
    """All radiances that there are."""
    none = exact(world.sky)
    return hull(none, Interval(jnp.min(world.emission), jnp.max(world.emission)))


def _first(world: _World, met: Met) -> tuple[Interval, Bool[Array, ""]]:
    """Radiance of what a ray meets first, and whether it is one number."""
    reach = jnp.min(jnp.where(met.sure, met.t.hi, jnp.inf), initial=jnp.inf)
    eps = jnp.finfo(reach.dtype).eps
    slack = 8.0 * eps * jnp.max(jnp.abs(world.p))
    first = met.possible & ~(met.t.lo > reach * (1.0 + 2.0 * tie(reach.dtype)) + 2.0 * slack)
    first = first & ~_outranked(world, met, first)
    sides = world.emission[met.number]
    front, back = sides[:, FRONT], sides[:, BACK]
    known = jnp.where(met.front, front, back)
    low = jnp.where(met.sure, known, jnp.minimum(front, back))
    high = jnp.where(met.sure, known, jnp.maximum(front, back))
    open_sky = jnp.where(reach < jnp.inf, jnp.nan, world.sky)
    lo = jnp.fmin(jnp.min(jnp.where(first, low, jnp.inf), initial=jnp.inf), open_sky)
    hi = jnp.fmax(jnp.max(jnp.where(first, high, -jnp.inf), initial=-jnp.inf), open_sky)
    return Interval(lo, hi), lo == hi


def _outranked(world: _World, met: Met, first: Bool[Array, " h"]) -> Bool[Array, " h"]:
    """Segments in whose place another one is seen that lies on the same line."""
    a, b = (world.lines.number[world.pairs.in_line[:, k]] for k in range(2))
    rows = world.pairs.in_line
    rank = ranks(world.emission)
    second = (rank[a] < rank[b])[:, None]
    loser, winner = (jnp.where(second, rows, rows[:, ::-1])[:, k] for k in range(2))
    return jnp.zeros_like(first).at[loser].max((first & met.sure)[winner])


def _clusters(world: _World, at: _Heights, apart, L: Interval) -> tuple[Interval, Bool[Array, ""]]:
    """Radiance inside each silhouette's interval, and whether two places are in one line.

    Silhouettes between two gaps form a cluster. If they are one place, radiance in it is that of
    one neighbouring gap or the other; else it is any.
    """
    number = jnp.arange(apart.size)
    before = jax.lax.cummax(jnp.where(apart, number, -1))[:-1]
    after = jax.lax.cummin(jnp.where(apart, number, apart.size), reverse=True)[1:]
    joined = ~apart[1:-1]
    mixed = joined & ~jnp.all(at.place[:-1] == at.place[1:], -1)
    counted = jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(mixed)])
    first, last = jnp.maximum(before, 0), jnp.minimum(after, apart.size - 1)
    one_place = (counted[last - 1] == counted[first]) & (before >= 0) & (after < apart.size)
    every = jax.tree.map(lambda end: jnp.broadcast_to(end, one_place.shape), _any(world))
    within = choose(one_place, hull(L[first], L[last]), every)
    in_line = joined & ~_near(at.way[:-1], at.way[1:]) & at.above[:-1] & at.above[1:]
    return within, jnp.any(in_line)


def _near(a: Interval, b: Interval) -> Bool[Array, " m"]:
    """Whether two ways may be to one place."""
    return jnp.all((a.lo <= b.hi) & (b.lo <= a.hi), -1)


def _point_light(world: _World, position, intensity) -> tuple[Interval, Bool[Array, ""]]:
    """Irradiance from a point light, and whether it surely is seen or hidden."""
    way = exact(position) - exact(world.p)
    up = dot(world.normal, way)
    full = exact(intensity) * up.within(0.0, jnp.inf) / square(way)
    met = hits(world.lines, world.rings, world.p, way, world.on)
    near_end = 1.0 - tie(position.dtype)
    hidden = jnp.any(met.sure & (met.t.hi < near_end))
    clear = ~jnp.any(met.possible & ~(met.t.lo > near_end))
    lo = jnp.where(clear, full.lo, 0.0)
    hi = jnp.where(hidden, 0.0, full.hi)
    return Interval(lo, hi), hidden | clear | ~up.positive
