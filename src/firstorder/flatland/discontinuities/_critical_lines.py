"""Critical lines: the lines that pass two edges of a scene.

An edge is a point (an end of a shape, a place where radiance jumps, a point light) or a point of
tangency of a curve. So a critical line goes through two points, through a point and along a curve,
or along two curves. What an eye on such a line sees changes its order there: `events` follows the
lines to the receivers they meet. Found on the host, once for a scene, from its concrete numbers.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from firstorder.flatland.discontinuities._queries import batched
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Segments
from firstorder.numerics._batching import host_rows

LIGHT = -1  # in place of a shape's number: a point light
GRID = 96  # pieces of a curve between which a common tangent of two curves is looked for

Breaks = tuple[tuple[int, float], ...]


@dataclasses.dataclass(frozen=True)
class LineEnds:
    """One end of each of many lines.

    Attributes:
        point: where the line passes the edge [m].
        shape: number of the shape whose edge it is, `LIGHT` for a point light.
        s: parameter on the shape; the light's number for a point light.
        tangent: whether the line is tangent to the shape there, and does not just pass a point.
    """

    point: Float[np.ndarray, "n 2"]
    shape: Int[np.ndarray, " n"]
    s: Float[np.ndarray, " n"]
    tangent: np.ndarray

    def __len__(self) -> int:
        return len(self.shape)

    def take(self, rows) -> LineEnds:
        """Some of the rows."""
        return LineEnds(self.point[rows], self.shape[rows], self.s[rows], self.tangent[rows])

    @staticmethod
    def stack(parts: list[LineEnds]) -> LineEnds:
        """Several of these as one."""
        fields = ("point", "shape", "s", "tangent")
        return LineEnds(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))


def critical_lines(scene: Scene, breaks: Breaks = ()) -> tuple[LineEnds, LineEnds]:
    """All lines through two edges, whether or not anything stands between them.

    Args:
        scene: concrete shapes and lights.
        breaks: further places (shape, parameter) at which the radiance of a surface jumps.

    Returns:
        The two edges of each line, each line once. Two point lights make no line.

    Example:
        >>> from firstorder.flatland import Circles, Scene, primitive
        >>> from firstorder.flatland.discontinuities._critical_lines import critical_lines
        >>> two = Scene.of(primitive(Circles([(0.0, 0.0), (3.0, 0.0)], [1.0, 0.5])))
        >>> len(critical_lines(two)[0])  # two outer and two inner common tangents
        4
    """
    points = point_edges(scene, breaks)
    parts = [_through_points(points), _along_one(scene, points), _along_two(scene)]
    first, second = (LineEnds.stack([part[i] for part in parts]) for i in (0, 1))
    way = np.linalg.norm(second.point - first.point, axis=1)
    apart = way > 1e3 * np.finfo(way.dtype).eps * (1.0 + np.abs(first.point).max(1, initial=0.0))
    return first.take(apart), second.take(apart)


def point_edges(scene: Scene, breaks: Breaks = ()) -> LineEnds:
    """Ends of shapes that are not closed, crossings, breaks and point lights; each place once."""
    at = [(i, s) for i in open_shapes(scene) for s in (0.0, 1.0)]
    at += [(int(i), float(s)) for i, s in breaks]
    at += [first for first, _ in crossing_places(scene)]
    shape = np.array([i for i, _ in at], dtype=int)
    s = np.array([t for _, t in at])
    point = positions(scene, shape, s)
    lights = np.asarray(scene.points.position).reshape(-1, 2)
    point = np.concatenate([point, lights])
    shape = np.concatenate([shape, np.full(len(lights), LIGHT)])
    s = np.concatenate([s, np.arange(len(lights))])
    keep, size = [], 0.0
    if len(point):
        rounding = 8.0 * np.finfo(point.dtype).eps * np.abs(point).max()
        size = max(1e-9 * np.ptp(point, axis=0).max(), rounding)
    for row in range(len(point)):  # the common end of two segments is one edge
        if all(np.abs(point[row] - point[k]).max() > size for k in keep):
            keep.append(row)
    return LineEnds(point, shape, s, np.zeros(len(point), bool)).take(np.array(keep, dtype=int))


def crossing_places(scene: Scene) -> list[tuple[tuple[int, float], tuple[int, float]]]:
    """Where shapes cross: on both of each pair, the shape's number and the parameter, to rounding.

    (What a scene keeps is where a search begins: on round shapes it lies on a chord.)
    """
    pairs, near = np.asarray(scene.crossings.pairs), np.asarray(scene.crossings.near)
    if not len(pairs):
        return []
    s, _, there = batched(_crossings, scene, pairs, near)
    rows = zip(pairs[there].tolist(), s[there].tolist(), strict=True)
    return [((i, u), (j, v)) for (i, j), (u, v) in rows]


@eqx.filter_jit
def _crossings(scene, pairs, near):
    return jax.vmap(scene.crossing)(pairs, near)


def open_shapes(scene: Scene) -> list[int]:
    """Numbers of the shapes that have ends."""
    return [i for i, shape in enumerate(singles(scene)) if not shape.closed]


def singles(scene: Scene) -> list:
    """Each shape of a scene by itself, in order, as a slice of its kind."""
    return [
        jax.tree.map(lambda leaf, k=k: leaf[k], group)
        for group in scene.groups
        for k in range(group.count)
    ]


def positions(scene: Scene, shape, s) -> np.ndarray:
    """Points of shapes."""
    return batched(_positions, scene, np.asarray(shape, int), np.asarray(s, float))


@eqx.filter_jit
def _positions(scene, shape, s):
    return jax.vmap(lambda i, t: scene.motion(i, t)[0])(shape, s)


# --- two points ----------------------------------------------------------------------------------


def _through_points(points: LineEnds) -> tuple[LineEnds, LineEnds]:
    """Every pair of points."""
    a, b = np.triu_indices(len(points), 1)
    both = (points.shape[a] == LIGHT) & (points.shape[b] == LIGHT)
    return points.take(a[~both]), points.take(b[~both])


# --- a point and a curve -------------------------------------------------------------------------


def _along_one(scene: Scene, points: LineEnds) -> tuple[LineEnds, LineEnds]:
    """Tangents from every point to every curve, but to the curve on which the point lies."""
    found = _tangents(scene, jnp.asarray(points.point)) if len(points) else None
    firsts, seconds, number = [], [], 0
    for group, answer in zip(scene.groups, found or (), strict=False):
        place, valid = (np.asarray(a) for a in answer)  # (points, shapes, tangents, ...)
        for k in range(group.count):
            ok = valid[:, k].copy()
            ok[points.shape == number] = False
            if not isinstance(group, Segments):
                row, which = np.nonzero(ok)
                touch = place[row, k, which]
                firsts.append(points.take(row))
                seconds.append(_tangent_edges(scene, number, touch))
            number += 1
    empty = points.take(np.zeros(0, int))
    return LineEnds.stack([empty, *firsts]), LineEnds.stack([empty, *seconds])


@eqx.filter_jit
def _tangents(scene, points):
    """Points of tangency by group; an arc's ends, which come last, are points and left out."""

    def one(shape, p):
        place, valid = shape.silhouettes(p, jnp.asarray(False))
        return (place[:2], valid[:2]) if isinstance(shape, Arcs) else (place, valid)

    return [
        jax.vmap(lambda p, g=g: jax.vmap(lambda shape: one(shape, p))(g))(points)
        for g in scene.groups
    ]


