"""R07 Fig. 18: the bumpy sphere from near, sampled by analytic gradients and by differences.

The scene of Fig. 5 (`r07.shared.table`), the camera on the bumpy sphere; no shadows. Both trees
begin with 8 x 8 blocks and end with as many samples, images are linear over the samples'
triangulation as in the paper. Its bumps repeat with the first grid or nearly so (the three wave
lengths of Fig. 5 are one); here they are three incommensurate ones. What is claimed is judged over
lay-outs of wave lengths and phases, materials and lamps (`r07.shared.table.layouts`), in images of
two sizes: bumps are 4 to 11 steps of the first grid long in the larger one, and 2 to 5 in the
smaller one. "Underestimates": the mean size of differences between the first grid's samples against
that of the true gradients at them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.r07.shared import look
from figures.r07.shared import table as shared
from figures.spread import geometric
from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least, at_most
from firstorder import plotting
from firstorder.imaging.camera import pinhole
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import QuadtreeCells, by_area, by_differences, by_gradient
from firstorder.reconstruction.quadtree import sample_image

SHARES, SHOWN = (0.05, 0.1, 0.17), (0.1,)
WAYS = {"gradient": by_gradient, "differences": by_differences, "even": by_area}


CAMERA = pinhole((1.0, -5.0, 2.4), (1.2, 0.0, 0.5), gamma=9.0)
LENGTHS, PHASES = (0.25, 0.19, 0.31), (0.0, 1.0, 2.0)  # of the bumps that are shown [m], [rad]
SOURCE = "R07 §9.2, Fig. 18"
# Of the images of the lay-outs, and what bumps have there in steps of the first grid.
SIDES, BUMPS = (128, 256), ("2 to 5", "4 to 11")


class Refined(NamedTuple):
    """One scene sampled in several ways.

    Attributes:
        true: the image.
        labels: which object each pixel shows.
        bumpy: whether a pixel shows the sphere.
        slopes: size of differences over that of gradients, on the first grid.
        rmse: on the sphere, by way, for each share of samples.
        pictures: put together from a tenth of the samples.
        samples: these, by way.
    """

    true: np.ndarray
    labels: np.ndarray
    bumpy: np.ndarray
    slopes: float
    rmse: dict[str, np.ndarray]
    pictures: dict[str, np.ndarray]
    samples: dict[str, np.ndarray]


def draw(quick: bool) -> Drawing:
    side = 160 if quick else 512
    waves = tuple(2.0 * np.pi / length for length in LENGTHS)
    shown = _refined(shared.table(waves=waves, phases=PHASES), shared.lamp(), side, SHARES)
    true, rmse = shown.true, shown.rmse
    pictures, samples = shown.pictures, shown.samples
    count = 3 if quick else 24
    scan = {
        small: [_refined(o.world, o.lamp(), small, SHOWN) for o in shared.layouts(count)]
        for small in SIDES
    }

    figure, axes = plotting.panels(2, 4, 3.2, 3.2)
    world = shared.table()
    seen = look.look(true, shown.labels, shared.tints(world))
    seen.show(axes[0, 0], true, "a) every pixel")
    faint, drawn = seen.levels(true), None
    for k, name in enumerate(WAYS):
        look.show_samples(axes[0, k + 1], samples[name], side, f"{'bcd'[k]}) samples, {name}",
                          faint)  # fmt: skip
        error = np.where(shown.bumpy, abs(pictures[name] - true), 0.0)
        drawn = shared.show_decades(axes[1, k + 1], error, f"{'fgh'[k]}) error with 10 %, {name}",
                                    -5.0, -2.0)  # fmt: skip
    figure.colorbar(drawn, ax=axes[1, 1:], shrink=0.85, label="log$_{10}$ W/(m$^2$ sr)")
    for name, errors in rmse.items():
        axes[1, 0].loglog(100.0 * np.array(SHARES), errors, "o-", markersize=3, label=name)
    axes[1, 0].set(title="e) error on the sphere", xlabel="samples (% of pixels)",
                   ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    axes[1, 0].set_xticks([5.0, 10.0, 17.0], ["5", "10", "17"])
    axes[1, 0].xaxis.minorticks_off()
    axes[1, 0].legend(fontsize=7)

    curves = {"rmse": {"share": np.array(SHARES), **{k: np.array(v) for k, v in rmse.items()}}}
    arrays = {"true": true, **{f"p {k}": v for k, v in samples.items()}, **pictures}
    claims = _claims(scan, f"{count} bumps, materials and lamps")
    size = f"{side} x {side} pixels, 64 light nodes; lay-outs {SIDES[0]} and {SIDES[1]} across"
    return Drawing(figure, arrays, claims, curves, size)


def _refined(world, lamp, side: int, shares) -> Refined:
    """The sphere from near, sampled in three ways."""
    world, light = world._replace(camera=CAMERA), [lamp]
    p = shared.grid(side)
    truth, index = shared.shaded(world, light, shared.coordinates(p, side), shadows=False)
    true, labels = truth.value.reshape(side, side), index.reshape(side, side)
    bumpy = labels == world.bumpy
    shade = shared.seen_by_tree(world, light, side, shadows=False)
    rmse, pictures, samples = {}, {}, {}
    for name, metric in WAYS.items():
        errors = []
        for share in shares:
            got = sample_image(shade, side, side, int(share * side**2), metric, labels=labels)
            at = shared.shown(world, shared.coordinates(got.p, side))
            picture = delaunay_image(got.p, got.value, side, side, label=at, labels=labels)
            errors.append(float(np.sqrt(np.mean((picture - true)[bumpy] ** 2))))
            if share in SHOWN:
                pictures[name], samples[name] = picture, got.p
        rmse[name] = np.array(errors)
    return Refined(true, labels, bumpy, _first_slopes(shade, side, labels), rmse, pictures, samples)


def _first_slopes(shade, side: int, labels) -> float:
    """On the first grid: mean size of differences over that of gradients, inside of the sphere."""
    seen: list[QuadtreeCells] = []

    def metric(squares):
        seen.append(squares)
        return by_area(squares)

    blocks = -(-side // 8)
    sample_image(shade, side, side, blocks**2, metric)
    first = seen[0]
    # Blocks that show the sphere, and whose neighbours show it too.
    whole = labels[4::8, 4::8] == labels[side // 2, side // 2]
    inner = whole.copy()
    for axis in (0, 1):
        inner &= np.roll(whole, 1, axis) & np.roll(whole, -1, axis)
    numeric = np.linalg.norm(first.differences, axis=1)[inner.ravel()]
    gradient = first.shaded.gradient
    assert gradient is not None
    return float(np.mean(numeric) / np.mean(np.linalg.norm(gradient, axis=1)[inner.ravel()]))


def _claims(scan, scanned: str) -> list[Statement]:
    """Over lay-outs: geometric means with their standard errors."""
    told = []
    for (_, rows), bumps in zip(scan.items(), BUMPS, strict=True):
        slopes = geometric([row.slopes for row in rows])
        better = geometric([_over(row, "differences") for row in rows])
        told += [
            Statement(f"Differences on the first grid underestimate gradients: mean size of the "
                      f"true one's, bumps of {bumps} steps", "somewhat", slopes.mean,
                      at_most(1.0, "'underestimates'"), SOURCE, "", slopes.error, scanned,
                      "Differences over a few steps see long bumps as gradients do."),
            Statement(f"Sampling by gradients preserves the bumps somewhat better: rms error by "
                      f"differences over its own, 10 % of samples, bumps of {bumps} steps",
                      "somewhat better", better.mean, at_least(1.0, "'better': smaller error"),
                      SOURCE, "times", better.error, scanned,
                      "Differences over a few steps see these bumps as well as gradients do."),
        ]  # fmt: skip
    # Both images of a lay-out count once.
    pairs = zip(*scan.values(), strict=True)
    even = geometric([np.sqrt(_over(a, "even") * _over(b, "even")) for a, b in pairs])
    told.append(
        Statement("Rms error of an even tree over that by gradients, 10 % of samples", None,
                  even.mean, at_least(1.0, "smaller error by gradients"), OURS, "times",
                  even.error, scanned)
    )  # fmt: skip
    return told


def _over(row: Refined, way: str) -> float:
    """Error of one way over that by gradients."""
    return float((row.rmse[way] / row.rmse["gradient"])[0])
