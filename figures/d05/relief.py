"""D05 §7: where relief is geometry, bumps, or a BRDF, and the light in pits.

The paper asks for "the frequency cutoff for micro, meso, and macro-geometry effects" and for local
shadowing, and has neither. Ours: waves of a mirror, seen from afar at 0.5 rad by pixels of 5 mm
(standard deviation), in the light of a lamp 2 m above, whose brightness is a Gaussian 0.1 m wide.
Its spectrum is positive and the bounds grow at most with the square of a frequency, so its RMS
frequencies stand for the cut-offs; errors are relative to its peak. (a) the amplitudes up to which
a flat mirror, bumps, and a BRDF err by at most 10 %: by the bounds (lines), and by rays that meet
the waves one by one (dots); above the grey line waves shadow themselves. (b) errors of waves of
20 / m, and their bounds. (c) a highlight on waves of 200 / m with the slope 0.2, as pixels get it.
A BRDF of all normals alike forgets that the eye sees more of the sides that face it. (d) the light
of a uniform sky at the bottom of pits: exact, and by gratings that stand for their walls. (e) what
leaks through such walls, and its bound. (f) rays that the eye sends to four places of the base.
(g) in space: patterns of three waves in periods of any angle, seen from anywhere, in waves of light
of frequencies and directions at random, each along the ray that it errs most for: errors by rays,
and bounds of any shape. (h) how far a facet turns the mirror, by the azimuth of its slope from the
plane of incidence: the formula, and rays (dots). (i) relief that lights itself: grooves with walls
0.6 rad from upright, of mirrors and rough ones (albedo 0.9), seen from 0.25 rad, solved for
forwards; pixels have half a groove as standard deviation.
"""

from __future__ import annotations

import jax
import numpy as np
from matplotlib.ticker import NullLocator

from derivations.bandwidth import _relief_rays as rays
from figures.d05.shared import relief_space as space
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.bandwidth import (
    brdf_relief_error,
    bump_relief_error,
    flat_relief_error,
    relief_cutoffs,
)
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Constant
from firstorder.flatland import ConstantSky, Receiver, Scene, Segments, irradiance, primitive
from firstorder.transport import pit_blockers

LAMP, HEIGHT, VIEW, PIXEL, SHARE = 0.1, 2.0, 0.5, 0.005, 0.1
SPAN = 0.4  # of the base that is looked at, to both sides of the highlight [m]
RESOLVED = 1e-7  # bounds below that are not told from the end of a pixel's filter at 6 deviations
NAMES = ("flat", "bumps", "BRDF")
PERIOD, DEPTH, OPEN = 0.8, 0.6, 0.7
SHEETS = (1, 2, 4, 8)


def draw(quick: bool) -> Drawing:
    f = np.geomspace(2.0, 200.0, 7 if quick else 25)
    slope = np.geomspace(1e-3, 0.36, 9 if quick else 37)
    u = np.linspace(-SPAN, SPAN, 4097 if quick else 16385)
    errors, bounds = _scan(f, slope, u)
    x = 0.5 * OPEN * PERIOD * np.linspace(-0.99, 0.99, 21 if quick else 81)
    exact, behind = _pits(x, 4000 if quick else 40_000)
    figure, axes = plotting.panels(3, 3, 3.5, 2.8)
    true = [_crossing(f, slope, e) for e in errors]
    cut = _cutoffs(f)
    _draw_map(axes[0, 0], f, cut, true)
    _draw_errors(axes[0, 1], slope, u)
    wide = np.linspace(-2.0, 2.0, 201 if quick else 801)
    highlight = _highlight(wide, 200.0, 0.2)
    for (name, light), line in zip(highlight.items(), ("-", "--", "-.", ":"), strict=True):
        axes[0, 2].plot(wide, light, line, label=name)
    axes[0, 2].set(xlabel="$x$ (m)", ylim=(0.0, 0.5))
    axes[0, 2].set_title("c) highlight on fine waves", loc="left")
    axes[0, 2].legend()
    _draw_pits(axes[1], x, exact, behind)
    _draw_rays(axes[1, 2])
    beyond, more = _beyond_waves(axes[2], quick)
    arrays = {"f": f, "slope": slope, "errors": errors, "bounds": bounds, "x": x, "exact": exact}
    arrays |= {f"sheets_{n}": E for n, E in behind.items()}
    arrays |= beyond
    claims = _claims(f, errors, bounds, cut, true, highlight) + _pit_claims(exact, behind) + more
    return Drawing(figure, arrays, claims, size=f"{f.size} x {slope.size} waves, {u.size} places")