def _tangent_edges(scene: Scene, number: int, place: np.ndarray) -> LineEnds:
    n = len(place)
    s = np.array([parameter(scene, number, p) for p in place])
    return LineEnds(place, np.full(n, number), s.reshape(n), np.ones(n, bool))


def parameter(scene: Scene, number: int, place: np.ndarray) -> float:
    """The parameter of the point of a shape that is nearest to a place on it."""
    shape = singles(scene)[number]
    if isinstance(shape, Circles):
        x, y = place - np.asarray(shape.center)
        return float(np.mod(np.arctan2(x, y) / (2.0 * np.pi), 1.0))
    if isinstance(shape, Arcs):
        x, y = place - np.asarray(shape.center)
        turned = (np.arctan2(-x, y) - float(shape.start)) * np.sign(float(shape.sweep))
        return float(np.mod(turned, 2.0 * np.pi) / abs(float(shape.sweep)))
    s = np.linspace(0.0, 1.0, 4 * GRID + 1)
    c = positions(scene, np.full(len(s), number), s)
    t = float(s[np.argmin(np.sum((c - place) ** 2, axis=1))])
    for _ in range(8):
        c, v, a = (np.asarray(m) for m in _motion(scene, jnp.asarray(number), jnp.asarray(t)))
        t -= float((c - place) @ v / (v @ v + (c - place) @ a))
    return float(np.clip(t, 0.0, 1.0)) if not shape.closed else float(np.mod(t, 1.0))


@eqx.filter_jit
def _motion(scene, number, s):
    return scene.motion(number, s)


# --- two curves ----------------------------------------------------------------------------------


def _along_two(scene: Scene) -> tuple[LineEnds, LineEnds]:
    """The common tangents of every pair of curves, and of a curve that bends both ways."""
    shapes = singles(scene)
    curved = [i for i, shape in enumerate(shapes) if not isinstance(shape, Segments)]
    firsts, seconds = [_none()], [_none()]
    for m, i in enumerate(curved):
        for j in curved[m:]:
            round_ = isinstance(shapes[i], (Circles, Arcs)) and isinstance(
                shapes[j], (Circles, Arcs)
            )
            if i == j and round_:
                continue
            a, b = _of_circles(shapes[i], shapes[j]) if round_ else _of_curves(scene, i, j)
            sides = [_tangent_edges(scene, n, p) for n, p in ((i, a), (j, b))]
            on = (sides[0].s <= 1.0) & (sides[1].s <= 1.0)  # beyond 1 it is not on the arc
            firsts.append(sides[0].take(on))
            seconds.append(sides[1].take(on))
    return LineEnds.stack(firsts), LineEnds.stack(seconds)


