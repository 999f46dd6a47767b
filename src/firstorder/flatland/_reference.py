"""Reference tracer, slow and readable: one ray, one shape, one equation at a time.

It shares no code with `intersect`: NumPy and SciPy solve the textbook equations, and the first hit
is the smallest of a list. The tests hold the fast tracer to it; so can a reader.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np
from scipy.optimize import brentq

from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments, Shape

# A ray does not meet the point that it starts from; how near is that point still?
OWN = 1e-7


def reference_nearest(
    scene: Scene, origins: np.ndarray, along: np.ndarray, on: int = -1
) -> tuple[np.ndarray, np.ndarray]:
    """Distance and shape of the first hit of every ray, infinity and -1 for a miss.

    Args:
        scene: the shapes.
        origins: where the rays start, shape (r, 2) [m].
        along: unit directions, shape (r, 2).
        on: the shape on which all rays start, or -1.

    Example:
        >>> import numpy as np
        >>> from firstorder.flatland import Circles, Scene, primitive
        >>> from firstorder.flatland._reference import reference_nearest
        >>> scene = Scene.of(primitive(Circles((0.0, 3.0), 1.0)))
        >>> reference_nearest(scene, np.array([[0.0, 0.0]]), np.array([[0.0, 1.0]]))[0].item()
        2.0
    """
    # (NumPy's numbers once: to take them out of JAX one by one takes longer than the search.)
    groups = jax.tree.map(lambda a: np.asarray(a, np.float64), scene.groups)
    t, index = [], []
    for origin, direction in zip(np.asarray(origins), np.asarray(along), strict=True):
        best, which = np.inf, -1
        for number, hits in enumerate(_all_hits(groups, origin, direction)):
            least = OWN if number == on else 0.0
            ahead = [hit for hit in hits if hit > least]
            if ahead and min(ahead) < best:
                best, which = min(ahead), number
        t.append(best)
        index.append(which)
    return np.array(t), np.array(index)


def _all_hits(groups: Sequence[Shape], o: np.ndarray, d: np.ndarray):
    """For each shape, all distances at which the line meets it."""
    for group in groups:
        for i in range(group.count):
            match group:
                case Segments():
                    yield _segment(group.start[i], group.end[i], o, d)
                case Circles():
                    axes = np.eye(2) / group.radius[i]
                    yield _conic(group.center[i], axes, o, d)
                case Arcs():
                    yield _arc(group, i, o, d)
                case Ellipses():
                    tilt, semi = group.tilt[i], group.semi[i]
                    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
                    axes = turn / semi[:, None]
                    yield _conic(group.center[i], axes, o, d)
                case Curves():
                    yield _curve(group, i, o, d)


def _segment(a, b, o, d) -> list[float]:
    """`o + t d = a + s (b - a)`, with s in [0, 1]."""
    M = np.stack([d, a - b], axis=1)
    if np.linalg.det(M) == 0.0:
        return []
    t, s = np.linalg.solve(M, a - o)
    return [t] if 0.0 <= s <= 1.0 else []


def _conic(center, axes, o, d) -> list[float]:
    """`|A (o + t d - c)|^2 = 1`: both roots of `a t^2 + 2 b t + c`.

    The larger by size comes first, and from it the other: their product is `c / a`.
    """
    w, u = axes @ (o - center), axes @ d
    a, b, c = u @ u, w @ u, w @ w - 1.0
    square = b * b - a * c
    if square < 0.0:
        return []
    q = -(b + np.copysign(np.sqrt(square), b))
    return [float(q / a), float(c / q)] if q else [0.0]


def _arc(group: Arcs, i: int, o, d) -> list[float]:
    """The hits of the whole circle whose angle is swept."""
    center, start, sweep = group.center[i], group.start[i], group.sweep[i]
    found = []
    for t in _conic(center, np.eye(2) / group.radius[i], o, d):
        h = o + t * d - center
        turned = (np.arctan2(-h[0], h[1]) - start) * np.sign(sweep)
        if turned % (2.0 * np.pi) <= abs(sweep):
            found.append(t)
    return found


def _curve(group: Curves, i: int, o, d) -> list[float]:
    """Changes of side along the curve, on many pieces, each narrowed by Brent's method."""
    a, b = group.cosines[i], group.sines[i]
    k = 2.0 * np.pi * np.arange(a.shape[0])

    def point(s):
        return np.cos(np.multiply.outer(s, k)) @ a + np.sin(np.multiply.outer(s, k)) @ b - o

    def side(s):
        return point(s) @ np.array([-d[1], d[0]])

    # Pieces end away from 0, 1/4, 1/2 ..., where rays along its axes meet a symmetric curve.
    edges = np.linspace(0.0, 1.0, 2001) + 1e-4 * np.pi
    ahead = side(edges) > 0.0
    return [
        float(point(brentq(side, edges[j], edges[j + 1], xtol=1e-15)) @ d)
        for j in np.flatnonzero(ahead[:-1] != ahead[1:])
    ]
