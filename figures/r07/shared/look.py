"""How pictures of scenes in space are shown: film in colour, a ground where nothing is, a closeup.

Images are grey, and all numbers are of them. In a picture each object has a tint of luminance 1
(`plotting.tinted`), so that the luminance is what was measured; all pictures of a figure share one
exposure. What shows no object has a ground that is no radiance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from firstorder import plotting
from firstorder.plotting import develop, exposure_of, tinted

WOOD, CLAY, BRASS, SLATE, LEAF = (
    (0.60, 0.48, 0.38), (0.80, 0.25, 0.12), (0.85, 0.50, 0.10), (0.12, 0.33, 0.80),
    (0.16, 0.50, 0.08),
)  # fmt: skip
FRAMES = (plotting.COLOURS[1], plotting.COLOURS[3])
GROUND = np.array([[226, 230, 236], [244, 245, 247]])  # below and above, levels of a screen


class Closeup(NamedTuple):
    """A part of an image that is also shown enlarged.

    Attributes:
        columns, rows: first and last, as shares of the image.
        at: where the enlargement stands on the axes: left, low, width, height, as shares.
        color: of both frames.
    """

    columns: tuple[float, float]
    rows: tuple[float, float]
    at: tuple[float, float, float, float]
    color: str = FRAMES[0]


class Look(NamedTuple):
    """One exposure and one set of tints for all pictures of a scene.

    Attributes:
        labels: what each pixel shows, -1 for nothing.
        tints: of each label.
        exposure: of all pictures.
        closeups: of all pictures.
    """

    labels: np.ndarray
    tints: np.ndarray
    exposure: float
    closeups: tuple[Closeup, ...] = ()

    def levels(self, values: np.ndarray) -> np.ndarray:
        """A picture in levels of a screen, rows from the top."""
        values = np.asarray(values)
        found = develop(tinted(values, self.labels, self.tints), self.exposure)
        share = np.linspace(1.0, 0.0, values.shape[1])[:, None, None]
        ground = share * GROUND[1] + (1.0 - share) * GROUND[0]
        nothing = (self.labels < 0).T[::-1, :, None]
        return np.where(nothing, ground, found).astype(np.uint8)

    def show(self, ax: Axes, values: np.ndarray, title: str) -> None:
        """A picture and its closeups."""
        show_levels(ax, self.levels(values), title, self.closeups)


def look(true, labels, tints, closeups: tuple[Closeup, ...] = (), middle: float = 0.13) -> Look:
    """The look of a scene, exposed for its image."""
    lit = np.where(labels >= 0, true, 0.0)
    return Look(labels, np.asarray(tints, float), exposure_of(lit, middle), closeups)


def show_levels(ax: Axes, levels, title: str, closeups: tuple[Closeup, ...] = ()) -> None:
    """Levels of a screen, rows from the top, in axes of pixels, with enlarged parts in frames."""
    height, width = levels.shape[:2]
    box = dict(extent=(0, width, 0, height), origin="upper")
    ax.imshow(levels, interpolation="antialiased", **box)
    ax.set(title=title, xticks=[], yticks=[], xlim=(0, width), ylim=(0, height))
    for part in closeups:
        (left, right), (low, high) = (
            np.multiply(part.columns, width),
            np.multiply(part.rows, height),
        )
        x, y = [left, right, right, left, left], [low, low, high, high, low]
        ax.plot(x, y, "-", color=part.color, linewidth=0.9)
        inset = ax.inset_axes(part.at)
        inset.imshow(levels, interpolation="nearest", **box)
        inset.set(xlim=(left, right), ylim=(low, high), xticks=[], yticks=[])
        for side in inset.spines.values():
            side.set(color=part.color, linewidth=1.4)


def show_samples(ax: Axes, p, side: int, title: str, picture=None) -> None:
    """Places of samples as dots, over a faint picture."""
    if picture is not None:
        faint = (0.35 * picture + 0.65 * 255.0).astype(np.uint8)
        ax.imshow(faint, extent=(0, side, 0, side), origin="upper")
    ax.plot(*np.asarray(p).T, ",", color="0.05")
    ax.set(title=title, xticks=[], yticks=[], xlim=(0, side), ylim=(0, side), aspect="equal")