def _beyond_waves(axes, quick: bool):
    """Arrays and claims of relief in space, and of relief that lights itself."""
    patterns = space.patterns(30 if quick else 300)
    errors, bounds = patterns["space_errors"], patterns["space_bounds"]
    mirror, grooves = space.mirror(41), space.grooves(*(9, 64) if quick else (25, 512))
    space.draw_patterns(axes[0], errors, bounds)
    space.draw_mirror(axes[1], mirror)
    space.draw_grooves(axes[2], grooves)
    claims = space.pattern_claims(errors, bounds) + space.groove_claims(grooves)
    return patterns | mirror | grooves, claims


# --- waves ---------------------------------------------------------------------------------------


def _lamp(place) -> np.ndarray:
    """Radiance from the lamp, which the eye sees mirrored at x = 0 of a flat base."""
    x, theta = place
    return np.exp(-0.5 * ((x - HEIGHT * (np.tan(theta) + np.tan(VIEW))) / LAMP) ** 2)


def _seen(middles, f, slope) -> np.ndarray:
    """What pixels get by rays, summed over the place that they meet: u = x + h(x) tan(view)."""
    step, a, w = min(1.0 / (128.0 * f), PIXEL / 8.0), slope / (2.0 * np.pi * f), 2.0 * np.pi * f
    margin = 6.0 * PIXEL + a * np.tan(VIEW)
    x = middles[:, None] + np.arange(-margin, margin, step)
    height, rise = a * np.sin(w * x), slope * np.cos(w * x)
    share = _filter(x + height * np.tan(VIEW) - middles[:, None]) * (1.0 + rise * np.tan(VIEW))
    theta = 2.0 * np.arctan(rise) - VIEW
    return step * np.sum(share * _lamp((x + height * np.tan(theta), theta)), -1)


def _filter(u) -> np.ndarray:
    """Gaussian of a pixel."""
    return np.exp(-0.5 * (u / PIXEL) ** 2) / (PIXEL * np.sqrt(2.0 * np.pi))


def _brdf(middles, slope, seen=True) -> np.ndarray:
    """What pixels get by the distribution of the normals, each as large as the eye sees it."""
    rise = slope * np.cos(2.0 * np.pi * (np.arange(256) + 0.5) / 256)
    share = 1.0 + rise * np.tan(VIEW) if seen else np.ones(256)
    t, weight = np.polynomial.hermite_e.hermegauss(12)
    u = (middles[:, None] + PIXEL * t)[..., None]
    light = np.mean(share * _lamp((u, 2.0 * np.arctan(rise) - VIEW)), -1)
    return light @ weight / weight.sum()


