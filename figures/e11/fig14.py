"""E11 Fig. 14: grids that descend and trees that turn: 21 frames, and how much each way flickers.

The paper shows stills and leaves the flicker to a video; here it is measured: over pixels of the
ground that two following frames both show, the root mean square of how much the error changes from
one to the next. An error that stands still is seen less than one that jumps. Every frame has rays
of its own, drawn anew, for stratified rays too. The scenes are those of Figs. 9 and 11
(`e11.shared.space`), whose models are ours; grids descend from 0.6 m to 0.1 m, trees turn by 2
degrees a frame, one either way.

Chance is in the rays, not in the frames: an animation is measured with four seeds of shared rays,
and errors are those of its mean over them. Frames differ by much more, since grids come near.

The paper's images are of some 1,000 x 1,000 pixels. Ours are closeups of 96 x 96 of 1,024 x 1,024
pixels, those with most penumbra in the middle frame; the ground up to 32 pixels beside them traces
shared rays, too. Every sixth pixel both ways is judged, and every second one drawn. Light band
limits and cells of the lamp are those of `methods` for 16 times the rays, since a pixel of 256 x
256 holds 16 of these; pixels among blockers have 64 rays of their own.

What flicker is visible? The paper says that 2,048 stratified rays a pixel leave a small amount of
noise which is still visible in the animation. So that flicker is the threshold: what flickers more
is noticeable, and what is to be seen no more has to flicker less. Two independent images of 2,048
rays for each frame tell how much these flicker, and serve as references: products of errors against
either are free of the references' noise.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from figures.e11.shared import limits, methods, space
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting

FRAMES, QUICK_FRAMES = 21, 4
CLOSEUP, EDGE, QUICK_CLOSEUP, QUICK_EDGE = 96, 32, 24, 8  # pixels, and pixels around them
JUDGED, DRAWN = 6, 2  # every so manieth pixel, both ways
RAYS, QUICK_RAYS = 2048, 256
SEEDS, QUICK_SEEDS = 4, 2  # of shared rays
COARSE = 64  # pixels of the view in which closeups are found
BUDGETS = {"grids": (0.3, 3.0), "trees": (3.0, 10.0)}
SHOWN = {"grids": 3.0, "trees": 10.0}  # as the paper's stills
STRATIFIED = "2,048 stratified"


def frame(name: str, k: int, quick: bool) -> space.Scene:
    """One frame of an animation, in a closeup."""
    side = 4 * space.QUICK_SIDE if quick else space.PAPER_SIDE
    size, edge = (QUICK_CLOSEUP, QUICK_EDGE) if quick else (CLOSEUP, EDGE)
    i, j = (round(c * side) - edge for c in _corner(name, quick))
    return _scene(name, k, side, quick, (i, j, size + 2 * edge))


def _scene(name: str, k: int, side: int, quick: bool, window=None) -> space.Scene:
    if name == "grids":
        return space.grids(side, 0.6 - 0.5 * k / (FRAMES - 1), window)
    leaves = 1500 if quick else 20_000
    return space.trees(side, angle=np.deg2rad(2.0 * k), leaves=leaves, window=window)


@functools.cache
def _corner(name: str, quick: bool) -> tuple[float, float]:
    """Where the closeup is, in widths of the image: most penumbra, in the middle of the frames."""
    scene = _scene(name, FRAMES // 2, COARSE, quick)
    seen = scene.picture(space.own_rays(scene, scene.floor, 64, 5), scene.floor)
    size = round(COARSE * (CLOSEUP / space.PAPER_SIDE))
    i, j = limits.window(seen, size)
    return i.start / COARSE, j.start / COARSE


class Flicker(NamedTuple):
    """An animation, measured.

    Attributes:
        squares: mean square of how the error changes, by way, pair of frames and seed.
        stills: images of the last frame.
        steps: images of how errors changed to the last frame.
    """

    squares: dict[str, np.ndarray]
    stills: dict[str, np.ndarray]
    steps: dict[str, np.ndarray]

    def ratio(self, way: str) -> tuple[float, float]:
        """Flicker over that of 2,048 stratified rays, and its standard error over seeds.

        Both are roots of means over all pairs of frames: what flickers as much comes out as 1.
        """
        base, noise = spread(self.squares[STRATIFIED])
        squares = np.maximum(np.mean(self.squares[way], 0), 0.0)
        mean, error = spread(np.sqrt(squares / base))
        return mean, float(np.hypot(error, mean * 0.5 * noise / base))

    def percent(self, way: str) -> float:
        """Flicker in % of the light."""
        return 100.0 * float(np.sqrt(max(np.mean(self.squares[way]), 0.0)))


def errors(name: str, k: int, quick: bool, step: int, seeds: int = 1) -> dict[str, np.ndarray]:
    """Of a frame's pixels, NaN off the ground: what each way sees, by seed, and two references."""
    scene, edge = frame(name, k, quick), QUICK_EDGE if quick else EDGE
    some = scene.floor & scene.every(step, edge)
    part = slice(edge, scene.side - edge, step)
    rays = QUICK_RAYS if quick else RAYS

    def image(values) -> np.ndarray:
        return scene.picture(values, some)[part, part]

    def shared(budget: float, seed: int) -> np.ndarray:
        answer = methods.ours(scene, budget, k + FRAMES * seed, judged=some, dense=space.DENSE)
        return image(answer.visible)

    found = {
        f"{b:g} shared": np.stack([shared(b, seed) for seed in range(seeds)]) for b in BUDGETS[name]
    }
    few = round(SHOWN[name])
    found[f"{few} stratified"] = image(space.own_rays(scene, some, few, [k, few]))[None]
    for half in "ab":
        found[half] = image(space.own_rays(scene, some, rays, [k, ord(half)]))[None]
    return found


