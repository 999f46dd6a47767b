"""What all stills are made with: a frame of pixels, fields, renderings and lines on it."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Callable

import jax
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.ndimage import map_coordinates

from firstorder.numerics._batching import host_blocks
from firstorder.plotting import develop
from firstorder.rendering import Renderer, World, antialiased, render_tiles, subpixels

DPI = 120.0
WIDE = 1920  # for which line widths are given [pixels]


@dataclasses.dataclass(frozen=True)
class Frame:
    """A still's pixels.

    Attributes:
        width: [pixels].
        height: [pixels].
        folder: for tiles; of this still and size alone.
        key: what the tiles are made from: folders of another one are refused.
    """

    width: int
    height: int
    folder: pathlib.Path
    key: str = ""

    @property
    def fine(self) -> float:
        """Points of a line one pixel wide at full size."""
        return 72.0 / DPI * self.width / WIDE

    def extent(self, center, wide: float) -> tuple[float, float, float, float]:
        """Left, right, low and high end of a view `wide` metres across."""
        (x, y), half = center, 0.5 * wide
        up = half * self.height / self.width
        return x - half, x + half, y - up, y + up

    def field(
        self, at: Callable, extent, *, rows: int = 2, block: int = 2048, every: int = 1
    ) -> np.ndarray:
        """A field over the plane, as means of `rows`^2 places a pixel, by tiles that are kept.

        Args:
            at: from a place, shape (2,), to bands; it is mapped and compiled.
            extent: left, right, low, high [m].
            rows: of places in a pixel.
            block: places of one compiled size.
            every: pixels from place to place of a smooth field, a cubic spline in between.
        """
        if every > 1:
            few = dataclasses.replace(self, width=self.width // every, height=self.height // every)
            return self._between(few.field(at, extent, rows=rows, block=block))
        left, right, low, high = extent
        mapped, places = jax.jit(jax.vmap(at)), subpixels(rows)
        scale = np.array([right - left, high - low]) / (self.width, self.height)

        def shade(p, number):
            x = (p + places[number] - 0.5) * scale + (left, low)
            return {"value": host_blocks(mapped, x, block)}

        return render_tiles(shade, self.width, self.height, self.folder, side=240,
                            passes=rows**2, key=self.key)["value"]  # fmt: skip

    def _between(self, values: np.ndarray) -> np.ndarray:
        """Pixels of this frame from those of a coarser one, by a cubic spline."""
        axes = [(np.arange(n) + 0.5) * m / n - 0.5
                for n, m in zip((self.width, self.height), values.shape, strict=False)]  # fmt: skip
        at = np.stack(np.meshgrid(*axes, indexing="ij"))
        bands = values.reshape(*values.shape[:2], -1)
        found = [map_coordinates(bands[..., k], at, order=3, mode="reflect")
                 for k in range(bands.shape[-1])]  # fmt: skip
        return np.stack(found, -1).reshape(self.width, self.height, *values.shape[2:])

    def rendered(self, world: World) -> np.ndarray:
        """A world in space, antialiased."""
        made = Renderer(world)
        return antialiased(made, self.width, self.height, self.folder, side=240, key=self.key).value

    def canvas(self, image: np.ndarray | None, extent, ground: str = "#0b1020") -> Axes:
        """Axes that fill the frame, over levels of a screen or a plain ground."""
        figure = Figure(figsize=(self.width / DPI, self.height / DPI), dpi=DPI, facecolor=ground)
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.set(xlim=extent[:2], ylim=extent[2:])
        ax.set_axis_off()
        if image is not None:
            ax.imshow(image, extent=extent, origin="upper", interpolation="antialiased",
                      aspect="auto", zorder=-10)  # fmt: skip
        return ax


def drawn(ax: Axes) -> np.ndarray:
    """Levels of a screen of the figure of some axes, rows from the top."""
    canvas = FigureCanvasAgg(ax.figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def developed(values: np.ndarray, exposure: float | None = None) -> np.ndarray:
    """Film, of grey or colour, as red, green and blue."""
    levels = develop(values, exposure)
    return levels if levels.ndim == 3 else np.repeat(levels[..., None], 3, -1)
