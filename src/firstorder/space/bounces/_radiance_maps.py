"""Radiance maps on the faces of a scene, and rays that look them up.

Every face of a shape has a map: one value in each cell of the square [-1, 1]^2. Canonical
coordinates give each face its place in the square: of a box by coordinate, of a ball by height and
azimuth, of a cylinder by azimuth and height. The backs of flat shapes, the insides of closed ones
and planes without end have no map and send nothing.

A ray's canonical hit is at once the place on the map, so that `trace_maps` needs no search after
the search: it asks each shape in turn and keeps, where it is nearer, distance, face, place and
normal.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_count, check_shape
from firstorder._display import Module
from firstorder.numerics._vectors import apart, inverse_3x3, matvec_apart, unit
from firstorder.scene._bands import by_band
from firstorder.scene._intersect import MISS, ranks, rounding, tie
from firstorder.space.scene import Scene
from firstorder.space.shapes._slabs import Rounding, rounding_of
from firstorder.space.shapes.kinds import Shape

FACES = {
    "Ellipsoids": 1, "Boxes": 6, "Cylinders": 3, "Discs": 1, "Rectangles": 1, "Triangles": 1,
    "Planes": 0,
}  # fmt: skip
FLAT = ("Discs", "Rectangles", "Triangles", "Planes")


class FaceLayout(NamedTuple):
    """Numbering of the faces of a scene's shapes.

    Attributes:
        first: number of each shape's first face.
        shape: of each face.
        face: number of each face within its shape.
        kind: name of the kind of each face's shape.
    """

    first: np.ndarray
    shape: np.ndarray
    face: np.ndarray
    kind: list[str]


def face_layout(scene: Scene) -> FaceLayout:
    """The faces of a scene, from its structure alone.

    Example:
        >>> from firstorder.space import library
        >>> face_layout(library.j12_occluder()).kind.count("Boxes")
        6
    """
    kinds = [type(group).__name__ for group in scene.groups for _ in range(group.count)]
    faces = [FACES[kind] for kind in kinds]
    first = np.concatenate([[0], np.cumsum(faces)[:-1]]).astype(int)
    shape = np.repeat(np.arange(len(faces)), faces)
    return FaceLayout(first, shape, np.arange(sum(faces)) - first[shape], [kinds[i] for i in shape])


class RadianceMaps(Module):
    """Radiance that leaves the faces of a scene.

    Attributes:
        scene: whose faces these are.
        L: for each face a value in each cell, rows along its second coordinate; bands last
            [W/(m^2 sr)].

    Raises:
        ValueError: if `L` has not a square of cells for every face.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.bounces import RadianceMaps
        >>> from firstorder.space.library import j12_box
        >>> RadianceMaps(j12_box(), jnp.ones((4, 2, 2))).L.shape
        (4, 2, 2)
    """

    BANDED: ClassVar = {"L": 3}

    scene: Scene
    L: Float[Array, "f k k *bands"]

    def __check_init__(self):
        """Refuse other numbers of faces: cells are looked up without a check."""
        shape = np.shape(self.L)
        k = max([1, *shape[1:2]])
        check_shape("L", self.L, (len(face_layout(self.scene).shape), k, k, *shape[3:]))


class MapHits(Module):
    """First hits of rays, with the radiance of the maps there; coordinates in separate arrays.

    Attributes:
        radiance: from the maps, 0 for a miss; bands last [W/(m^2 sr)].
        distance: infinite for a miss [m].
        normal: of the side that is seen, three arrays; zero for a miss.
        index: number of the shape, -1 for a miss.
    """

    radiance: Float[Array, "*r_bands"]
    distance: Float[Array, "*r"]
    normal: tuple[Array, Array, Array]
    index: Int[Array, "*r"]


Coordinates = tuple[Array, Array, Array]
# Where the leaves of `MapHits` have bands: radiance has, and what is met is the same in all.
_OF_HITS = (-1, *(None,) * 5)


def trace_maps(
    maps: RadianceMaps, origin: Coordinates, along: Coordinates, on: Int[Array, "..."] | int
) -> MapHits:
    """First hits of rays, and the radiance that the maps send back along them.

    Of surfaces in the same place, such as a lamp drawn on a wall, the one counts that `Scene.of`
    says.

    Args:
        maps: of the scene.
        origin: x, y and z of where rays start [m].
        along: x, y and z of their unit directions.
        on: numbers of the shapes on which they start, which, convex, they do not meet again; -1
            for none.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import library
        >>> from firstorder.space.bounces import RadianceMaps, trace_maps
        >>> maps = RadianceMaps(library.j12_box(), jnp.ones((4, 2, 2)))
        >>> at, up = (jnp.full(1, 0.5),) * 2 + (jnp.zeros(1),), (jnp.zeros(1),) * 2 + (jnp.ones(1),)
        >>> trace_maps(maps, at, up, 0).distance.item()
        1.0
    """
    return _traced(maps, ranks(maps.scene.material.emission), origin, along, on)


@by_band(_OF_HITS)
def _traced(
    maps: RadianceMaps,
    rank: Int[Array, " n"],
    origin: Coordinates,
    along: Coordinates,
    on: Int[Array, "..."] | int,
) -> MapHits:
    """First hits, where the rank tells which counts of several in one place: one for all bands."""
    scene, number = maps.scene, 0
    first = jnp.asarray(face_layout(scene).first, jnp.int32)
    zero = jnp.zeros_like(along[0])
    none = jnp.full(zero.shape, MISS, jnp.int32)
    state = (jnp.full_like(zero, jnp.inf), none, (zero, zero, zero, zero, zero, none))
    places = jnp.stack(jnp.broadcast_arrays(*origin), -1)
    share, slack = 1.0 + tie(zero.dtype), rounding(places).astype(zero.dtype)
    for group in scene.groups:
        kind, numbers = type(group).__name__, number + jnp.arange(group.count, dtype=jnp.int32)

        def visit(state, row, kind=kind):
            (shape, face, this, high), (best, most, kept) = row, state
            t, found = _asked(shape, kind, face, origin, along)
            t = t.astype(best.dtype)
            # In one place with the best the higher rank counts, and else the nearer one.
            nearer = (t < jnp.inf) & (t <= share * best + slack)
            nearer &= (high > most) | (share * t + slack < best)
            nearer &= (t > 0.0) & (jnp.asarray(on) != this)
            pairs = zip(found, kept, strict=True)
            kept = tuple(jnp.where(nearer, a.astype(b.dtype), b) for a, b in pairs)
            return (jnp.where(nearer, t, best), jnp.where(nearer, high, most), kept), None

        rows = group, first[numbers], numbers, rank[numbers]
        state, _ = jax.lax.scan(visit, state, rows)
        number += group.count
    best, most, kept = state
    index = jnp.where(most == MISS, MISS, most % scene.count)
    s, t, *normal, face = kept
    has = face >= 0
    L = jnp.where(has, _looked_up(maps.L, jnp.maximum(face, 0), s, t), 0.0)
    return MapHits(L, best, (normal[0], normal[1], normal[2]), index)


def _asked(shape: Shape, kind: str, first: Array, origin: Coordinates, along: Coordinates):
    """Distance to one shape, and (place, seen normal, face) there."""
    turn = inverse_3x3(shape.axes)

    x, y, z = (a - shape.center[i] for i, a in enumerate(origin))
    o, d = matvec_apart(turn, (x, y, z)), matvec_apart(turn, along)
    size = along[0].shape
    lengths = shape.axes[..., : shape.spans]
    place, way = (apart(a) for a in rounding_of(turn, shape.center, lengths))
    x, y, z = (jnp.abs(a) for a in origin)
    far = jnp.maximum(jnp.maximum(x, y), z)
    off = Rounding(tuple(a + far * b for a, b in zip(place, way, strict=True)), way)
    t = jnp.broadcast_to(shape.canonical_distance(o, d, off), size)
    hit = jnp.isfinite(t) & (t > 0.0)
    x, y, z = (a + jnp.where(hit, t, 0.0) * b for a, b in zip(o, d, strict=True))
    s, up, face, n = place_on_face(kind, x, y, z)
    front = n[0] * d[0] + n[1] * d[1] + n[2] * d[2] < 0.0
    face, side = jnp.where(front, face, -1), jnp.where(front, 1.0, -1.0)
    n = tuple(side * a for a in n)
    world = [turn[0, i] * n[0] + turn[1, i] * n[1] + turn[2, i] * n[2] for i in range(3)]
    length = jnp.sqrt(world[0] ** 2 + world[1] ** 2 + world[2] ** 2)
    length = jnp.where(length > 0.0, length, 1.0)
    world = [jnp.broadcast_to(a / length, size) for a in world]
    face = jnp.broadcast_to(jnp.where(face >= 0, first + face, -1).astype(jnp.int32), size)
    return t, (s, up, *world, face)


def place_on_face(kind: str, x: Array, y: Array, z: Array):
    """Place on the square, face, and a vector along the normal, at canonical points."""
    none = jnp.zeros_like(x)
    if kind == "Boxes":
        ax, ay, az = jnp.abs(x), jnp.abs(y), jnp.abs(z)
        first, second = (ax >= ay) & (ax >= az), (ay >= az) & (ay > ax)
        high = jnp.where(first, x, jnp.where(second, y, z)) > 0.0
        sign = jnp.where(high, 1.0, -1.0)
        n = (
            jnp.where(first, sign, 0.0),
            jnp.where(second & ~first, sign, 0.0),
            jnp.where(first | second, 0.0, sign),
        )
        face = jnp.where(first, 0, jnp.where(second, 2, 4)) + high
        s = jnp.where(first, y, jnp.where(second, z, x))
        return s, jnp.where(first, z, jnp.where(second, x, y)), face, n
    if kind == "Ellipsoids":
        return jnp.arctan2(y, x) / math.pi, z, 0, (x, y, z)
    if kind == "Cylinders":
        cap = jnp.abs(z) > jnp.sqrt(x * x + y * y)
        face = jnp.where(cap, jnp.where(z > 0.0, 2, 1), 0)
        n = (jnp.where(cap, 0.0, x), jnp.where(cap, 0.0, y), jnp.where(cap, jnp.sign(z), 0.0))
        side = jnp.arctan2(y, x) / math.pi
        return jnp.where(cap, x, side), jnp.where(cap, y, z), face, n
    face = -1 if kind == "Planes" else 0
    if kind == "Triangles":
        return 2.0 * x - 1.0, 2.0 * y - 1.0, face, (none, none, none + 1.0)
    return x, y, face, (none, none, none + 1.0)


def _looked_up(L: Array, face: Array, s: Array, t: Array) -> Array:
    """Values of the cells in which places lie."""
    k = L.shape[-1]

    def cell(a):
        return jnp.clip(0.5 * (a + 1.0) * k, 0, k - 1).astype(jnp.int32)

    at = (face.astype(jnp.int32) * k + cell(t)) * k + cell(s)
    return L.reshape(-1).at[at].get(mode="promise_in_bounds")


def refine_maps(maps: RadianceMaps, cells: int) -> RadianceMaps:
    """Radiance maps resampled to more cells, bilinear between the centres of the old ones.

    Azimuth goes round; beyond the outermost centres of any other coordinate the line goes on.

    Args:
        maps: of any number of cells, at least 2.
        cells: along each side of each face.

    Raises:
        ValueError: if `cells` is no positive integer.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.bounces import RadianceMaps, refine_maps
        >>> from firstorder.space.library import j12_box
        >>> coarse = RadianceMaps(j12_box(), jnp.ones((4, 2, 2)))
        >>> refine_maps(coarse, 8).L.shape
        (4, 8, 8)
    """
    check_count("cells", cells)
    plan = face_layout(maps.scene)
    flat, around = (_resampling(maps.L.shape[1], cells, closes) for closes in (False, True))
    closes = [
        kind == "Ellipsoids" or (kind == "Cylinders" and face == 0)
        for kind, face in zip(plan.kind, plan.face, strict=True)
    ]
    across = np.stack([around if one else flat for one in closes])
    W, across = (jnp.asarray(weights, maps.L.dtype) for weights in (flat, across))
    L = jnp.einsum("ai,fbj,fij...->fab...", W, across, maps.L)
    return RadianceMaps(maps.scene, jnp.maximum(L, 0.0))


def _resampling(old: int, new: int, closes: bool) -> np.ndarray:
    """Weights of old cells in new ones along a row, which may close on itself; shape (new, old)."""
    u = (np.arange(new) + 0.5) / new * old - 0.5
    low = np.floor(u) if closes else np.clip(np.floor(u), 0, old - 2)
    weights = np.zeros((new, old))
    for cell, part in ((low, 1.0 - (u - low)), (low + 1, u - low)):
        np.add.at(weights, (np.arange(new), cell.astype(int) % old), part)
    return weights


def cell_centers(scene: Scene, cells: int) -> tuple[Array, Array]:
    """Centres of all cells of all faces, and the outward normals there: (f, cells^2, 3)."""
    plan = face_layout(scene)
    s = (np.arange(cells) + 0.5) / cells * 2.0 - 1.0
    t, s = (a.ravel() for a in np.meshgrid(s, s, indexing="ij"))
    q, n = [], []
    for kind, face in zip(plan.kind, plan.face, strict=True):
        point, normal = _canonical(kind, int(face), s, t)
        q.append(point)
        n.append(normal)
    own = jnp.asarray(plan.shape)
    center = jnp.concatenate([g.center for g in scene.groups])[own]
    axes = jnp.concatenate([g.axes for g in scene.groups])[own]
    q, n = jnp.asarray(np.stack(q), axes.dtype), jnp.asarray(np.stack(n), axes.dtype)
    point = center[:, None] + jnp.einsum("fij,fkj->fki", axes, q)
    return point, unit(jnp.einsum("fji,fkj->fki", inverse_3x3(axes), n))


def _canonical(kind: str, face: int, s: np.ndarray, t: np.ndarray):
    """Points of a canonical face, and vectors along its normal."""
    zero, one = np.zeros_like(s), np.ones_like(s)
    if kind == "Boxes":
        a, side = divmod(face, 2)
        sign = 2.0 * side - 1.0
        point, normal = np.stack([sign * one, s, t], -1), np.stack([sign * one, zero, zero], -1)
        return np.roll(point, a, axis=-1), np.roll(normal, a, axis=-1)
    around = np.cos(math.pi * s), np.sin(math.pi * s)
    if kind == "Ellipsoids":
        rho = np.sqrt(1.0 - t * t)
        q = np.stack([rho * around[0], rho * around[1], t], -1)
        return q, q
    if kind == "Cylinders" and face == 0:
        return np.stack([*around, t], -1), np.stack([*around, zero], -1)
    up = np.stack([zero, zero, one], -1)
    if kind == "Cylinders":
        sign = 2.0 * face - 3.0
        return np.stack([s, t, sign * one], -1), sign * up
    if kind == "Triangles":
        return np.stack([0.5 * (s + 1.0), 0.5 * (t + 1.0), zero], -1), up
    return np.stack([s, t, zero], -1), up
