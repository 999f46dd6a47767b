"""E11 Fig. 11: two trees over curved ground under a medium and a large lamp; stratified rays.

The paper times three cases against 2,048 stratified rays: its Fig. 1 and both lamps of this figure,
4.3, 2.4 and 16.4 times as fast with one ray a pixel (23:03 over 5:18, 16:19 over 6:50, 3:34:00 over
13:02). Its errors are not given. Ours: seeded trees (`shared.space.trees`), lamps of 0.7 and 2.1 m,
256 x 256 pixels, 1,024 stratified rays as the reference; ours are the processor's seconds of one
process, rays by Embree.

One shared ray has the error of a few dozen stratified ones and not of 2,048, so that times are
compared at equal RMS error, of 60 seeds on every fourth pixel both ways, called in turns. Embree
traces two million rays a second, some thirty times as many as the paper's renderer, so that ours
spends most of its time in the filter. Where a ray costs more, for geometry that does not fit or for
shaders, the ratio of rays is what counts: the last numbers say at which cost of a ray both are
equally fast.

Under the larger lamp shared rays save most rays at equal error: softer shadows, wider filters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures import timing
from figures.e11.shared import compared, measures, methods
from figures.e11.shared import space as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting

SEED = 11
LAMPS = {"medium lamp": 0.35, "large lamp": 1.05}
PAPER = {"medium lamp": 2.4, "large lamp": 16.4}
WORDS = {"medium lamp": "16:19 over 6:50", "large lamp": "3:34:00 over 13:02"}
PAPER_SPLIT = {"medium lamp": 325.0 / 410.0, "large lamp": 392.0 / 782.0}  # tracing's share
SHARED, COUNTS, QUICK = (1, 4), (4, 16, 64, 128), (4, 16, 64)
RAYS = 1024  # of the reference
SEEDS = 60  # with 20 seeds and 30 rounds one claim was within its error
ROUNDS, QUICK_ROUNDS = 120, 3  # of times


class Case(NamedTuple):
    """A lamp, and what was measured under it.

    Attributes:
        scene: the scene.
        true: the reference on the ground, NaN elsewhere.
        shared, plain: images by shared rays and by stratified ones.
        off, plain_off: their errors.
        even: stratified rays a pixel of equal RMS as 1 shared ray, by seed.
    """

    scene: e11.Scene
    true: np.ndarray
    shared: list[methods.Answer]
    plain: list[methods.Answer]
    off: list[measures.Errors]
    plain_off: list[measures.Errors]
    even: np.ndarray

    @property
    def saved(self) -> np.ndarray:
        """Stratified rays of equal RMS over all that 1 shared ray takes, by seed."""
        return self.even / self.shared[0].rays

    @property
    def seconds(self) -> float:
        """Of one stratified ray for every pixel of the ground, at the largest count."""
        return self.plain[-1].seconds / self.plain[-1].rays

    def equal(self, k: int) -> measures.EqualRays:
        """Stratified rays of the RMS of the k-th of the shared ones."""
        rms = [e.rms for e in self.plain_off]
        return measures.equal_rays([a.rays for a in self.plain], rms, self.off[k].rms)


def draw(quick: bool) -> Drawing:
    side, rays = (e11.QUICK_SIDE, e11.QUICK_RAYS) if quick else (e11.SIDE, RAYS)
    methods.warm()
    cases = {
        name: _case(e11.trees(side, half), rays, QUICK if quick else COUNTS, 3 if quick else SEEDS)
        for name, half in LAMPS.items()
    }
    figure, axes = plotting.panels(2, 5, 2.6, 2.6)
    for row, (name, case) in zip(axes, cases.items(), strict=True):
        _draw_images(row[:4], name, case)
        _draw_errors(row[4], case)
    curves = {
        name: {
            "rays": [a.rays for a in (*case.shared, *case.plain)],
            "rms": [e.rms for e in (*case.off, *case.plain_off)],
            "trace seconds": [a.trace for a in (*case.shared, *case.plain)],
            "filter seconds": [a.filter for a in (*case.shared, *case.plain)],
        }
        for name, case in cases.items()
    }
    arrays = {}
    for name, case in cases.items():
        arrays[f"{name} reference"] = case.scene.picture(case.true)
        arrays[f"{name} shared"] = case.scene.picture(case.shared[0].visible, case.scene.floor)
    others = timing.Others()
    times = _in_turns(cases, QUICK_ROUNDS if quick else ROUNDS)
    claims = [
        claim
        for name, case in cases.items()
        for claim in _claims(name, case, timing.of_times(times[name], others))
    ]
    claims += _larger(*cases.values(), _gained(*times.values(), others))
    return Drawing(figure, arrays, claims, curves, f"{side} x {side} pixels", SEED)


def _case(scene, rays, counts, seeds) -> Case:
    floor = scene.floor
    image = e11.penumbra_reference(scene, rays)
    true = np.where(floor, image.ravel(), np.nan)
    shared = [methods.ours(scene, n, SEED) for n in SHARED]
    plain = [methods.stratified(scene, n, SEED) for n in counts]
    off, plain_off = (
        [measures.errors(a.visible, true[floor]) for a in some] for some in (shared, plain)
    )
    where = scene.every(4)
    some = compared.repeated(scene, image, 1.0, methods.BAND, seeds, where, own=(methods.OWN, 0))
    rms = compared.stratified_rms(scene, some, where, counts)
    even = compared.equal_stratified(some, rms, counts)
    return Case(scene, true, shared, plain, off, plain_off, even)


def _in_turns(cases: dict[str, Case], rounds: int) -> dict[str, list[tuple[float, float]]]:
    """Times of stratified and of shared rays under each lamp, after one unmeasured turn [s]."""
    ways = {n: compared.both_ways(case.scene, 1.0, methods.BAND) for n, case in cases.items()}
    turns = [
        {n: (timing.seconds(slow), timing.seconds(fast)) for n, (slow, fast) in ways.items()}
        for _ in range(rounds + 1)
    ]
    return {name: [turn[name] for turn in turns[1:]] for name in cases}


def _draw_images(axes, name, case: Case) -> None:
    floor = case.scene.floor
    off = (case.off[0], case.plain_off[1], case.plain_off[-1])
    shown = (case.shared[0], case.plain[1], case.plain[-1])
    titles = ("1 shared ray", *(f"{a.rays:.0f} stratified" for a in shown[1:]))
    for ax, title, a, e in zip(axes, titles, shown, off, strict=False):
        image = case.scene.picture(a.visible, floor)
        e11.show(ax, image, f"{title}: {100 * e.rms:.1f} % rms", cmap="gray", vmin=0.0, vmax=1.0)
        filtering = f", {a.filter:.2g} s filter" if a.filter else ""
        ax.set_xlabel(f"{a.trace:.2g} s rays{filtering}")
    e11.show(axes[3], case.scene.picture(case.true), "reference", cmap="gray", vmin=0.0, vmax=1.0)
    axes[0].set_ylabel(name)
    for ax in axes:
        ax.set_facecolor("#5b6b86")


def _draw_errors(ax, case: Case) -> None:
    pairs = (("stratified", case.plain, case.plain_off), ("shared", case.shared, case.off))
    for (name, answers, off), colour in zip(pairs, plotting.COLOURS, strict=False):
        at = [a.rays for a in answers]
        ax.loglog(at, [e.rms for e in off], "o-", color=colour, markersize=3, label=name)
    equal = case.equal(0)
    ax.plot([case.shared[0].rays, equal.rays], [case.off[0].rms] * 2, color="0.6",
            linestyle=":", zorder=0)  # fmt: skip
    ax.set(title="RMS error", xlabel="rays a pixel")
    ticks = (1, 4, 16, 64)
    ax.set_xticks(ticks, [str(n) for n in ticks])
    ax.minorticks_off()
    ax.legend(fontsize=7)


def _claims(name: str, case: Case, time: timing.Ratio) -> list[Statement | Measurement]:
    one, equal = case.shared[0], case.equal(0)
    # Where a ray costs c: c (equal - own rays) = filter.
    pixels = len(one.visible)
    more = equal.rays - one.rays
    worth = one.filter / (more * pixels) * 1e6 if more > 0.0 else None
    saved = spread(case.saved)
    timed = compared.at_equal_error(time, spread(case.even))
    found = [
        Measurement(
            f"{name}, {n} shared ray{'s' * (n != 1)} a pixel: RMS, 99th percentile, largest error",
            ", ".join(f"{100 * x:.2f}" for x in e),
            "% of light",
        )
        for n, e in zip(SHARED, case.off, strict=True)
    ]
    return [
        Statement(
            f"{name}: time of stratified rays over that of 1 shared ray a pixel, at equal RMS "
            "error",
            PAPER[name],
            timed.mean,
            at_least(PAPER[name], f"the paper's {WORDS[name]}, against 2,048 rays"),
            "E11 §6.2, Fig. 11",
            "times",
            timed.error,
            "rounds in turns",
            "One shared ray has the error of some 60 stratified ones here and not of 2,048, and "
            "rays cost a thirtieth of the paper's, so that the filter takes most of the time.",
        ),
        # Rays through trees that fit into memory cost half a microsecond here, and the filter takes
        # the rest: shares are the machine's.
        Measurement(
            f"{name}: share of the time that goes to rays (on the paper's machine "
            f"{PAPER_SPLIT[name]:.2f})",
            one.trace / one.seconds,
            source="E11 §6.2",
        ),
        *found,
        Measurement(f"{name}: rays saved at equal RMS by 1 shared ray", saved[0], "times",
                    saved[1]),
        Measurement(f"{name}: effective rays in the penumbra at 1 ray a pixel",
                    measures.effective(one.samples, case.true[case.scene.floor]), "rays"),
        Measurement(f"{name}: time of 2,048 stratified rays, which are no equal image, over that "
                    "of 1 shared", 2048 * case.seconds / one.seconds, "times"),
        Measurement(
            f"{name}: cost of a ray at which both are equally fast, and that of ours",
            f"{worth:.2f} and {case.seconds / pixels * 1e6:.2f}" if worth else "none",
            "microseconds",
        ),
    ]  # fmt: skip


def _gained(medium, large, others: timing.Others) -> timing.Ratio:
    """Speed-up under the large lamp over that under the medium one."""
    both = zip(large, medium, strict=True)
    return timing.of_times([(a / b, c / d) for (a, b), (c, d) in both], others)


def _larger(medium: Case, large: Case, time: timing.Ratio) -> list[Statement]:
    """What a larger lamp gains, in time and in rays."""
    even = spread(large.even / medium.even)
    ratio, off = time.mean * even[0], np.hypot(time.error / time.mean, even[1] / even[0])
    saved = spread(large.saved / medium.saved)
    return [
        Statement(
            "The wider light produces more significant speedups: at equal RMS error, large over "
            "medium",
            "more significant",
            ratio,
            at_least(1.0, "'more': a larger speedup"),
            "E11 §6.2",
            "times",
            ratio * float(off),
            "rounds in turns",
            "Rays cost as much under either lamp, while wider filters weigh more of them.",
        ),
        Statement(
            "The method excels for very soft shadows: rays saved at equal RMS, large lamp over "
            "medium",
            "excels",
            saved[0],
            at_least(1.0, "'excels': more rays saved"),
            "E11 §8",
            "times",
            saved[1],
            f"{len(large.saved)} seeds",
        ),
    ]
