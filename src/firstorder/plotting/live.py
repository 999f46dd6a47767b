"""Figures that redraw fast: everything that stands still is drawn once and kept."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from PIL import Image

from firstorder.plotting.style import house_style
from firstorder.plotting.style import panels as make_panels

NO_VALUE = np.array([205, 209, 214, 255], np.uint8)  # cells that are NaN: no colour of any map


class LiveFigure:
    """A figure with moving parts, for sliders.

    Axes, ticks and labels take matplotlib most of its time, and do not depend on the slider. They
    are drawn once; `png` puts the moving artists over a copy of them.

    Args:
        figure: with everything in it; its layout is frozen.
        moving: artists that change between redraws (`set_data`, `set_text`, ...).

    Example:
        >>> from firstorder.plotting import LiveFigure, panels
        >>> figure, axes = panels()
        >>> (line,) = axes[0, 0].plot([0.0, 1.0], [0.0, 1.0])
        >>> live = LiveFigure(figure, [line])
        >>> line.set_ydata([1.0, 0.0])
        >>> live.png()[1:4]
        b'PNG'
    """

    def __init__(self, figure: Figure, moving: Sequence[Artist]):
        """Draw the background."""
        self.figure = figure
        self._canvas = FigureCanvasAgg(figure)
        for artist in moving:
            artist.set_animated(True)
        self._canvas.draw()
        figure.set_layout_engine("none")
        self._background = self._canvas.copy_from_bbox(figure.bbox)
        self._images = [_Pixels(a, figure) for a in moving if isinstance(a, AxesImage)]
        self._others = [a for a in moving if not isinstance(a, AxesImage)]

    def __repr__(self) -> str:
        return f"LiveFigure of {len(self._images) + len(self._others)} moving artists"

    def png(self) -> bytes:
        """The picture as it is now: images below, other artists above."""
        self._canvas.restore_region(self._background)
        pixels = np.asarray(self._canvas.buffer_rgba())
        for image in self._images:
            image.paint(pixels)
        for artist in self._others:
            self.figure.draw_artist(artist)
        file = io.BytesIO()
        # Nothing is transparent, and a picture that is looked at once need not be small.
        picture = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
        picture.save(file, "png", compress_level=1)
        return file.getvalue()


class LiveImages:
    """Images of one size in a figure of two columns that redraws fast, with notes and dots on them.

    Args:
        panels: by title: the colour map, and the value at its top; 0 is at its bottom.
        columns: of the images [pixels].
        rows: of the images [pixels].

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import LiveImages
        >>> live = LiveImages({"radiance": ("gray", 1.0), "error": ("gray", 0.1)}, 4, 3)
        >>> both = np.ones((4, 3)), np.zeros((4, 3))
        >>> live.png(both, notes={1: "RMS 0"}, dots={0: np.array([[2.0, 1.5]])})[1:4]
        b'PNG'
    """

    def __init__(self, panels: Mapping[str, tuple[str | Colormap, float]], columns: int, rows: int):
        """Draw axes, titles and scales."""
        self._images, self._notes, self._dots = [], [], []
        options = {"vmin": 0.0, "origin": "lower", "extent": (0, columns, 0, rows)}
        with house_style():
            figure, axes = make_panels(-(-len(panels) // 2), 2, 3.9, 3.4)
            for ax in axes.flat[len(panels) :]:
                ax.set_axis_off()
            for ax, (title, (colours, top)) in zip(axes.flat, panels.items(), strict=False):
                nothing = np.zeros((rows, columns))
                self._images.append(ax.imshow(nothing, cmap=colours, vmax=top, **options))
                self._notes.append(
                    ax.text(0.02, 0.97, "", color="w", va="top", transform=ax.transAxes)
                )
                self._dots.append(ax.plot([], [], ".", color="#38bdf8", markersize=1.6)[0])
                ax.set(title=title, xticks=[], yticks=[])
                ax.grid(False)
                figure.colorbar(self._images[-1], ax=ax, shrink=0.8)
            self._live = LiveFigure(figure, [*self._images, *self._notes, *self._dots])

    def __repr__(self) -> str:
        return f"LiveImages of {len(self._images)} panels"

    def png(
        self,
        images: Sequence[Float[np.ndarray, "c r"]],
        notes: Mapping[int, str] | None = None,
        dots: Mapping[int, Float[np.ndarray, "n 2"]] | None = None,
    ) -> bytes:
        """The picture of these images.

        Args:
            images: one for each panel, first axis across, second upwards.
            notes: in panels by their number.
            dots: over panels by their number, in pixels, (0, 0) a corner.
        """
        notes, dots = notes or {}, dots or {}
        for k, (image, values) in enumerate(zip(self._images, images, strict=True)):
            image.set_data(values.T)
            self._notes[k].set_text(notes.get(k, ""))
            self._dots[k].set_data(*dots.get(k, np.zeros((0, 2))).T)
        return self._live.png()


class _Pixels:
    """An image whose cells are copied into the canvas: matplotlib's resampling takes far longer.

    Its extent must fill its axes, as `show_light_field` and `show_spectrum` leave them.
    """

    def __init__(self, image: AxesImage, figure: Figure):
        self.image = image
        box = image.axes.get_window_extent()
        left, right = math.floor(box.x0) + 1, math.ceil(box.x1) - 1
        bottom, top = math.floor(box.y0) + 1, math.ceil(box.y1) - 1
        height = round(figure.bbox.height)
        self._window = slice(height - top, height - bottom), slice(left, right)
        ny, nx = np.shape(image.get_array())
        self._rows = np.arange(top - bottom)[::-1, None] * ny // (top - bottom)
        self._columns = np.arange(right - left) * nx // (right - left)
        self._colours = np.append(image.get_cmap()(np.arange(256), bytes=True), [NO_VALUE], 0)

    def paint(self, pixels: np.ndarray) -> None:
        """Each pixel takes the colour of the cell that it lies in, grey where that is NaN."""
        low, high = self.image.get_clim()
        values = np.asarray(self.image.get_array())
        # As matplotlib has it: where the scale has no length all is at its bottom.
        scale = 255.99 / (high - low) if high > low else 0.0
        shade = np.clip(np.nan_to_num(values - low) * scale, 0, 255)
        colours = self._colours[np.where(np.isnan(values), 256, shade).astype(int)]
        pixels[self._window] = colours[self._rows, self._columns]
