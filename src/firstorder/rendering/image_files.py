"""Rendering of whole images to files: resumable tiles, layers in an EXR file, and a picture."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_count
from firstorder.imaging._lamps import Lamp
from firstorder.io._locks import at_work
from firstorder.io.exr import _writer, write_layers
from firstorder.io.scenes._surface_maps import MapSet, surface_maps_of
from firstorder.io.scenes.space_toml import SpaceFile
from firstorder.rendering.renderer import Renderer, World
from firstorder.rendering.tiles import render_tiles
from firstorder.scene._arguments import check_kind
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import KINDS, Rectangles, Shape
from firstorder.space.skies import ConstantSky


def image_coordinates(p: Float[np.ndarray, "n 2"], width: int, height: int):
    """Image coordinates of places in pixels: u from -1 to 1 across, v as long a unit upwards.

    Args:
        p: places, the first pixel's corner at zero [pixels].
        width: of the image [pixels].
        height: of the image [pixels].

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering import image_coordinates
        >>> image_coordinates(np.array([[0.0, 0.0], [4.0, 2.0]]), 4, 2).tolist()
        [[-1.0, -0.5], [1.0, 0.5]]
    """
    return (2.0 * np.asarray(p, float) - (width, height)) / width


def render_to_files(
    world: World,
    width: int,
    height: int,
    folder: str | os.PathLike[str],
    *,
    passes: int = 1,
    side: int = 64,
    key: str = "",
    out: str | os.PathLike[str] | None = None,
    quiet: bool | None = None,
    scheduler: str | None = None,
) -> dict[str, Float[np.ndarray, "w h *bands"]]:
    """Render a whole image by tiles that are kept: killed at any time, the same call goes on.

    After every pass the picture so far is written. Several programs may render the same image at
    once and share the work. The image is the same to the bit with the same settings of the
    compiler (`session.settings`), which the folder's `job.json` keeps.

    Args:
        world: what is seen.
        width: of the image [pixels].
        height: of the image [pixels].
        folder: for the tiles; of this image alone.
        passes: over the image, each with other nodes of the light.
        side: of a tile [pixels].
        key: what the world is, in words: a folder of another key is refused.
        out: an .exr file for all layers; a tone-mapped .png is written beside it, in colour if
            there are three bands, and none if there is another number of them.
        quiet: as in `rendering.tiles.render_tiles`.
        scheduler: the same; the world travels, so workers need no files of the scene.

    Returns:
        Layers by name (`Renderer.layers`), the mean over passes; bands, if any, in a last axis.

    Raises:
        ValueError: if the folder holds tiles of another image (`rendering.render_tiles`), `out` is
            no .exr file, or another program is rendering to it with other settings.
    """
    for name, number in (("width", width), ("height", height)):
        check_count(name, number)
    if out is not None:
        _writer(out)
    shade = _Shade(world, width, height)
    if scheduler is None:
        shade.renderer  # noqa: B018 (what is wrong with the world is said before a folder is made)

    def show(layers, number):
        if out is not None:
            _write_image(out, layers)

    about = dict(width=width, height=height, side=side, passes=passes, key=key)
    with contextlib.nullcontext() if out is None else at_work(out, about):
        return render_tiles(
            shade, width, height, folder, side=side, passes=passes, key=key, after_pass=show,
            quiet=quiet, scheduler=scheduler,
        )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class _Shade:
    """Layers of an image's pixels, here or on a worker, where the renderer is built anew."""

    world: World
    width: int
    height: int

    @functools.cached_property
    def renderer(self) -> Renderer:
        return Renderer(self.world)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "renderer"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    def __call__(self, places: Float[np.ndarray, "n 2"], number: int) -> dict[str, np.ndarray]:
        return self.renderer.layers(image_coordinates(places, self.width, self.height), number)


def _write_image(path: str | os.PathLike[str], layers: Mapping[str, np.ndarray]) -> None:
    """Write layers as an .exr file, and `value` as a picture of the same name beside it.

    Args:
        path: ends in .exr.
        layers: by name, first axis across; `value` among them. Without three bands that are red,
            green and blue, or a single one, there is no picture.
    """
    from firstorder.plotting.pictures import write_png

    write_layers(path, layers)
    if layers["value"].shape[2:] in ((), (3,)):
        write_png(pathlib.Path(path).with_suffix(".png"), layers["value"])


