"""D05 Fig. 15: the band limit of glossy reflection, step by step, and what its criteria are worth.

The paper draws segments and gives no numbers. Chosen: a bump of curvature 0.8 per metre (ours: a
valley is positive, so -0.8), seen from 1.5 m under 35 degrees; a small distant lamp, which has all
frequencies, up to 200 cycles per radian; an ideal lobe that stops at 120. The light at each step is
that of exact rays off a circle, under a Gaussian window of 0.03 m and 0.03 rad, and is transformed
as sampled; so a segment is a blurred one, and its measured end is where it falls to half.

Two things that the paper prints do not hold. The end point at the eye has a wrong sign (a bump
spreads light), and the criteria (20) and (21) are no bounds: they leave out the eye's own turn,
which is all there is on a flat mirror; (21) also leaves out the cosine of incidence and the band of
the light that a blocker cuts. "d >> 1" compares a length with a number.
"""

from __future__ import annotations

import numpy as np

from derivations.bandwidth._bandwidth_steps import predicted_bands
from derivations.bandwidth.curved_mirror import edges
from derivations.reconstruction import tracer
from figures.d05.shared.readings import ALIKE
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most, near
from firstorder import plotting
from firstorder.bandwidth import (
    glossy_bandwidth,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)
from firstorder.fields import Grid, discrete_transform

KAPPA, THETA, D = -0.8, np.deg2rad(35.0), 1.5
CUTOFF, ENVIRONMENT, WINDOW, REACH = 120.0, 200.0, 0.03, 560.0
STEPS = {
    "environment": "(a) environment",
    "curvature": "(b) curvature",
    "mirror": "(c) mirror",
    "cutoff": "(d) lobe",
    "outwards": "(e) curvature back",
    "leaving": r"(f) $1 / \cos\theta_1$",
    "eye": "travel to the eye",
}
BUMP, VALLEY, PRINT = plotting.COLOURS[1], plotting.COLOURS[2], "0.45"


def light(step: str, x, theta):
    """The environment's angle that each ray (x, theta about the central ray) comes from."""
    n = KAPPA * x  # the normal's angle, at arc length x
    match step:
        case "environment":
            return theta
        case "curvature":
            return theta + n
        case "mirror" | "cutoff":
            return n - theta
        case "outwards":
            return 2.0 * n - theta
    # Across the central ray, at the mirror or at the eye: both on exact rays, traced from there.
    start = tracer.eye(D if step == "eye" else 0.0, THETA)
    E = start + x[..., None] * np.array([np.cos(THETA), np.sin(THETA)])
    out = tracer.direction(THETA + theta)
    if step == "leaving":  # follow each ray off the mirror, to be traced back to it
        E = E + out * np.max(np.abs(x))
    P = tracer.hit(E, -out, KAPPA)
    return tracer.angle(tracer.reflect(-out, tracer.normal(P, KAPPA))) + THETA


def lamp(angle, limit: float):
    """A small lamp: all frequencies alike, up to its own limit, or up to that of an ideal lobe."""
    return 2.0 * limit * np.sinc(2.0 * limit * angle)


def spectrum(step: str, samples: int, Omega):
    """Transform of the windowed light of a step."""
    grid = Grid.spanning((samples, samples), (3.4 * WINDOW, 3.4 * WINDOW))
    x, t = np.moveaxis(grid.points(), -1, 0)
    limit = ENVIRONMENT if step in ("environment", "curvature", "mirror") else CUTOFF
    bell = np.exp(-0.5 * (x**2 + t**2) / WINDOW**2)
    return np.asarray(discrete_transform(bell * lamp(light(step, x, t), limit), grid, *Omega))


def measured_end(F, Omega, end):
    """Where the spectrum, along the predicted segment, falls to half of what it is inside."""
    from scipy.interpolate import RectBivariateSpline

    size = RectBivariateSpline(*Omega, np.abs(F))
    t = np.linspace(0.3, 1.5, 1201)
    profile = size(t * end[0], t * end[1], grid=False)
    inside = np.median(profile[(t > 0.5) & (t < 0.8)])
    return float(t[t > 0.8][np.argmax(profile[t > 0.8] < 0.5 * inside)])


