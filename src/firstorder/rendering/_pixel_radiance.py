"""Radiance of pixels of meshes and its image gradient, and nothing else: the renderer's fast way.

Shadow rays go to a lamp's nodes from all pixels of a block at once (`io.Embree.fan_occluded`); the
sums over nodes are `imaging._radiance`; edges of shadows are a sparse list, and only beside them is
a blocker's depth asked (`_shadow_edges`). Blocks have a few sizes, so that few pixels fill none up.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder._display import in_print
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._lamps import SampledLight
from firstorder.imaging._radiance import (
    ShadingPoint,
    edge_radiance,
    point_motion,
    radiance,
    radiance_gradient,
    shading_point,
)
from firstorder.io.meshes import Embree
from firstorder.rendering._shadow_edges import edge_weights, shadow_edges
from firstorder.scene._bands import by_band

NODES = 131072  # of all pixels of a block, so that what is known of them stays in the cache
LARGEST, SMALLEST = 1024, 16  # pixels of a block
EDGES = 8192  # edges of shadows at a time
STRETCH = 1 << 24  # nodes of all pixels for whose shadows' edges are kept
# A shadow ray starts this far in front of a face, in sizes of all meshes: single precision.
OFF = 1e-5


def before_lamp(light: SampledLight, off: float) -> Float[np.ndarray, "k 3"]:
    """Steps from a near lamp's nodes to just before it: a face may be where it is drawn [m]."""
    area = np.asarray(light.toward(jnp.zeros(3))[1])
    return off * area / np.linalg.norm(area, axis=1, keepdims=True)


@dataclasses.dataclass(frozen=True)
class PixelRadiance:
    """Radiance of pixels, its image gradient, and what they show.

    Attributes:
        value: without what surfaces themselves emit; bands last [W/(m^2 sr)].
        gradient: along px and py, the last axis, with what moving shadows add; None if not asked.
        index: number of the primitive, -1 for the sky.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering import PixelRadiance
        >>> PixelRadiance(np.zeros(2), None, np.array([0, -1])).gradient is None
        True
    """

    value: Float[np.ndarray, "n *bands"]
    gradient: Float[np.ndarray, "n *bands 2"] | None
    index: Int[np.ndarray, " n"]

    __repr__ = in_print