def _errors(u, f, slope) -> list[float]:
    """Largest difference of light by exact rays from that by each of what replaces the waves."""
    at = (u, slope / (2.0 * np.pi * f), f, VIEW)
    true = _lamp(rays.traced(*at))
    found = [np.abs(true - _lamp(by(*at))).max() for by in (rays.flat, rays.bumped)]
    middles = u[:: u.size // 64]
    return [*found, np.abs(_seen(middles, f, slope) - _brdf(middles, slope)).max()]


def _reach(slope):
    return VIEW + 2.0 * np.arctan(slope)


def _bands(reach) -> tuple[float, np.ndarray]:
    """RMS frequencies of the lamp at the base: along it, and in angles up to the reach."""
    along = 1.0 / (2.0 * np.pi * LAMP)
    return along, HEIGHT * along / np.cos(reach) ** 2


def _bounds(f, slope) -> list[np.ndarray]:
    reach = _reach(slope)
    along, cutoff = _bands(reach)
    given = (slope / (2.0 * np.pi * f), f, cutoff, along)
    looked = {"view": VIEW, "reach": reach}
    return [
        np.asarray(flat_relief_error(*given, **looked)),
        np.asarray(bump_relief_error(*given, **looked)),
        np.asarray(brdf_relief_error(*given, width=PIXEL, **looked)),
    ]


def _scan(f, slope, u):
    """Errors and bounds, shape (3, f, slope); waves that shadow themselves are left out."""
    lit = slope * np.tan(_reach(slope)) < 1.0
    errors = np.full((3, f.size, slope.size), np.nan)
    for i, rate in enumerate(f):
        for j in np.flatnonzero(lit):
            errors[:, i, j] = _errors(u, rate, slope[j])
    bounds = np.array(_bounds(*np.meshgrid(f, slope, indexing="ij")))
    return errors, np.where(lit, bounds, np.nan)


def _crossing(f, slope, error) -> np.ndarray:
    """Amplitude from which on the error of each frequency is above the share; NaN if none."""
    found = np.full(f.size, np.nan)
    for i, row in enumerate(error):
        over = np.flatnonzero(row > SHARE)
        if over.size and over[0]:
            j = over[0]
            t = np.log(SHARE / row[j - 1]) / np.log(row[j] / row[j - 1])
            found[i] = slope[j - 1] * (slope[j] / slope[j - 1]) ** t / (2.0 * np.pi * f[i])
    return found


def _cutoffs(f):
    """Cut-offs, by fixed-point steps in the reach, for the normals' turn adds to it."""

    def at(slope):
        reach = np.minimum(_reach(slope), 1.5)
        along, cutoff = _bands(reach)
        return relief_cutoffs(SHARE, f, cutoff, along, width=PIXEL, view=VIEW, reach=reach)

    slopes = np.zeros((3, f.size))
    for _ in range(60):
        found = np.array([at(slope)[k] for k, slope in enumerate(slopes)])
        slopes = 0.5 * (slopes + 2.0 * np.pi * f * found)
    return slopes / (2.0 * np.pi * f), float(np.asarray(at(slopes[0]).frequency)[0])


def _highlight(middles, f, slope) -> dict[str, np.ndarray]:
    return {
        "rays": _seen(middles, f, slope),
        "BRDF": _brdf(middles, slope),
        "all normals alike": _brdf(middles, slope, seen=False),
        "flat": _brdf(middles, 0.0),
    }


def _draw_map(ax, f, cut, true):
    (amplitudes, frequency), colours = cut, ("#2563eb", "#15803d", "#b91c1c")
    for name, a, dots, colour in zip(NAMES, amplitudes, true, colours, strict=True):
        ax.loglog(f, 1e3 * np.where(a > 0.0, a, np.nan), "-", color=colour, label=name)
        ax.loglog(f, 1e3 * dots, "o", color=colour, markersize=2.5, linestyle="none")
    steep = np.geomspace(1e-3, 0.5, 2000)
    limit = steep[np.argmax(steep * np.tan(_reach(steep)) >= 1.0)]
    ax.loglog(f, 1e3 * limit / (2.0 * np.pi * f), "-", color="0.6", linewidth=0.8)
    ax.axvline(frequency, color="0.6", linestyle=":")
    ax.set(xlabel="waves (1/m)", ylabel="amplitude (mm)")
    ax.set_title("a) error below 10 % under the line", loc="left")
    ax.legend()


def _draw_errors(ax, slope, u):
    f, colours = 20.0, ("#2563eb", "#15803d", "#b91c1c")
    lit = slope[slope * np.tan(_reach(slope)) < 1.0]
    measured = np.array([_errors(u, f, m) for m in lit]).T
    for name, row, found, colour in zip(NAMES, measured, _bounds(f, lit), colours, strict=True):
        ax.loglog(1e3 * lit / (2.0 * np.pi * f), found, "-", color=colour, label=name)
        ax.loglog(1e3 * lit / (2.0 * np.pi * f), row, "o", color=colour, markersize=2.5)
    ax.set(xlabel="amplitude (mm)", ylim=(1e-4, 3.0))
    ax.set_title("b) errors and bounds, 20 waves / m", loc="left")
    ax.legend()


def _draw_rays(ax):
    a, f, up = 0.08, 1.0, 0.7
    u, x = np.array([-0.75, -0.3, 0.1, 0.7]), np.linspace(-1.0, 1.0, 400)
    ax.plot(x, a * np.sin(2.0 * np.pi * f * x), "-", color="0.3")
    ax.axhline(0.0, color="0.7", linestyle="-", linewidth=0.8)
    met = rays.met(u, a, f, VIEW)
    raised = met, a * np.sin(2.0 * np.pi * f * met)
    ways = (("waves", rays.traced, raised, "-"), ("bumps", rays.bumped, (u, 0.0 * u), ":"))
    for (name, by, (at, height), line), colour in zip(ways, ("#c2410c", "#15803d"), strict=True):
        base, theta = by(u, a, f, VIEW)
        across = np.array([u - up * np.tan(VIEW), at, base - up * np.tan(theta)])
        drawn = ax.plot(across, [0.0 * u + up, height, 0.0 * u + up], line, color=colour)
        drawn[0].set_label(name)
    ax.set(xlabel="$x$ (m)", xlim=(-1.0, 1.0), ylim=(-0.12, up))
    ax.set_title("f) rays to four places of the base", loc="left")
    ax.legend(loc="upper right")


def _claims(f, errors, bounds, cut, true, highlight) -> list[Statement | Measurement]:
    amplitudes, frequency = cut
    claims: list[Statement | Measurement] = []
    for name, error, bound, ours, exact in zip(
        NAMES, errors, bounds, amplitudes, true, strict=True
    ):
        there = np.isfinite(exact) & (ours > 0.0)
        claims += [
            Statement(f"{name} for waves: error over its bound, at most", None,
                      float(np.max((error / bound)[bound > RESOLVED])), at_most(1.0, "a bound"),
                      OURS, scanned="2 to 200 waves / m, slopes up to shadowing"),
            Measurement("... amplitude at which it errs by 10 % over its cut-off, median",
                        float(np.median(exact[there] / ours[there]))),
        ]  # fmt: skip
    peak = highlight["rays"].max()
    fine = f > frequency
    claims += [
        Measurement("Waves beyond which a pixel averages any slope to within 10 %", frequency,
                    "1/m"),
        Statement("Relief finer than that is micro-geometry: largest error of a BRDF",
                  None,
                  float(np.nanmax(errors[2][fine])), at_most(SHARE, "the share asked for"),
                  OURS, "of the peak", scanned="slopes up to shadowing"),
        Measurement("Highlight on fine waves: error of the BRDF",
                    float(np.abs(highlight["BRDF"] - highlight["rays"]).max() / peak)),
        Measurement("... of a BRDF with all normals alike",
                    float(np.abs(highlight["all normals alike"] - highlight["rays"]).max() / peak)),
    ]  # fmt: skip
    return claims


# --- pits ----------------------------------------------------------------------------------------


def _pits(x, count):
    """Irradiance at the bottom: between two walls, exact, and behind gratings."""
    half = 0.5 * OPEN * PERIOD
    walls = [primitive(Segments((s * half, 0.0), (s * half, DEPTH))) for s in (-1.0, 1.0)]
    scene = Scene.of(*walls, environment=ConstantSky())
    at = Receiver.at(np.stack([x, 0.0 * x], -1))
    exact = np.asarray(jax.vmap(lambda a: irradiance(scene, a))(at))
    theta = (np.arange(count) + 0.5) * np.pi / count - 0.5 * np.pi
    sky = Constant(1.0, FLATLAND_SLOPE)
    behind = {}
    for n in SHEETS:
        V = pit_blockers(PERIOD, DEPTH, n, FLATLAND_SLOPE, OPEN)(sky)
        behind[n] = np.asarray(V(x[:, None], np.tan(theta))) @ np.cos(theta) * np.pi / count
    return exact, behind


def _leak_bound(sheets) -> np.ndarray:
    steep = np.asarray(sheets) * (1.0 - OPEN) * PERIOD / DEPTH
    return 2.0 * (1.0 - steep / np.hypot(1.0, steep))


def _draw_pits(axes, x, exact, behind):
    axes[0].plot(x, exact, label="exact")
    for n in (1, 2, 8):
        axes[0].plot(x, behind[n], label=f"{n} grating{'s' * (n > 1)}")
    axes[0].set(xlabel="$x$ (m)", ylim=(0.0, 1.6))
    axes[0].set_title("d) irradiance in a pit (W/m)", loc="left")
    axes[0].legend()
    leaks = [np.max(E - exact) for E in behind.values()]
    axes[1].loglog(SHEETS, _leak_bound(SHEETS), label="bound")
    axes[1].loglog(SHEETS, leaks, "o", linestyle="none", label="largest leak")
    axes[1].xaxis.set_minor_locator(NullLocator())
    axes[1].set_xticks(SHEETS, [str(n) for n in SHEETS])
    axes[1].set(xlabel="gratings")
    axes[1].set_title("e) what leaks (W/m)", loc="left")
    axes[1].legend()


def _pit_claims(exact, behind) -> list[Statement | Measurement]:
    share = [np.max(E - exact) / _leak_bound(n) for n, E in behind.items()]
    return [
        Statement("Light that leaks into pits through walls of gratings, over its bound, at most",
                  None, float(max(share)), at_most(1.0, "a bound"), OURS,
                  scanned="1, 2, 4 and 8 gratings"),
        Measurement("... one grating, as a perforated screen has: largest error of the irradiance",
                    float(np.max(behind[1] - exact) / exact.max()), "of the largest"),
        Measurement("... eight", float(np.max(behind[8] - exact) / exact.max()), "of the largest"),
    ]  # fmt: skip
