"""Antialiased images: the mean of several places in each pixel, with what it may be off by."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_count, check_integer
from firstorder._display import in_print
from firstorder.numerics._batching import host_blocks
from firstorder.rendering._programs import sky_of
from firstorder.rendering.image_files import image_coordinates
from firstorder.rendering.renderer import RAYS, Renderer
from firstorder.rendering.tiles import render_tiles


class Antialiased(NamedTuple):
    """An image with its error.

    Attributes:
        value: mean over the places in each pixel, the box filter [W/(m^2 sr)].
        error: standard error of that mean as if places were independent. They are stratified, so
            that it is too large rather than too small: over many silhouettes some twice the true
            one. Zero where all places send the same.
    """

    value: Float[np.ndarray, "w h *bands"]
    error: Float[np.ndarray, "w h *bands"]

    __repr__ = in_print


def subpixels(rows: int = 2) -> Float[np.ndarray, "n 2"]:
    """Places in a pixel: one in each of `rows` x `rows` cells, no two in one column or row.

    Cell (i, j) has its place at `((i + (j + 1/2) / k) / k, (j + 1 - (i + 1/2) / k) / k)`, a square
    lattice turned a little, so that an edge along the axes meets k^2 steps of grey and not k.

    Args:
        rows: k, positive.

    Reference: K. Chiu, P. Shirley, C. Wang, "Multi-jittered sampling", Graphics Gems IV, 1994.

    Raises:
        ValueError: if `rows` is no positive integer.

    Example:
        >>> from firstorder.rendering import subpixels
        >>> subpixels(2).tolist()
        [[0.125, 0.375], [0.375, 0.875], [0.625, 0.125], [0.875, 0.625]]
    """
    check_count("rows", rows)
    i, j = np.divmod(np.arange(rows**2), rows)
    return np.stack([i + (j + 0.5) / rows, j + 1.0 - (i + 0.5) / rows], -1) / rows


def antialiased(
    made: Renderer,
    width: int,
    height: int,
    folder: str | os.PathLike[str],
    *,
    rows: int = 2,
    side: int = 128,
    key: str = "",
    quiet: bool | None = None,
) -> Antialiased:
    """Render an image with several places in each pixel, by tiles that are kept.

    Each place sees other nodes of the lights (`Renderer.lights_of`), so that steps in soft shadows
    are averaged too. Killed at any time, the same call goes on (`rendering.render_tiles`).

    Args:
        made: the renderer.
        width: of the image [pixels].
        height: of the image [pixels].
        folder: for the tiles; of this image alone.
        rows: of places in a pixel, which has `rows`^2 of them; at least 2.
        side: of a tile [pixels].
        key: what is rendered, in words: a folder of another key is refused.
        quiet: as in `rendering.render_tiles`.

    Raises:
        ValueError: if `rows` is below 2, or the folder holds another image.

    Example:
        >>> import tempfile
        >>> from firstorder.imaging import Lamp, pinhole
        >>> from firstorder.rendering import Renderer, World, antialiased
        >>> from firstorder.space.library import sphere_over_plane
        >>> lamp = Lamp((0, 0, 3), (0, 1, 0), (1, 0, 0), count=2, even=True)
        >>> camera = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.5))
        >>> world = World(camera, sphere_over_plane(), lamps=(lamp,))
        >>> antialiased(Renderer(world), 4, 3, tempfile.mkdtemp()).value.shape
        (4, 3)
    """
    check_integer("rows", rows)
    if rows < 2:
        raise ValueError(f"Argument `rows` must be at least 2, but is {rows}.")
    places = subpixels(rows)
    count = len(places)

    def shade(p, number):
        p = image_coordinates(p + places[number] - 0.5, width, height)
        value = _seen_radiance(made, p, number)
        return {"value": value, "square": value**2}

    key = f"{key} rows={rows}"
    got = render_tiles(
        shade, width, height, folder, side=side, passes=count, key=key, quiet=quiet
    )  # fmt: skip
    spread = got["square"] - got["value"] ** 2
    rounding = 4.0 * count * np.finfo(float).eps * got["square"]  # of two sums of so many squares
    spread = np.where(spread > rounding, spread, 0.0)
    return Antialiased(got["value"], np.sqrt(spread / (count - 1)))


def _seen_radiance(made: Renderer, p, number: int) -> np.ndarray:
    """Radiance alone, lamps and sky included, as a pass sees it."""
    seen = made.seen(p)
    found, index = made.pixels(p, seen=seen, gradients=False, lights=made.lights_of(number))
    value, world = np.array(found.value), made.world
    lamps, sky = index >= world.shapes + len(world.models), index < 0
    if np.any(lamps):
        value[lamps] = made._emitted(p[lamps], index[lamps])
    if np.any(sky) and world.sky is not None:
        L = host_blocks(lambda q: sky_of(world.sky, world.camera, q), p[sky], RAYS)[0]
        value[sky] = L[:, None] if L.ndim < value.ndim else L
    return value
