"""Everything that a cache record on a flat floor could hold, at many places, computed once.

Filling a cache, bisecting its threshold and comparing metrics are then choices among rows of a
table; no ray is cast again. The sums are those of `space.gathering`, for a receiver in a plane and
steps in that plane, several at once and in blocks that stay in the cache.
"""

from __future__ import annotations

import concurrent.futures
import math
import os

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder.errors import check_positive
from firstorder.space.gathering import Samples, stratified
from firstorder.space.maps import Maps, cast
from firstorder.space.strata import Strata, strata
from firstorder.typing import as_float

BLOCK = 2048  # rays whose state stays in the cache


class Table(eqx.Module):
    """Irradiance at places of a plane with its derivatives by steps in the plane.

    Attributes:
        position: [m].
        E: irradiance [W/m^2].
        gradient: stratified, shadow edges included [W/m^3].
        area_gradient: by surface area, shadow edges left out [W/m^3].
        hessian: by surface area [W/m^4].
        geometric: the same with radiance 1 on all surfaces [1/m^2].
        minimum: shortest ray; infinite if none meets anything [m].
        harmonic: harmonic mean of the rays' lengths [m].
        brightest: largest radiance that a ray met [W/(m^2 sr)].
    """

    position: Float[Array, "m 3"]
    E: Float[Array, " m"]
    gradient: Float[Array, "m 2"]
    area_gradient: Float[Array, "m 2"]
    hessian: Float[Array, "m 2 2"]
    geometric: Float[Array, "m 2 2"]
    minimum: Float[Array, " m"]
    harmonic: Float[Array, " m"]
    brightest: Float[Array, " m"]


class Looks(eqx.Module):
    """Sets of directions that places share, in the receivers' frame.

    Attributes:
        directions: k sets of m x n, coordinates apart.
        theta, phi: borders of their cells.
        noise: what each ray's radiance is multiplied by; None for nothing.
    """

    directions: Float[Array, "k 3 m n"]
    theta: Float[Array, " m_1"]
    phi: Float[Array, " n_1"]
    noise: Float[Array, "k m n"] | None = None


def looks(rows: int, columns: int, sets: int = 16, seed: int = 0, noise: bool = False) -> Looks:
    """Jittered directions in `rows * columns` cells of equal projected solid angle.

    Args:
        rows: of theta.
        columns: of phi.
        sets: how many; places take one after the other in random order.
        seed: of the random numbers.
        noise: whether each ray's radiance gets a factor, uniform in [0, 2], as in J12 Fig. 21.
    """
    for name, number in (("rows", rows), ("columns", columns), ("sets", sets)):
        check_positive(name, number)
    one, other = jax.random.split(jax.random.key(seed))
    cells = strata(rows, columns, one, shape=(sets,))
    factor = 2.0 * jax.random.uniform(other, cells.weights.shape) if noise else None
    return Looks(jnp.moveaxis(cells.directions, -1, 1), cells.theta, cells.phi, factor)