def draw(quick: bool) -> Drawing:
    """Steps above; below, curvature, distance, angle and a blocker."""
    figure, axes = plotting.panels(3, 4, 2.9, 2.55)
    samples, n = (248, 81) if quick else (296, 161)
    Omega = np.linspace(-REACH, REACH, n), np.linspace(-REACH, REACH, n)
    bands = predicted_bands(D, KAPPA, THETA, CUTOFF, ENVIRONMENT)
    spectra = {step: spectrum(step, samples, Omega) for step in STEPS}
    arrays = {"Omega_x": Omega[0], "Omega_theta": Omega[1]}
    ends, found = {}, {}
    for ax, (step, title) in zip(axes.flat, STEPS.items(), strict=False):
        F, band = spectra[step], bands[step]
        ends[step] = np.asarray(band.farthest(np.array([1e-3, 1.0])))
        found[step] = measured_end(F, Omega, ends[step])
        plotting.show_spectrum(ax, F, *Omega, decades=2.0, title=title, equal=True, scale=False)
        _segment(ax, ends[step])
        arrays |= {f"spectrum_{step}": F, f"end_{step}": ends[step]}
    printed_eye = np.array(
        [ends["leaving"][0], CUTOFF * (1.0 - 2.0 * abs(KAPPA) * D / np.cos(THETA))]
    )
    axes[1, 2].plot(*printed_eye, "x", color="white", markersize=7, markeredgewidth=1.6)
    axes[1, 2].annotate(
        "printed",
        printed_eye,
        xytext=(6, -3),
        textcoords="offset points",
        color="white",
        fontsize=8,
    )
    view = _view(axes[1, 3])
    curves = {"view": view}
    for ax, (name, make) in zip(axes[2], _SWEEPS.items(), strict=True):
        curves[name] = make(ax)
    for ax in [*axes[:2, 1:].flat, *axes[2, 1:]]:
        ax.set_ylabel("")
    axes[1, 0].set_ylabel(plotting.label("Omega_theta"))
    for ax in axes[0]:
        ax.set_xlabel("")
    size = f"{samples} x {samples} rays a step, {_count(quick)} views"
    return Drawing(figure, arrays, _claims(quick, ends, found), curves, size, seed=1)


def _segment(ax, end) -> None:
    """The predicted segment, and its end points."""
    ax.plot(*np.stack([-end, end]).T, color="white", linestyle=(0, (3, 3)), linewidth=0.9)
    ax.plot(*np.stack([-end, end]).T, "o", color="white", markersize=5, fillstyle="none")


def _view(ax) -> dict:
    """What the eye sees, as a function of its angle alone: the spectrum's end beside the claims."""
    offset = np.linspace(-5.0, 5.0, 4001) * WINDOW
    _, mirrored = tracer.seen(np.array(D), THETA, KAPPA, THETA + offset)
    signal = np.exp(-0.5 * (offset / WINDOW) ** 2) * lamp(mirrored + THETA, CUTOFF)
    Omega = np.linspace(0.0, 1.25 * REACH, 401)
    size = np.abs(np.exp(-2j * np.pi * Omega[:, None] * offset) @ signal)
    size = size / np.median(size[Omega < 0.7 * REACH])
    true, printed = _ours(glossy_bandwidth, D, KAPPA), _ours(glossy_criterion, D, KAPPA)
    ax.plot(Omega, size, color=plotting.COLOURS[0], linestyle="-")
    ax.axvline(true, color=BUMP, linestyle="-", linewidth=1.2)
    ax.axvline(printed, color=PRINT, linestyle="--", linewidth=1.2)
    ax.set_ylim(0.0, 1.5)
    ax.text(true + 8, 1.35, "ours", color=BUMP, fontsize=8)
    ax.text(printed - 8, 1.35, "(20)", color=PRINT, fontsize=8, ha="right")
    ax.set_title("seen by the eye", loc="left")
    ax.set_xlabel(plotting.label("Omega_theta"))
    ax.set_yticks([])
    return {"Omega": Omega, "size": size}


def _ours(function, d, kappa, theta=THETA, *more):
    return np.asarray(function(CUTOFF, d, kappa, np.cos(theta), *more))


def _sweep(ax, name: str, values, title: str, label: str, log=True) -> dict:
    """Ours, printed and traced, on a bump and in a valley, along one of the three variables."""
    columns = {name: values}
    ones = np.ones_like(values)
    base = {"curvature": abs(KAPPA), "distance": D, "angle": THETA}
    at = {k: values if k == name else v * ones for k, v in base.items()}
    d, theta = at["distance"], at["angle"]
    x = np.rad2deg(values) if name == "angle" else values
    for word, sign, colour in (("bump", -1.0, BUMP), ("valley", 1.0, VALLEY)):
        kappa = sign * at["curvature"]
        ours = np.asarray(glossy_bandwidth(1.0, d, kappa, np.cos(theta)))
        traced = tracer.traced_frequency(d, kappa, theta)
        ax.plot(x, ours, color=colour, linestyle="-", label=word)
        ax.plot(x[::8], traced[::8], "o", color=colour, markersize=3.2, fillstyle="none")
        columns |= {f"ours_{word}": ours, f"traced_{word}": traced}
    printed = np.asarray(glossy_criterion(1.0, d, kappa, np.cos(theta)))
    ax.plot(x, printed, color=PRINT, linestyle="--", label="D05 (20)")
    ax.set_yscale("log")
    ax.set_xscale("log" if log else "linear")
    ax.set_title(title, loc="left")
    ax.set_xlabel(label)
    return columns | {"printed": printed}


