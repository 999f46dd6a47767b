"""E11 Fig. 14: grids that descend and trees that turn: 24 frames, and how much each way flickers.

The paper shows stills and leaves the flicker to a video; here it is measured: over pixels of the
ground that two following frames both show, the root mean square of how much the error changes from
one to the next. An error that stands still is seen less than one that jumps. Every frame has rays
of its own, drawn anew, for stratified rays too. The scenes are those of Figs. 9 and 11
(`e11.shared.space`), whose models are ours; grids descend from 0.6 m to 0.1 m, trees turn by 2
degrees a frame, one either way. Light band limit: 1 wavelength per lamp; bounds of depths are
smoothed over one pixel; pixels among blockers have 64 rays of their own, which are counted.

References are 2,048 stratified rays wherever 64 pilot rays of a pixel or of one no farther than two
pixels do not all agree, and the pilots' 0 or 1 elsewhere. What such a reference flickers itself is
measured on the first two frames, with other rays, and taken out of all numbers in square.

10 shared rays for trees are not smoother than 2,048 stratified ones, as the paper sees them, but as
some hundred: our picture has 1/60 of its pixels, and so as much fewer rays to share.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.ndimage

from figures.e11.shared import compared, space
from figures.e11.shared.measures import equal_rays, without_reference
from figures.style import Claim, Drawing
from firstorder import plotting

FRAMES, QUICK_FRAMES = 24, 3
SIDE, QUICK_SIDE = 128, 32
BUDGETS = (0.3, 3.0, 10.0)
RAYS = 2048  # of the reference
SHOWN = {"grids": 3.0, "trees": 10.0}  # as the paper's stills
BAND = 1.0
CURVE = (1, 3, 10, 32)


def frame(name: str, k: int, side: int, quick: bool) -> space.Scene:
    """One frame of an animation."""
    if name == "grids":
        return space.grids(side, 0.6 - 0.5 * k / (FRAMES - 1))
    return space.trees(side, angle=np.deg2rad(2.0 * k), leaves=1500 if quick else 20_000)


def truth(scene: space.Scene, rays: int) -> np.ndarray:
    """The reference on the ground, NaN elsewhere."""
    floor = compared.ground_of(scene)
    pilot = scene.picture(space.own_rays(scene, scene.floor, 64, 7), scene.floor)
    partly = scipy.ndimage.binary_dilation((pilot > 0.0) & (pilot < 1.0), iterations=2) & floor
    found = space.reference(scene, rays, partly.ravel(), quiet=True)
    return np.where(partly, found, pilot)


class Flicker(NamedTuple):
    """An animation, measured.

    Attributes:
        shared: root mean square of how the error changes between frames, for each budget.
        rms: of the error itself.
        rays: of all kinds that shared ones took, for each pixel of the ground.
        plain: as `shared`, by `CURVE` stratified rays.
        reference: what the reference flickers itself.
        stills: images of the last frame.
        steps: images of how errors changed to the last frame.
    """

    shared: np.ndarray
    rms: np.ndarray
    rays: np.ndarray
    plain: np.ndarray
    reference: float
    stills: dict[str, np.ndarray]
    steps: dict[str, np.ndarray]


def measured(name: str, frames: int, side: int, rays: int, quick: bool) -> Flicker:
    """Renders an animation in every way."""
    before, changes, squares, taken = {}, {}, {}, np.zeros(len(BUDGETS))
    stills, steps, own = {}, {}, []
    for k in range(frames):
        scene = frame(name, k, side, quick)
        true = truth(scene, rays)
        now = {}
        for b, budget in enumerate(BUDGETS):
            found = compared.shared(scene, budget, BAND, (64, 0), seed=k, radius=1)
            taken[b] += found.floor_rays / frames
            now[f"shared {budget:g}"] = found.visible
        for count in CURVE:
            plain = space.own_rays(scene, scene.floor, count, [k, count])
            now[f"plain {count}"] = scene.picture(plain, scene.floor)
        if k < 2:
            other = scene.picture(space.own_rays(scene, scene.floor, rays, [k, 8]), scene.floor)
            own.append(np.nanmean((other - true) ** 2))  # twice the square of its error
        off = {key: value - true for key, value in now.items()}
        for key, error in off.items():
            squares.setdefault(key, []).append(np.nanmean(error**2))
            if before:
                steps[key] = error - before[key]
                changes.setdefault(key, []).append(np.nanmean(steps[key] ** 2))
        before, stills = off, now | {"true": true}
    reference = np.sqrt(np.mean(own))
    flicker = {
        key: float(without_reference(np.sqrt(np.mean(values)), reference))
        for key, values in changes.items()
    }
    keys = [f"shared {b:g}" for b in BUDGETS]
    return Flicker(
        np.array([flicker[key] for key in keys]),
        np.sqrt([np.mean(squares[key]) for key in keys]),
        taken,
        np.array([flicker[f"plain {c}"] for c in CURVE]),
        float(reference),
        stills,
        steps,
    )


def draw(quick: bool) -> Drawing:
    side, frames = (QUICK_SIDE, QUICK_FRAMES) if quick else (SIDE, FRAMES)
    rays = 128 if quick else RAYS
    runs = {name: measured(name, frames, side, rays, quick) for name in SHOWN}
    figure, axes = plotting.panels(2, 5, 2.9, 2.9)
    for letters, row, (name, run) in zip(("abcde", "fghij"), axes, runs.items(), strict=True):
        _draw_row(row, letters, name, run)
    arrays = {
        f"{name} {key}": image for name, run in runs.items() for key, image in run.stills.items()
    }
    curves = {}
    for name, run in runs.items():
        curves[f"{name}_shared"] = {"rays": run.rays, "flicker": run.shared, "rms": run.rms}
        curves[f"{name}_stratified"] = {"rays": np.array(CURVE), "flicker": run.plain}
    size = f"{frames} frames of {side} x {side} pixels, {rays} stratified rays as reference"
    claims = [c for name, run in runs.items() for c in _claims(name, run)]
    return Drawing(figure, arrays, claims, curves, size, 0)


def _draw_row(row, letters: str, name: str, run: Flicker) -> None:
    still = f"shared {SHOWN[name]:g}"
    plain = f"plain {SHOWN[name]:g}"
    grey = dict(cmap="gray", vmin=0.0, vmax=1.0)
    space.show(row[0], run.stills[still], f"{letters[0]}) {name}, {SHOWN[name]:g} rays", **grey)
    space.show(row[1], run.stills[plain], f"{letters[1]}) stratified, as many", **grey)
    signed = dict(cmap=plotting.SIGNED, vmin=-0.2, vmax=0.2)
    drawn = space.show(row[2], run.steps[still], f"{letters[2]}) change of the error", **signed)
    drawn = space.show(row[3], run.steps[plain], f"{letters[3]}) ... stratified", **signed)
    row[3].figure.colorbar(drawn, ax=row[3], shrink=0.75)
    ax = row[4]
    ax.loglog(run.rays, run.shared, "o-", label="shared")
    ax.loglog(CURVE, run.plain, "s--", label="stratified")
    ax.set(title=f"{letters[4]}) flicker", xlabel="rays for each pixel", ylabel="RMS change")
    ax.legend()


def _claims(name: str, run: Flicker) -> list[Claim]:
    words = {
        ("grids", 0.3): "artifacts are noticeable",
        ("grids", 3.0): "artifacts are gone",
        ("trees", 3.0): "flickers",
        ("trees", 10.0): "no flickering; smoother than 2,048 stratified rays",
    }
    claims = [
        Claim(f"Flicker of the reference of {name}", None, 100.0 * run.reference, "% of light")
    ]
    for b, budget in enumerate(BUDGETS):
        at = f"of {name} at {budget:g} shared rays"
        claims.append(
            Claim(f"Flicker {at}", words.get((name, budget)), 100.0 * run.shared[b], "% of light")
        )
        equal = equal_rays(CURVE, run.plain, float(run.shared[b]))
        claims.append(
            Claim(
                f"Stratified rays that flicker as much as those {at}, of all kinds they took",
                "> 2048" if (name, budget) == ("trees", 10.0) else None,
                f"{equal.text} for {run.rays[b]:.3g}",
                "rays",
                equal.rays > 2048 if (name, budget) == ("trees", 10.0) else None,
            )
        )
    for b in (1, 2):
        claims.append(
            Claim(
                f"Flicker of {name} falls from {BUDGETS[b - 1]:g} to {BUDGETS[b]:g} shared rays",
                "falls",
                run.shared[b - 1] / run.shared[b],
                "times",
                run.shared[b] < run.shared[b - 1],
            )
        )
    return claims
