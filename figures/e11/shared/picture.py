"""How E11's scenes are looked at: antialiased film in colour with closeups, scales below panels.

A picture has four places in each pixel, of which each has a quarter of the pixel's rays: a scene of
twice the pixels both ways is taken apart into four, one for each place (`interleaved`), and
pictures of these are averaged before they are developed (`Film`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.e11.shared import space
from figures.r07.shared.look import FRAMES, GROUND, LEAF, WOOD, Closeup
from firstorder.plotting import develop, exposure_of, tinted

TINTS = np.array([WOOD, LEAF])  # of the ground, and of what stands on it


def interleaved(scene: space.Scene) -> list[space.Scene]:
    """Four scenes of half as many pixels both ways: every second one, from each of 2 x 2 places."""
    side = scene.side // 2

    def part(a, i, j):
        whole = a.reshape(scene.side, scene.side, -1)[i::2, j::2]
        return np.ascontiguousarray(whole).reshape(side * side, *a.shape[1:])

    return [
        scene._replace(
            side=side,
            receivers=part(scene.receivers, i, j),
            normals=part(scene.normals, i, j),
            part=part(scene.part, i, j),
            pixel=2.0 * scene.pixel,
        )
        for i in (0, 1)
        for j in (0, 1)
    ]


class Film(NamedTuple):
    """The places of a picture, and its exposure.

    Attributes:
        scenes: one for each place in a pixel.
        exposure: of all pictures that are compared.
    """

    scenes: list[space.Scene]
    exposure: float

    @classmethod
    def of(cls, scenes: list[space.Scene], seen: list[np.ndarray]) -> Film:
        """Exposed for what is seen of the lamp, an image for each of the scenes."""
        return cls(scenes, exposure_of(_colour(scenes, seen)[0], 0.2))

    def levels(self, seen: list[np.ndarray]) -> np.ndarray:
        """Levels of a screen, rows from the top, of what is seen of the lamp."""
        colour, shown = _colour(self.scenes, seen)
        levels = develop(colour / np.maximum(shown, 1e-9)[..., None], self.exposure)
        share = np.linspace(1.0, 0.0, len(levels))[:, None, None]
        ground = share * GROUND[1] + (1.0 - share) * GROUND[0]
        shown = shown.T[::-1, :, None]
        return np.rint(shown * levels + (1.0 - shown) * ground).astype(np.uint8)


def _colour(scenes, seen) -> tuple[np.ndarray, np.ndarray]:
    """Mean light over the places that show something, times their share, and that share."""
    colour, shown = 0.0, 0.0
    for scene, visible in zip(scenes, seen, strict=True):
        label = np.minimum(scene.part, 1).reshape(scene.side, -1)
        light = np.where(label >= 0, scene.picture(scene.light()) * visible, 0.0)
        colour = colour + tinted(light, label, TINTS) / len(scenes)
        shown = shown + (label >= 0) / len(scenes)
    return np.asarray(colour), np.asarray(shown)


def closeups(*parts) -> tuple[Closeup, ...]:
    """Parts of a picture: columns, rows, and where the enlargement stands."""
    return tuple(Closeup(*part, color) for part, color in zip(parts, FRAMES, strict=False))


def scale_below(ax, drawn, label: str = "") -> None:
    """A colour scale below a panel, so that panels stay as far apart as they are."""
    bar = ax.figure.colorbar(drawn, cax=ax.inset_axes((0.0, -0.09, 1.0, 0.05)),
                             orientation="horizontal")  # fmt: skip
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
