"""E11's wedge: the share of a shadow's spectral energy between the depths of its blockers.

The visibility V(x, v) of rays past all blockers is traced on a grid over the receiver's line and
over slopes, and so is each blocker's own shadow. Of a sum of shadows the energy lies in the wedge
(planar layers: on lines); a product of them puts energy anywhere. So with `V = 1 - sum b_i + R`

    sqrt(energy outside) <= sqrt(outside of the sum) + sqrt(energy of R)

The first is what the grid itself leaks of straight edges, whose line is known: a shadow has two,
and edges at different places add incoherently, to within a factor of two.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements._record import Found, Row, attempted
from firstorder.checks.agreements._spectra import window_of
from firstorder.checks.agreements.sizes import Sizes
from firstorder.conventions import direction
from firstorder.errors import Refused
from firstorder.fields import Grid
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.shadowfield import Wedge, energy_outside, power_spectrum

QUANTITY = "energy outside"
BINS = 2.0  # what the Hann window smears to each side
TOUCHING = 0.02  # nearest over farthest blocker, below which the wedge is everything
STEEP = 1.0  # largest slope of the grid
FINER = 3  # rays along each side of a sample


def wedge_rows(scene: Scene, at: Receiver, sizes: Sizes) -> tuple[Row, ...]:
    """One row: the share outside the wedge of the blockers' depths, and the bound on it.

    Args:
        scene: concrete shapes and lights.
        at: one receiver, above whose line the blockers stand.
        sizes: how many rays.

    Reference: E11 §3.2, Fig. 4.
    """
    way = "traced rays, E11's wedge"
    said = attempted(lambda: outside(scene, at, sizes))
    if isinstance(said, str):
        return (Row(QUANTITY, way, reason=said),)
    verdict = "agrees" if said.value <= said.bound else "differs"
    return (Row(QUANTITY, way, said.value, said.value, said.bound, 0.0, None, verdict),)


def outside(scene: Scene, at: Receiver, sizes: Sizes) -> Found:
    """The share of the shadows' energy outside the wedge, and the bound on it.

    Raises:
        Refused: if no blocker stands above the line, or one touches it.
    """
    blockers, depths = depths_of(scene, at)
    n = max(sizes.samples // 4, 64)
    half = window_of(scene, at, sizes).half
    grid = Grid.spanning((n, n), (half, STEEP))
    alone = shadows(scene, at, blockers, grid)
    together = np.sum(alone, 0)
    V, R = (coarser(f) for f in (1.0 - np.minimum(together, 1.0), np.maximum(together - 1.0, 0.0)))
    if np.ptp(V) == 0.0:
        raise Refused("no blocker comes before these rays: visibility is constant")
    energy = power_spectrum(V, grid)
    share = float(energy_outside(energy, inside(Wedge(*depths), grid)))
    total, product = float(jnp.sum(energy)), float(jnp.sum(power_spectrum(R, grid)))
    edges = 2 * int(np.sum(np.any(alone, (1, 2))))
    leaks = 2.0 * edges * max(leaked(z, half, grid) for z in depths)
    return Found(share, float((np.sqrt(leaks) + np.sqrt(product)) ** 2 / total))


def finer(grid: Grid) -> Grid:
    """Grid over the box of another, with `FINER` times as many samples along each axis."""
    return Grid(tuple(FINER * n for n in grid.size), tuple(h / FINER for h in grid.step))


def coarser(f: np.ndarray) -> np.ndarray:
    """Means over boxes of `FINER` squared rays, or aliases of edges would count as outside."""
    n, m = f.shape[-2] // FINER, f.shape[-1] // FINER
    return f.reshape(*f.shape[:-2], n, FINER, m, FINER).mean((-3, -1))


def depths_of(scene: Scene, at: Receiver) -> tuple[list[int], tuple[float, float]]:
    """The shapes that block and do not shine, and between which heights above the line they lie.

    Raises:
        Refused: if there are none, or the lowest touches the line, whose wedge is everything.
    """
    emission = np.asarray(scene.material.emission)
    heights = np.asarray(_heights(scene, at))
    above = [
        i
        for i in range(scene.count)
        if i != int(at.on) and not emission[i].any() and heights[i].max() > 0.0
    ]
    if not above:
        raise Refused("no blocker stands above the receiver's line")
    low, high = float(heights[above].min()), float(heights[above].max())
    if low <= TOUCHING * high:
        raise Refused("a blocker touches the receiver's line: every direction lies in the wedge")
    return above, (low, high)


@eqx.filter_jit
def _heights(scene: Scene, at: Receiver):
    """Heights of points of every shape above the receiver's line."""
    s = jnp.linspace(0.0, 1.0, 65)

    def of(i):
        return jax.vmap(lambda s: (scene.motion(i, s)[0] - at.position) @ at.normal)(s)

    return jax.vmap(of)(jnp.arange(scene.count))


def shadows(scene: Scene, at: Receiver, blockers: list[int], grid: Grid) -> np.ndarray:
    """Which rays of a finer grid each blocker stops, alone: ones and zeros, (blockers, x, v)."""
    x, v = (jnp.asarray(finer(grid).axis(i)) for i in range(2))
    return np.asarray(_stopped(scene, at, jnp.asarray(blockers), x, v))


@eqx.filter_jit
def _stopped(scene: Scene, at: Receiver, blockers, x, v):
    along = jax.vmap(direction)(at.n + jnp.arctan(v))

    def one(number, x):
        start = at.position + x * at.tangent
        t = jax.vmap(lambda d: scene.hit(number, start, d, at.on)[0])(along)
        return jnp.where(jnp.isfinite(t), 1.0, 0.0)

    return jax.lax.map(lambda i: jax.vmap(lambda x: one(i, x))(x), blockers)


def inside(wedge: Wedge, grid: Grid):
    """Frequencies in the wedge, or within what the window smears of it.

    Incoming light that passes a point at height z does so at `x - z v`: its energy lies at
    `Omega_v = -z Omega_x` (E11 measures v from the light, downwards).
    """
    x, v = np.meshgrid(*(np.asarray(grid.frequencies(i)) for i in range(2)), indexing="ij")
    # Each axis in bins, so that the window smears both alike.
    bins = [1.0 / e for e in grid.extent]
    scaled = Wedge(*(z * bins[0] / bins[1] for z in (wedge.d2_min, wedge.d2_max)))
    return scaled.contains(x / bins[0], -v / bins[1], margin=BINS)


def leaked(depth: float, half: float, grid: Grid) -> float:
    """The energy that the grid leaks of one straight edge at a depth, beside its own line.

    The largest of several edges at even places: it depends a little on where the grid cuts them.
    """
    x, v = (np.asarray(finer(grid).axis(i)) for i in range(2))
    bins = [1.0 / e for e in grid.extent]
    kx, kv = np.meshgrid(
        *(np.asarray(grid.frequencies(i)) / b for i, b in enumerate(bins)), indexing="ij"
    )
    z = depth * bins[0] / bins[1]
    near = abs(kv + z * kx) <= BINS * (1.0 + z)
    lost = []
    for place in np.linspace(-0.5, 0.5, 5):
        edge = coarser((x[:, None] - depth * v > place * half) * 1.0)
        lost.append(np.sum(np.asarray(power_spectrum(edge, grid))[~near]))
    return float(max(lost))
