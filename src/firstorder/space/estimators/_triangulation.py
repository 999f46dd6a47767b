"""Directions of gather rays over the hemisphere, and their triangulation."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_count, check_key
from firstorder._display import in_print
from firstorder.conventions import cylindrical


class HemisphereTriangulation(NamedTuple):
    """Directions of gather rays, and their triangulation.

    Attributes:
        directions: unit vectors about +z, density proportional to the cosine.
        triangles: counter-clockwise as x turns to y; index i + m is the foot of ray i on the
            horizon. Together they cover the hemisphere once.
        neighbours: the rays within a window around each; a ray itself stands for none.
    """

    directions: Float[Array, "m 3"]
    triangles: Int[np.ndarray, "k 3"]
    neighbours: Int[np.ndarray, "m q"]

    __repr__ = in_print


def hemisphere_triangulation(rays: int, key: PRNGKeyArray | None = None) -> HemisphereTriangulation:
    """A square grid of at most `rays` rays, with the cosine as density, and its triangles.

    Equal areas of the square become equal areas of the disc (Shirley's concentric map), and so
    equal parts of irradiance: `E = pi mean(radiance)`.

    Args:
        rays: budget; the largest square number within it is used.
        key: for a ray anywhere in its cell; None takes the middle.

    Raises:
        ValueError: if there are fewer than 4 rays, or their number is no integer.
        TypeError: if `key` is no key.

    Example:
        >>> from firstorder.space.estimators import hemisphere_triangulation
        >>> hemisphere_triangulation(30).directions.shape
        (25, 3)
    """
    check_count("rays", rays)
    if key is not None:
        check_key("key", key)
    side = math.isqrt(rays)
    if side < 2:
        raise ValueError(f"Argument `rays` must be at least 4, but is {rays}.")
    grid = np.arange(side**2).reshape(side, side)
    edge = np.concatenate([grid[:-1, 0], grid[-1, :-1], grid[:0:-1, -1], grid[0, :0:-1]])
    triangles = np.concatenate([_quads(grid), _hem(edge, side**2)])
    reach = max(1, round(0.35 * np.sqrt(side)))
    return HemisphereTriangulation(
        _directions(side, key), triangles, _window(grid, reach, reach, wrap=False)
    )


def strata_triangulation(
    rows: int, columns: int
) -> tuple[Int[np.ndarray, "k 3"], Int[np.ndarray, "m q"]]:
    """Triangles and neighbours of rays in cells of latitude and longitude (`hemisphere_strata`).

    Rays are counted row by row, from the pole to the horizon.

    Args:
        rows: how many cells from the pole to the horizon.
        columns: how many around, at least 3.

    Returns:
        `triangles` and `neighbours`, as `HemisphereTriangulation` has them.

    Raises:
        ValueError: if there is no row, or there are fewer than 3 columns.

    Example:
        >>> from firstorder.space.estimators._triangulation import strata_triangulation
        >>> triangles, neighbours = strata_triangulation(4, 12)
        >>> triangles.shape
        (106, 3)
    """
    if rows < 1 or columns < 3:
        raise ValueError(
            f"Arguments `rows` and `columns` must be at least 1 and 3, but are {rows}, {columns}."
        )
    grid = np.arange(rows * columns).reshape(rows, columns)
    closed = np.concatenate([grid, grid[:, :1]], 1)
    pole = [(0, i, i + 1) for i in range(1, columns - 1)]
    parts = [np.array(pole), _quads(closed), _hem(grid[-1], grid.size)]
    reach = max(1, round(0.35 * np.sqrt(rows))), max(1, round(0.35 * np.sqrt(columns)))
    return np.concatenate(parts), _window(grid, *reach, wrap=True)


@functools.partial(jax.jit, static_argnums=0)
def _directions(side: int, key) -> Float[Array, "m 3"]:
    """Directions whose projections are the concentric image of cells of [-1, 1]^2."""
    shift = 0.5 if key is None else jax.random.uniform(key, (2, side, side))
    cell = jnp.stack(jnp.meshgrid(jnp.arange(side), jnp.arange(side), indexing="ij"))
    a, b = 2.0 * (cell + shift) / side - 1.0
    wide = jnp.abs(a) > jnp.abs(b)
    rho = jnp.where(wide, a, b)
    safe = jnp.where(rho == 0.0, 1.0, rho)
    turn = 0.25 * jnp.pi * jnp.where(wide, b, a) / safe
    phi = jnp.where(wide, turn, 0.5 * jnp.pi - turn)
    up = jnp.sqrt(jnp.maximum((1.0 - rho) * (1.0 + rho), 0.0))
    return cylindrical(rho, phi, up).reshape(-1, 3)


def _quads(grid) -> np.ndarray:
    """Two triangles for every four neighbours, their common side along alternate diagonals."""
    i, j = np.indices((grid.shape[0] - 1, grid.shape[1] - 1))
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    odd = ((i + j) % 2 == 1)[..., None]
    first = np.where(odd, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(odd, np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def _hem(edge, count) -> np.ndarray:
    """Triangles from the outermost rays down to the horizon."""
    i, j = edge, np.roll(edge, -1)
    lower = np.stack([i, i + count, j + count], -1)
    return np.concatenate([lower, np.stack([i, j + count, j], -1)])


def _window(grid, down, across, wrap) -> np.ndarray:
    """The rays within so many rows and columns of each; past the border, itself."""
    rows, columns = grid.shape
    own = np.arange(grid.size)
    i, j = own // columns, own % columns
    found = []
    for a in range(-down, down + 1):
        for b in range(-across, across + 1):
            y, x = i + a, j + b
            if wrap:
                x = x % columns
            inside = (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
            found.append(np.where(inside, columns * y + x, own))
    return np.stack(found, -1)