def _none() -> LineEnds:
    return LineEnds(np.zeros((0, 2)), np.zeros(0, int), np.zeros(0), np.zeros(0, bool))


def _of_circles(a, b) -> tuple[np.ndarray, np.ndarray]:
    """Points of tangency of the two outer and two inner tangents, where they exist.

    With a unit normal m of the line, touched at `c_a + r_a m` and `c_b + sign r_b m`,
    `(c_b - c_a) . m = r_a - sign r_b`.
    """
    ca, cb = np.asarray(a.center), np.asarray(b.center)
    ra, rb = float(a.radius), float(b.radius)
    d = float(np.linalg.norm(cb - ca))
    touch_a, touch_b = [], []
    for sign in (1.0, -1.0):
        along = (ra - sign * rb) / d if d > 0.0 else 2.0
        if abs(along) >= 1.0:
            continue
        for side in (1.0, -1.0):
            e = (cb - ca) / d
            m = along * e + side * np.sqrt(1.0 - along**2) * np.array([-e[1], e[0]])
            touch_a.append(ca + ra * m)
            touch_b.append(cb + sign * rb * m)
    return np.reshape(touch_a, (-1, 2)), np.reshape(touch_b, (-1, 2))


def _of_curves(scene: Scene, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
    """Common tangents of two curves: cells of a grid in which both conditions change sign, Newton.

    `F = (v_i x (c_j - c_i), v_j x (c_j - c_i))` vanishes at both points of tangency.
    """
    s = (np.arange(GRID) + 0.5) / GRID
    t = np.array(s + (0.25 / GRID if i == j else 0.0))
    pair = jnp.asarray(i), jnp.asarray(j)  # as arrays: every pair is the same program
    F = np.asarray(_conditions(scene, *pair, jnp.asarray(s), jnp.asarray(t)))
    sign = F > 0.0
    corners = [np.roll(sign, (-di, -dj), axis=(0, 1)) for di in (0, 1) for dj in (0, 1)]
    mixed = np.any(corners, axis=0) & ~np.all(corners, axis=0)
    rows, columns = np.nonzero(mixed.all(axis=-1))
    start = np.stack([s[rows], t[columns]], -1) + 0.5 / GRID
    if not len(start):
        return np.zeros((0, 2)), np.zeros((0, 2))
    roots, left, a, b = host_rows(lambda start: _newton(scene, *pair, start), start)
    near = np.abs(roots - start).max(axis=1) < 2.0 / GRID
    size = np.ptp(np.concatenate([a, b]), axis=0).max()
    apart = np.linalg.norm(a - b, axis=1) > 1e-3 * size
    keep = []
    for k in np.flatnonzero(near & (left < 1e-9) & apart):
        ends = np.concatenate([a[k], b[k]])
        swapped = np.concatenate([b[k], a[k]])
        known = [np.concatenate([a[q], b[q]]) for q in keep]
        same = [
            min(np.abs(ends - q).max(), np.abs(swapped - q).max() if i == j else np.inf)
            for q in known
        ]
        if all(distance > 1e-6 * size for distance in same):
            keep.append(k)
    return a[keep], b[keep]


def _condition(scene, i, j, s):
    a, va, _ = scene.motion(i, s[0])
    b, vb, _ = scene.motion(j, s[1])
    way = b - a
    F = jnp.stack([va[0] * way[1] - va[1] * way[0], vb[0] * way[1] - vb[1] * way[0]])
    return F / jnp.stack([jnp.sum(va**2), jnp.sum(vb**2)])


@eqx.filter_jit
def _conditions(scene, i, j, s, t):
    pair = jax.vmap(lambda p: jax.vmap(lambda q: _condition(scene, i, j, jnp.stack([p, q])))(t))
    return pair(s)


@eqx.filter_jit
def _newton(scene, i, j, start):
    def f(s):
        return _condition(scene, i, j, s)

    def step(_, s):
        J = jax.jacfwd(f)(s)
        det = J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
        inverse = jnp.array([[J[1, 1], -J[0, 1]], [-J[1, 0], J[0, 0]]])
        return s - inverse @ f(s) / jnp.where(det == 0.0, 1.0, det)

    def one(s):
        s = jax.lax.fori_loop(0, 12, step, s)
        ends = [scene.motion(k, t)[0] for k, t in zip((i, j), s, strict=True)]
        return s, jnp.abs(f(s)).max(), *ends

    return jax.vmap(one)(start)
