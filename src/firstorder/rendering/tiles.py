"""Resumable rendering, tile by tile and pass by pass: finished tiles are kept.

Each tile of each pass is a file that is there whole or not at all. The same call with the same
folder takes what it finds and makes the rest; since every tile is made from its places and the
number of its pass alone, the image is the same to the bit, interrupted or not, with the same
settings of the compiler (`session.settings`). These stand in the folder's `job.json`; tiles are
taken as they are, but none is added with other settings.

A tile that a full disk or a power cut has damaged is renamed to `....npz.damaged` and made anew.
Damage is what the file itself tells, by its checksums and shapes: NaN and infinity may be answers.
"""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from firstorder import session
from firstorder._argument_checks import check_count
from firstorder.io._damage import set_aside
from firstorder.io._locks import at_work
from firstorder.io._parts import sweep_parts
from firstorder.io.files import write_json, write_npz
from firstorder.rendering._distant import tiles_by_workers

Layers = dict[str, Float[np.ndarray, "w h *bands"]]
Shade = Callable[[Float[np.ndarray, "n 2"], int], Mapping[str, np.ndarray]]

JOB = "job.json"


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
    scheduler: str | None = None,
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
        scheduler: address of a scheduler of `dask.distributed` whose workers make the tiles, as in
            `jobs.run_jobs`; `shade` travels to them, and tiles come back and are written here.

    Returns:
        Layers by name, first axis across.

    Raises:
        TypeError: if `shade` gives no arrays by name.
        ValueError: if one of these has not one row a place; if the folder holds tiles of another
            image, or of one that its `job.json` does not tell, or if some are missing and the
            others were made with other settings of the compiler; with a scheduler, as
            `jobs.run_jobs`.

    Example:
        >>> import tempfile
        >>> from firstorder.rendering import render_tiles
        >>> ramp = lambda p, k: {"value": p[:, 0] + k}
        >>> render_tiles(ramp, 3, 1, tempfile.mkdtemp(), passes=2)["value"].ravel().tolist()
        [1.0, 2.0, 3.0]
    """
    for name, number in (("width", width), ("height", height), ("side", side), ("passes", passes)):
        check_count(name, number)
    folder = pathlib.Path(folder)
    differing = _claim(folder, dict(width=width, height=height, side=side, key=key))
    parts = list(_tiles(width, height, side))
    jobs = {
        folder / f"pass{number:04d}_tile{k:05d}.npz": (tile, number)
        for number in range(passes)
        for k, tile in enumerate(parts)
    }
    elsewhere = {f: job for f, job in jobs.items() if scheduler and not f.exists()}
    if elsewhere:
        _refuse_other_settings(folder, differing)
    arriving = tiles_by_workers(_layers, shade, elsewhere, scheduler)
    quiet = not sys.stderr.isatty() if quiet is None else quiet
    sums: Layers = {}
    progress = tqdm(total=passes * len(parts), unit="tile", disable=quiet)
    with progress, contextlib.closing(arriving):
        for file, (tile, number) in jobs.items():
            while not file.exists() and next(arriving, None) is not None:
                pass
            found = _kept(file, tile)
            if found is None:
                _refuse_other_settings(folder, differing)
                found = _made(file, shade, tile, number)
            for name, values in found.items():
                whole = sums.setdefault(name, np.zeros((width, height, *values.shape[2:])))
                whole[tile.left : tile.right, tile.low : tile.high] += values
            progress.update()
            if after_pass is not None and tile is parts[-1]:
                after_pass({name: a / (number + 1) for name, a in sums.items()}, number)
    return {name: a / passes for name, a in sums.items()}


def _claim(folder: pathlib.Path, job: dict[str, Any]) -> str:
    """Record whose tiles these are, or check that they are this image's.

    Removes what killed programs were writing; another one may be at work in the folder right now.

    Returns:
        In which settings of the compiler the tiles differ from what would be made now, in words.
    """
    now = {**session.settings(), "device": jax.default_backend()}
    with at_work(folder / JOB, {**job, **now}):  # of two that begin at once, one is the first
        known = _known(folder)
        if known is None:
            write_json(folder / JOB, {**job, "made_with": now})
            return ""
    if other := ", ".join(k for k in job if known.get(k) != job[k]):
        raise ValueError(
            f"Argument `folder` must be empty or hold tiles of this image, but {folder.name} "
            f"holds those of another one ({other} differ)."
        )
    sweep_parts(folder, r"pass\d+_tile\d+", ".npz")
    return session.differing(known.get("made_with", now), now)  # older ones do not say


def _known(folder: pathlib.Path) -> dict[str, Any] | None:
    """The job whose tiles lie in a folder; None where there are no tiles, or no folder."""
    file = folder / JOB
    try:
        known = json.loads(file.read_text(encoding="utf-8"))
        if isinstance(known, dict) and isinstance(known.get("made_with", {}), dict):
            return known
        reason = "damaged"
    except FileNotFoundError:
        reason = "missing"
    except ValueError:  # no JSON, or not even text
        reason = "damaged"
    if any(folder.glob("pass*_tile*.npz")):
        raise ValueError(
            f"{file} is {reason}, so nothing tells whose tiles these are: delete the folder "
            f"{folder.name} and render again, or choose another one."
        )
    if reason == "damaged":
        warnings.warn(set_aside(file, "it is no JSON object"), stacklevel=4)
    return None


def _refuse_other_settings(folder: pathlib.Path, differing: str) -> None:
    if differing:
        raise ValueError(
            "Argument `folder` must hold all tiles, or tiles made with the same settings of the "
            f"compiler, but some are missing in {folder.name} and the others differ ({differing}): "
            "set these as they were, or choose another folder."
        )


def _kept(file: pathlib.Path, tile: _Tile) -> dict[str, np.ndarray] | None:
    """A tile from its file; None where there is none, or a damaged one that is set aside."""
    try:
        with file.open("rb") as opened, np.load(opened) as kept:
            found = {name: kept[name] for name in kept.files}
    except FileNotFoundError:
        return None
    except (OSError, MemoryError):  # the system's trouble, and not the file's
        raise
    except Exception:  # what zipfile, zlib and NumPy say of broken files is of many kinds
        reason = "it is no whole NPZ file"
    else:
        if found and all(v.dtype == float and v.shape[:2] == tile.shape for v in found.values()):
            return found
        reason = f"it does not hold numbers of {tile.shape[0]} by {tile.shape[1]} pixels"
    warnings.warn(set_aside(file, reason), stacklevel=3)
    return None


def _made(file: pathlib.Path, shade: Shade, tile: _Tile, number: int) -> dict[str, np.ndarray]:
    """A tile, made and kept."""
    found = _layers(shade, tile, number)
    write_npz(file, found)
    return found


def _layers(shade: Shade, tile: _Tile, number: int) -> dict[str, np.ndarray]:
    """A tile, made."""
    made = shade(tile.places, number)
    if not isinstance(made, Mapping):
        raise TypeError(
            f"Argument `shade` must give arrays by layer's name, but gives a {type(made).__name__}."
        )
    found = {k: np.asarray(v, float) for k, v in made.items()}
    count = tile.shape[0] * tile.shape[1]
    for name, values in found.items():
        if values.shape[:1] != (count,):
            raise ValueError(
                f"Argument `shade` must give a row for each of {count} places, but its layer "
                f"{name!r} has shape {values.shape}."
            )
    return {k: v.reshape(*tile.shape, *v.shape[1:]) for k, v in found.items()}