def _curvature(ax) -> dict:
    values = np.logspace(-2.5, 2.0, 241)
    columns = _sweep(ax, "curvature", values, "over curvature", r"$|\kappa|$ (rad/m)")
    ax.set_ylabel(r"$B / \Omega_\rho$ (circles: exact rays)")
    ax.set_ylim(3e-3, 3e2)
    ax.legend(loc="lower right")
    return columns


def _distance(ax) -> dict:
    columns = _sweep(ax, "distance", np.logspace(-2.0, 2.0, 241), "over distance", r"$d$ (m)")
    ax.set_ylim(1e-2, 5e2)
    return columns


def _angle(ax) -> dict:
    values = np.deg2rad(np.linspace(0.0, 85.0, 241))
    columns = _sweep(ax, "angle", values, "over angle", r"$\theta_1$ (degrees)", log=False)
    ax.set_ylim(0.7, 50.0)
    return columns


def _blocker(ax) -> dict:
    depth = np.logspace(-2.0, 2.0, 241)
    ones, columns = np.ones_like(depth), {"depth": depth}
    for word, kappa, colour in (("bump", KAPPA, BUMP), ("valley", -KAPPA, VALLEY)):
        ours = np.asarray(occluded_bandwidth(1.0, D, kappa, np.cos(THETA), depth))
        blur, wander = np.abs(
            tracer.traced_edge(D * ones, kappa * ones, THETA * ones, depth, -THETA * ones)
        )
        ax.plot(depth, ours, color=colour, linestyle="-")
        ax.plot(depth[::8], blur[::8], "o", color=colour, markersize=3.2, fillstyle="none")
        columns |= {f"ours_{word}": ours, f"traced_{word}": blur}
        if word == "bump":
            sharp = np.asarray(occluded_bandwidth(1.0, D, kappa, np.cos(THETA), depth, light=20.0))
            ax.plot(depth, sharp, color=colour, linestyle=":", label=r"light to $20\,\Omega_\rho$")
            rays = (blur + 20.0 * wander)[::8]
            ax.plot(depth[::8], rays, "o", color=colour, markersize=3.2, fillstyle="none")
            columns |= {"ours_sharp": sharp}
    printed = np.asarray(occluded_criterion(1.0, D, KAPPA, np.cos(THETA), depth))
    ax.plot(depth, printed, color=PRINT, linestyle="--", label="D05 (21)")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title("behind an edge", loc="left")
    ax.set_xlabel(r"$d'$ (m)")
    ax.legend(loc="upper right")
    return columns | {"printed": printed}


_SWEEPS = {"curvature": _curvature, "distance": _distance, "angle": _angle, "blocker": _blocker}


def _count(quick: bool) -> int:
    return 4000 if quick else 100_000


BOUND = at_most(1.0, "a bound")
CLOSE = at_most(1.0 + ALIKE, "'approximate': a tenth too large")
EXACT = at_most(1e-6, "rays in double precision, against their own differences")
TURN = (
    "The eye's own turn, 1 of |1 - 2 k d / (n.v)|, is left out: it is all there is on a flat "
    "mirror, adds on bumps and cancels in valleys."
)


def _claims(quick: bool, ends, found) -> list[Statement | Measurement]:
    """What is printed, over the whole range of curvature, distance and angle, against rays."""
    d, k, theta = tracer.configurations(_count(quick), seed=1)
    c, valley = np.cos(theta), k > 0
    true = tracer.traced_frequency(d, k, theta)
    printed = np.asarray(glossy_criterion(1.0, d, k, c))
    ours = np.asarray(glossy_bandwidth(1.0, d, k, c))
    views = f"{_count(quick):,} views"
    return [
        *_segments(ends, found),
        Statement("(20) bounds what the eye sees in a bump: largest traced / printed", "<= 1",
                  np.max((true / printed)[~valley]), BOUND, "D05 (20)", scanned=views,
                  reason=f"{TURN} No bump is bounded; within a tenth from 2 |k| d / (n.v) = 9 on."),
        Statement("(20) bounds what the eye sees in a valley: largest traced / printed", "<= 1",
                  np.max((true / printed)[valley]), BOUND, "D05 (20)", scanned=views,
                  reason=f"{TURN} Valleys are not bounded where 2 k d / (n.v) is below 1/2."),
        Statement("(20) is an approximate bound in a valley: largest printed / traced", "~ 1",
                  np.max((printed / true)[valley]), CLOSE, "D05 (20)", scanned=views,
                  reason=f"{TURN} Near the focus, 2 k d / (n.v) = 1, the true one is nothing; "
                  "within a tenth from 11 on."),
        Statement("(20) holds if d >> 1: printed / traced at d = 1000 m, k = 1e-5 per m", "~ 1",
                  0.02 / float(tracer.traced_frequency(*map(np.array, (1000.0, -1e-5, 0.0)))),
                  near(1.0, ALIKE, "'approximate': a tenth"), "D05 (20)",
                  reason="d has a unit: what must be large is 2 |k| d / (n.v), here 0.02. As "
                  "printed the limit holds at no distance for a surface that is flat enough."),
        Measurement("(20) is within 10 % of rays off bumps from this 2 |k| d / (n.v) on",
                    _tenth(-1.0)),
        Measurement("(20) is within 10 % of rays off valleys from this 2 |k| d / (n.v) on",
                    _tenth(1.0)),
        Statement("|1 - 2 kappa d / (n.v)| is what rays do: largest error over all views", None,
                  np.max(np.abs(ours - true) / (1.0 + printed)), EXACT, OURS, "relative",
                  scanned=views),
        *_blocker_claims(quick),
    ]  # fmt: skip


