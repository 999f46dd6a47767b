"""Figures that redraw fast: everything that stands still is drawn once and kept."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image


class Live:
    """A figure with moving parts, for sliders.

    Axes, ticks and labels take matplotlib most of its time, and do not depend on the slider. They
    are drawn once; `png` puts the moving artists over a copy of them.

    Args:
        figure: with everything in it; its layout is frozen.
        moving: artists that change between redraws (`set_data`, `set_text`, ...).

    Example:
        >>> from firstorder.plotting import Live, panels
        >>> figure, axes = panels()
        >>> (line,) = axes[0, 0].plot([0.0, 1.0], [0.0, 1.0])
        >>> live = Live(figure, [line])
        >>> line.set_ydata([1.0, 0.0])
        >>> live.png()[1:4]
        b'PNG'
    """

    def __init__(self, figure: Figure, moving: Sequence[Artist]):
        """Draw the background."""
        self.figure, self.moving = figure, tuple(moving)
        self._canvas = FigureCanvasAgg(figure)
        for artist in self.moving:
            artist.set_animated(True)
        self._canvas.draw()
        figure.set_layout_engine("none")
        self._background = self._canvas.copy_from_bbox(figure.bbox)

    def png(self) -> bytes:
        """The picture as it is now."""
        self._canvas.restore_region(self._background)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        file = io.BytesIO()
        # Nothing is transparent, and a picture that is looked at once need not be small.
        picture = Image.fromarray(np.asarray(self._canvas.buffer_rgba())[..., :3])
        picture.save(file, "png", compress_level=1)
        return file.getvalue()
