"""Resumable rendering, tile by tile and pass by pass: finished tiles are kept.

Each tile of each pass is a file that is there whole or not at all. The same call with the same
folder takes what it finds and makes the rest; since every tile is made from its places and the
number of its pass alone, the image is the same to the bit, interrupted or not.
"""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from firstorder._argument_checks import check_positive
from firstorder.io.files import write_json, write_npz

Layers = dict[str, Float[np.ndarray, "w h *bands"]]
Shade = Callable[[Float[np.ndarray, "n 2"], int], Mapping[str, np.ndarray]]

JOB = "job.json"
ABANDONED = 60.0  # seconds after which nobody is still writing a tile


class _Tile(NamedTuple):
    """A rectangle of pixels, from the first column and row to those after the last."""

    left: int
    low: int
    right: int
    high: int

    @property
    def places(self) -> Float[np.ndarray, "n 2"]:
        """Centres of its pixels [pixels]; rows vary fastest."""
        x, y = np.arange(self.left, self.right) + 0.5, np.arange(self.low, self.high) + 0.5
        return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)

    @property
    def shape(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.right - self.left, self.high - self.low


def _tiles(width: int, height: int, side: int) -> Iterator[_Tile]:
    """Tiles that cover an image, those at its border smaller.

    Example:
        >>> from firstorder.rendering.tiles import _tiles
        >>> [t.shape for t in _tiles(5, 2, 3)]
        [(3, 2), (2, 2)]
    """
    for left in range(0, width, side):
        for low in range(0, height, side):
            yield _Tile(left, low, min(left + side, width), min(low + side, height))


def render_tiles(
    shade: Shade,
    width: int,
    height: int,
    folder: str | os.PathLike[str],
    *,
    side: int = 64,
    passes: int = 1,
    key: str = "",
    after_pass: Callable[[Layers, int], None] | None = None,
    quiet: bool | None = None,
) -> Layers:
    """Mean over passes of an image, resumed where an earlier call was ended.

    Args:
        shade: from centres of pixels and the number of the pass to numbers by layer, one a place,
            or a row of bands.
            It must depend on nothing else: random numbers come from the pass.
        width: of the image [pixels].
        height: of the image [pixels].
        folder: for the tiles; of this image alone.
        side: of a tile [pixels].
        passes: over the image.
        key: what else the image depends on, in words; a folder of another key is refused.
        after_pass: called with the mean so far when a pass is finished, to look at.
        quiet: whether to show no progress; by default it is shown on a terminal.

    Returns:
        Layers by name, first axis across.

    Raises:
        ValueError: if the folder holds tiles of another image.

    Example:
        >>> import tempfile
        >>> from firstorder.rendering.tiles import render_tiles
        >>> ramp = lambda p, k: {"value": p[:, 0] + k}
        >>> render_tiles(ramp, 3, 1, tempfile.mkdtemp(), passes=2)["value"].ravel().tolist()
        [1.0, 2.0, 3.0]
    """
    for name, number in (("width", width), ("height", height), ("side", side), ("passes", passes)):
        check_positive(name, number)
    folder = pathlib.Path(folder)
    _claim(folder, dict(width=width, height=height, side=side, key=key))
    parts = list(_tiles(width, height, side))
    quiet = not sys.stderr.isatty() if quiet is None else quiet
    sums: Layers = {}
    with tqdm(total=passes * len(parts), unit="tile", disable=quiet) as progress:
        for number in range(passes):
            for k, tile in enumerate(parts):
                found = _made(folder / f"pass{number:04d}_tile{k:05d}.npz", shade, tile, number)
                for name, values in found.items():
                    whole = sums.setdefault(name, np.zeros((width, height, *values.shape[2:])))
                    whole[tile.left : tile.right, tile.low : tile.high] += values
                progress.update()
            if after_pass is not None:
                after_pass({name: a / (number + 1) for name, a in sums.items()}, number)
    return {name: a / passes for name, a in sums.items()}


def _claim(folder: pathlib.Path, job: dict) -> None:
    """Record whose tiles these are, or check that they are this image's.

    Removes what a killed program was writing; another one may be at work in the folder right now.
    """
    file = folder / JOB
    if not file.exists():
        write_json(file, job)
    elif (known := json.loads(file.read_text(encoding="utf-8"))) != job:
        other = ", ".join(k for k in job if known.get(k) != job[k])
        raise ValueError(
            f"Argument `folder` must be empty or hold tiles of this image, but {file.parent.name} "
            f"holds those of another one ({other} differ)."
        )
    for part in folder.glob(".pass*.npz"):
        with contextlib.suppress(FileNotFoundError):
            if time.time() - part.stat().st_mtime > ABANDONED:
                part.unlink()


def _made(file: pathlib.Path, shade: Shade, tile: _Tile, number: int) -> dict[str, np.ndarray]:
    """A tile from its file, or made and kept."""
    if not file.exists():
        found = shade(tile.places, number)
        found = {k: np.asarray(v, float) for k, v in found.items()}
        write_npz(file, {k: v.reshape(*tile.shape, *v.shape[1:]) for k, v in found.items()})
    with np.load(file) as kept:
        return {name: kept[name] for name in kept.files}
