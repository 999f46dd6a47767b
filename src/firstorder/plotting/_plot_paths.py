"""Paths as strips of portraits, over windows that hold the light of all their steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from firstorder.errors import Refused
from firstorder.fields import Field, Grid
from firstorder.plotting._axes import check_one_of_numbers
from firstorder.plotting._plot_light import _batch_of, _checked
from firstorder.plotting._windows import frequencies_of, window_of
from firstorder.plotting.path_portraits import ROWS, portrait_strip, portraits
from firstorder.plotting.style import house_style
from firstorder.transport import Path

SIZE = 96  # samples along both axes; even, so that none lies in the middle


def plot_path(path: Path, window: Grid | None = None, rows: Sequence[str] = ROWS) -> Figure:
    """A column for each step; steps over the same coordinates have the same axes."""
    check_one_of_numbers("path", path, "path", lambda path: _batch_of(path.source))
    steps, words = path.steps, ["source", *(type(event).__name__ for event in path.events)]
    for k, (field, word) in enumerate(zip(steps, words, strict=True)):
        _check_two(k, word, field)
    _checked("path", steps[0], window)
    grids = _shared(steps, [window or window_of(field, SIZE) for field in steps])
    waves = _shared(steps, [_frequencies(*pair) for pair in zip(steps, grids, strict=True)])
    columns = [
        portraits(word, field, grid, wave.axis(0), wave.axis(1))
        for word, field, grid, wave in zip(words, steps, grids, waves, strict=True)
    ]
    with house_style():
        return portrait_strip(columns, rows)


def _check_two(step: int, word: str, field: Field) -> None:
    """Refuse light that is not over two coordinates, which has no image."""
    if field.frame.dims != 2:
        raise ValueError(
            f"Argument `path` must be of light over two coordinates to be drawn, but its step "
            f"{step}, {word}, is over ({', '.join(field.frame.coordinates)})."
        )


def _frequencies(field: Field, grid: Grid) -> Grid:
    """Where its spectrum has its energy; without a closed form, all that the samples tell."""
    try:
        return frequencies_of(field.spectrum(), SIZE)
    except Refused:
        return Grid.spanning((SIZE, SIZE), tuple(0.5 / step for step in grid.step))


def _shared(steps: Sequence[Field], grids: Sequence[Grid]) -> list[Grid]:
    """Grids of the same size, each around all those of steps over its coordinates."""
    return [
        _around([g for f, g in zip(steps, grids, strict=True) if f.frame.coordinates == names])
        for names in (field.frame.coordinates for field in steps)
    ]


def _around(grids: Sequence[Grid]) -> Grid:
    """The smallest grid that holds others of its size."""
    centers, halves = np.array([g.center for g in grids]), 0.5 * np.array([g.extent for g in grids])
    low, high = np.min(centers - halves, 0), np.max(centers + halves, 0)
    half, center = 0.5 * (high - low), 0.5 * (high + low)
    return Grid.spanning(grids[0].size, tuple(half.tolist()), tuple(center.tolist()))
