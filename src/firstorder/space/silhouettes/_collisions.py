"""Concrete shapes that run into each other, found on the host by points of their surfaces.

Where a surface enters a body, or two flat shapes cut each other, they meet in a line that is
nobody's silhouette. Exact integrals along silhouettes do not know it, and are wrong if light
differs across it. A pair is found if

    of points of one surface some lie in the other body and some outside, or
    an edge of one shape, or a line along its surface, passes through the other one, or
    both are planes in one place that rounding alone turns against each other.

The line in which planes meet otherwise is known (`_common_lines`).

Every pair that is found does meet, by more than rounding. A rim or a round side that dips in
between two points may be missed.
"""

from __future__ import annotations

import warnings
import weakref
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import is_concrete
from firstorder.scene._primitives import BACK, FRONT
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes._bounds import bounds
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Shape,
    Triangles,
)

WRONG = "Answers are wrong where that line is seen."

_Pairs = list[tuple[int, int, np.ndarray]]


def check_apart(scene: Any, at: Any, *, radiance: Any = None, **_: Any) -> None:
    """Refuses shapes that run into each other and send unlike light to the receiver.

    Args:
        scene: of concrete shapes; a traced one is not looked at.
        at: one receiver; what lies below its horizon does not count.
        radiance: given, it is the light, and nothing is known of it.

    Raises:
        ValueError: if there is such a pair.
    """
    if not (isinstance(scene, Scene) and isinstance(at, Receiver)):
        return  # the question itself refuses what is of another world
    if radiance is not None or np.ndim(at.on) or not is_concrete((scene, at)):
        return
    check_apart_from(scene, np.asarray(at.position)[None], np.asarray(at.axes)[None, :, 2])


def check_apart_from(
    scene: Scene, places: Float[np.ndarray, "n 3"], ups: Float[np.ndarray, "n 3"]
) -> None:
    """Refuses shapes that run into each other and send unlike light to one of many receivers.

    Args:
        scene: of concrete shapes.
        places: of the receivers [m].
        ups: their normals; what lies below a horizon does not count.

    Raises:
        ValueError: if there is such a pair.
    """
    for i, j, where in _collisions(scene):
        unlike = np.any(_shown(scene, i, places) != _shown(scene, j, places), axis=-1)
        unlike &= ~(_edge_on(scene, i, places) | _edge_on(scene, j, places))
        seen = zip(places[unlike], ups[unlike], strict=True)
        if any(np.any(_rises(where - x, up)) for x, up in seen):
            raise ValueError(_told(scene, i, j))


def warn_of_collisions(scene: Any, at: Any, *, radiance: Any = None, **_: Any) -> None:
    """Warns a traced receiver of concrete shapes that run into each other and send unlike light.

    Whether it sees the line in which they meet is not known; from the plane of one of them, on
    which it lies, it does not.

    Args:
        scene: a traced one is not looked at.
        at: a concrete one has been looked at.
        radiance: given, it is the light, and nothing is known of it.
    """
    if not (isinstance(scene, Scene) and isinstance(at, Receiver)):
        return  # the question itself refuses what is of another world
    if radiance is not None or not is_concrete(scene) or is_concrete(at):
        return
    on = int(at.on) if is_concrete(at.on) and not np.ndim(at.on) else None
    for i, j, *_rest in _collisions(scene):
        one, other = _lights(scene, i), _lights(scene, j)
        if on not in (i, j) and np.any(one[:, None] != other):
            warnings.warn(f"{_told(scene, i, j)} {WRONG}", stacklevel=3)


def have_collisions(scene: Scene) -> bool:
    """Whether concrete shapes run into each other where light may differ between the two."""
    return bool(_collisions(scene))


def _told(scene: Scene, i: int, j: int) -> str:
    """The words of a refusal, and of a warning."""
    one, other = (f"{k} (`{scene.names[k]}`)" if scene.names[k] else k for k in (i, j))
    return (
        f"Shapes {one} and {other} run into each other and send unlike light: exact integrals do "
        "not know the line in which they meet. Move them apart, or let one end at the other."
    )


def _lights(scene: Scene, number: int) -> np.ndarray:
    """Radiance of those sides of a shape that can be seen from outside: (sides, bands)."""
    group, _ = _found(scene, number)
    emission = np.asarray(scene.material.emission)[number].reshape(2, -1)
    return emission[[FRONT]] if group.closed else emission