def tabulate(
    maps: Maps, position: ArrayLike, given: Looks, on: int, axes: ArrayLike | None = None
) -> Table:
    """Casts the same number of rays from every place, and keeps what a record would hold.

    Args:
        maps: the light.
        position: places on one flat shape, (m, 3) [m].
        given: directions.
        on: number of the shape they lie on.
        axes: its frame, tangents and normal as columns; the world's if left out.

    Reference: J12 §7-8: eqs. 58, 61, 64, 66 and 71.
    """
    x = as_float(position)
    axes = jnp.eye(3, dtype=x.dtype) if axes is None else as_float(axes)
    pick = np.random.default_rng(0).permutation(x.shape[0]) % given.directions.shape[0]
    # Loops run on one core; places are shared out among all.
    cores = min(os.cpu_count() or 1, x.shape[0])
    size = -(-x.shape[0] // cores)
    index = np.minimum(np.arange(cores * size), x.shape[0] - 1).reshape(cores, size)

    def part(rows):
        return jax.block_until_ready(_rows(maps, x[rows], pick[rows], given, axes, on))

    with concurrent.futures.ThreadPoolExecutor(cores) as pool:
        parts = list(pool.map(part, index))
    return jax.tree.map(lambda *a: jnp.concatenate(a)[: x.shape[0]], *parts)


@eqx.filter_jit
def _rows(maps: Maps, x: Array, pick: Array, given: Looks, axes: Array, on: int) -> Table:
    count = given.directions.shape[2] * given.directions.shape[3]
    size = min(BLOCK, count)
    blocks = -(-count // size)
    # The last block is filled up with rays that count for nothing.
    pad = blocks * size - count

    def blocked(a):
        flat = a.reshape(*a.shape[:-2], count)
        flat = jnp.pad(flat, [(0, 0)] * (flat.ndim - 1) + [(0, pad)], mode="edge")
        return flat.reshape(*a.shape[:-2], blocks, size)

    directions = jnp.moveaxis(blocked(given.directions), 2, 1)
    factor = None if given.noise is None else blocked(given.noise)
    counts = (jnp.arange(blocks * size) < count).reshape(blocks, size)

    def one(place):
        x, k = place
        noise = jnp.ones((blocks, size), x.dtype) if factor is None else factor[k]
        sums, L, r = jax.lax.map(
            lambda block: _block(maps, x, axes, on, *block), (directions[k], noise, counts)
        )
        shape = given.directions.shape[2:]
        grid = [a.reshape(-1)[:count].reshape(shape) for a in (L, r)]
        return _row(x, sums, *grid, given, count)

    return jax.lax.map(one, (x, pick))


def _block(maps: Maps, x, axes, on: int, local, noise, counts):
    """Sums over a block of rays: (kernels, light and surface), and what each ray sees."""
    along = [
        axes[i, 0] * local[0] + axes[i, 1] * local[1] + axes[i, 2] * local[2] for i in range(3)
    ]
    start = [jnp.broadcast_to(x[i], local[0].shape) for i in range(3)]
    seen = cast(maps, (start[0], start[1], start[2]), (along[0], along[1], along[2]), on)
    met = seen.index >= 0
    L = seen.radiance * noise
    n = seen.normal
    b = -(n[0] * along[0] + n[1] * along[1] + n[2] * along[2])
    p, q = (axes[0, j] * n[0] + axes[1, j] * n[1] + axes[2, j] * n[2] for j in (0, 1))
    over = 1.0 / jnp.where(b > 0.0, b, 1.0)
    p, q, u, v = p * over, q * over, local[0], local[1]
    inverse = jnp.where(met, 1.0 / jnp.where(met, seen.distance, 1.0), 0.0)
    square = inverse * inverse
    # Kernels per projected solid angle: coupling's gradient and Hessian over the coupling.
    kernels = [
        inverse * (4.0 * u + p),
        inverse * (4.0 * v + q),
        square * (24.0 * u * u - 4.0 + 8.0 * p * u),
        square * (24.0 * u * v + 4.0 * (p * v + q * u)),
        square * (24.0 * v * v - 4.0 + 8.0 * q * v),
        inverse,
    ]
    weights = [jnp.where(counts, L, 0.0), jnp.where(counts & met, 1.0, 0.0)]
    return jnp.stack(kernels) @ jnp.stack(weights, -1), L, seen.distance


def _row(x, sums, L, r, given: Looks, count: int) -> Table:
    """One place's row, from the sums of its blocks."""
    total = jnp.sum(sums, axis=0) * (math.pi / count)
    area, light = total[:, 0], total[:, 1]
    nowhere = jnp.zeros((*L.shape, 3), L.dtype)
    cells = Strata(given.theta, given.phi, nowhere, jnp.zeros_like(L))
    samples = Samples(cells, L, r, nowhere, jnp.ones_like(L), jnp.zeros(L.shape, int))
    moved = stratified(samples).translation()
    inverse = light[5] / math.pi
    return Table(
        x,
        moved.value,
        moved.gradient,
        area[:2],
        jnp.array([[area[2], area[3]], [area[3], area[4]]]),
        jnp.array([[light[2], light[3]], [light[3], light[4]]]),
        jnp.min(r),
        jnp.where(inverse > 0.0, 1.0 / jnp.where(inverse > 0.0, inverse, 1.0), jnp.inf),
        jnp.max(L),
    )
