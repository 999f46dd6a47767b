"""A lamp above a floor, a closed room: irradiance in closed form and by sums, not the library's.

The closed form is that of Lambert: half the sum over edges of the angle that each subtends, times
the cosine between the floor's normal and that of the edge's plane.
"""

from __future__ import annotations

import functools

import numpy as np


def polygon_irradiance(vertices, x, numpy=np):
    """E on the floor z = 0, normal +z, from a polygon of radiance 1 above the floor.

    Counter-clockwise as seen from the floor below it.

    Args:
        vertices: corners, in order, all with z > 0.
        x: places on the floor (..., 2).
        numpy: the module to compute with.
    """
    corners = [(cx - x[..., 0], cy - x[..., 1], cz) for cx, cy, cz in vertices]
    total = 0.0
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        # The edge's plane has the normal a x b; components, so that places may be many.
        nx, ny = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
        nz = a[0] * b[1] - a[1] * b[0]
        size = numpy.sqrt(nx * nx + ny * ny + nz * nz)
        along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        total = total + 0.5 * numpy.arctan2(size, along) * nz / size
    return total


def lamp(x, numpy=np):
    """E of a lamp one metre up, off-centre and not square; its corners as seen from below."""
    corners = ((-0.5, -0.2, 1.0), (0.4, -0.2, 1.0), (0.4, 0.5, 1.0), (-0.5, 0.5, 1.0))
    return polygon_irradiance(corners, x, numpy)


def summed(place, corner, u, v, radiance=1.0, nodes=40):
    """E at a place of the floor from a rectangle, by Gauss-Legendre sums of the definition.

    Args:
        place: (..., 2) on the floor z = 0.
        corner: of the rectangle.
        u: one of its edges; the cosine there is taken by its modulus.
        v: the other.
        radiance: a number, or a function of two numbers in [0, 1].
        nodes: along each edge.
    """
    t, w = np.polynomial.legendre.leggauss(nodes)
    t, w = 0.5 * (1.0 + t), 0.5 * w
    s, t = np.meshgrid(t, t, indexing="ij")
    y = np.asarray(corner, float) + s[..., None] * np.asarray(u) + t[..., None] * np.asarray(v)
    place = np.asarray(place, float)
    d = y - np.concatenate([place, np.zeros((*place.shape[:-1], 1))], -1)[..., None, None, :]
    normal = np.cross(u, v)
    square = np.sum(d * d, axis=-1)
    G = np.abs(d @ normal) * np.maximum(d[..., 2], 0.0) / square**2
    L = radiance(s, t) if callable(radiance) else radiance
    return np.sum(w[:, None] * w * L * G, axis=(-1, -2))


def hessian_of(E, place, h=2e-3):
    """Second differences of the fourth order of a function of places (..., 2)."""
    a = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12.0
    first = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
    i = h * np.arange(-2.0, 3.0)
    grid = np.stack(np.meshgrid(i, i, indexing="ij"), -1) + np.asarray(place, float)
    values = E(grid)
    xx, yy = a @ values[:, 2], values[2] @ a
    xy = first @ values @ first
    return np.array([[xx, xy], [xy, yy]]) / h**2


# Left, right, front, back and ceiling of the unit cube, as corner and edges.
WALLS = (
    ((0, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
)


@functools.cache
def room(place, pieces=1) -> np.ndarray:
    """Hessians of the geometry terms of a room's walls, each cut in pieces x pieces parts."""
    found = []
    for corner, u, v in WALLS:
        u, v = np.array(u) / pieces, np.array(v) / pieces
        for i in range(pieces):
            for j in range(pieces):
                part = np.array(corner) + i * u + j * v

                def E(at, part=part, u=u, v=v):
                    return summed(at, part, u, v, nodes=24)

                found.append(hessian_of(E, place))
    return np.array(found)
