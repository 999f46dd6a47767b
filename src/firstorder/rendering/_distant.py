"""Tiles that workers make: what travels is the bytes of a tile's file, and only this side writes.

So workers need no folder in common, a tile is there whole or not at all however workers end, and
one that is made twice is the same file.
"""

from __future__ import annotations

import dataclasses
import io
import pathlib
from collections.abc import Callable, Generator, Mapping
from typing import Any

import numpy as np

from firstorder.io.files import _pack_npz, atomic_write
from firstorder.jobs.running import run_jobs


@dataclasses.dataclass(frozen=True)
class _Packed:
    """Makes tiles and packs them as files of NPZ; the same object for all tiles of a worker."""

    layers: Callable[..., Mapping[str, np.ndarray]]
    shade: Any

    def __call__(self, job: tuple[Any, int]) -> bytes:
        file = io.BytesIO()
        _pack_npz(file, self.layers(self.shade, *job))
        return file.getvalue()


def tiles_by_workers(
    layers: Callable[..., Mapping[str, np.ndarray]],
    shade: Any,
    missing: Mapping[pathlib.Path, tuple[Any, int]],
    scheduler: str | None,
) -> Generator[pathlib.Path]:
    """Files of tiles as they are written, in any order.

    Args:
        layers: of the shading function, a tile and the number of the pass, to arrays by name.
        shade: the shading function, which travels.
        missing: tiles and numbers of their passes, by file.
        scheduler: address of a scheduler; only where nothing is missing there may be none.
    """
    files = list(missing)
    jobs = list(missing.values())
    for number, made in run_jobs(_Packed(layers, shade), jobs, scheduler=scheduler):
        with atomic_write(files[number]) as part:
            part.write_bytes(made)
        yield files[number]
