"""J12 §8-9: two scenes of some complexity, all metrics at equal records, and what thresholds mean.

`clutter` (a closed room, nine boxes and three balls on and over its floor) and `tables` (a lamp
that shines up, so that all light on the floor is indirect), both of `space.library._scenes`, with
five reflections on radiosity maps. Truth is gathered on the same maps with other and more rays.
Places under the boxes that stand on the floor are left out. All caches are of first order with the
stratified gradient but for the last row of claims.

Of what a threshold may tolerate (total, average, relative, integrated squared error) only the power
of the Hessian tells the records apart at equal counts: R goes as |H|^(-1/4) for the total, -1/3 for
the integrated square, -1/2 for averages. Each is judged by RMS and by structural similarity.

Surface-area Hessians leave out shadow edges, and these scenes are full of them. The radiometric has
1.7 times less error than either plain split sphere, in both; against the best, the harmonic mean
with neighbour clamping, 1.3 times less where light is soft (`tables`, all of it indirect) and about
the same in the clutter, where the geometric one loses to it. The occlusion-aware Hessian (576 rays
of its own) is the best of all in the clutter, with an eighth less error than the radiometric one;
in soft light the geometric one is better. Ellipses lose everywhere: their long axes reach across
shadows that the Hessian does not know. So does second order in the clutter.
"""

from __future__ import annotations

import functools

import numpy as np

from figures.j12.shared.box import (
    Case,
    Size,
    compare,
    ellipse,
    floor_limits,
    metrics,
    places,
    show_error,
    show_light,
    similar,
)
from figures.j12.shared.caching import pointwise, split
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import floats_per_record, neighbour_clamping
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates
from firstorder.caching.occlusion import occlusion_table
from firstorder.space.bounces._radiance_maps import refine_maps
from firstorder.space.bounces.radiosity import solve_radiosity
from firstorder.space.library import _scenes

SCENES = ("clutter", "tables")
DEFINITIONS = ("total", "average", "relative", "integrated squared")


def draw(quick: bool) -> Drawing:
    s = Size(24, 12, 36, 60, 2) if quick else Size(64, 40, 120, 500, 3)
    figure, axes = plotting.panels(2, 6, 2.0, 2.3)
    claims, arrays = [], {}
    for row, name in enumerate(SCENES):
        c = _case(name, s, quick)
        within, table = floor_limits(c.size.pixels), c.table
        held = neighbour_clamping(table.position, table.harmonic)
        more = {"neighbours": split(held, within), "ellipses": ellipse(table.geometric, within)}
        (floor,) = c.maps.scene.named("floor")
        aware = occlusion_table(c.maps, table.position, floor, rays=144 if quick else 576)
        more["occlusion-aware"] = pointwise(aware.hessian, within)
        value = np.maximum(table.E, 1e-9)
        by = {d: pointwise(table.geometric, within, 1, d, value) for d in DEFINITIONS[1:]}
        found = compare(c, metrics(c) | more | by)
        second = compare(c, {"geometric": metrics(c)["geometric"]}, order=2)["geometric"]
        show_light(axes[row, 0], c, name)
        most = 4.0 * found["geometric"].mean
        for k, method in enumerate(
            ("minimum", "harmonic", "radiometric", "geometric", "occlusion-aware")
        ):
            show_error(axes[row, k + 1], c, found[method], most, method)
        arrays |= {f"{name}_{k.replace(' ', '_')}": o.errors for k, o in found.items()}
        claims += _claims(name, found, second, c)
    claims.append(
        Claim(
            "Numbers stored in a record: value and gradient, and Hessian, and ellipse (grey)",
            "8, 11, -",
            f"{floats_per_record(1)}, {floats_per_record(2)}, {floats_per_record(1, ellipse=True)}",
            "",
            (floats_per_record(1), floats_per_record(2)) == (8, 11),
        )
    )
    return Drawing(figure, arrays, claims, size=s.words(), seed=12)


@functools.cache
def _case(name: str, s: Size, quick: bool) -> Case:
    scene = _scenes.named_scene(name)
    cells, rays = (6, 64) if quick else (16, 128)
    coarse = solve_radiosity(scene, cells=cells, bounces=3 if quick else 5, rays=rays, shadow=3)
    maps = refine_maps(coarse, 2 * cells if quick else 64)
    x = places(s.pixels)
    shut = np.zeros(len(x), bool)
    for group in scene.groups:
        if type(group).__name__ == "Boxes":
            for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
                q = (np.append(x, np.zeros((len(x), 1)), 1) - center) @ np.linalg.inv(axes).T
                shut |= np.all(np.abs(q) < 1.0 + 1e-9, axis=1)
    (floor,) = scene.named("floor")
    table = tabulate_candidates(maps, x[~shut], gather_directions(s.rows, s.columns), floor)
    better = gather_directions(2 * s.rows, 2 * s.columns, seed=1)
    return Case(maps, table, tabulate_candidates(maps, x[~shut], better, floor).E, ~shut, s)


def _claims(name: str, found, second, c: Case) -> list[Claim]:
    best = min(("minimum", "harmonic", "neighbours"), key=lambda m: found[m].mean)
    split_best = found[best].mean
    by_error = {d: found["geometric" if d == "total" else d] for d in DEFINITIONS}
    lowest = min(by_error, key=lambda d: by_error[d].mean)
    alike = max(by_error, key=lambda d: similar(c, by_error[d]))
    spread = found["geometric"].spread / found["geometric"].mean
    return [
        *(
            Claim(
                "RMS error of the best split sphere (minimum, harmonic, neighbours) over that of "
                f"the {m} Hessian, {name}",
                "> 1",
                split_best / found[m].mean,
                "",
                split_best > found[m].mean,
            )
            for m in ("radiometric", "geometric")
        ),
        Claim(
            "RMS error of the radiometric and of the geometric Hessian over that of the "
            f"occlusion-aware one, {name}",
            "> 1",
            f"{found['radiometric'].mean / found['occlusion-aware'].mean:.2f}, "
            f"{found['geometric'].mean / found['occlusion-aware'].mean:.2f}",
            "",
            found["occlusion-aware"].mean
            < min(found[m].mean for m in ("radiometric", "geometric")),
        ),
        Claim(
            f"RMS error of ellipses over circles, geometric Hessian, {name}",
            "0.6 (box)",
            found["ellipses"].mean / found["geometric"].mean,
            "",
            found["ellipses"].mean < found["geometric"].mean,
        ),
        Claim(
            f"Threshold whose records have the lowest RMS error, and that with the highest SSIM, "
            f"{name}",
            "total",
            f"{lowest}, {alike}",
            "",
            lowest == "total",
        ),
        Claim(
            f"RMS error of second over first order, same records, {name}",
            None,
            second.mean / found["geometric"].mean,
        ),
        Claim(f"Spread of the error over orders of insertion, over its mean, {name}", None, spread),
        Claim(
            f"RMS error of the table's own irradiance over that of the best cache, {name}",
            None,
            c.noise / min(o.mean for o in found.values()),
        ),
    ]
