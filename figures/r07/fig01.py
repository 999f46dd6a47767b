"""R07 Fig. 1: what gradients buy: images from few samples (above), soft shadows from fewer (below).

Above: the scene of Fig. 15 (`r07.shared.meshes`, meshes of our own for the paper's models), 17 % of
the samples where the gradient says, put together with the samples' own gradients; "evenly" is a
lattice that knows of no silhouettes, put together linearly. Below: the scene of Fig. 13
(`r07.shared.spheres`), values and gradients of the shadow at 20 x 20 places of 200 x 200, which is
1 %. The paper gives pictures, 6x, and "1 %"; times are in Fig. 15, and what the shadows gain, over
rooms, in Fig. 13. "Comparable to the reference" and "accurate" are our reading: rms below one level
of 8 bits above, which are what images are looked at with, and below two levels below.
"""

from __future__ import annotations

import jax
import numpy as np

from figures.r07.shared import look, spheres, table
from figures.r07.shared import meshes as shared
from figures.spread import rms
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.reconstruction import GridInterpolant
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import by_gradient
from firstorder.reconstruction.quadtree import sample_image
from firstorder.space.library._scenes import three_spheres

SHARE, HALF, NODES = 0.17, 1.5, 20
CLOSEUPS = (
    look.Closeup((0.72, 0.88), (0.46, 0.62), (0.60, 0.67, 0.38, 0.31)),
    look.Closeup((0.62, 0.78), (0.24, 0.40), (0.02, 0.67, 0.38, 0.31), look.FRAMES[1]),
)
SHADOWS = (look.Closeup((0.36, 0.60), (0.36, 0.60), (0.66, 0.02, 0.32, 0.32)),)


def draw(quick: bool) -> Drawing:
    side, nodes, pixels = (96, 6, 80) if quick else (512, shared.NODES, 200)
    known = shared.lattices(side, nodes)
    true, labels = known.reference["value"], known.labels
    budget = int(SHARE * side**2)
    got = sample_image(known.shade(), side, side, budget, by_gradient, labels=labels,
                       smallest=shared.FINEST)  # fmt: skip
    label = known.at(got.p, "label").astype(int)
    image = delaunay_image(got.p, got.value, side, side, gradient=got.gradient, scheme="gradient",
                        label=label, labels=labels)  # fmt: skip
    even = _evenly(known, budget)
    shadow, soft, fine = _shadows(pixels)

    white = np.quantile(true, 0.998)
    figure, axes = plotting.panels(2, 4, 3.4, 3.4)
    seen = look.look(true, known.reference["index"].astype(int), shared.TINTS, CLOSEUPS)
    seen.show(axes[0, 0], true, "a) every pixel")
    seen.show(axes[0, 1], image, "b) 17 %, where the gradient says")
    seen.show(axes[0, 2], even, "c) 17 %, evenly")
    look.show_samples(axes[0, 3], got.p, side, "d) samples of b", seen.levels(true))
    ground = look.Look(np.zeros(shadow.shape, int), np.array([look.WOOD]), 0.30, SHADOWS)
    ground.show(axes[1, 0], shadow, "e) soft shadows, every pixel")
    ground.show(axes[1, 1], soft, "f) 1 % of pixels, with gradients")
    ground.show(axes[1, 2], fine, "g) 1 %, bilinear")
    drawn = table.show_decades(axes[1, 3], abs(soft - shadow), "h) error of f", -4.0, -1.0)
    figure.colorbar(drawn, ax=axes[1, 3], shrink=0.8, label="log$_{10}$ of open light")

    lit = {n: rms(a - true) / white for n, a in (("gradient", image), ("even", even))}
    dark = {n: rms(a - shadow) for n, a in (("gradient", soft), ("bilinear", fine))}
    level = 1.0 / 255.0
    claims = [
        Statement("With only 17 % of the samples we obtain sharp results comparable to the "
                  "reference: rms error by gradient, of white", "comparable",
                  100.0 * lit["gradient"], at_most(100.0 * level, "one level of 8 bits"),
                  "R07 §9.1, Fig. 1", "%"),
        Statement("An equal number of uniform samples blurs the bumps considerably: rms error "
                  "evenly over that by gradient", "considerably", lit["even"] / lit["gradient"],
                  at_least(2.0, "'considerably': twice the error"), "R07 §9.1", "times"),
        Statement("Accurate results by explicitly evaluating only 1 % of the pixels: rms error of "
                  "soft shadows, of open light", "accurate", 100.0 * dark["gradient"],
                  at_most(200.0 * level, "two levels of 8 bits"), "R07 §8, Fig. 1", "%"),
        Measurement("1 % of pixels: rms error bilinear over that with gradients",
                    dark["bilinear"] / dark["gradient"], "times"),
    ]  # fmt: skip
    arrays = {"true": true, "image": image, "even": even, "p": got.p, "shadow": shadow,
              "soft": soft, "bilinear": fine}  # fmt: skip
    size = f"{side} x {side} pixels, {budget} samples, {nodes**2} shadow rays; {pixels} x {pixels}"
    return Drawing(figure, arrays, claims, {}, size)


def _evenly(known, budget: int):
    """As many samples on a lattice of their own, silhouettes unknown: plain uniform sampling."""
    side = known.side
    count = int(np.sqrt(budget))
    x = (np.arange(count) + 0.5) * side / count
    at = np.rint(x - 0.5).astype(int).clip(0, side - 1)
    p = np.stack(np.meshgrid(at + 0.5, at + 0.5, indexing="ij"), -1).reshape(-1, 2)
    return delaunay_image(p, known.at(p, "value"), side, side)


def _shadows(pixels: int):
    """Of the spheres: truth, with gradients from 20 x 20 nodes, bilinear from the same."""
    scene, light = three_spheres(), spheres.sun()
    balls = scene.groups[0]
    world = spheres.Spheres(balls.center, balls.axes[:, 0, 0])
    whole = float(spheres.open_light(light))
    x = HALF * (2.0 * np.arange(pixels) + 1.0 - pixels) / pixels
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    truth = np.asarray(spheres.values(world, light, places)).reshape(pixels, pixels) / whole
    a = np.linspace(-HALF, HALF, NODES)
    nodes = np.stack(np.meshgrid(a, a, indexing="ij"), -1).reshape(-1, 2)
    E, slope = spheres.with_gradients(world, light, nodes)
    data = (np.concatenate([E[:, None], slope], -1) / whole).reshape(NODES, NODES, 3)
    across, up = np.meshgrid(x, x, indexing="ij")

    def put(scheme):
        return np.asarray(jax.jit(GridInterpolant(a, a, data, scheme).__call__)(across, up))

    return truth, put("hermite"), put("bilinear")