def measured(name: str, frames: int, quick: bool) -> Flicker:
    """Renders an animation in every way."""
    squares: dict[str, list[np.ndarray]] = {}
    before: dict[str, np.ndarray] = {}
    for k in range(frames):
        now = errors(name, k, quick, JUDGED, QUICK_SEEDS if quick else SEEDS)
        for key in () if not before else (key for key in now if key not in "ab"):
            one, other = ((now[key] - now[r]) - (before[key] - before[r]) for r in "ab")
            squares.setdefault(key, []).append(_over_pixels(one * other))
        if before:
            # Both references flicker: their difference has twice the square of either.
            both = (now["a"] - now["b"]) - (before["a"] - before["b"])
            squares.setdefault(STRATIFIED, []).append(0.5 * _over_pixels(both**2))
        before = now
    last, one = (
        {key: images[0] for key, images in errors(name, frames - n, quick, DRAWN).items()}
        for n in (1, 2)
    )
    steps = {
        key: (last[key] - last["a"]) - (one[key] - one["a"]) for key in last if key not in "ab"
    }
    return Flicker({key: np.array(v) for key, v in squares.items()}, last, steps)


def _over_pixels(squares: np.ndarray) -> np.ndarray:
    """Means over the ground, by seed."""
    return np.nanmean(squares, axis=(-2, -1))


def draw(quick: bool) -> Drawing:
    frames = QUICK_FRAMES if quick else FRAMES
    runs = {name: measured(name, frames, quick) for name in SHOWN}
    figure, axes = plotting.panels(2, 5, 2.9, 2.9)
    for letters, row, (name, run) in zip(("abcde", "fghij"), axes, runs.items(), strict=True):
        _draw_row(row, letters, name, run)
    arrays = {
        f"{name} {key}": image for name, run in runs.items() for key, image in run.stills.items()
    }
    curves = {
        f"{name}_flicker": {"pair": np.arange(1, frames)}
        | {key: np.sqrt(np.maximum(np.mean(v, -1), 0.0)) for key, v in run.squares.items()}
        for name, run in runs.items()
    }
    rays = QUICK_RAYS if quick else RAYS
    size = f"{frames} frames, closeups of 1,024 x 1,024 pixels, {rays} stratified rays"
    return Drawing(figure, arrays, _claims(runs), curves, size, 0)


def _draw_row(row, letters: str, name: str, run: Flicker) -> None:
    still, plain = f"{SHOWN[name]:g} shared", f"{SHOWN[name]:.0f} stratified"
    grey = dict(cmap="gray", vmin=0.0, vmax=1.0)
    space.show(row[0], run.stills[still], f"{letters[0]}) {name}, {still}", **grey)
    space.show(row[1], run.stills[plain], f"{letters[1]}) {plain}", **grey)
    signed = dict(cmap=plotting.SIGNED, vmin=-0.05, vmax=0.05)
    drawn = space.show(row[2], run.steps[still], f"{letters[2]}) change of the error", **signed)
    drawn = space.show(row[3], run.steps[plain], f"{letters[3]}) ... stratified", **signed)
    row[3].figure.colorbar(drawn, ax=row[3], shrink=0.75)
    ax = row[4]
    for key, values in run.squares.items():
        mean = np.maximum(np.mean(values, -1), 1e-9)
        ax.semilogy(np.arange(1, len(mean) + 1), np.sqrt(mean), label=key)
    ax.set(title=f"{letters[4]}) flicker", xlabel="frame", ylabel="RMS change")
    ax.legend(fontsize=6)


def _claims(runs: dict[str, Flicker]) -> list[Statement | Measurement]:
    grids, trees = runs["grids"], runs["trees"]
    visible = "the flicker of 2,048 stratified rays, 'a small amount of noise still visible'"
    more, less = at_least(1.0, visible), at_most(1.0, visible)
    pairs = f"{len(grids.squares[STRATIFIED])} pairs of frames"
    too_much = (
        "Grids that hang 0.4 m and more above the ground flicker less than that, and up to twice "
        "as much from there down to 0.15 m, where filters at their feet hold few rays and each "
        "frame has rays of its own."
    )
    rows = (
        (grids, "0.3 shared", "With 0.3 rays a pixel there are noticeable artifacts, grids",
         "noticeable", more),
        (grids, "3 shared", "These artifacts go away using 3.0 rays a pixel, grids", "go away",
         less),
        (trees, "3 shared", "With 3.0 rays a pixel flickering can be seen, trees", "can be seen",
         more),
        (trees, "10 shared", "10.0 rays a pixel deliver a smoother result than 2,048 stratified "
         "rays with no visual flickering, trees", "smoother", less),
    )  # fmt: skip
    found: list[Statement | Measurement] = []
    for run, way, words, paper, rule in rows:
        ratio, error = run.ratio(way)
        found.append(
            Statement(
                f"{words}: flicker over that of 2,048 stratified rays",
                paper,
                ratio,
                rule,
                "E11 §6.4",
                "times",
                error,
                pairs,
                too_much if rule is less else "It flickers less than what is visible.",
            )
        )
    for name, run in runs.items():
        found += [
            Measurement(f"Flicker of {name}, {way}", run.percent(way), "% of light")
            for way in run.squares
        ]
    return found