def _segments(ends, found) -> list[Statement]:
    """End points of the seven steps, predicted and measured."""
    last = found["eye"] * ends["eye"][1] / CUTOFF
    printed = 1.0 - 2.0 * abs(KAPPA) * D / np.cos(THETA)
    return [
        Statement("Ends of the segments, steps (a) to (f): largest error of the measured ones", 0.0,
                  max(abs(found[s] - 1.0) for s in STEPS if s != "eye"),
                  at_most(0.03, "a segment is blurred by the window"), "D05 §6.2 Fig. 15",
                  "relative"),
        Statement("End of the segment at the eye, over the cut-off: 1 - 2 k d / cos, for a bump",
                  printed, last, near(printed, 0.03, "a segment is blurred by the window"),
                  "D05 §6.2",
                  reason="D05's caustic has k < 0 in a valley, so a bump has k > 0; it spreads "
                  "light, and travel adds: 1 + 2 k d / cos. The printed sign is wrong for every "
                  "curvature."),
    ]  # fmt: skip


def _blocker_claims(quick: bool) -> list[Statement | Measurement]:
    d, k, theta, depth, _ = edges(_count(quick), seed=2)
    c = np.cos(theta)
    blur, wander = np.abs(tracer.traced_edge(d, k, theta, depth, -theta))
    printed = np.asarray(occluded_criterion(1.0, d, k, c, depth))
    ours = np.asarray(occluded_bandwidth(1.0, d, k, c, depth, None, 5.0))
    sharp = blur + 5.0 * wander
    scale = 1.0 + printed + 5.0 * wander
    bump, graze = k < 0, (k < 0) & (2.0 * np.abs(k) * depth < 0.1) & (d > 10.0 * depth)
    views = f"{_count(quick):,} views"
    return [
        Statement("(21) bounds what the eye sees behind an edge: largest traced / printed", "<= 1",
                  np.max((blur / printed)[bump]), BOUND, "D05 (21)", scanned=views,
                  reason="The eye's own turn is left out, as in (20): no bump is bounded where "
                  "(1 / (n.v) - 1) d / d' is below 1, however curved it is."),
        Statement("(21), where it bounds, does so for light five times sharper: traced / printed",
                  "<= 1", np.max((sharp / printed)[bump & (blur <= printed)]), BOUND, "D05 (21)",
                  scanned=views,
                  reason="What the edge cuts is light with a band of its own, which the lobe does "
                  "not blur where the edge wanders over it: with light that is sharper than the "
                  "lobe that band counts."),
        Statement("(21) is an approximate bound beside an edge, d >> d': largest printed / traced",
                  "~ 1", np.max((printed / blur)[graze]), CLOSE, "D05 (21)", scanned=views,
                  reason="An edge in the mirrored direction is foreshortened by the cosine by "
                  "which (21) divides: 1 / d' comes out 1 / (n.v) too large, more than a tenth "
                  "beyond 25 degrees."),
        Statement("With the eye's turn, the incidence and the light it equals rays: largest error",
                  None, np.max(np.abs(ours - sharp) / scale), EXACT, OURS, "relative",
                  scanned=views),
    ]  # fmt: skip


def _tenth(sign: float) -> float:
    """The t = 2 |k| d / (n.v) beyond which printed and traced differ by less than a tenth."""
    low, high = 2.0, 1000.0
    for _ in range(60):
        t = np.sqrt(low * high)
        true = float(tracer.traced_frequency(np.array(0.5 * t), np.array(sign), np.array(0.0)))
        low, high = (t, high) if abs(t / true - 1.0) > 0.1 else (low, t)
    return float(high)
