"""E11 Fig. 9: grids that cast shadows from sharp to wide: wavelets, photons, shared rays.

The paper gives no errors. Ours: two leaning grids (`e11.shared.space.grids`), 256 x 256 pixels,
against 2,048 stratified rays. Adaptive wavelet rendering is our own, after Overbeck et al. 2009
(`figures.e11.competitors.wavelets`), not the original program that the paper ran; the photon map is
ours too (`figures.e11.competitors.photons`), with photons sent to the ground alone, and k = 0.015
N^(2/3) of N are averaged: about the best for this scene. They are sent to the rectangle that holds
all that is seen of the ground, of which a third is seen. Budgets are rays, or photons that leave
the lamp, for each pixel of the ground. All methods see the ground; what stands on it is painted
flat.

"Better with 4 rays than both with 32" holds of photons and not of wavelets: ours end a tenth or so
below shared rays, with eight times their rays, and their largest errors are half as large. These
wavelets are better off than the paper's: their rays are spread over the lamp by an additive
sequence. Coefficients are shrunk by the variances of independent samples; those of an additive
sequence have less, 0.39, 0.31 and 0.19 of it at 4, 8 and 32 rays, so that they are shrunk more than
they need be. Errors of shared rays stand close to the grids' feet, where the filter is as narrow as
a pixel.

Memory: the paper's 33 M photons take 1.8 GB, 55 bytes each. Ours are 12 bytes each, for all have
the same power and lie on one plane, and as much again and more in the tree that finds them.
"""

from __future__ import annotations

from matplotlib.patches import Rectangle

from figures.e11.shared import measures, methods
from figures.e11.shared import space as e11
from figures.style import Claim, Drawing
from firstorder import plotting

SEED = 9
TITLES = ("adaptive wavelets, 32 samples", "photons, 32 a pixel", "shared rays, 4 a pixel")
INSETS = ((0.14, 0.26), (0.66, 0.2))  # corners, in widths of the image
INSET = 0.2
PAPER_BYTES = 1.8e9 / 33e6


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
    claims = _claims(answers, off, sent, int(spread.sum()))
    return Drawing(figure, arrays, claims, {}, f"{side} x {side} pixels", SEED)


def _show(ax, image, title):
    e11.show(ax, image, title, cmap="gray", vmin=0.0, vmax=1.0)
    ax.set_facecolor("#5b6b86")  # what stands on the ground


def _claims(answers, off, sent, rays) -> list[Claim]:
    names = ("adaptive wavelets, 32 samples", "photon map, 32 photons", "shared rays, 4")
    found = [
        Claim(
            f"Grids, {name} a pixel: RMS, 99th percentile, largest error",
            None,
            ", ".join(f"{100 * x:.2f}" for x in e),
            "% of light",
        )
        for name, e in zip(names, off, strict=True)
    ]
    return [
        *found,
        Claim(
            "RMS of wavelets and of photons over that of shared rays",
            "better with 4 rays than both with 32",
            ", ".join(f"{e.rms / off[2].rms:.2f}" for e in off[:2]),
            "times",
            off[2].rms < min(off[0].rms, off[1].rms),
        ),
        Claim(
            "Rays for each pixel of the ground in all, own ones near blockers counted in",
            4.0,
            answers[2].rays,
            "rays",
        ),
        Claim(
            "Samples that wavelets took for each pixel of the ground, in the mean",
            32.0,
            rays / answers[0].visible.size,
            "samples",
        ),
        Claim(
            "Bytes for a photon, without the tree that finds it",
            PAPER_BYTES,
            sent.bytes_each,
            "bytes",
            sent.bytes_each <= PAPER_BYTES,
        ),
        Claim("Photons that arrived", 33e6, float(len(sent.position)), "photons"),
        Claim(
            "Processor time of wavelets, photons, shared rays",
            None,
            ", ".join(f"{a.seconds:.1f}" for a in answers),
            "s",
        ),
    ]  # fmt: skip
