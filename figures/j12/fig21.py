"""J12 Fig. 21: 16 rays from each record, their radiance multiplied by noise, and no clamps.

The box, sizes as in the library. Each place casts 4 x 4 stratified rays of its own and multiplies
what each sees by a uniform number in [0, 2], as in the paper. Radii are held between a cell and
1.5 m only, as everywhere. The places of about a thousand records are judged by what noise leaves
of the radii (their scatter against those of 30,000 rays), by where the records go (their density
against that of 30,000 rays, on a grid of 8 x 8), and by the error that clean records at
these places would make, since the noisy values themselves err by their own noise.

Where none of the 16 rays meets light the radiometric Hessian is zero and its radius infinite, at
any tolerance: it may not reach the wanted number of records at all, and is then drawn with as many
as it can make. The geometric one is infinite only where all rays miss everything. It is a mean of
kernels that fall with the square of distance and change sign: near a wall one close hit decides,
and nothing cancels it. Radii there come out several times too small, and records crowd along both
walls, more than with many rays: robust in that nothing is left uncovered, not in the distribution.
Beside the bright wall this happens to suit the light, and clean values at these places err less.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared import caching
from figures.j12.shared.box import EXTENT, asked, case, compare, floor_limits, metrics, size
from figures.j12.shared.caching import pointwise
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import Fit, ValidityRegion, derivative_norm, fill, random_orders, rms
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates


def draw(quick: bool) -> Drawing:
    s = size(quick)
    c = case("j12_box", s)
    n = s.pixels
    noisy = tabulate_candidates(
        c.maps, c.table.position, gather_directions(4, 4, n * n // 4, 21, noise=True), _floor(c)
    )
    clean = compare(c, metrics(c))
    found = {
        name: _filled(c, pointwise(H, floor_limits(n)))
        for name, H in (("radiometric", noisy.hessian), ("geometric", noisy.geometric))
    }
    figure, axes = plotting.panels(1, 5, 2.1, 2.3)
    noise = rms(noisy.E, c.truth) / np.mean(c.truth)
    axes[0, 0].imshow(c.image(noisy.E), cmap="magma", vmin=0.0, extent=EXTENT)
    axes[0, 0].set_title("E of 16 noisy rays", fontsize=8)
    axes[0, 0].set_xlabel(f"RMS error {100 * noise:.0f} % of mean", fontsize=7.5)
    titles = ("geometric, many rays", "geometric, 16 rays", "radiometric, 16 rays")
    shown = (clean["geometric"], found["geometric"], found["radiometric"])
    for ax, title, outcome in zip(axes[0, 1:4], titles, shown, strict=True):
        x = np.asarray(outcome.cache(0).records.position)
        ax.plot(x[:, 0], x[:, 1], ".", color="black", markersize=2.0, markeredgewidth=0.0)
        ax.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
        ax.set_title(title, fontsize=8)
        ax.set_xlabel(f"clean values: RMS {outcome.mean:.1e}", fontsize=7.5)
    scatter, blind = {}, {}
    for name, H, exact in (
        ("geometric", noisy.geometric, c.table.geometric),
        ("radiometric", noisy.hessian, c.table.hessian),
    ):
        k, right = (np.asarray(derivative_norm(a, 2)) for a in (H, exact))
        blind[name] = float(np.mean(k == 0.0))
        ratio = k[k > 0.0] / right[k > 0.0]
        scatter[name] = float(np.std(0.25 * np.log(ratio)))
        axes[0, 4].hist(-0.25 * np.log2(ratio), 40, (-3, 3), histtype="step", label=name)
    axes[0, 4].legend(fontsize=6.5)
    axes[0, 4].set_xlabel("log2 of R over R of many rays", fontsize=7.5)
    axes[0, 4].set(yticks=[])
    for ax in axes[0, :4]:
        ax.set(xticks=[], yticks=[])
    arrays = {"E": c.image(noisy.E)} | {f"rms_{k}": o.errors for k, o in found.items()}
    claims = _claims(clean, found, scatter, blind, noise)
    return Drawing(figure, arrays, claims, size=s.words() + "; 16 noisy rays", seed=21)


def _filled(c, regions):
    """Caches of the wanted number of records, or of as many as the smallest tolerance gives."""
    try:
        return compare(c, {"x": regions})["x"]
    except ValueError:
        candidates, region = c.table.candidates(), regions(1e-14)
        visits = random_orders(len(c.truth), c.size.orders, caching.SEED)
        records = np.stack([fill(candidates, region, visit) for visit in visits])
        each = ValidityRegion(*(np.stack([a] * len(visits)) for a in region))
        size = records.sum(axis=1)
        fitted = Fit(np.full(len(visits), 1e-14), size, records, each, size == c.size.records)
        return caching.answered(candidates, fitted, asked(c))


def _floor(c) -> int:
    return c.maps.scene.named("floor")[0]


def _density(outcome) -> np.ndarray:
    """Records in each of 8 x 8 squares, mean over orders of insertion."""
    every = outcome.positions()
    return np.histogram2d(every[:, 1], every[:, 0], 8, [[0, 1], [0, 1]])[0].ravel()


def _claims(clean, found, scatter, blind, noise) -> list[Claim]:
    alike = {
        name: float(np.corrcoef(_density(found[name]), _density(clean[name]))[0, 1])
        for name in found
    }
    cost = found["geometric"].mean / clean["geometric"].mean
    best = min(clean[m].mean for m in ("minimum", "harmonic")) / found["geometric"].mean
    return [
        Claim("RMS error of the noisy irradiance over its mean", "very noisy", noise),
        Claim(
            "Correlation of the records' density with that of many rays, geometric Hessian",
            "a good distribution",
            alike["geometric"],
            "",
            alike["geometric"] > 0.9,
        ),
        Claim(
            "Correlation of the records' density with that of many rays, radiometric Hessian",
            None,
            alike["radiometric"],
        ),
        Claim(
            "Share of places whose radius is infinite: geometric, radiometric",
            None,
            f"{blind['geometric']:.4f}, {blind['radiometric']:.4f}",
            "",
            blind["geometric"] < blind["radiometric"],
        ),
        Claim(
            "Most records, of those wanted, that the radiometric Hessian of 16 rays makes at any "
            "tolerance, 1 for all",
            None,
            float(np.mean(found["radiometric"].fit.size) / np.mean(clean["radiometric"].fit.size)),
        ),
        Claim(
            "Scatter of the finite radii (standard deviation of log R), geometric over radiometric",
            "< 1",
            scatter["geometric"] / scatter["radiometric"],
            "",
            scatter["geometric"] < scatter["radiometric"],
        ),
        Claim(
            "RMS error of clean records at places by 16 noisy rays over places by many, "
            "geometric Hessian",
            None,
            cost,
        ),
        Claim(
            "RMS error of the better split sphere of many rays over that of clean records at "
            "places by the geometric Hessian of 16 noisy rays",
            "> 1",
            best,
            "",
            best > 1.0,
        ),
    ]