def world_from_scene(
    space: SpaceFile, nodes: int = 12, sky_rows: int = 12, sky_nodes: str = "even"
) -> World:
    """World of a scene file, ready to render: rectangles that emit become lamps.

    Args:
        space: as `io.read_space` gives it.
        nodes: of a lamp, along each edge.
        sky_rows: of the sky's nodes.
        sky_nodes: where they stand, as in `World`.

    Raises:
        ValueError: if there is no camera, or something emits that is no rectangle or has surface
            maps.

    Example:
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.io import SpaceFile
        >>> from firstorder.rendering import world_from_scene
        >>> camera = pinhole((0.0, -2.0, 2.0), (0.0, 0.0, 0.0))
        >>> world_from_scene(SpaceFile((), sky=0.5, camera=camera)).sky_rows
        12
    """
    check_kind("space", space, SpaceFile)
    if space.camera is None:
        raise ValueError("Argument `space` must have a camera to be rendered, but has none.")
    lamps, things, worn = [], [], []
    coats = space.coats or (MapSet(),) * (len(space.things) + len(space.models))
    for one, coat in zip(space.things, coats, strict=False):
        L = np.asarray(one.material.emission)
        if not np.any(L):
            things.append(one)
            worn.append(coat)
            continue
        if coat.names:
            raise ValueError(
                "Argument `space` must have lamps without textures, bumps and normal maps, "
                f"but {one.name or 'one of them'!r} has some."
            )
        if not isinstance(one.shape, Rectangles) or np.any(L[:, 1]):
            raise ValueError(
                "Argument `space` must have lamps that are rectangles which emit from their "
                f"fronts, but {one.name or 'one of them'!r} is another."
            )
        for center, axes, (front, _) in zip(one.shape.center, one.shape.axes, L, strict=True):
            u, v = axes[:, 0], axes[:, 1]
            if np.linalg.det(axes) < 0.0:  # a front is on the side of the third axis
                u, v = v, u
            lamps.append(Lamp(center, u, v, front, nodes, True))
    if any(np.any(np.asarray(m.material.get("emission", 0.0))) for m in space.models):
        raise ValueError("Argument `space` must have meshes that do not emit, but one does.")
    sky = space.sky
    if not callable(sky):
        sky = ConstantSky(sky) if np.any(np.asarray(sky) > 0.0) else None
    scene = Scene.of(*things) if things else None
    own = _numbers([thing.shape for thing in things], len(space.models))
    finish = surface_maps_of(list(zip(own, [*worn, *coats[len(space.things) :]], strict=True)))
    return World(space.camera, scene, space.models, tuple(lamps), sky, sky_rows, sky_nodes, finish)


def _numbers(shapes: Sequence[Shape], models: int) -> list[tuple[int, ...]]:
    """Numbers of some shapes, as a scene counts them, kind by kind; and then of models."""
    found, first = {}, 0
    for kind in KINDS:
        for k, shape in enumerate(shapes):
            if isinstance(shape, kind):
                found[k] = tuple(range(first, first + shape.count))
                first += shape.count
    return [*(found[k] for k in range(len(shapes))), *((first + k,) for k in range(models))]


def scene_fingerprint(space: SpaceFile) -> str:
    """Letters that change with any number or kind in a scene, files that it names included.

    Args:
        space: as `io.read_space` gives it.

    Example:
        >>> from firstorder.rendering import scene_fingerprint
        >>> from firstorder.io import SpaceFile
        >>> scene_fingerprint(SpaceFile((), sky=0.5)) == scene_fingerprint(SpaceFile((), sky=0.6))
        False
    """
    things = [(t.shape, t.name, t.material) for t in space.things]
    models = [(m.mesh.vertices, m.mesh.faces, m.name, m.material, m.uv) for m in space.models]
    whole = things, models, space.sky, space.camera, space.coats
    # Of what kind a shape, a sky or a map is, or whether a picture repeats, is no number.
    found = hashlib.sha256(str(jax.tree.structure(whole)).encode())
    for leaf in jax.tree.leaves(whole):
        a = np.asarray(leaf)
        found.update(f"{a.dtype} {a.shape} ".encode() + a.tobytes())
    return found.hexdigest()[:16]
