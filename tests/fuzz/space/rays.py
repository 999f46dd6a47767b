"""Irradiance in space by rays: NumPy in its longest precision, nothing of the library's code."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.fuzz.space.layout import BALL, BOX, TRIANGLE, Space

LONG = np.longdouble
BLOCK = 1 << 16  # strata at once
SIGMAS = 6.0  # of 10^5 scenes hardly one is off by more
MISSED = 8.0  # strata
CORNERS = (-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)


def by_rays(s: Space, row: int, eps: float, rays: int) -> tuple[float, float]:
    """Irradiance of one scene by rays to pairs of points in equal strata of each lamp.

        E = integral over the lamp of L V cos(theta) cos(theta') / d^2 dA

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
    for number in range(2):
        lit = np.any(one.emission[number])
        for first in range(0, side * side if lit else 0, BLOCK):
            cells = np.arange(first, min(first + BLOCK, side * side))
            a, b = (_strata(one, number, cells, side, rng, eps) for _ in range(2))
            total += float(np.sum(a[0] + b[0])) / 2.0
            variance += float(np.sum((a[0] - b[0]) ** 2)) / 4.0
            unseen = max(unseen, float(np.max(a[1])), float(np.max(b[1])))
        if lit:  # a corner may be all that is above the horizon
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
    """What points of a lamp in some strata give, and what they would if nothing were between."""
    places = (np.stack([cells // side, cells % side], -1) + rng.random((len(cells), 2))) / side
    d, far, free = _free(one, number, 2.0 * places - 1.0, side)
    return np.where(_between(one, d, eps) < far * (1.0 - eps**0.75), 0.0, free), free


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
    """Distances along directions to the first thing that does not shine."""
    origin, on = one.at, int(one.on)
    a, b, c = one.triangle
    hits = [_ball(ball, origin, d, k == on) for k, ball in enumerate(one.spheres, BALL)]
    hits.append(_box(one.box, origin, d, on == BOX))
    hits.append(_triangle(a, b - a, c - a, origin, d, on == TRIANGLE))
    return np.min(np.stack(hits), 0) + 8.0 * eps * np.max(np.abs(origin))


def _ball(ball, origin, d, own: bool) -> np.ndarray:
    """Distances to a sphere; the inside of its own it does not see."""
    way = ball[:3] - origin
    middle = d @ way
    off = way - middle[:, None] * d
    inner = ball[3] ** 2 - np.sum(off**2, -1)
    root = np.sqrt(np.where(inner > 0.0, inner, 0.0))
    near, far = middle - root, middle + root
    t = np.where(near > 0.0, near, far)
    return np.where((inner > 0.0) & (t > 0.0) & (not own), t, np.inf)


def _box(box, origin, d, own: bool) -> np.ndarray:
    """Distances to a box, between pairs of planes."""
    inverse = np.linalg.inv(box[1:].T.astype(float)).astype(LONG)
    inverse = inverse @ (2.0 * np.eye(3) - box[1:].T @ inverse)  # a step of Newton's: to LONG
    w, v = inverse @ (origin - box[0]), d @ inverse.T
    safe = np.where(v == 0.0, LONG(1e-4000), v)
    a, b = (-1.0 - w) / safe, (1.0 - w) / safe
    near, far = np.max(np.minimum(a, b), -1), np.min(np.maximum(a, b), -1)
    t = np.where(near > 0.0, near, far)
    return np.where((near <= far) & (t > 0.0) & (not own), t, np.inf)


def _triangle(start, u, v, origin, d, own: bool) -> np.ndarray:
    """Distances to a triangle from its corner along its edges."""
    n, way = np.cross(u, v), start - origin
    det = d @ n
    safe = np.where(det == 0.0, 1.0, det)
    t = (way @ n) / safe
    across = np.cross(d, -way[None])
    x, y = (across @ v) / safe, -(across @ u) / safe
    hit = (det != 0.0) & (t > 0.0) & (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0) & (not own)
    return np.where(hit, t, np.inf)


# --- what the library says of itself that it cannot answer ---------------------------------------


def refused(s: Space, eps: float) -> np.ndarray:
    """Scenes that may be NaN: the receiver is in a ball or a box, or on one or on the triangle and
    does not name it; or a lamp runs into one, where light is NaN in place of less than none.
    """
    slack = 16.0 * eps * s.size
    found = _in_the_triangle(s, eps)
    for k in range(2):
        far = np.linalg.norm(s.spheres[:, k, :3] - s.at, axis=-1)
        found |= (far <= s.spheres[:, k, 3] + slack) & (s.on != BALL + k)
    inverse = np.linalg.inv(np.swapaxes(s.box[:, 1:], 1, 2))
    w = np.einsum("bij,bj->bi", inverse, s.at - s.box[:, 0])
    thin = np.min(np.linalg.norm(s.box[:, 1:], axis=-1), -1)
    found |= (np.max(np.abs(w), -1) <= 1.0 + slack / thin) & (s.on != BOX)
    for points in _lit_points(s, 33):
        for k in range(2):
            far = _distances(points, s.spheres[:, k, :3])
            found |= np.any(far < s.spheres[:, k, None, 3], 1)
        w = (points - s.box[:, None, 0]) @ np.swapaxes(inverse, 1, 2)
        found |= np.any(np.all(np.abs(w) < 1.0, -1), 1)
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
    is in the plane of the triangle, by rounding, and does not name it.

    `irradiance` says that shapes of different radiance must not run into each other, and a receiver
    on a shape says so by `Receiver.on`.
    """
    found = _in_the_triangle(s, eps)
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
    return within & (np.abs(height) <= 16.0 * eps * s.size) & (s.on != TRIANGLE)