def blocks_of(count: int, nodes: int, largest: int = LARGEST) -> Iterator[tuple[slice, int]]:
    """Slices of rows and the sizes to which they are filled up, a few sizes in all.

    Args:
        count: of rows.
        nodes: of all lamps, for each row.
        largest: size.

    Example:
        >>> from firstorder.rendering._pixel_radiance import blocks_of
        >>> [(s.stop - s.start, size) for s, size in blocks_of(1300, 64)]
        [(1024, 1024), (256, 256), (16, 16), (4, 16)]
    """
    most = 1 << int(np.log2(max(NODES // max(nodes, 1), 1)))
    sizes = [min(max(most, SMALLEST), largest)]
    while sizes[-1] > SMALLEST:
        sizes.append(max(sizes[-1] // 4, SMALLEST))
    first = 0
    while first < count:
        left = count - first
        fits = [s for s in sizes if s <= left]
        size = fits[0] if fits else sizes[-1]
        yield slice(first, min(first + size, count)), size
        first += size


# --- light on meshes ------------------------------------------------------------------------------


class Shadowed(NamedTuple):
    """Pixels that see some of a light's nodes, and not others: where shadows have edges.

    Attributes:
        number: of the pixels.
        seen: which nodes they see.
        factors: of their lobes (`imaging._radiance`).
        point: their surface points.
        moved: how these move with px and py.
    """

    number: Int[np.ndarray, " m"]
    seen: Bool[np.ndarray, "m k"]
    factors: np.ndarray
    point: ShadingPoint
    moved: Float[np.ndarray, "m 3 2"]


class MeshLight:
    """Light on meshes from lamps that stand still: shadow rays, sums over nodes, moving edges.

    Args:
        look: from what a block is given to its surface interactions; compiled with the sums.
        embree: the meshes.
        lights: near lamps, and distant light that is the same from everywhere.
    """

    def __init__(
        self,
        look: Callable[[Any], SurfaceInteraction],
        embree: Embree,
        lights: Sequence[SampledLight],
    ):
        self.look, self.embree, self.lights = look, embree, tuple(lights)
        self._ways = [np.asarray(one.toward(jnp.zeros(3))[0]) for one in self.lights]
        self._off = OFF * embree.mesh.size
        self._ends = [
            way + before_lamp(one, self._off) if one.near else way
            for one, way in zip(self.lights, self._ways, strict=True)
        ]

    def pixels(self, fixed: tuple, rows: tuple, x, up, gradients: bool) -> tuple[np.ndarray, ...]:
        """Radiance of pixels, and its gradient if that is wanted.

        Args:
            fixed: what `look` takes first.
            rows: arrays that it takes then, with a row for each pixel.
            x: positions of the pixels [m].
            up: unit normals of their faces, towards the eye.
            gradients: whether they are wanted.
        """
        nodes, found = sum(map(len, self._ways)), []
        most = max(STRETCH // nodes, SMALLEST)
        for first in range(0, len(x), most):
            some = slice(first, first + most)
            given = (fixed, tuple(a[some] for a in rows), x[some], up[some])
            found.append(self._stretch(*given, nodes, gradients))
        return tuple(np.concatenate(a) for a in zip(*found, strict=True))

    def _stretch(self, fixed, rows, x, up, nodes: int, gradients: bool) -> tuple[np.ndarray, ...]:
        """As many pixels as may be kept at a time, by blocks, and then all edges of shadows."""
        start, found = x + self._off * up, []
        edges: list[list[Shadowed]] = [[] for _ in self.lights]
        for some, size in blocks_of(len(x), nodes):
            number = np.minimum(np.arange(some.start, some.start + size), some.stop - 1)
            given = (*fixed, *(a[number] for a in rows))
            seen = [self._seen(start[some], k, size) for k in range(len(self.lights))]
            if not gradients:
                got = (_values(self.look, given, self.lights, seen),)
            else:
                *got, factors, point, moved = _gradients(self.look, given, self.lights, seen)
                for k, light in enumerate(self.lights):
                    if light.even:
                        edges[k].append(_shadowed(some, seen[k], factors, point, moved))
            found.append(tuple(np.asarray(a)[: some.stop - some.start] for a in got))
        sums = tuple(np.concatenate(a) for a in zip(*found, strict=True))
        for k, parts in enumerate(edges):
            if parts:
                whole = jax.tree.map(lambda *a: np.concatenate(a), *parts)
                self._move(sums[1], whole, x, up, k)
        return sums

    def _seen(self, start: np.ndarray, k: int, size: int) -> Bool[np.ndarray, "n k"]:
        """Visibility of a light's nodes; of what fills the block up, none."""
        reach = 1.0 if self.lights[k].near else np.inf
        hidden = self.embree.fan_occluded(start, self._ends[k], reach)
        seen = np.zeros((size, hidden.shape[1]), bool)
        np.logical_not(hidden, seen[: len(hidden)])
        return seen

    def _move(self, gradient: np.ndarray, at: Shadowed, x, up, k: int) -> None:
        """Add to gradients what the edges of one light's shadows do."""
        light, way = self.lights[k], self._ways[k]
        x, up = x[at.number], up[at.number]
        height = up @ way.T
        above = height > (np.einsum("ij,ij->i", up, x)[:, None] if light.near else 0.0)
        seen = at.seen & above
        edges = shadow_edges(seen.reshape(-1, *light.shape), light.wraps)

        def depth(row, node):
            start = x[row] + self._off * up[row]
            if light.near:
                return np.minimum(self.embree.first_share(start, way[node]), 1.0)
            share = self.embree.first_share(start, way[node], np.inf)
            return np.where(np.isfinite(share), share * np.linalg.norm(way[node], axis=1), 0.0)

        weight = edge_weights(edges, seen, above, depth, light.near)
        some = np.flatnonzero(weight)
        if not len(some):
            return
        row, weight = edges.row[some], weight[some]
        pairs = edges.before[some], edges.after[some], edges.axis[some]
        sent = _uncovered(light, pairs, jax.tree.map(lambda a: a[row], (at.point, at.moved)))
        if sent.ndim < gradient.ndim + 1:  # a light without bands is the same in all
            sent = sent[..., None]
        sent = sent * weight.reshape(-1, *(1,) * (sent.ndim - 1))
        moved = np.sum(sent * at.factors[row][:, :, None], 1)
        np.add.at(gradient, at.number[row], np.moveaxis(moved, 1, -1))


def _shadowed(some: slice, seen, factors, point, moved) -> Shadowed:
    """Pixels of a block among whose nodes a shadow has an edge."""
    row = np.flatnonzero(seen.any(1) & ~seen.all(1))
    kept = jax.tree.map(lambda a: np.asarray(a)[row], (factors, point, moved))
    return Shadowed(row + some.start, seen[row], *kept)


def _uncovered(light: SampledLight, pairs: tuple, at: tuple) -> np.ndarray:
    """`edge_radiance` of many edges, in blocks of a few sizes."""
    found = []
    for some, size in blocks_of(len(pairs[0]), NODES // EDGES, EDGES):
        number = np.minimum(np.arange(some.start, some.start + size), some.stop - 1)
        rows = jax.tree.map(lambda a, number=number: a[number], (pairs, at))
        found.append(np.asarray(_edges(light, *rows))[: some.stop - some.start])
    return np.concatenate(found)


@eqx.filter_jit
@by_band()
def _values(look, given, lights, seen):
    point, factors = jax.vmap(shading_point)(look(given))
    return sum(
        jax.vmap(functools.partial(radiance, light))(s, point, factors)
        for light, s in zip(lights, seen, strict=True)
    )


@eqx.filter_jit
@by_band((-1, -2, -1, *(None,) * 6))
def _gradients(look, given, lights, seen):
    """Values, gradients, factors of the lobes, points and how these move."""
    at = look(given)
    point, factors = jax.vmap(shading_point)(at)
    motion = jax.vmap(point_motion)(at)
    each = [
        jax.vmap(functools.partial(radiance_gradient, light))(s, point, factors, motion)
        for light, s in zip(lights, seen, strict=True)
    ]
    value, gradient = (sum(part) for part in zip(*each, strict=True))
    return value, gradient, factors, point, motion.position


@eqx.filter_jit
@by_band()
def _edges(light, pairs, at):
    def one(before, after, axis, point, moved):
        return edge_radiance(light, (before, after), axis, point, moved)

    return jax.vmap(one)(*pairs, *at)
