"""J12 Fig. 18: caches of order 0, 1 and 2 on the floor of the box, and of the box with a block.

Sizes of the scenes are the library's. All caches use the split sphere by the shortest ray and have
the same records, so that only the extrapolation differs. The gradient is stratified (shadow edges
included), the Hessian by surface area (they are left out). Error images share one scale a row.

Beside the block second order gains next to nothing, as the paper has it: the error is at the
shadow's edge, which the surface-area Hessian does not know. In the empty box it nearly halves the
error and stays just short of the paper's factor of 2: of the 1.15e-5 W/m² that remain, 0.67e-5 are
the noise of 30,000 rays (Fig. 17), the same in all three. Scene sizes are ours.
"""

from __future__ import annotations

from figures.j12.shared.box import case, compare, metrics, show_error, show_light, size
from figures.style import Claim, Drawing
from firstorder import plotting

SCENES = {"j12_box": "box", "j12_occluder": "box with a block"}
ORDERS = ("constant", "gradient", "Hessian")


def draw(quick: bool) -> Drawing:
    s = size(quick)
    figure, axes = plotting.panels(2, 4, 2.1, 2.5)
    claims, arrays = [], {}
    for row, (name, words) in enumerate(SCENES.items()):
        c = case(name, s)
        radii = {"minimum": metrics(c)["minimum"]}
        found = [compare(c, radii, order=k)["minimum"] for k in (0, 1, 2)]
        show_light(axes[row, 0], c, words)
        most = 3.0 * found[1].mean
        for k, outcome in enumerate(found):
            show_error(axes[row, k + 1], c, outcome, most, ORDERS[k], dots=k == 0)
            arrays[f"{name}_rms_{k}"] = outcome.errors
        gain = found[1].mean / found[2].mean
        wanted = 2.0 if row == 0 else 1.0
        claims += [
            Claim(
                f"RMS error of gradient over Hessian extrapolation, same records, {words}",
                "> 2" if row == 0 else "> 1, less than without the block",
                gain,
                "",
                gain > wanted,
            ),
            Claim(
                f"RMS error of constant over gradient extrapolation, same records, {words}",
                "> 1",
                found[0].mean / found[1].mean,
                "",
                found[0].mean > found[1].mean,
            ),
        ]
    return Drawing(figure, arrays, claims, size=s.words(), seed=12)
