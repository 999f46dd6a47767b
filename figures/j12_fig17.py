"""J12 Fig. 17: the two test scenes in space, and the indirect light on their floor.

The paper gives albedos (0.5 on the left, 0 on the right) and no size: sizes are those of
`space.library.j12_box` and `j12_occluder`, the block's albedo is 0.5. The floor is black and one
reflection is followed, so that the light on walls and block is known in closed form, and that on
the floor by quadrature cut at every edge. Beside it stands the irradiance of the table that the
figures after this one share, 30,000 stratified rays from every cell: their difference is the noise
below which no cache can be judged.
"""

from __future__ import annotations

import numpy as np

from figures._j12_box import case, exact, show_light, size
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.space.image import pinhole

SCENES = {"j12_box": "box", "j12_occluder": "box with a block"}


def draw(quick: bool) -> Drawing:
    s = size(quick)
    figure, axes = plotting.panels(2, 3, 2.6, 2.4)
    claims, arrays = [], {}
    for row, (name, words) in enumerate(SCENES.items()):
        c = case(name, s)
        view, light, noise = axes[row]
        camera = pinhole((0.62, -1.55, 0.85), (0.5, 0.5, 0.45))
        plotting.draw_view(view, c.maps.scene, camera, half_width=0.5)
        view.set(xticks=[], yticks=[])
        view.set_title(words, fontsize=8)
        show_light(light, c, "indirect irradiance, exact")
        miss = c.image(c.table.E - c.truth)
        most = 3.0 * c.noise
        noise.imshow(miss, cmap="RdBu_r", vmin=-most, vmax=most, extent=(0, 1, 0, 1))
        noise.set(xticks=[], yticks=[])
        noise.set_title("table minus exact", fontsize=8)
        noise.set_xlabel(f"RMS {c.noise:.1e} W/m²", fontsize=7.5)
        arrays |= {f"{name}_truth": c.image(c.truth), f"{name}_table": c.image(c.table.E)}
        finer = exact(c.maps, c.table.position[::7], 48, 32)
        claims += [
            Claim(
                f"RMS error of the gathered irradiance over its mean, {words}",
                None,
                c.noise / np.mean(c.truth),
            ),
            Claim(
                f"Change of the exact irradiance with twice the nodes, over its mean, {words}",
                None,
                np.max(np.abs(finer - c.truth[::7])) / np.mean(c.truth),
            ),
        ]
    return Drawing(figure, arrays, claims, size=s.words(), seed=0)
