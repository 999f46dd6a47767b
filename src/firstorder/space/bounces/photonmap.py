"""Photon maps in space: flux is sent from the lamps, and its density on surfaces is irradiance.

    E(x) ~ sum_i dPhi_i / (pi r^2)    over the photons within r of x      (J12 eq. 30, in space)

Photons lie in one tree for each side of each face, so that none is counted through a wall or around
the edge of a box. The disc of radius r smears light over its area; at the edge of a face a part of
it hangs over (the boundary bias), which `cut` leaves out. With k nearest the printed estimator is
`k / (k - 1)` too bright, as in flatland: the area up to the k-th photon of an even density is Gamma
distributed with k, and `k / area` is `k / (k - 1)` times the density on average.

Trees are SciPy's, on the host. Tracing photons is jitted.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.spatial import KDTree

from firstorder._argument_checks import check_count, check_index
from firstorder._display import in_print
from firstorder.numerics._batching import in_batches
from firstorder.numerics._vectors import dot, orthonormal_frame
from firstorder.sampling._density import DensityEstimator
from firstorder.scene._arguments import check_asked
from firstorder.space.bounces._radiance_maps import (
    RadianceMaps,
    cell_centers,
    face_layout,
    place_on_face,
)
from firstorder.space.bounces.photons import Photons
from firstorder.space.estimators._irradiance_forms import trace_strata
from firstorder.space.estimators.strata import Strata
from firstorder.space.receiver import Receiver
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Boxes, Cylinders, Ellipsoids, Shape

BLOCK = 4096  # places asked at a time
LATTICE = 256  # points of a disc by which it is told how much of it lies on the face
MOST_FACES = 6


class _FacePhotons(NamedTuple):
    """Photons on one side of one face.

    Attributes:
        tree: of their positions.
        flux: of each [W].
    """

    tree: KDTree
    flux: np.ndarray


@dataclasses.dataclass(frozen=True)
class PhotonMap:
    """Photons by the side of the face on which they landed; on the host.

    Attributes:
        scene: in which they were traced.
        faces: photons by the number of their side; sides without photons are left out.
        photons: those that landed, in rows.
    """

    scene: Scene
    faces: dict[int, _FacePhotons]
    photons: Photons

    __repr__ = in_print


# --- the map -------------------------------------------------------------------------------------


def photon_map(scene: Scene, photons: Photons) -> PhotonMap:
    """Sorts photons into trees, one for each side of each face; on the host.

    Args:
        scene: in which they were traced.
        photons: of `trace_photons`, or a part of them.

    Example:
        >>> import jax
        >>> from firstorder.space.bounces import photonmap, photons
        >>> from firstorder.space.library import j12_box
        >>> found = photons.trace_photons(j12_box(), jax.random.key(0), 1000, 2)
        >>> found = photonmap.photon_map(j12_box(), found)
        >>> sorted(found.faces)  # fronts of floor, left wall, lamp and right wall
        [0, 12, 24, 36]
    """
    there = np.asarray(photons.index).ravel() >= 0
    rows = photons.index.ndim
    landed = jax.tree.map(lambda a: np.asarray(a).reshape(-1, *a.shape[rows:])[there], photons)
    side = np.asarray(_sides(scene, landed.index, landed.front, landed.position))
    faces = {}
    for number in np.unique(side):
        which = side == number
        faces[int(number)] = _FacePhotons(KDTree(landed.position[which]), landed.flux[which])
    return PhotonMap(scene, faces, landed)


@eqx.filter_jit
def _sides(scene: Scene, index, front, position) -> Int[Array, " q"]:
    """Numbers of the sides of faces on which places lie."""

    def face(index, position):
        return scene.ask(index, lambda shape: jnp.asarray(_on_face(shape, position)[0], jnp.int32))

    number = MOST_FACES * index + jax.vmap(face)(index, position)
    return 2 * number + jnp.where(front, FRONT, BACK)


def _on_face(shape: Shape, position: Float[Array, "3"]):
    """The face of a shape on which a place lies, and its canonical coordinates."""
    q = shape.local(position)
    face = place_on_face(type(shape).__name__, *q)[2]
    return jnp.maximum(face, 0), q


# --- asking it -----------------------------------------------------------------------------------


def photon_irradiance(
    photons: PhotonMap, how: DensityEstimator, at: Receiver
) -> Float[Array, "*r"]:
    """Irradiance at places of surfaces, from the density of photons: direct and all other light.

    Biased by the width of the disc: for a smooth irradiance by `r^2 / 8` of its Laplacian, at the
    edge of a face by a half and in a corner by three quarters unless it is `cut`, and first order
    in r if it is.

    Args:
        photons: the map.
        how: nearest or fixed.
        at: receivers that lie on shapes; only the sign of their normals counts.

    Returns:
        For each receiver; by the nearest photons, zero on a side with fewer than two [W/m^2].

    Raises:
        ValueError: if a receiver lies on no shape, or on one that is not there.

    Reference: Jensen 2001; J12 §4.4, eq. 30.

    Example:
        >>> import jax
        >>> from firstorder.space import Receiver
        >>> from firstorder.space.bounces import photonmap, photons
        >>> from firstorder.space.library import j12_box
        >>> traced = photons.trace_photons(j12_box(), jax.random.key(0), 20_000)
        >>> found = photonmap.photon_map(j12_box(), traced)
        >>> floor = Receiver.at((0.5, 0.5, 0.0), on=0)
        >>> k = photonmap.DensityEstimator(k=200)
        >>> bool(0.12 < photonmap.photon_irradiance(found, k, floor) < 0.21)
        True
    """
    if np.any(np.asarray(at.on) < 0):
        raise ValueError("Argument `at` must lie on shapes: set `on` to the number of each.")
    check_index("at.on", at.on, photons.scene.count)
    row = _in_a_row(at)
    side = np.asarray(_sides(photons.scene, row.on, _fronts(photons.scene, row), row.position))
    flux, radius = (np.zeros(side.size) for _ in range(2))
    place = np.asarray(row.position)
    for number in np.unique(side):
        rows, found = np.flatnonzero(side == number), photons.faces.get(int(number))
        for block in np.array_split(rows, -(-rows.size // BLOCK)) if found else []:
            flux[block], radius[block] = _near(found, how, place[block])
    wide = jnp.asarray(radius, row.position.dtype)
    area = jnp.pi * wide**2 * (_share(photons.scene, row, wide) if how.cut else 1.0)
    E = jnp.where(area > 0.0, jnp.asarray(flux, wide.dtype) / jnp.where(area > 0.0, area, 1.0), 0.0)
    return E.reshape(at.on.shape)


def _in_a_row(at: Receiver) -> Receiver:
    """Receivers with a single leading axis."""
    position, axes, S = at.position.reshape(-1, 3), at.axes.reshape(-1, 3, 3), at.S
    return Receiver(position, axes, S.reshape(-1, 2, 2), jnp.asarray(at.on).reshape(-1))


def _near(found: _FacePhotons, how: DensityEstimator, place: np.ndarray):
    """Flux within a disc, and its radius; zero where it holds too little to have one."""
    if not how.k:
        rows = found.tree.query_ball_point(place, how.radius)
        sums = np.array([found.flux[row].sum() for row in rows])
        return sums, np.full(len(place), how.radius)
    k = min(how.k, found.flux.size)
    if k < 2:
        return np.zeros(len(place)), np.zeros(len(place))
    distance, row = found.tree.query(place, k)
    counted = k if how.keep_farthest else k - 1
    return found.flux[row[:, :counted]].sum(-1), distance[:, -1]


@eqx.filter_jit
def _fronts(scene: Scene, at: Receiver) -> Bool[Array, " r"]:
    """Whether receivers face as the fronts of their shapes do."""
    return dot(jax.vmap(scene.normal)(at.on, at.position), at.normal) > 0.0


@eqx.filter_jit
def _share(scene: Scene, at: Receiver, radius: Float[Array, " r"]) -> Float[Array, " r"]:
    """Share of discs around receivers that lies on their faces, by a lattice of points."""
    n = np.arange(LATTICE) + 0.5
    around = np.pi * (3.0 - np.sqrt(5.0)) * n
    disc = jnp.stack([jnp.asarray(f(around) * np.sqrt(n / LATTICE)) for f in (np.cos, np.sin)], -1)

    def one(asked):
        at, radius = asked
        tangents = orthonormal_frame(scene.normal(at.on, at.position))[:, :2]
        points = at.position + radius * disc @ tangents.T

        def ask(shape: Shape):
            face, _ = _on_face(shape, at.position)
            return jnp.mean(jax.vmap(lambda p: _holds(shape, face, shape.local(p)))(points))

        return scene.ask(at.on, lambda shape: ask(shape).astype(radius.dtype))

    return in_batches(one, (at, radius), BLOCK)


def _holds(shape: Shape, face: Array, q: Float[Array, "3"]) -> Array:
    """Whether a canonical point near a face belongs to it, read along the face's normal."""
    within = jnp.abs(q) <= 1.0
    round_part = q[0] ** 2 + q[1] ** 2 <= 1.0
    match shape:
        case Boxes():
            return jnp.all(within | (jnp.arange(3) == face // 2))
        case Cylinders():
            return jnp.where(face == 0, within[2], round_part)
        case Ellipsoids():
            return jnp.asarray(True)
    return type(shape).holds(q[0], q[1])  # pyright: ignore[reportAttributeAccessIssue]


# --- what it is asked for ------------------------------------------------------------------------


def photon_radiances(
    photons: PhotonMap, how: DensityEstimator, every: int = 4
) -> Float[Array, " m"]:
    """Reflected radiance where photons landed: `albedo / pi E` at every few of them.

    Their largest is J12's estimate of the largest radiance of a scene (footnote 2), with
    `caching.largest_radiance`: a geometric error times it keeps the unit of irradiance.

    Valid for diffuse surfaces: glossy shares count as black.

    Args:
        photons: the map.
        how: nearest or fixed.
        every: how many photons share one.

    Returns:
        In the order of the photons [W/(m^2 sr)].

    Raises:
        ValueError: if `every` is not positive.

    Reference: Christensen 1999; J12 footnote 2.

    Example:
        >>> import jax
        >>> from firstorder.caching import largest_radiance
        >>> from firstorder.space.bounces import photonmap, photons
        >>> from firstorder.space.library import j12_box
        >>> traced = photons.trace_photons(j12_box(), jax.random.key(0), 20_000)
        >>> k = photonmap.DensityEstimator(k=200, cut=True)
        >>> L = photonmap.photon_radiances(photonmap.photon_map(j12_box(), traced), k)
        >>> bool(0.02 < largest_radiance(L) < 0.05)  # of the left wall; the lamp's is 1
        True
    """
    check_count("every", every)
    some: Photons = jax.tree.map(lambda a: jnp.asarray(a[::every]), photons.photons)
    outward = jax.vmap(photons.scene.normal)(some.index, some.position)
    normal = jnp.where(some.front[:, None], outward, -outward)
    at = Receiver.at(some.position, normal, on=some.index)
    return _reflected(photons, how, at)


def _reflected(photons: PhotonMap, how: DensityEstimator, at: Receiver) -> Float[Array, "*r"]:
    """Radiance that diffuse surfaces reflect at receivers on them."""
    front = _fronts(photons.scene, _in_a_row(at)).reshape(at.on.shape)
    albedo = photons.scene.material.albedo[at.on, jnp.where(front, FRONT, BACK)]
    return albedo / jnp.pi * photon_irradiance(photons, how, at)


def photon_radiance_maps(
    photons: PhotonMap, how: DensityEstimator, cells: int = 32
) -> RadianceMaps:
    """Radiance maps of every face from a photon map: reflected light of all orders.

    They take the place of `solve_radiosity` where lamps are no rectangles, and feed what gathers
    from maps: `trace_maps`, and caches by `caching.tabulate_candidates`. What lamps emit is not in
    them.

    Valid for diffuse surfaces whose fronts reflect: planes and backs have no map.

    Args:
        photons: the map.
        how: nearest or fixed; `cut` keeps the cells at edges bright.
        cells: along each side of each face.

    Raises:
        ValueError: if `cells` is not positive.

    Reference: J12 §4.5: a cache as the final gather of a photon map.

    Example:
        >>> import jax
        >>> from firstorder.space.bounces import photonmap, photons
        >>> from firstorder.space.library import j12_box
        >>> traced = photons.trace_photons(j12_box(), jax.random.key(0), 1000)
        >>> found = photonmap.photon_map(j12_box(), traced)
        >>> photonmap.photon_radiance_maps(found, photonmap.DensityEstimator(k=50), 8).L.shape
        (4, 8, 8)
    """
    check_count("cells", cells)
    scene, own = photons.scene, face_layout(photons.scene).shape
    point, normal = cell_centers(scene, cells)
    on = jnp.broadcast_to(jnp.asarray(own)[:, None], point.shape[:2])
    at = Receiver.at(point, normal, on=on)
    return RadianceMaps(scene, _reflected(photons, how, at).reshape(-1, cells, cells))


def final_gather(
    scene: Scene, at: Receiver, *, where: Strata, photons: PhotonMap, how: DensityEstimator
) -> Float[Array, "*r"]:
    """Final gathering: rays from each receiver, and the map's radiance where they end.

    Light of lamps and sky comes along the rays themselves, and the map is asked one reflection
    away, where its noise is averaged over the surfaces that the receiver sees.

    Valid for diffuse surfaces: glossy shares count as black.

    Args:
        scene: in which the photons were traced.
        at: receivers.
        where: cells of the hemisphere, one ray in each.
        photons: the map.
        how: nearest or fixed.

    Returns:
        Irradiance of each receiver [W/m^2].

    Reference: Reichert 1992; J12 §4.4, Fig. 5.

    Raises:
        ValueError: if the receiver is not one, or its number is that of no shape.

    Example:
        >>> import jax
        >>> from firstorder.space import Receiver
        >>> from firstorder.space.bounces import photonmap, photons
        >>> from firstorder.space.estimators import hemisphere_strata
        >>> from firstorder.space.library import j12_box
        >>> box, k = j12_box(), photonmap.DensityEstimator(k=100)
        >>> found = photonmap.photon_map(box, photons.trace_photons(box, jax.random.key(0), 5000))
        >>> at, where = Receiver.at((0.5, 0.5, 0.0), on=0), hemisphere_strata(32, 128)
        >>> bool(0.14 < photonmap.final_gather(box, at, where=where, photons=found, how=k) < 0.18)
        True
    """
    check_asked(scene, Scene, at, Receiver)
    seen = trace_strata(scene, at, where=where)
    there = seen.index >= 0
    frame = at.axes[..., None, None, :, :]
    along = jnp.sum(frame * seen.strata.directions[..., None, :], -1)
    reach = jnp.where(there, seen.distance, 0.0)[..., None]
    point = at.position[..., None, None, :] + reach * along
    normal = jnp.sum(frame * seen.normal[..., None, :], -1)
    met = Receiver.at(point, normal, on=jnp.maximum(seen.index, 0))
    L = seen.radiance + jnp.where(there, _reflected(photons, how, met), 0.0)
    return jnp.sum(seen.strata.weights * seen.strata.directions[..., 2] * L, (-2, -1))
