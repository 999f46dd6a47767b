"""Isosurfaces of functions in space by tetrahedra, and metaballs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_count, check_finite, check_positive
from firstorder.space.meshes.triangle_mesh import Mesh, mesh


def metaballs(centers: Any, radii: Any, cells: int = 48) -> Mesh:
    """Metaballs: the surface where `sum exp(1 - |x - c|^2 / r^2)` is 1; one ball alone is a sphere.

    Found on a lattice whose cubes are cut into six tetrahedra each, so that the surface is closed
    whatever it does.

    Args:
        centers: of the balls, shape (n, 3) [m].
        radii: of each if it were alone, shape (n,) [m].
        cells: along the longest side.

    Raises:
        ValueError: if centers and radii do not match, or cells are so few that all balls fall
            between their corners.

    Reference: A. Gueziec, R. Hummel, "Exploiting triangulated surface extraction using tetrahedral
    decomposition", TVCG 1(4), 1995.

    Example:
        >>> from firstorder.models import metaballs
        >>> one = metaballs([[0, 0, 0], [1.2, 0, 0]], [0.7, 0.7], 24)
        >>> one.closed, len(one.vertices) - len(one.edges) + one.count  # in one piece
        (True, 2)
    """
    c, r = np.asarray(centers, float), np.asarray(radii, float)
    if c.ndim != 2 or c.shape[1] != 3 or not len(c) or r.shape != (len(c),):
        raise ValueError(
            "Arguments `centers` and `radii` must have shapes (n, 3) and (n,), "
            f"but have {c.shape} and {r.shape}."
        )
    check_finite("centers", c)
    check_positive("radii", r)
    check_count("cells", cells)
    # Farther than this from all centres the sum is below 1.
    reach = (r * math.sqrt(1.0 + math.log(len(r))))[:, None]
    low, high = (c - reach).min(0), (c + reach).max(0)
    step = float(np.max(high - low)) / cells
    axes = [np.arange(a - step, b + 2.0 * step, step) for a, b in zip(low, high, strict=True)]
    total = np.zeros([len(a) for a in axes])
    for one, radius in zip(c, r, strict=True):  # a product of three: exponentials of lines alone
        x, y, z = (np.exp(-(((a - m) / radius) ** 2)) for a, m in zip(axes, one, strict=True))
        total += math.e * x[:, None, None] * y[:, None] * z
    if not np.any(total > 1.0):
        raise ValueError(
            f"Argument `cells` must be more, but is {cells}: none of their corners lies in a ball."
        )
    return isosurface(total - 1.0, np.array([a[0] for a in axes]), step)


def isosurface(values: Float[np.ndarray, "a b c"], corner: Any, step: float) -> Mesh:
    """The surface between positive and other numbers on a lattice; positive ones are inside.

    Args:
        values: on the lattice; not positive on its border.
        corner: where the first one is [m], shape (3,).
        step: between neighbours [m].

    Raises:
        ValueError: if a value on the border is positive, or none is, one is not a number or
            endless, or the step is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.models import isosurface
        >>> x = np.linspace(-1, 1, 21)
        >>> far = x[:, None, None] ** 2 + x[:, None] ** 2 + x**2
        >>> ball = isosurface(0.5 - far, [-1, -1, -1], 0.1)
        >>> ball.closed, round(ball.area.item() / (2 * np.pi), 2)
        (True, 0.99)
    """
    check_positive("step", step)
    values = np.asarray(values, float)  # differences of half precision overflow
    check_finite("values", values)
    inside = values > 0.0
    within = np.zeros_like(inside)
    within[1:-1, 1:-1, 1:-1] = True
    if np.any(inside & ~within) or not np.any(inside):
        raise ValueError(
            "Argument `values` must be positive somewhere but not on the border, but is not so."
        )
    number = np.arange(values.size).reshape(values.shape)
    mixed = np.zeros(tuple(n - 1 for n in values.shape), int)
    for i, j, k in np.ndindex(2, 2, 2):
        mixed += inside[i:, j:, k:][tuple(slice(n) for n in mixed.shape)]
    cube = number[:-1, :-1, :-1][(mixed > 0) & (mixed < 8)]
    strides = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    ends = np.concatenate([_crossed(cube, order, strides, inside.ravel()) for order in _ORDERS])
    # A vertex for each pair of lattice points that a triangle's corner lies between.
    names, faces = np.unique(ends.reshape(-1, 2) @ [values.size, 1], return_inverse=True)
    a, b = names // values.size, names % values.size
    f, g = values.ravel()[a], values.ravel()[b]
    share = np.clip(f / (f - g), 1e-3, 1.0 - 1e-3)[:, None]
    at = [np.stack(np.unravel_index(n, values.shape), -1) for n in (a, b)]
    v = np.asarray(corner, float) + step * ((1.0 - share) * at[0] + share * at[1])
    return mesh(v, faces.reshape(-1, 3))


# The ways from a cube's first corner to its last along its edges: six tetrahedra that fill it, and
# that meet those of the neighbours; even orders of the axes are right-handed.
_ORDERS = ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2))
_EVEN = _ORDERS[:3]
# By which corners of a right-handed tetrahedron are inside: triangles, each corner of which lies
# between one inside and one outside, counter-clockwise as seen from outside.
_TRIANGLES: dict[tuple[int, ...], list[tuple[tuple[int, int], ...]]] = {}
for _i, _j, _k, _m in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 0, 1, 3), (3, 0, 2, 1)):
    _TRIANGLES[(_i,)] = [((_i, _j), (_i, _k), (_i, _m))]
    _TRIANGLES[tuple(sorted((_j, _k, _m)))] = [((_i, _j), (_i, _m), (_i, _k))]
for _i, _j, _k, _m in (
    (0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (2, 3, 0, 1), (3, 1, 0, 2), (1, 2, 0, 3)
):  # fmt: skip
    _TRIANGLES[tuple(sorted((_i, _j)))] = [
        ((_i, _k), (_j, _m), (_j, _k)),
        ((_i, _k), (_i, _m), (_j, _m)),
    ]


def _crossed(cube: np.ndarray, order, strides: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Triangles in one tetrahedron of each cube: pairs of lattice points, shape (f, 3, 2)."""
    corner = cube[:, None] + np.r_[0, np.cumsum(strides[list(order)])]
    case = inside[corner] @ [1, 2, 4, 8]
    found = []
    for which, triangles in _TRIANGLES.items():
        here = corner[case == sum(1 << k for k in which)]
        for triangle in triangles:
            pairs = np.sort(here[:, np.array(triangle)], -1)  # the same pair from either side
            found.append(pairs if order in _EVEN else pairs[:, ::-1])
    return np.concatenate(found)
