"""J12 Fig. 22: about 256 records as circles and as ellipses, by the geometric Hessian.

Above is the library's box; the gain is scanned over 20 rooms with lamp and walls of random sizes
and over 64, 256 and 1,024 records. Records hold the exact light (`shared.exact_box`), and no radius
has a limit. Circles are J12's (70); ellipses are drawn by the corrected (73), whose axes keep the
total error, and by the printed axes. As in the paper, reaches are drawn at half their size. Ratios
of the axes are held at 8 in the corrected form, since an eigenvalue may vanish. Beside them stand
the ellipses of Herzog et al. 2009, of which J12 §8.4 tells: harmonic means of the rays' lengths,
shortened along the gradient by a factor that the user sets for all.

Forty per cent are not found in any room. What ellipses gain depends on how unlike the eigenvalues
of the geometric Hessian are, and on this floor they are alike nearly everywhere: it is the
floor between two walls that fixes them, not the light, so that no lamp changes it. The ellipses of
the radiometric Hessian are longer and gain some in the mean of the rooms, not in the one shown:
where one eigenvalue crosses zero they reach far along it, to where that Hessian no longer holds.
"""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Ellipse

from figures.j12.shared import exact_box
from figures.j12.shared.box import ellipse
from figures.j12.shared.caching import pointwise, split
from figures.j12.shared.exact_box import FREE, Light, Room, factor, image
from figures.j12.shared.floor import (
    letter,
    plain,
    records_of,
    scale,
    show_error,
    show_map,
)
from figures.j12.shared.picture import show_box
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting
from firstorder.caching import ValidityRegion
from firstorder.caching.regions import FREE as NO_LIMIT
from firstorder.plotting.style import COLOURS

RECORDS = (64, 256, 1024)
ECCENTRIC = (2.0, 4.0)
BOTH = "geometric circles", "geometric ellipses"


