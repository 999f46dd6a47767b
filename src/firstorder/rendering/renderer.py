"""A small renderer of meshes and analytic shapes, with image gradients.

Meshes and analytic shapes, one bounce of near lamps and of a sky with soft shadows, diffuse and
glossy lobes, bumps, normal maps and textures (`imaging.SurfaceMaps`); every pixel comes
with its gradient, with what moving shadows add, and with R07's terms. Meshes are met by Embree,
analytic shapes in JAX; what is found is shaded by the one code there is
(`imaging._light_terms`). Blocks of pixels are independent, and `ABREAST` of them are at work at a
time: while Embree traces the shadow rays of one, another is shaded.

Primitives are numbered: shapes of the scene, then models, then lamps. Light that was reflected
before does not arrive; lamps hide nothing and are seen as they are.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from firstorder._argument_checks import check_finite
from firstorder._display import in_print
from firstorder.imaging._lamps import Lamp
from firstorder.imaging._light_terms import Light
from firstorder.imaging._point_shading import ShadedPixels, shade_rows
from firstorder.imaging.camera import Pinhole, _check_camera
from firstorder.imaging.facets import Facets
from firstorder.imaging.shading import SurfaceMaps
from firstorder.imaging.sky_lights import CosineSkyLight, sky_light
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.numerics._batching import host_blocks
from firstorder.rendering import _programs as programs
from firstorder.rendering._pixel_radiance import MeshLight, PixelRadiance
from firstorder.rendering._traced_models import TracedModels
from firstorder.scene._arguments import check_kind
from firstorder.scene._bands import bands_of
from firstorder.scene._intersect import tie
from firstorder.scene._primitives import joined
from firstorder.space.primitives import Material, primitive
from firstorder.space.scene import Scene
from firstorder.space.shapes.build import sphere
from firstorder.space.shapes.kinds import Rectangles

BLOCK = 256  # pixels of one compiled size: numbers of all nodes then fit the second cache
ABREAST = 2  # blocks at a time
RAYS = 4096  # primary rays at a time


class World(NamedTuple):
    """Camera, scene, lights and surface maps of a rendering.

    Attributes:
        camera: the eye.
        scene: analytic shapes, or None.
        models: meshes with materials.
        lamps: near light.
        sky: distant light, a function of the direction; None for none.
        sky_rows: of its nodes; twice as many columns.
        sky_nodes: "even", "cosine" or "luminance" (`imaging.sky_light`); shadows move over two.
        finish: bumps and textures, by number of the primitive.
        normals: of each model, at its vertices; None for `vertex_normals`.

    Example:
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.rendering import World
        >>> from firstorder.space.library import sphere_over_plane
        >>> World(pinhole((0.0, -2.0, 2.0), (0.0, 0.0, 0.0)), sphere_over_plane()).shapes
        2
    """

    camera: Pinhole
    scene: Scene | None = None
    models: tuple[MeshModel, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    sky: Any = None
    sky_rows: int = 12
    sky_nodes: str = "even"
    finish: SurfaceMaps | None = None
    normals: tuple[Any, ...] | None = None

    __repr__ = in_print

    @property
    def shapes(self) -> int:
        """Number of analytic shapes; models are counted from there."""
        return 0 if self.scene is None else self.scene.count


@dataclasses.dataclass(frozen=True)
class TileHits:
    """First hits of primary rays.

    Attributes:
        index: number of the primitive, -1 for the sky.
        face: of all models' faces, -1 if it is no model.
        distance: from the eye, infinity for the sky [m].
    """

    index: Int[np.ndarray, " n"]
    face: Int[np.ndarray, " n"]
    distance: Float[np.ndarray, " n"]

    __repr__ = in_print


class Renderer:
    """Renderer of a world: shades pixels, a few or all.

    Of several bands shadow rays are traced once.

    Args:
        world: what is seen.

    Raises:
        ValueError: if there is nothing to see, or no light, or numbers of bands differ, or there
            are normals, but not for each model.
        TypeError: if the camera or the scene is none, or the lamps are not in a tuple.
        ModuleNotFoundError: for models, without the extra `mesh`.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering import Renderer, World
        >>> from firstorder.space import Scene, plane, primitive
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.imaging import Lamp
        >>> floor = Scene.of(primitive(plane((0, 0, 0), (0, 0, 1)), albedo=0.5))
        >>> lamp = Lamp((0, 0, 2), (0, 1, 0), (1, 0, 0), count=4, even=True)
        >>> camera = pinhole((0.0, -2.0, 2.0), (0.0, 0.0, 0.0))
        >>> found, index = Renderer(World(camera, floor, lamps=(lamp,))).pixels(np.zeros((1, 2)))
        >>> index.tolist(), bool(found.value[0] > 0.05)
        ([0], True)
    """

    def __init__(self, world: World):
        _check_camera(world.camera)
        if world.scene is not None:
            check_kind("scene", world.scene, Scene)
        if isinstance(world.lamps, Lamp):
            raise TypeError("Argument `lamps` must be a tuple of lamps: write (lamp,).")
        if world.scene is None and not world.models:
            raise ValueError("Argument `world` must have a shape or a model, but has none.")
        if not world.lamps and world.sky is None:
            raise ValueError("Argument `world` must have a lamp or a sky, but has none.")
        if world.normals is not None and len(world.normals) != len(world.models):
            raise ValueError(
                f"Argument `normals` must have one entry for each of {len(world.models)} models, "
                f"but has {len(world.normals)}."
            )
        self.world = world
        self.lights = self.lights_of(0)
        self._models = None
        if world.models:
            self._models = TracedModels(world.models, world.normals, world.shapes)
        rows = [] if world.scene is None else [world.scene.material]
        rows += [primitive(sphere((0, 0, 0), 1.0), **m.material).material for m in world.models]
        self._material: Material = joined(rows)
        lamps = [primitive(_shade_of(lamp)) for lamp in world.lamps]
        self._lamps = Scene.of(*lamps) if lamps else None
        self.bands = bands_of(world.scene, self._material, self.lights, world.finish)

    def __repr__(self) -> str:
        return f"Renderer({self.world!r})"

    def lights_of(self, number: int) -> tuple[Light, ...]:
        """The light as a pass of the image sees it: even nodes, moved within their cells.

        Args:
            number: of the pass; nodes of 0 stand in the middles, of 1 and 2 (and on) opposite.
        """
        # The most irrational pair of numbers fills a cell evenly; what is odd cancels in pairs.
        step = (number + 1) // 2 * np.array([0.7548776662466927, 0.5698402909980532])
        shift = (np.modf(0.5 + step)[0] - 0.5) * (1 if number % 2 else -1)
        lights: list[Any] = [
            eqx.tree_at(lambda a: a.shift, lamp, jnp.asarray(shift)) if lamp.even else lamp
            for lamp in self.world.lamps
        ]
        if (world := self.world).sky is not None:
            lights.append(sky_light(world.sky, world.sky_nodes, world.sky_rows, tuple(shift)))
        return tuple(lights)

    # --- what is seen ----------------------------------------------------------------------------

    def seen(self, p: Float[np.ndarray, "n 2"]) -> TileHits:
        """First hits of the primary rays of image coordinates."""
        world, p = self.world, np.asarray(p, float)
        index, face = np.full(len(p), -1), np.full(len(p), -1)
        t = np.full(len(p), np.inf)
        eye = np.asarray(world.camera.eye)
        d = host_blocks(lambda q: programs.directions(world.camera, q), p, RAYS)

        def closer(scene, first, ahead=1.0):
            far, number = host_blocks(lambda w: programs.met(scene, eye, w), d, RAYS)
            here = far < ahead * t
            index[here], t[here] = number[here] + first, far[here]

        if world.scene is not None:
            closer(world.scene, 0)
        if self._models is not None:
            far, met, number = self._models.seen_from(eye, d)
            here = far < t
            face[here], t[here], index[here] = met[here], far[here], number[here]
        if self._lamps is not None:
            before = index.copy()
            # One that is drawn on a wall is seen, and not the wall.
            closer(self._lamps, self._first_lamp, 1.0 + tie(d.dtype))
            face[index != before] = -1
        return TileHits(index, face, t)

    # --- what it sends ---------------------------------------------------------------------------

    def pixels(
        self,
        p: Float[np.ndarray, "n 2"],
        *,
        seen: TileHits | None = None,
        shadows: bool = True,
        gradients: bool = True,
        lights: Sequence[Light] | None = None,
    ) -> tuple[ShadedPixels, Int[np.ndarray, " n"]]:
        """Pixels at image coordinates, and what each shows; zeros for lamps and for the sky.

        Args:
            p: image coordinates.
            seen: what they show, if that is known.
            shadows: whether rays are traced to the lights.
            gradients: whether more than the value is wanted; the rest is zero if not.
            lights: those of pass 0, if left out.

        Raises:
            ValueError: if a coordinate is not finite.
        """
        p = np.asarray(p, float)
        check_finite("p", p)
        seen = self.seen(p) if seen is None else seen
        lights = self.lights if lights is None else tuple(lights)
        lit = np.flatnonzero((seen.index >= 0) & (seen.index < self._first_lamp))
        found = shade_rows(
            lambda *block: self._shaded(*block, lights, shadows, gradients),
            (p, seen.index, seen.face),
            lit,
            BLOCK,
            self.bands,
            ABREAST,
        )
        return found, seen.index

    def radiance(
        self,
        p: Float[np.ndarray, "n 2"],
        *,
        seen: TileHits | None = None,
        gradients: bool = True,
        lights: Sequence[Light] | None = None,
    ) -> PixelRadiance:
        """Radiance of pixels and its image gradient, shadows in motion, and no terms of it.

        What `value` and `gradient + edges` of `pixels` are, for meshes under lamps at a fraction
        of the time; depths of blockers are in single precision. Where there are analytic shapes or
        a sky whose nodes turn with the surface, `pixels` is asked.

        Args:
            p: image coordinates.
            seen: what they show, if that is known.
            gradients: whether the gradient is wanted.
            lights: those of pass 0, if left out.

        Raises:
            ValueError: if a coordinate is not finite.
        """
        p = np.asarray(p, float)
        check_finite("p", p)
        seen = self.seen(p) if seen is None else seen
        lights = self.lights if lights is None else tuple(lights)
        if self.world.shapes or any(isinstance(one, CosineSkyLight) for one in lights):
            found, _ = self.pixels(p, seen=seen, gradients=gradients, lights=lights)
            slope = np.asarray(found.gradient + found.edges) if gradients else None
            return PixelRadiance(np.asarray(found.value), slope, seen.index)
        rows = np.flatnonzero(seen.face >= 0)
        shape = (len(p),) if self.bands is None else (len(p), self.bands)
        value, slope = np.zeros(shape), np.zeros((*shape, 2)) if gradients else None
        if len(rows):
            value[rows], *more = self._radiance(p[rows], seen, rows, lights, gradients)
            if slope is not None:
                (slope[rows],) = more
        return PixelRadiance(value, slope, seen.index)

    def _radiance(self, p, seen: TileHits, rows, lights, gradients: bool) -> tuple:
        """Radiance of pixels of models, and its gradient."""
        assert self._models is not None
        world, face = self.world, seen.face[rows]
        d = host_blocks(lambda q: programs.directions(world.camera, q), p, RAYS)
        x = np.asarray(world.camera.eye) + seen.distance[rows, None] * d
        up = self._models.normals_against(face, d)
        light = MeshLight(programs.interactions, self._models.embree, lights)
        return light.pixels(self._fixed, (p, seen.index[rows], face), x, up, gradients)

    @property
    def _first_lamp(self) -> int:
        """Number of the first lamp among the primitives."""
        return self.world.shapes + len(self.world.models)

    @property
    def _facets(self) -> Facets | None:
        """Faces of all models."""
        return None if self._models is None else self._models.facets

    @property
    def _fixed(self) -> tuple:
        """Arguments of `_programs.interactions` that stand before the pixels."""
        world = self.world
        return world.scene, self._facets, self._material, world.camera, world.finish

    def _shaded(self, p, index, face, lights, shadows: bool, gradients: bool) -> ShadedPixels:
        """Shading of one block."""
        world = self.world
        at = programs.looked_at((*self._fixed, p, index, face))
        hidden = None
        if shadows:
            hidden = [None] * len(lights)
            if world.scene is not None:
                hidden = programs.shares(at, world.scene, lights)
            if self._models is not None:
                hidden = self._hidden(self._models, at, lights, hidden, gradients)
        run = programs.pixels if gradients else programs.values
        return run(at, lights, hidden)

    @staticmethod
    def _hidden(
        models: TracedModels, at: programs.LookedAt, lights: Sequence[Light], by_shapes, depths
    ):
        """Share of the way at which something hides nodes, infinity where nothing does."""
        x, up = np.asarray(at.point.position), np.asarray(at.up)
        found = []
        for light, (way, lit), share in zip(
            lights, programs.ways(at, lights), by_shapes, strict=True
        ):
            way, lit = np.asarray(way), np.asarray(lit)
            share = np.full(lit.shape, np.inf) if share is None else np.array(share)
            found.append(models.hidden(x, up, way, lit, share, light, depths))
        return found

    def layers(self, p: Float[np.ndarray, "n 2"], number: int = 0) -> dict[str, np.ndarray]:
        """All quantities of pixels by name, as an EXR file has them.

        `value` and `grad.u`, `grad.v` (per unit of the image), `shadow.u`, `shadow.v` (the part of
        the gradient that moving shadows make), R07's `SV`, `DV`, `CV`, `CDV` of both lobes and,
        with `.diffuse` and `.glossy`, apart; `index` and `distance`. What depends on light has a
        last axis of bands, if there are any.

        Args:
            p: image coordinates.
            number: of the pass.
        """
        seen = self.seen(p)
        found, index = self.pixels(p, seen=seen, lights=self.lights_of(number))
        value, gradient = np.array(found.value), np.asarray(found.gradient + found.edges)
        shadow = np.asarray(found.edges)
        lamps = index >= self._first_lamp
        if np.any(lamps):
            value[lamps] = self._emitted(p[lamps], index[lamps])
        sky = index < 0
        if np.any(sky) and self.world.sky is not None:
            L, slope = host_blocks(
                lambda q: programs.sky_of(self.world.sky, self.world.camera, q), p[sky], RAYS
            )
            alone = L.ndim < value.ndim  # a sky without bands is the same in all
            value[sky], gradient[sky] = (L[:, None], slope[:, None]) if alone else (L, slope)
        layers: dict[str, np.ndarray] = {
            "value": value,
            "grad.u": gradient[..., 0],
            "grad.v": gradient[..., 1],
        }
        layers |= {"shadow.u": shadow[..., 0], "shadow.v": shadow[..., 1]}
        for name in ("SV", "DV", "CV", "CDV"):
            both = np.asarray(getattr(found, name))
            layers |= {name: both.max(-1) if name == "CV" else both.sum(-1)}
            layers |= {f"{name}.diffuse": both[..., 0], f"{name}.glossy": both[..., 1]}
        far = np.where(np.isfinite(seen.distance), seen.distance, 0.0)
        layers |= {"cosine": np.asarray(found.cosine), "curvature": np.asarray(found.curvature)}
        return layers | {"index": index.astype(float), "distance": far}

    def _emitted(self, p, index) -> np.ndarray:
        """Emission of lamps, from their fronts."""
        first = self._first_lamp
        d = host_blocks(lambda q: programs.directions(self.world.camera, q), p, RAYS)
        lamps = self.world.lamps
        normal = np.array([np.cross(lamp.u, lamp.v) for lamp in lamps])[index - first]
        shape = () if self.bands is None else (self.bands,)
        radiance = np.array([np.broadcast_to(lamp.radiance, shape) for lamp in lamps])
        front = np.sum(d * normal, -1) < 0.0
        return np.where(front.reshape(-1, *(1,) * len(shape)), radiance[index - first], 0.0)


def _shade_of(lamp: Lamp) -> Rectangles:
    u, v = np.asarray(lamp.u), np.asarray(lamp.v)
    n = np.cross(u, v)
    axes = np.stack([u, v, n / np.linalg.norm(n)], -1)
    return Rectangles(jnp.asarray(lamp.center)[None], jnp.asarray(axes)[None])
