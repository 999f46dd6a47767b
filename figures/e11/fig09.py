"""E11 Fig. 9: grids that cast shadows from sharp to wide: wavelets, photons, shared rays.

The paper gives no errors. Ours: two leaning grids (`e11.shared.space.grids`), 256 x 256 pixels,
against 2,048 stratified rays. Adaptive wavelet rendering is our own, after Overbeck et al. 2009
(`figures.e11.competitors.wavelets`), not the original program that the paper ran; the photon map is
ours too (`figures.e11.competitors.photons`), with photons sent to the ground alone, and k = 0.015
N^(2/3) of N are averaged: about the best for this scene. They are sent to the rectangle that holds
all that is seen of the ground, of which a third is seen. Budgets are rays, or photons that leave
the lamp, for each pixel of the ground. All methods see the ground; what stands on it is painted
flat.

What is judged are closeups of the paper's density, 96 x 96 pixels of 1,024 x 1,024 in each of the
two insets, 10 seeds each, on every third pixel both ways against 2,048 stratified rays. Wavelets
and photons have them for themselves; shared rays come from 64 pixels beside them, too. Their band
limit and cells are those of `methods.band_of` and `cells_of` for 16 times the rays, since a pixel
of 256 x 256 holds 16 of these.

These wavelets are better off than the paper's: their rays are spread over the lamp by an additive
sequence. Coefficients are shrunk by the variances of independent samples; those of an additive
sequence have less, 0.39, 0.31 and 0.19 of it at 4, 8 and 32 rays, so that they are shrunk more than
they need be.

Memory: the paper's 33 M photons take 1.8 GB, 55 bytes each, with their tree, direction and power.
Ours are 12 bytes each, for all have the same power and lie on one plane, and as much again and more
in the tree that finds them: that is no claim about a photon map, and is measured.
"""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Rectangle

from figures.e11.shared import measures, methods
from figures.e11.shared import space as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting

SEED = 9
TITLES = ("adaptive wavelets, 32 samples", "photons, 32 a pixel", "shared rays, 4 a pixel")
INSETS = ((0.14, 0.26), (0.66, 0.2))  # corners, in widths of the image
INSET = 0.2
CLOSEUP, EDGE, STEP = 96, 64, 3  # pixels; around them; of those that are judged
QUICK_CLOSEUP, QUICK_EDGE = 24, 8


def draw(quick: bool) -> Drawing:
    side = e11.QUICK_SIDE if quick else e11.SIDE
    methods.warm()
    scene = e11.grids(side)
    floor = scene.floor
    true = e11.reference(scene, e11.QUICK_RAYS if quick else e11.RAYS)
    true = scene.picture(true.ravel()[floor], floor)
    by_wavelets, spread = methods.by_wavelets(scene, 32, SEED)
    by_photons, sent = methods.by_photons(scene, 32, SEED)
    answers = (by_wavelets, by_photons, methods.ours(scene, 4, SEED))
    off = [measures.errors(a.visible, true.ravel()[floor]) for a in answers]
    images = [scene.picture(a.visible, floor) for a in answers]

    figure, axes = plotting.panels(3, 4, 3.0, 3.0)
    whole = [*images, true]
    for ax, image, title in zip(axes[0], whole, (*TITLES, "reference"), strict=True):
        _show(ax, image, title)
        for k, corner in enumerate(INSETS):
            box = [c * side for c in corner]
            edge = dict(fill=False, edgecolor=plotting.COLOURS[1 + k], linewidth=1.2)
            ax.add_patch(Rectangle(box, INSET * side, INSET * side, **edge))
    for k, corner in enumerate(INSETS):
        i, j = (round(c * side) for c in corner)
        part = slice(i, i + round(INSET * side)), slice(j, j + round(INSET * side))
        for ax, image in zip(axes[1 + k], whole, strict=True):
            _show(ax, image[part], "")
            for spine in ax.spines.values():
                spine.set(color=plotting.COLOURS[1 + k], linewidth=1.6)
    for ax, e in zip(axes[1], off, strict=False):
        ax.set_title(f"rms {100 * e.rms:.2f} %, largest {100 * e.largest:.0f} %")
    arrays = {"reference": true, "samples of wavelets": spread}
    arrays |= {name.split(",")[0]: image for name, image in zip(TITLES, images, strict=True)}
    claims = _claims(answers, off, sent, int(spread.sum()), _ratios(quick))
    return Drawing(figure, arrays, claims, {}, f"{side} x {side} pixels", SEED)


