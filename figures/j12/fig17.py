"""J12 Fig. 17: the two test scenes in space, and the indirect light on their floor.

The paper gives albedos (0.5 on the left, 0 on the right) and no size: sizes are those of
`space.library._scenes.j12_box` and `j12_occluder`, the block's albedo is 0.5. The floor is black
and one reflection is followed, so that the light on walls and block is known in closed form, and
that on the floor by quadrature cut at every edge: once from maps of what surfaces send
(`shared.box`), once from the closed form (`shared.exact_box`, which later figures use).
Beside it stands what 30,000 stratified rays from every cell find, the number that the paper
uses: their difference is the noise below which no cache of such records can be judged. The box is
rendered in closed form (`shared.picture`); in the picture alone the floor is drawn as if of albedo
0.5.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.box import Case, Size, case, exact, show_light, size
from figures.j12.shared.exact_box import Room, blocked_light, empty_light
from figures.j12.shared.picture import rendered
from figures.style import Drawing
from figures.verdicts import Measurement
from firstorder import plotting

SCENES = {"j12_box": "box", "j12_occluder": "box with a block"}


def draw(quick: bool) -> Drawing:
    s = size(quick) if quick else Size(48, 100, 300, 1000, 3)
    figure, axes = plotting.panels(2, 3, 3.3, 2.9, width_ratios=(1.15, 1.0, 1.0))
    width = 150 if quick else 600
    claims, arrays = [], {}
    for row, (name, words) in enumerate(SCENES.items()):
        c = case(name, s)
        view, light, noise = axes[row]
        image = rendered(Room(), c.image(c.truth), name != "j12_box", (width, width))
        view.imshow(image, origin="upper")
        view.set(xticks=[], yticks=[], title=f"{'ad'[row]}) {words}, rendered")
        drawn = show_light(light, c, f"{'be'[row]}) indirect irradiance, exact")
        light.set_xlabel("")
        figure.colorbar(drawn, ax=light, label="W/m$^2$", shrink=0.9)
        miss = c.image(c.table.E - c.truth)
        most = 3.0 * c.noise
        drawn = noise.imshow(1e3 * miss, cmap=plotting.SIGNED, vmin=-1e3 * most, vmax=1e3 * most,
                             extent=(0, 1, 0, 1), origin="lower")  # fmt: skip
        noise.set(
            xticks=[], yticks=[], title=f"{'cf'[row]}) {s.rows * s.columns:,} rays minus exact"
        )
        figure.colorbar(drawn, ax=noise, label="mW/m$^2$", shrink=0.9)
        for ax in (light, noise):
            ax.set_facecolor("0.92")  # under the block
        arrays |= {f"{name}_truth": c.image(c.truth), f"{name}_table": c.image(c.table.E)}
        finer = exact(c.maps, c.table.position[::7], 48, 32)
        claims += _claims(words, c, finer, _closed(name, c.table.position))
    return Drawing(
        figure, arrays, claims, size=f"{s.pixels}^2 places, {s.rows * s.columns} rays", seed=0
    )


def _closed(name: str, x: np.ndarray) -> np.ndarray:
    """Irradiance from what surfaces send in closed form."""
    return empty_light(Room())(x).E if name == "j12_box" else blocked_light(Room(), x).E


def _claims(words: str, c: Case, finer: np.ndarray, closed: np.ndarray) -> list[Measurement]:
    mean = np.mean(c.truth)
    return [
        Measurement(
            f"RMS error of the irradiance of 30,000 rays over its mean, {words}", c.noise / mean
        ),
        Measurement(
            f"Change of the exact irradiance with twice the nodes, over its mean, {words}",
            np.max(np.abs(finer - c.truth[::7])) / mean,
        ),
        Measurement(
            "RMS difference of the exact irradiance by radiance maps of 128^2 cells from that in "
            f"closed form, over its mean, {words}",
            np.sqrt(np.mean((c.truth - closed) ** 2)) / mean,
        ),
    ]
