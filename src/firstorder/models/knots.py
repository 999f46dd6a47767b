"""Tubes along torus knots: closed meshes that wind through themselves."""

from __future__ import annotations

import math

import numpy as np

from firstorder._argument_checks import check_integer, check_positive
from firstorder.models.primitives import quad_triangles
from firstorder.space.meshes.triangle_mesh import Mesh, mesh


def torus_knot(
    p: int = 2,
    q: int = 3,
    radius: float | int = 0.2,
    rings: int = 400,
    sides: int = 16,
    size: float | int = 1.0,
) -> Mesh:
    """A tube along a torus knot: `p` times around the axis z while it winds `q` times.

    The line is at `(2 + cos q t) (cos p t, sin p t), sin q t`, times size / 3. Rings are carried
    along without twist; what is left when they come round is spread over all of them.

    Args:
        p: times around the axis.
        q: times around the torus.
        radius: of the tube [m].
        rings: along the line.
        sides: of a ring.
        size: of the farthest point of the line from the axis [m].

    Raises:
        ValueError: if p and q have a divisor in common, or the tube would meet itself.

    Reference: W. Wang et al., "Computation of rotation minimizing frames", TOG 27(1), 2008.

    Example:
        >>> from firstorder.models import torus_knot
        >>> tube = torus_knot(2, 3)
        >>> tube.closed, len(tube.vertices) - len(tube.edges) + tube.count  # a torus
        (True, 0)
    """
    for name, count in (("p", p), ("q", q), ("rings", rings), ("sides", sides)):
        check_integer(name, count)
    for name, number in (("p", p), ("q", q), ("radius", radius), ("size", size)):
        check_positive(name, number)
    if math.gcd(p, q) != 1:
        raise ValueError(
            f"Arguments `p` and `q` must have no divisor in common, but are {p} and {q}."
        )
    if rings < 8 or sides < 3:
        raise ValueError(
            f"Arguments `rings` and `sides` must be at least 8 and 3, but are {rings} and {sides}."
        )
    t = 2.0 * math.pi * np.arange(rings) / rings
    far = 2.0 + np.cos(q * t)
    line = np.stack([far * np.cos(p * t), far * np.sin(p * t), np.sin(q * t)], -1) * size / 3.0
    _check_room(line, radius)
    u, w = _untwisted(line)
    angle = 2.0 * math.pi * np.arange(sides) / sides
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    v = line[:, None] + radius * (u[:, None] * c + w[:, None] * s)
    n = np.arange(rings * sides).reshape(rings, sides)
    on, beside = np.roll(n, -1, 0), np.roll(n, -1, 1)
    return mesh(v.reshape(-1, 3), quad_triangles(n, beside, np.roll(on, -1, 1), on))


def _check_room(line: np.ndarray, radius: float) -> None:
    """Refuses a tube that is thicker than its bends, or than half of what is between its runs."""
    d1 = 0.5 * (np.roll(line, -1, 0) - np.roll(line, 1, 0))
    d2 = np.roll(line, -1, 0) - 2.0 * line + np.roll(line, 1, 0)
    speed = np.linalg.norm(d1, axis=1)
    bend = np.min(speed**3 / np.maximum(np.linalg.norm(np.cross(d1, d2), axis=1), 1e-300))
    most = min(bend, 0.5 * _least_gap(line, math.pi * radius))
    if radius >= most:
        raise ValueError(
            f"Argument `radius` must be below {most:.3g} for a tube that does not meet itself, "
            f"but is {radius}."
        )


def _least_gap(line: np.ndarray, apart: float) -> float:
    """Least distance between pieces of a closed polygon that lie farther apart than that along it.

    Between pieces, not between corners: where these are far apart, two runs may cross between them.
    """
    way = np.roll(line, -1, 0) - line
    square = np.sum(way**2, 1)
    length = np.sqrt(square)
    middle, total = np.cumsum(length) - 0.5 * length, np.sum(length)
    least = np.inf
    for k in range(len(line)):
        along = abs(middle - middle[k])
        along = np.minimum(along, total - along) - 0.5 * (length + length[k])
        others = np.flatnonzero(along > apart)
        if len(others):
            near = _gaps(line[k], way[k], line[others], way[others])
            least = min(least, float(np.min(near)))
    return least


def _gaps(p: np.ndarray, u: np.ndarray, q: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Distances from the piece between p and p + u to those between q and q + w."""
    from_ = p - q
    a, b, e = u @ u, w @ u, np.sum(w * w, 1)
    c, f = from_ @ u, np.sum(w * from_, 1)
    bent = a * e - b * b
    some = bent > 1e-12 * a * e  # parallel ones are nearest at an end of one of them
    s = np.where(some, np.clip((b * f - c * e) / np.where(some, bent, 1.0), 0.0, 1.0), 0.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    return np.linalg.norm(from_ + s[:, None] * u - t[:, None] * w, axis=1)


def _untwisted(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across a closed line at each of its points, by double reflection."""
    along = np.roll(line, -1, 0) - np.roll(line, 1, 0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    u = np.empty((len(line) + 1, 3))
    u[0] = np.cross(along[0], np.eye(3)[np.argmin(abs(along[0]))])
    u[0] /= np.linalg.norm(u[0])
    for k in range(len(line)):
        on = (k + 1) % len(line)
        a = line[on] - line[k]
        mirrored = u[k] - 2.0 * a * (a @ u[k]) / (a @ a)
        seen = along[k] - 2.0 * a * (a @ along[k]) / (a @ a)
        b = along[on] - seen
        u[k + 1] = mirrored - 2.0 * b * (b @ mirrored) / max(b @ b, 1e-300)
    u -= np.sum(u * along[np.r_[: len(line), 0]], 1)[:, None] * along[np.r_[: len(line), 0]]
    u /= np.linalg.norm(u, axis=1)[:, None]
    w = np.cross(along, u[:-1])
    left = math.atan2(u[-1] @ w[0], u[-1] @ u[0])  # how far the last is turned past the first
    turn = -left * np.arange(len(line)) / len(line)
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    return c * u[:-1] + s * w, c * w - s * u[:-1]