def _show(ax, image, title):
    e11.show(ax, image, title, cmap="gray", vmin=0.0, vmax=1.0)
    ax.set_facecolor("#5b6b86")  # what stands on the ground


def _ratios(quick: bool) -> np.ndarray:
    """RMS errors of wavelets and of photons over those of shared rays, a row for each run."""
    whole = 4 * e11.QUICK_SIDE if quick else e11.PAPER_SIDE
    size, edge = (QUICK_CLOSEUP, QUICK_EDGE) if quick else (CLOSEUP, EDGE)
    found = []
    for corner in INSETS:
        # In the middle of the inset.
        i, j = (round((c + 0.5 * INSET) * whole) - size // 2 for c in corner)
        alone = e11.grids(whole, window=(i, j, size))
        around = e11.grids(whole, window=(i - edge, j - edge, size + 2 * edge))
        some = alone.floor & alone.every(STEP)
        true = e11.own_rays(alone, some, e11.QUICK_RAYS if quick else e11.RAYS, 3)
        at = some[alone.floor]
        judged = around.every(STEP, edge)
        for seed in range(1, 3 if quick else 11):
            answers = (
                methods.ours(around, 4, seed, judged=judged, dense=e11.DENSE).visible,
                methods.by_wavelets(alone, 32, seed)[0].visible[at],
                methods.by_photons(alone, 32, seed)[0].visible[at],
            )
            rms = [np.sqrt(np.mean((a - true) ** 2)) for a in answers]
            found.append([rms[1] / rms[0], rms[2] / rms[0], rms[0]])
    return np.array(found)


def _claims(answers, off, sent, rays, ratios) -> list[Statement | Measurement]:
    names = ("adaptive wavelets, 32 samples", "photon map, 32 photons", "shared rays, 4")
    found = [
        Measurement(
            f"Grids, {name} a pixel: RMS, 99th percentile, largest error",
            ", ".join(f"{100 * x:.2f}" for x in e),
            "% of light",
        )
        for name, e in zip(names, off, strict=True)
    ]
    wavelets, photons, shared = (spread(column) for column in ratios.T)
    scanned = f"two closeups of 1,024 x 1,024 pixels, {len(ratios) // 2} seeds each"
    better = at_least(1.0, "'better', 'a fair amount of noise': a larger error than ours")
    return [
        Statement(
            "4 shared rays capture the shadow better than adaptive wavelets with 32 samples: RMS "
            "error of these over that of shared rays",
            "better",
            wavelets[0],
            better,
            "E11 §6.1, Fig. 9",
            "times",
            wavelets[1],
            scanned,
            "Where bars are a few pixels wide and blockers near, the filter's bias at 4 rays "
            "exceeds "
            "the noise of 32 samples that are spread over the lamp by an additive sequence.",
        ),
        Statement(
            "A photon map still has a fair amount of noise with 32 photons a pixel: its RMS error "
            "over that of 4 shared rays",
            "a fair amount of noise",
            photons[0],
            better,
            "E11 §6.1, Fig. 9",
            "times",
            photons[1],
            scanned,
        ),
        Measurement("RMS error of 4 shared rays in the closeups", shared[0], "of the light",
                    shared[1]),
        *found,
        Measurement("RMS of wavelets and of photons over that of shared rays, 256 x 256 pixels",
                    ", ".join(f"{e.rms / off[2].rms:.2f}" for e in off[:2]), "times"),
        Measurement("Rays for each pixel of the ground in all, own ones near blockers counted in",
                    answers[2].rays, "rays"),
        Measurement("Samples that wavelets took for each pixel of the ground, in the mean",
                    rays / answers[0].visible.size, "samples"),
        Measurement("Bytes for a photon as stored here, without the tree that finds it",
                    sent.bytes_each, "bytes"),
        Measurement("Photons that arrived", float(len(sent.position)), "photons"),
        Measurement("Processor time of wavelets, photons, shared rays",
                    ", ".join(f"{a.seconds:.1f}" for a in answers), "s"),
    ]  # fmt: skip
