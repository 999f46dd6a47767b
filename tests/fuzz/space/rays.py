"""Irradiance in space by rays: NumPy in its longest precision, nothing of the library's code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tests.fuzz.space.layout import BALL, BODIES, BOX, SKY, Space

LONG = np.longdouble
BLOCK = 1 << 16  # strata at once
SIGMAS = 6.0  # of 10^5 scenes hardly one is off by more
MISSED = 8.0  # strata
LAMPS = 2  # rectangles
ELSEWHERE = -1  # in place of a lamp's number: all that is no lamp
CORNERS = (-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)


def by_rays(s: Space, row: int, eps: float, rays: int) -> tuple[float, float]:
    """Irradiance of one scene by rays to pairs of points in equal strata of each lamp.

        E = integral over the lamp of L V cos(theta) cos(theta') / d^2 dA

    and, if other things shine or the sky, to pairs of directions in strata of equal cosine.

    Args:
        s: scenes.
        row: which of them.
        eps: of the precision by which surfaces in one place are told apart.
        rays: how many, roughly.

    Returns:
        The sum, and a bound on its error: `SIGMAS` standard errors, and what strata hold that a
        thing which hides less than one of them can hide.
    """
    one = Space(*(np.asarray(a[row], LONG) for a in s))
    total, variance, unseen = 0.0, 0.0, 0.0
    side, rng = int(np.sqrt(rays / 2)), np.random.default_rng([row, rays])
    for number in (*range(LAMPS), ELSEWHERE):
        lit = np.any(one.emission[LAMPS:] if number == ELSEWHERE else one.emission[number])
        for first in range(0, side * side if lit else 0, BLOCK):
            cells = np.arange(first, min(first + BLOCK, side * side))
            a, b = (_strata(one, number, cells, side, rng, eps) for _ in range(2))
            total += float(np.sum(a[0] + b[0])) / 2.0
            variance += float(np.sum((a[0] - b[0]) ** 2)) / 4.0
            unseen = max(unseen, float(np.max(a[1])), float(np.max(b[1])))
        if lit and number != ELSEWHERE:  # a corner may be all that is above the horizon
            _, _, corners = _free(one, number, np.array(CORNERS, LONG), side)
            unseen = max(unseen, float(np.max(corners)))
    return total, SIGMAS * np.sqrt(variance) + MISSED * unseen


def truth(s: Space, row: int, eps: float, apart: float) -> tuple[float, float]:
    """The same by as many rays as it takes to tell two numbers apart, if so many are not too many.

    Args:
        s: scenes.
        row: which of them.
        eps: of the precision by which surfaces in one place are told apart.
        apart: by how much they differ.
    """
    for rays in (1 << 12, 1 << 15, 1 << 18):
        E, bound = by_rays(s, row, eps, rays)
        if bound < 0.25 * apart:
            break
    return E, bound


def _strata(one: Space, number: int, cells, side: int, rng, eps: float) -> tuple[Any, Any]:
    """What points of a lamp in some strata give, and what they would if nothing were between.

    Or what directions in some strata give that end elsewhere.
    """
    places = (np.stack([cells // side, cells % side], -1) + rng.random((len(cells), 2))) / side
    if number == ELSEWHERE:
        return _elsewhere(one, places, side, eps)
    d, far, free = _free(one, number, 2.0 * places - 1.0, side)
    return np.where(_between(one, d, eps) < far * (1.0 - eps**0.75), 0.0, free), free


def _elsewhere(one: Space, places, side: int, eps: float) -> tuple[Any, Any]:
    """What directions in strata of equal cosine give that end on no lamp, and what they may."""
    up = one.normal / np.sqrt(np.sum(one.normal**2))
    across = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    across /= np.sqrt(np.sum(across**2))
    square, around = places[:, :1], 2.0 * np.pi * places[:, 1:]
    level = np.cos(around) * across + np.sin(around) * np.cross(up, across)
    d = np.sqrt(square) * level + np.sqrt(1.0 - square) * up
    things, share = _things(one, d), np.pi / side**2
    # The sky is seen where all are infinitely far, and a lamp before what is in its place.
    ways, shown = [np.full(len(d), np.inf)], [np.full(len(d), one.emission[SKY, 0])]
    for (normal, t), sides in zip(things, one.emission[LAMPS:SKY], strict=True):
        ways.append(t)
        front = np.full(len(d), True) if normal is None else d @ normal < 0.0
        shown.append(np.where(front, *sides))
    for middle, *edges in one.rectangles:
        t = _sheet(middle, edges, one.at, d, lambda x, y: np.maximum(np.abs(x), np.abs(y)) <= 1.0)
        ways.append(t * (1.0 - eps**0.75) - 8.0 * eps * np.max(np.abs(one.at)))
        shown.append(np.zeros(len(d)))
    first = np.argmin(np.stack(ways), 0)
    found = np.take_along_axis(np.stack(shown), first[None], 0)[0]
    return share * found, share * np.full(len(d), np.max(one.emission))


def _free(one: Space, number: int, places, side: int) -> tuple[Any, Any, Any]:
    """Directions and distances of places on a lamp, and what their strata give if they are seen."""
    middle, u, v = one.rectangles[number]
    way = middle + places[:, :1] * u + places[:, 1:] * v - one.at
    far = np.sqrt(np.sum(way**2, -1))
    d = way / far[:, None]
    area, up = 4.0 * np.cross(u, v), one.normal / np.sqrt(np.sum(one.normal**2))
    facing, height = -(d @ area), d @ up
    radiance = np.where(facing > 0.0, *one.emission[number])
    free = radiance * np.abs(facing) * np.where(height > 0.0, height, 0.0) / far**2 / side**2
    return d, far, free


def _between(one: Space, d: np.ndarray, eps: float) -> np.ndarray:
    """Distances along directions to the first thing that is no lamp."""
    hits = np.stack([t for _, t in _things(one, d)])
    return np.min(hits, 0) + 8.0 * eps * np.max(np.abs(one.at))


def _things(one: Space, d: np.ndarray) -> list[tuple[Any, np.ndarray]]:
    """Of all things but lamps, in the order of emission, normals and distances along directions.

    What is closed has no normal: it is seen from outside. On its own thing the receiver sees none.
    """
    at, (a, b, c) = one.at, one.triangle
    balls = [(BALL + k, None, _ball(ball, at, d)) for k, ball in enumerate(one.spheres)]
    found = [*balls, (BOX, None, _box(one.box, at, d))]
    t = _sheet(a, (b - a, c - a), at, d, lambda x, y: (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0))
    found.append((one.triangle_number, np.cross(b - a, c - a), t))
    for k, cylinder in enumerate(one.cylinders, BODIES):
        found.append((k, None, _cylinder(cylinder, at, d)))
    for k, (middle, *radii) in enumerate(one.discs, BODIES + len(one.cylinders)):
        t = _sheet(middle, radii, at, d, lambda x, y: x**2 + y**2 <= 1.0)
        found.append((k, np.cross(*radii), t))
    for k, (point, up) in enumerate(zip(one.planes, one.ups, strict=True), one.plane_number):
        height = d @ up
        t = ((point - at) @ up) / np.where(height == 0.0, 1.0, height)
        found.append((k, up, np.where((height != 0.0) & (t > 0.0), t, np.inf)))
    return [(n, np.where(one.on == k, np.inf, t)) for k, n, t in found]


def _ball(ball, origin, d) -> np.ndarray:
    """Distances to a sphere."""
    way = ball[:3] - origin
    middle = d @ way
    off = way - middle[:, None] * d
    inner = ball[3] ** 2 - np.sum(off**2, -1)
    root = np.sqrt(np.where(inner > 0.0, inner, 0.0))
    near, far = middle - root, middle + root
    t = np.where(near > 0.0, near, far)
    return np.where((inner > 0.0) & (t > 0.0), t, np.inf)


def _box(box, origin, d) -> np.ndarray:
    """Distances to a box, between pairs of planes."""
    w, v = _inner(box, origin, d)
    a, b = (-1.0 - w) / v, (1.0 - w) / v
    near, far = np.max(np.minimum(a, b), -1), np.min(np.maximum(a, b), -1)
    return _entered(near, far)


def _cylinder(cylinder, origin, d) -> np.ndarray:
    """Distances to a cylinder, between a pair of planes and within a round wall."""
    w, v = _inner(cylinder, origin, d)
    a, b = (-1.0 - w[2]) / v[:, 2], (1.0 - w[2]) / v[:, 2]
    square, side = v[:, 0] ** 2 + v[:, 1] ** 2, w[0] * v[:, 1] - w[1] * v[:, 0]
    inner, middle = square - side**2, -(w[0] * v[:, 0] + w[1] * v[:, 1])
    root = np.sqrt(np.where(inner > 0.0, inner, 0.0))
    near = np.maximum(np.minimum(a, b), (middle - root) / square)
    far = np.minimum(np.maximum(a, b), (middle + root) / square)
    return np.where(inner > 0.0, _entered(near, far), np.inf)


def _inner(solid, origin, d) -> tuple[np.ndarray, np.ndarray]:
    """A place and directions in coordinates along the half edges of a solid."""
    axes = solid[1:].T
    inverse = np.linalg.inv(axes.astype(float)).astype(LONG)
    inverse = inverse @ (2.0 * np.eye(3) - axes @ inverse)  # a step of Newton's: to LONG
    v = d @ inverse.T
    return inverse @ (origin - solid[0]), np.where(v == 0.0, LONG(1e-4000), v)


def _entered(near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Distances to where a ray comes in, or if it starts inside to where it leaves."""
    t = np.where(near > 0.0, near, far)
    return np.where((near <= far) & (t > 0.0), t, np.inf)


def _sheet(start, edges, origin, d, holds: Callable[..., np.ndarray]) -> np.ndarray:
    """Distances to what is flat, if the coordinates along two vectors belong to it."""
    u, v = edges
    n, way = np.cross(u, v), start - origin
    det = d @ n
    safe = np.where(det == 0.0, 1.0, det)
    t = (way @ n) / safe
    across = np.cross(d, -way[None])
    x, y = (across @ v) / safe, -(across @ u) / safe
    return np.where((det != 0.0) & (t > 0.0) & holds(x, y), t, np.inf)


# --- what the library says of itself that it cannot answer ---------------------------------------


def refused(s: Space, eps: float) -> np.ndarray:
    """Scenes that may be NaN: the receiver is in a body, or on one, on a plane or on the triangle
    and does not name it; or a lamp runs into one, so that the edges of light do not close.
    """
    slack = 16.0 * eps * s.size
    found = _in_the_triangle(s, eps) | _in_a_plane(s, eps)
    for k in range(2):
        far = np.linalg.norm(s.spheres[:, k, :3] - s.at, axis=-1)
        found |= (far <= s.spheres[:, k, 3] + slack) & (s.on != BALL + k)
    inverse = np.linalg.inv(np.swapaxes(s.box[:, 1:], 1, 2))
    w = np.einsum("bij,bj->bi", inverse, s.at - s.box[:, 0])
    thin = np.min(np.linalg.norm(s.box[:, 1:], axis=-1), -1)
    found |= (np.max(np.abs(w), -1) <= 1.0 + slack / thin) & (s.on != BOX)
    narrow = np.min(np.linalg.norm(s.cylinders[:, :, 1:], axis=-1), -1)
    near = 1.0 + slack[:, None] / narrow
    found |= np.any(_in_cylinders(s, s.at[:, None])[:, 0] <= near, -1)
    for points in _lit_points(s, 33):
        for k in range(2):
            far = _distances(points, s.spheres[:, k, :3])
            found |= np.any(far < s.spheres[:, k, None, 3], 1)
        w = (points - s.box[:, None, 0]) @ np.swapaxes(inverse, 1, 2)
        found |= np.any(np.all(np.abs(w) < 1.0, -1), 1)
        found |= np.any(_in_cylinders(s, points) < 1.0, (1, 2))
    return found


def _lit_points(s: Space, side: int) -> Iterator[np.ndarray]:
    """Of each rectangle a grid of points, those of dark ones far off: shape (b, side^2, 3)."""
    x, y = (a.reshape(-1, 1) for a in np.meshgrid(*[np.linspace(-1.0, 1.0, side)] * 2))
    for k in range(2):
        middle, u, v = np.moveaxis(s.rectangles[:, k, :, None], 1, 0)
        lit = np.any(s.emission[:, k] > 0.0, -1)[:, None, None]
        yield np.where(lit, middle + x * u + y * v, np.inf)


def unanswered(s: Space, eps: float) -> np.ndarray:
    """Scenes that may be wrong: a lamp runs into a ball or a box, found generously, or the receiver
    is on the triangle or on a plane, by rounding, and does not name it.

    `irradiance` says that shapes of different radiance must not run into each other, and a receiver
    on a shape says so by `Receiver.on`.
    """
    found = _in_the_triangle(s, eps) | _in_a_plane(s, eps)
    reach = 2.0 * np.linalg.norm(s.box[:, 1:].sum(1), axis=-1)
    balls = ((s.spheres[:, k, :3], s.spheres[:, k, 3]) for k in range(2))
    bodies = [(s.box[:, 0], reach), *balls]
    for points, edges in zip(
        _lit_points(s, 9), np.moveaxis(s.rectangles[:, :, 1:], 1, 0), strict=True
    ):
        step = 0.25 * np.linalg.norm(edges, axis=-1).sum(-1)
        for center, radius in bodies:
            found |= np.min(_distances(points, center), 1) <= radius + step
    return found


def _distances(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    """From the middle of each scene's shape to its points, shape (b, p)."""
    way = points - center[:, None]
    return np.sqrt(np.einsum("bpi,bpi->bp", way, way))


def _in_the_triangle(s: Space, eps: float) -> np.ndarray:
    """Receivers within rounding of the triangle, which do not name it."""
    a, b, c = np.moveaxis(s.triangle, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.maximum(np.sum(normal**2, -1), 1e-300)
    way = s.at - a
    height = np.sum(way * normal, -1) / np.sqrt(square)
    x = np.sum(np.cross(way, c - a) * normal, -1) / square
    y = np.sum(np.cross(b - a, way) * normal, -1) / square
    slack = 1e-6  # about its edges
    within = (x >= -slack) & (y >= -slack) & (x + y <= 1.0 + slack)
    return within & (np.abs(height) <= 16.0 * eps * s.size) & (s.on != s.triangle_number)


def _in_cylinders(s: Space, points: np.ndarray) -> np.ndarray:
    """How far points (b, p, 3) are in each cylinder, as a share of the way to its wall or end."""
    inverse = np.linalg.inv(np.swapaxes(s.cylinders[:, :, 1:], -2, -1))
    w = np.einsum("bcij,bpcj->bpci", inverse, points[:, :, None] - s.cylinders[:, None, :, 0])
    return np.maximum(np.hypot(w[..., 0], w[..., 1]), np.abs(w[..., 2]))


def _in_a_plane(s: Space, eps: float) -> np.ndarray:
    """Receivers within rounding of a plane, which do not name it."""
    ups = s.ups / np.linalg.norm(s.ups, axis=-1, keepdims=True)
    heights = np.abs(np.sum((s.at[:, None] - s.planes) * ups, -1))
    others = s.on[:, None] != s.plane_number + np.arange(s.planes.shape[1])
    return np.any((heights <= 16.0 * eps * s.size[:, None]) & others, -1)