def draw(quick: bool) -> Drawing:
    cells, judged, counts = (32, 16, (64,)) if quick else (96, 48, RECORDS)
    paper = counts[len(counts) // 2]
    light, asked = exact_box.empty_case(Room(), cells, judged)
    found = exact_box.race(light, asked, _methods(light), paper)
    figure, axes = plotting.panels(2, 6, 2.2, 2.5)
    _show_scene(axes[:, 0], asked, found["geometric circles"])
    for row, kind in enumerate(("geometric", "radiometric")):
        most = 3.0 * found[f"{kind} circles"].mean
        for k, shape in enumerate(("circles", "ellipses")):
            outcome = found[f"{kind} {shape}"]
            _reaches(axes[row, 2 * k + 1], outcome.cache(0), f"{kind}, {shape}")
            ax = axes[row, 2 * k + 2]
            show_error(ax, asked, outcome, most, "their error", records=False)
        scale(axes[row, 4:5])
    some = exact_box.some_rooms(3 if quick else 20)
    every = {n: [] for n in counts}
    unlike = []
    for room in some:
        light, asked = exact_box.empty_case(room, cells, judged)
        unlike.append(_anisotropy(light.geometric))
        for n in counts:
            methods = _methods(light)
            wanted = methods if n == paper else {m: methods[m] for m in BOTH}
            outcomes = exact_box.race(light, asked, wanted, n)
            every[n].append({m: o.mean for m, o in outcomes.items()})
    _draw_gain(axes[0, 5], every, unlike)
    _reaches(axes[1, 5], found["gradient ellipses of 2"].cache(0), "along the gradient, 2 : 1")
    letter(axes)
    curves = {
        f"{kind}_ellipses": found[f"{kind} ellipses"].cache(0).columns()
        for kind in ("geometric", "radiometric")
    }
    arrays = {m.replace(" ", "_"): np.array([h[m] for h in every[paper]]) for m in found}
    arrays["anisotropy"] = np.array(unlike)
    size = f"{cells}^2 places, {paper} records, {len(some)} rooms"
    claims = _claims(every, paper, unlike)
    return Drawing(figure, arrays, claims, curves, size=size, seed=12)


def _methods(light: Light):
    """Circles and ellipses by both Hessians, and split spheres shortened along the gradient."""
    found = {}
    for kind, H in (("geometric", light.geometric), ("radiometric", light.hessian)):
        found[f"{kind} circles"] = pointwise(H, FREE)
        found[f"{kind} ellipses"] = ellipse(H, FREE)
        found[f"{kind} printed ellipses"] = ellipse(H, FREE, printed=True)
    found["harmonic circles"] = split(light.harmonic, FREE)
    for ratio in ECCENTRIC:
        found[f"gradient ellipses of {ratio:g}"] = _along_gradient(light, ratio)
    return found


def _along_gradient(light: Light, ratio: float):
    """Harmonic means, shortened along the gradient by a ratio that is the same everywhere."""
    along = light.gradient / np.linalg.norm(light.gradient, axis=1, keepdims=True)
    shape = np.eye(2) + (ratio - 1.0) * along[:, :, None] * along[:, None, :]
    matrix = shape / light.harmonic[:, None, None]
    code = np.full(len(matrix), NO_LIMIT)
    return lambda threshold: ValidityRegion(matrix / threshold, code)


def _anisotropy(H: np.ndarray) -> float:
    """Larger over smaller eigenvalue in size, median over the floor."""
    sizes = np.sort(np.abs(np.linalg.eigvalsh(H)), axis=-1)
    return float(np.median(sizes[:, 1] / sizes[:, 0]))


def _gain(found, one: str, other: str) -> tuple[float, float]:
    """By how many per cent an error is below another, mean over rooms, and its error."""
    lower = factor(found, one, other)
    return 100.0 * (1.0 - lower.mean), 100.0 * lower.error


def _claims(every, paper: int, unlike) -> list[Statement | Measurement]:
    best = max(every, key=lambda n: _gain(every[n], "geometric ellipses", "geometric circles")[0])
    gain, error = _gain(every[best], "geometric ellipses", "geometric circles")
    apart = spread(unlike)
    return [
        *_by_the_geometric_hessian(every[paper]),
        Measurement(
            "Largest mean gain of ellipses over circles at 64, 256 or 1,024 records, geometric",
            gain,
            "%",
            error,
            "J12 Fig. 22",
        ),
        Measurement(
            "Larger over smaller eigenvalue of the geometric Hessian, median of the floor",
            apart.mean,
            error=apart.error,
        ),
        *_by_the_radiometric_hessian(every[paper]),
        *(claim for ratio in ECCENTRIC for claim in _along_the_gradient(every[paper], ratio)),
    ]


def _by_the_geometric_hessian(found) -> list[Statement]:
    return [
        Statement(
            f"RMS error of {shape} below that of circles, geometric Hessian, as many records",
            40.0,
            gain,
            at_least(40.0, "the paper's number"),
            "J12 §8.4, Fig. 22",
            unit="%",
            error=error,
            scanned=exact_box.SCANNED,
            reason="The two eigenvalues of the geometric Hessian are alike over most of the "
            "floor, whatever the lamp and the height, so that ellipses are nearly circles; "
            "from 64 to 1,024 records.",
        )
        for shape in ("ellipses", "printed ellipses")
        for gain, error in (_gain(found, f"geometric {shape}", "geometric circles"),)
    ]


def _by_the_radiometric_hessian(found) -> list[Measurement]:
    return [
        Measurement(
            f"RMS error of {shape} below that of circles, radiometric Hessian", gain, "%", error
        )
        for shape in ("ellipses", "printed ellipses")
        for gain, error in (_gain(found, f"radiometric {shape}", "radiometric circles"),)
    ]


def _along_the_gradient(found, ratio: float) -> list[Statement | Measurement]:
    """Of ellipses whose eccentricity is set for all, and that lie along the gradient."""
    name = f"gradient ellipses of {ratio:g}"
    lost = [
        {
            "set": here[name] / here["harmonic circles"],
            "deduced": here["geometric ellipses"] / here["geometric circles"],
        }
        for here in found
    ]
    over = factor(lost, "set", "deduced")
    gain, error = _gain(found, name, "harmonic circles")
    return [
        Statement(
            "Deducing the eccentricity by minimizing error betters setting it to "
            f"{ratio:g} along the gradient: error of the latter over that of ellipses by "
            "the geometric Hessian, each over that of its own circles",
            "> 1",
            over.mean,
            at_least(1.0, "'principled': smaller error"),
            "J12 §8.4",
            error=over.error,
            scanned=exact_box.SCANNED,
        ),
        Measurement(
            f"RMS error of harmonic means with eccentricity {ratio:g} along the gradient below "
            "that of their circles",
            gain,
            "%",
            error,
            "J12 §8.4",
        ),
    ]


def _draw_gain(ax, every, unlike) -> None:
    """Gain of the geometric Hessian's ellipses in each room, over how unlike eigenvalues are."""
    for k, (n, found) in enumerate(every.items()):
        gain = [100.0 * (1.0 - h["geometric ellipses"] / h["geometric circles"]) for h in found]
        ax.plot(unlike, gain, "o", color=COLOURS[k], ms=3, label=f"{n} records")
    ax.axhline(40.0, color="0.6", linewidth=0.8, label="the paper's")
    ax.set_box_aspect(1.0)
    ax.legend(fontsize=6)
    ax.set_title("gain of ellipses in %", fontsize=8)
    ax.set_xlabel("ratio of eigenvalues, median", fontsize=7.5)


def _show_scene(axes, asked, outcome) -> None:
    """The box with records, and the light on its floor."""
    records, light = records_of(outcome), image(asked.x, asked.truth)
    show_box(axes[0], Room(), light, "box, records of b)", records=records)
    below = f"0 to {np.max(asked.truth):.3g} W/m²"
    show_map(axes[1], asked.x, asked.truth, "indirect light", below, cmap="magma", vmin=0.0)


def _reaches(ax, cache, title: str) -> None:
    """Ellipses at half their size."""
    lengths, angle = cache.region.axes()
    x = np.asarray(cache.records.position)
    for (a, b), at, turn in zip(lengths, x, np.degrees(angle), strict=True):
        ax.add_patch(Ellipse(at, a, b, angle=turn, fill=False, linewidth=0.5))
    ax.plot(x[:, 0], x[:, 1], ".", color="black", markersize=1.5, markeredgewidth=0.0)
    plain(ax, title, f"{len(x)} records, half their reach")