def _shown(scene: Scene, number: int, places: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """Radiance of the side that a shape shows to each place: (n, bands)."""
    group, k = _found(scene, number)
    front = np.full(len(places), True)
    if not group.closed:
        front = group.height(places[:, None])[:, k] > 0.0
    emission = np.asarray(scene.material.emission)[number]
    return emission[np.where(front, FRONT, BACK)].reshape(len(places), -1)


def _edge_on(scene: Scene, number: int, places: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """Which places lie in the plane of a flat shape, up to rounding: they see nothing of it."""
    group, k = _found(scene, number)
    if group.closed:
        return np.full(len(places), False)
    far = np.max(np.abs(places - np.asarray(group.center)[k]), -1)
    return abs(group.height(places[:, None])[:, k]) <= 8.0 * np.finfo(far.dtype).eps * far


def _found(scene: Scene, number: int) -> tuple[Shape, int]:
    """The group that holds a shape of the scene, and the shape's number in it."""
    starts = np.cumsum([0, *(group.count for group in scene.groups)])
    which = int(np.searchsorted(starts, number, side="right")) - 1
    return scene.groups[which], number - int(starts[which])


def _rises(way: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Which points are above the horizon, by more than rounding: a floor is not above itself."""
    return way @ up > _slack(way) * np.linalg.norm(way, axis=-1)


# By the scene's identity, for as long as it lives: a module has no hash.
_kept: dict[int, tuple[weakref.ref, _Pairs]] = {}


def _collisions(scene: Any) -> _Pairs:
    """`find_collisions`, looked for once."""
    key = id(scene)
    kept = _kept.get(key)
    if kept is not None and kept[0]() is scene:
        return kept[1]
    found = find_collisions(scene)
    _kept[key] = weakref.ref(scene, lambda _: _kept.pop(key, None)), found
    return found


def find_collisions(scene: Any) -> _Pairs:
    """Pairs of shapes that run into each other, where light may differ between the two.

    Args:
        scene: of concrete shapes.

    Returns:
        Numbers of both, and points near the line in which they meet [m].
    """
    ends = [bounds(group) for group in scene.groups]
    low, high = (np.concatenate(a) for a in zip(*ends, strict=True))
    center, axes = (
        np.concatenate([np.asarray(getattr(g, a)) for g in scene.groups])
        for a in ("center", "axes")
    )
    kinds = [type(g) for g in scene.groups for _ in range(g.count)]
    shines = np.any(np.asarray(scene.material.emission).reshape(len(low), -1) != 0.0, 1)
    found = []
    for i in np.flatnonzero(shines):
        near = np.all((low <= high[i]) & (high >= low[i]), 1)
        near &= ~(shines & (np.arange(len(low)) <= i))  # that pair has been looked at
        for j in np.flatnonzero(near):
            where = _meeting(*(_One(kinds[k], center[k], axes[k]) for k in (i, j)))
            if where is not None:
                found.append((int(i), int(j), where))
    return found


class _One(NamedTuple):
    """One shape, in NumPy's numbers."""

    kind: type[Shape]
    center: np.ndarray
    axes: np.ndarray

    @property
    def closed(self) -> bool:
        """Whether it is a body."""
        return self.kind in (Ellipsoids, Boxes, Cylinders)

    def local(self, p: np.ndarray) -> np.ndarray:
        """World to canonical coordinates."""
        return np.linalg.solve(self.axes, (p - self.center).T).T

    def world(self, q: np.ndarray) -> np.ndarray:
        """Canonical to world coordinates."""
        return self.center + q @ self.axes.T

    def surface(self, other: _One) -> np.ndarray:
        """Points of it; of a flat shape also the foot of the other's centre."""
        points = SURFACES[self.kind]
        if not self.closed:
            foot = self.local(other.center[None]) * [1.0, 1.0, 0.0]
            points = np.concatenate([points, foot[_gauge(self.kind, foot) < 1.0]])
        return self.world(points)


def _meeting(one: _One, other: _One) -> np.ndarray | None:
    """Points near the line in which two shapes meet, or None."""
    if one.kind is other.kind is Planes:
        where = _almost_one(one, other)
        return where if len(where) else None
    for a, b in ((one, other), (other, one)):
        where = _entered(a, b) if b.closed else _cut(a, b)
        if len(where):
            return where
    return None


def _entered(a: _One, body: _One) -> np.ndarray:
    """Points of a surface, or else of its edges, in a body, if it has others outside."""
    p = a.surface(body)
    found = p[_gauge(body.kind, body.local(p)) < 1.0 - _slack(p)]
    if a.kind is Planes:
        return found
    if not _leaves(a, body):
        return found[:0]
    if len(found):
        return found
    # Thin rods cross between the points of both. Chords of round edges lie in the shape, so that
    # the body must not lie in it as a whole.
    start, end = (body.local(a.world(ends)) for ends in EDGES[a.kind])
    near = np.all((np.minimum(start, end) < 1.0) & (np.maximum(start, end) > -1.0), 1)
    q = _deepest(body.kind, start[near], end[near])
    met = _gauge(body.kind, q) < 1.0 - _slack(q)
    return body.world(q[met & (not a.closed or _leaves(body, a))])


def _leaves(a: _One, body: _One) -> bool:
    """Whether some point of a surface lies outside of a body."""
    p = body.local(a.surface(body))
    return bool(np.any(_gauge(body.kind, p) > 1.0 + _slack(p)))


def _deepest(kind: type[Shape], start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The point of each segment that lies deepest in a body: its gauge is convex along it."""
    low, high = np.zeros((len(start), 1)), np.ones((len(start), 1))
    for _ in range(48):
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        deep, deeper = (_gauge(kind, start + s * (end - start))[:, None] for s in (one, two))
        low, high = np.where(deep < deeper, low, one), np.where(deep < deeper, two, high)
    return start + 0.5 * (low + high) * (end - start)


def _cut(a: _One, b: _One) -> np.ndarray:
    """Points in which edges of a shape, or lines along its surface, pass through a flat one."""
    if a.kind is Planes:
        return np.zeros((0, 3))
    start, end = (b.local(a.world(q)) for q in EDGES[a.kind])
    z, w = start[:, 2:], end[:, 2:]
    slack = _slack(z)
    least = slack * np.max(abs(start - end))
    crosses = (z * w < 0.0) & (np.minimum(abs(z), abs(w)) > least)
    q = start + np.where(crosses, z / np.where(crosses, z - w, 1.0), 0.0) * (end - start)
    q = q[crosses[:, 0]]
    if not a.closed and np.min(z) < -least and np.max(z) > least:
        # It is cut along a chord, whose ends may be corners, and may lie on the other one's edge.
        ends = np.concatenate([q, start[abs(z[:, 0]) <= least]])
        q = np.concatenate([ends, np.mean(ends, 0, keepdims=True)])
    return b.world(q[_gauge(b.kind, q) < 1.0 - slack])


def _almost_one(a: _One, b: _One) -> np.ndarray:
    """Points all over two planes that are one but for rounding; none of any others.

    Nobody knows which of the two is in front. Of parallel ones one is, everywhere.
    """
    normals = np.stack([one.axes[:, 2] / np.linalg.norm(one.axes[:, 2]) for one in (a, b)])
    way = b.center - a.center
    size = np.linalg.norm(way) + np.linalg.norm(a.center)
    rounding = 64.0 * np.finfo(way.dtype).eps
    sine, apart = np.linalg.norm(np.cross(*normals)), abs(normals[0] @ way)
    if not 0.0 < sine <= rounding or apart > rounding * size:
        return np.zeros((0, 3))
    far = (size or 1.0) * np.array([-1e6, -1.0, 1.0, 1e6])
    return a.center + np.concatenate([far[:, None] * a.axes[:, k] for k in (0, 1)])


def _slack(a: np.ndarray) -> float:
    """The share of a shape up to which it touches another one and does not enter it."""
    return float(np.finfo(a.dtype).eps ** 0.5)


# --- canonical shapes ----------------------------------------------------------------------------


def _gauge(kind: type[Shape], q: np.ndarray) -> np.ndarray:
    """A number less than one in a shape and more outside; of a flat one by x and y alone."""
    x, y, z = np.moveaxis(q, -1, 0)
    across = np.hypot(x, y)
    return {
        Ellipsoids: np.hypot(across, z),
        Boxes: np.max(abs(q), -1),
        Cylinders: np.maximum(across, abs(z)),
        Discs: across,
        Rectangles: np.maximum(abs(x), abs(y)),
        Triangles: 1.0 - 3.0 * np.minimum(np.minimum(x, y), 1.0 - x - y),
        Planes: 0.0 * x,
    }[kind]


def _surfaces() -> dict[type[Shape], np.ndarray]:
    """Points of canonical surfaces, evenly to a tenth of their size or so."""
    line, turn = np.linspace(-1.0, 1.0, 17), np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], -1)
    up = np.array([0.0, 0.0, 1.0])
    cube = np.stack(np.meshgrid(*[line[::2]] * 3), -1).reshape(-1, 3)
    square = np.stack([*np.meshgrid(line, line), np.zeros((17, 17))], -1).reshape(-1, 3)
    disc = np.concatenate([r * rim for r in line[8:]])
    ball = [np.cos(a) * rim + np.sin(a) * up for a in 0.5 * np.pi * line]
    wall = [rim + z * up for z in line]
    corner = 0.5 * (square + np.array([1.0, 1.0, 0.0]))
    return {
        Ellipsoids: np.concatenate(ball),
        Boxes: cube[np.max(abs(cube), -1) == 1.0],
        Cylinders: np.concatenate([*wall, disc - up, disc + up]),
        Discs: disc,
        Rectangles: square,
        Triangles: corner[corner.sum(-1) <= 1.0],
        Planes: np.zeros((0, 3)),
    }


def _edges() -> dict[type[Shape], tuple[np.ndarray, np.ndarray]]:
    """Starts and ends of edges, of round ones chords; of a ball and a wall lines from top to base.

    A thin rod passes through a flat shape between the points of both.
    """
    square = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    rim, up = SURFACES[Discs][-32:], np.array([0.0, 0.0, 1.0])
    outlines = {
        Rectangles: square,
        Triangles: np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        Discs: rim,
    }
    found = {kind: (p, np.roll(p, -1, 0)) for kind, p in outlines.items()}
    for kind, base in ((Boxes, square), (Cylinders, rim)):
        around = np.roll(base, -1, 0)
        found[kind] = (
            np.concatenate([base - up, base - up, base + up]),
            np.concatenate([base + up, around - up, around + up]),
        )
    ball = SURFACES[Ellipsoids]
    found[Ellipsoids] = ball[:-32], ball[32:]
    return found


SURFACES = _surfaces()
EDGES = _edges()
