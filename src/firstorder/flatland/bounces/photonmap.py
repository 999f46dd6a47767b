"""Photon maps: flux is emitted from the lights, and its density on the curves is irradiance.

    E(x) ~ sum_i dPhi_i / (2 r)      over the photons within r of x                (J12 eq. 30)

On a curve, photons are sorted by arc length, so that the k nearest, or all within a radius, are
found by bisection. Both are biased: the width smears light over `2 r` (at a shadow edge and at the
end of a receiver, its boundary bias), and with k nearest the printed estimator is `k / (k - 1)` too
bright, since the farthest photon decides the width that it is divided by. Leaving it out
(`keep_farthest=False`) is right on average. What to expect of either is in
`firstorder.sampling._density`.

The map is sorted on the host, once; tracing photons and querying the map are jitted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_count, check_index
from firstorder._display import Module
from firstorder.flatland.bounces.photons import Photons
from firstorder.flatland.direct_lighting import point_light_irradiance
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.sampling._density import (
    DensityEstimator,
    Window,
    fixed_window,
    nearest_window,
)
from firstorder.scene._arguments import check_asked, numbers
from firstorder.scene._primitives import BACK, FRONT

PIECES = 128  # of the table from parameter to arc length


class PhotonMap(Module):
    """Photons sorted along all curves, sides apart.

    A curve `j = 2 index + side` has its arc lengths in `[start_j, start_j + length]` of one long
    line, with half a length of its own before and behind. There a closed shape is continued.

    Attributes:
        at: sorted positions on the line, infinite where there is none [m].
        flux: of each [W].
        sums: of `flux`, from the left; one more than photons.
        sine, cosine: of the angle from which each came.
        start: of each curve [m].
        low: number of its first photon, and after the last curve, of all.
        table: arc length at even steps of the parameter, each shape [m].
        closed: whether each shape is.
    """

    at: Float[Array, " m"]
    flux: Float[Array, " m"]
    sums: Float[Array, " m_1"]
    sine: Float[Array, " m"]
    cosine: Float[Array, " m"]
    start: Float[Array, " c"]
    low: Int[Array, " c_1"]
    table: Float[Array, "n t"]
    closed: Bool[Array, " n"]


# --- the map -------------------------------------------------------------------------------------


def photon_map(scene: Scene, photons: Photons) -> PhotonMap:
    """Sorts photons along the curves they landed on; on the host.

    Args:
        scene: in which they were traced.
        photons: of `trace_photons`, or a part of them.

    Raises:
        ValueError: if a count is no positive integer.

    Example:
        >>> import jax
        >>> from firstorder.flatland.bounces import photon_map, trace_photons
        >>> from firstorder.flatland.library import scene_c
        >>> photons = photon_map(scene_c(), trace_photons(scene_c(), jax.random.key(0), 1000, 2))
        >>> photons.start.shape  # four walls, two sides each
        (8,)
    """
    table = np.asarray(_arc_tables(scene))
    closed = np.concatenate([np.full(g.count, g.closed) for g in scene.groups])
    length = table[:, -1]
    room = np.repeat(2.0 * length, 2)
    slot = np.cumsum(room) - room
    start = slot + 0.25 * room
    index = np.asarray(photons.index).ravel()
    kept = index >= 0
    fields = [np.asarray(getattr(photons, f)).ravel() for f in ("s", "flux", "sine", "cosine")]
    s, flux, sine, cosine = (a[kept] for a in fields)
    curve = 2 * index[kept] + np.where(np.asarray(photons.front).ravel()[kept], FRONT, BACK)
    arc = _arc(table[curve // 2], s)
    rows = [np.arange(curve.size), np.zeros(0, int), np.zeros(0, int)]
    shift = [np.zeros(curve.size)]
    own = length[curve // 2]
    for k, (which, by) in enumerate(((arc < 0.5 * own, 1.0), (arc >= 0.5 * own, -1.0))):
        rows[k + 1] = np.flatnonzero(which & closed[curve // 2])
        shift.append(by * own[rows[k + 1]])
    row, moved = np.concatenate(rows), np.concatenate(shift)
    at = start[curve[row]] + arc[row] + moved
    # By curve first: at half a length from its own a place may round to the next curve's.
    order = np.lexsort((at, curve[row]))
    row, at = row[order], at[order]
    low = np.searchsorted(curve[row], np.arange(start.size + 1))
    size = 1 << int(np.ceil(np.log2(max(at.size, 2))))  # few sizes, few compilations
    dtype = fields[0].dtype

    def padded(a, fill=0.0):
        return jnp.asarray(np.concatenate([a, np.full(size - a.size, fill)]), dtype)

    sums = np.concatenate([[0.0], np.cumsum(flux[row], dtype=np.float64)])
    return PhotonMap(
        padded(at, np.inf),
        padded(flux[row]),
        jnp.asarray(np.concatenate([sums, np.full(size - at.size, sums[-1])]), dtype),
        padded(sine[row]),
        padded(cosine[row]),
        jnp.asarray(start, dtype),
        jnp.asarray(low),
        jnp.asarray(table, dtype),
        jnp.asarray(closed),
    )


@eqx.filter_jit
def _arc_tables(scene: Scene) -> Float[Array, "n t"]:
    """Arc length at even steps of the parameter; constant speed makes it exact between them."""
    t, w = gauss_legendre(4)
    s = (np.arange(PIECES)[:, None] + 0.5 + 0.5 * t).ravel() / PIECES

    def table(index):
        speed = jax.vmap(lambda s: jnp.sqrt(jnp.sum(scene.motion(index, s)[1] ** 2)))
        pieces = speed(jnp.asarray(s)).reshape(PIECES, -1) @ jnp.asarray(0.5 * w / PIECES)
        return jnp.concatenate([jnp.zeros(1, pieces.dtype), jnp.cumsum(pieces)])

    return jax.vmap(table)(jnp.arange(scene.count))


def _arc(table, s):
    """Arc length at a parameter, from rows of the table; NumPy's arrays or JAX's."""
    xp: Any = np if isinstance(s, np.ndarray) else jnp
    place = xp.clip(s, 0.0, 1.0) * PIECES
    piece = xp.clip(place.astype(int), 0, PIECES - 1)
    left = xp.take_along_axis(table, piece[:, None], -1)[:, 0]
    right = xp.take_along_axis(table, piece[:, None] + 1, -1)[:, 0]
    return left + (place - piece) * (right - left)


# --- asking it -----------------------------------------------------------------------------------


def _window(photons: PhotonMap, how: DensityEstimator, x, curve) -> Window:
    """The photons that count and half the width: of a closed curve once around at most."""
    low, high = photons.low[curve], photons.low[curve + 1]
    # Of a closed curve each photon is there twice.
    own = jnp.where(photons.closed[curve // 2], (high - low) // 2, high - low)
    if not how.k:
        radius, half = jnp.full_like(x, how.radius), 0.5 * photons.table[curve // 2, -1]
        radius = jnp.where(photons.closed[curve // 2], jnp.minimum(radius, half), radius)
        around = fixed_window(photons.at, x, radius, low, high)
        return around._replace(last=jnp.minimum(around.last, around.first + own))
    return nearest_window(photons.at, x, jnp.minimum(how.k, own), low, high)


def _farthest(photons: PhotonMap, x, window: Window):
    """Number of the farthest photon of a window; of an empty one it is not to be asked for."""
    a, b = window.first, window.last - 1
    return jnp.where(x - photons.at[a] > photons.at[b] - x, a, b)


def photon_irradiance(
    photons: PhotonMap,
    how: DensityEstimator,
    index: ArrayLike,
    front: ArrayLike,
    s: ArrayLike,
) -> Float[Array, " q"]:
    """Irradiance at places of the curves, from the density of photons: direct and all other light.

    Args:
        photons: the map.
        how: nearest or fixed.
        index: number of the shape at each place, shape (q,).
        front: which side, shape (q,).
        s: parameter on it, shape (q,).

    Returns:
        For each place [W/m].

    Raises:
        ValueError: if there is no shape of a number.
        TypeError: if a number is no integer.

    Reference: J12 §4.4, eq. 30 for a diffuse surface, `L' = f E`.

    Example:
        >>> import jax
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland.bounces import DensityEstimator, photon_irradiance, photon_map
        >>> from firstorder.flatland.bounces import trace_photons
        >>> from firstorder.flatland.library import scene_c
        >>> photons = photon_map(scene_c(), trace_photons(scene_c(), jax.random.key(0), 1000, 2))
        >>> floor, up, middle = jnp.array([0]), jnp.array([True]), jnp.array([0.5])
        >>> E = photon_irradiance(photons, DensityEstimator(k=100), floor, up, middle)
        >>> bool(2.0 < E[0] < 3.0)  # 2 W/m of direct light, and that of the walls
        True
    """
    check_index("index", jnp.asarray(index), photons.closed.size)
    return _counted(photons, how, index, front, s)


@eqx.filter_jit
def _counted(photons: PhotonMap, how: DensityEstimator, index, front, s) -> Float[Array, " q"]:
    """`photon_irradiance` on shapes that are there."""
    index, s = jnp.asarray(index), numbers("s", s)
    curve = 2 * index + jnp.where(jnp.asarray(front), FRONT, BACK)
    arc = _arc(photons.table[index], s)
    x = photons.start[curve] + arc
    window = _window(photons, how, x, curve)
    flux = photons.sums[window.last] - photons.sums[window.first]
    if how.k and not how.keep_farthest:
        farthest = photons.flux[_farthest(photons, x, window)]
        flux = flux - jnp.where(window.last > window.first, farthest, 0.0)
    return _per_width(flux, photons, how, index, arc, window)


def _per_width(flux, photons: PhotonMap, how: DensityEstimator, index, arc, window: Window):
    """Flux over the width of a window; 0 for a window that has none."""
    width = 2.0 * window.radius
    if how.cut:
        right = photons.table[index, -1] - arc
        inside = jnp.minimum(arc, window.radius) + jnp.minimum(right, window.radius)
        width = jnp.where(photons.closed[index], width, inside)
    return jnp.where(width > 0.0, flux / jnp.where(width > 0.0, width, 1.0), 0.0)


def photon_radiance(
    photons: PhotonMap,
    how: DensityEstimator,
    brdf: Callable[[tuple[Array, Array], tuple[Array, Array]], Array],
    index: ArrayLike,
    front: ArrayLike,
    s: ArrayLike,
    out: tuple[ArrayLike, ArrayLike],
    most: int = 256,
) -> Float[Array, " q"]:
    """Reflected radiance for any BRDF: each photon is weighted by it.

    Args:
        photons: the map.
        how: nearest or fixed.
        brdf: of (sine, cosine) out and (sine, cosine) in.
        index: number of the shape at each place, shape (q,).
        front: which side, shape (q,).
        s: parameter on it, shape (q,).
        out: sine and cosine of the direction asked for, shape (q,) each.
        most: the most photons in a window; more give NaN.

    Returns:
        For each place, in the direction asked for [W/(m rad)].

    Reference: J12 §4.4, eq. 30.

    Raises:
        ValueError: if `most` is no positive integer, or there is no shape of a number.
        TypeError: if a shape's number is no integer.

    Example:
        >>> import jax
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland.bounces import DensityEstimator, photon_map, photon_radiance
        >>> from firstorder.flatland.bounces import trace_photons
        >>> from firstorder.flatland.library import scene_c
        >>> photons = photon_map(scene_c(), trace_photons(scene_c(), jax.random.key(0), 1000, 2))
        >>> half, k = jnp.array([0.5]), DensityEstimator(k=100)
        >>> grey = lambda out, into: 0.1 + 0.0 * into[0]
        >>> floor, up, out = jnp.array([0]), jnp.array([True]), (jnp.array([0.0]), jnp.array([1.0]))
        >>> L = photon_radiance(photons, k, grey, floor, up, half, out)
        >>> bool(0.2 < L[0] < 0.3)  # a tenth of the irradiance
        True
    """
    check_count("most", most)
    check_index("index", jnp.asarray(index), photons.closed.size)
    return _weighted(photons, how, brdf, index, front, s, out, most)


@eqx.filter_jit
def _weighted(photons: PhotonMap, how: DensityEstimator, brdf, index, front, s, out, most: int):
    """`photon_radiance` on shapes that are there."""
    index, s = jnp.asarray(index), numbers("s", s)
    curve = 2 * index + jnp.where(jnp.asarray(front), FRONT, BACK)
    arc = _arc(photons.table[index], s)
    x = photons.start[curve] + arc
    window = _window(photons, how, x, curve)
    row = window.first[:, None] + jnp.arange(how.k or most)
    inside = row < window.last[:, None]
    if how.k and not how.keep_farthest:
        inside = inside & (row != _farthest(photons, x, window)[:, None])
    row = jnp.minimum(row, photons.at.shape[0] - 1)
    sine, cosine = (numbers("out", part)[:, None] for part in out)
    f = brdf((sine, cosine), (photons.sine[row], photons.cosine[row]))
    sum_ = jnp.sum(jnp.where(inside, f * photons.flux[row], 0.0), -1)
    fits = window.last - window.first <= row.shape[1]
    return jnp.where(fits, _per_width(sum_, photons, how, index, arc, window), jnp.nan)


@eqx.filter_jit
def final_gather(
    scene: Scene,
    at: Receiver,
    *,
    photons: PhotonMap,
    how: DensityEstimator,
    rays: int,
    key: PRNGKeyArray | None = None,
) -> Float[Array, "*r"]:
    """Final gathering: rays from each receiver, and the map's radiance where they end.

    Direct light comes from the lights themselves, and the map is asked one reflection away, where
    its noise is averaged over the curves that the receiver sees. Diffuse surfaces only: glossy and
    mirror shares count as black.

    Args:
        scene: in which the photons were traced.
        at: receivers, one or a row of them.
        photons: the map.
        how: nearest or fixed.
        rays: from each, in strata of equal cosine.
        key: for a random ray in each; None takes the middle.

    Returns:
        Irradiance of each receiver [W/m].

    Reference: J12 §4.4, Fig. 5.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.bounces import DensityEstimator, final_gather, photon_map
        >>> from firstorder.flatland.bounces import trace_photons
        >>> from firstorder.flatland.library import scene_c
        >>> room, k = scene_c(), DensityEstimator(k=100)
        >>> photons = photon_map(room, trace_photons(room, jax.random.key(0), 1000, 2))
        >>> floor = Receiver([(0.5, 0.0)], [0.0], [0])
        >>> bool(2.2 < final_gather(room, floor, photons=photons, how=k, rays=64)[0] < 2.8)
        True
    """
    check_asked(scene, Scene, at, Receiver)
    albedo = scene.material.albedo

    def one(here: Receiver, key):
        seen = trace_strata(scene, here, where=hemicircle_strata(rays, key, cosine=True))
        index = jnp.maximum(seen.index, 0)
        E = photon_irradiance(photons, how, index, seen.front, seen.s)
        rho = albedo[index, jnp.where(seen.front, FRONT, BACK)]
        L = seen.radiance + jnp.where(seen.index >= 0, 0.5 * rho * E, 0.0)
        angles = seen.strata.angles
        return jnp.sum(seen.strata.weights * jnp.cos(angles) * L) + point_light_irradiance(
            scene, here
        )

    row = jax.tree.map(lambda a: a.reshape(-1, *a.shape[at.n.ndim :]), at)
    keys = None if key is None else jax.random.split(key, row.n.shape[0])
    return jax.vmap(one, (0, None if key is None else 0))(row, keys).reshape(at.n.shape)
