"""Relief in space, and pits that light themselves: errors by rays beside their bounds."""

from __future__ import annotations

import numpy as np

from derivations.bandwidth import _pit_rays as pit_rays
from derivations.bandwidth import _relief_space_rays as rays
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder.bandwidth import (
    Relief,
    brdf_shape_error,
    bump_shape_error,
    flat_shape_error,
    pit_brdf_error,
    pit_texture_error,
)

NAMES = ("flat", "bumps", "BRDF")
COLOURS = ("#2563eb", "#15803d", "#b91c1c")
PLACES = 48  # along each side of a period
RESOLVED = 1e-7  # of the amplitude: rounding below
LEAN, ALBEDO, VIEW = 0.6, 0.9, 0.25  # walls of the groove from upright, and the eye [rad]
PERIODS = 0.5  # standard deviation of the pixel, in periods of the groove


# --- relief ------------------------------------------------------------------------------------


def patterns(count: int) -> dict[str, np.ndarray]:
    """Errors and bounds, shape (3, count), of patterns of three waves in periods of any angle."""
    rng = np.random.default_rng(11)
    found = [row for row in (_pattern(rng) for _ in range(count)) if row is not None]
    errors, bounds = (np.array([row[k] for row in found]).T for k in (0, 1))
    return {"space_errors": errors, "space_bounds": bounds}


def _pattern(rng):
    """Errors and bounds of one of them, in the light of a wave; None if it shadows itself."""
    angle, first = rng.uniform(1.0, 2.0), rng.uniform(0.0, 2.0 * np.pi)
    sides = rng.uniform(0.7, 1.0, 2) * 10 ** rng.uniform(-2.0, 0.0)
    periods = np.stack([[np.cos(t), np.sin(t)] for t in (first, first + angle)], -1) * sides
    basis = np.linalg.inv(periods).T
    whole = np.array([[1, 0], [0, 1], rng.choice([[1, 1], [2, 1], [1, -1], [2, 0], [0, 2]])])
    relief = rays.Cosines(whole @ basis.T, rng.uniform(-1.0, 1.0, 3), rng.uniform(0.0, 6.3, 3))
    u, slope = rays.cell(periods, PLACES), 10 ** rng.uniform(-3.0, -0.5)
    steep = np.linalg.norm(relief.slope(u), axis=-1).max()
    relief = relief._replace(a=relief.a * slope / steep)
    view, bands = rng.uniform(-1.0, 1.0), (10 ** rng.uniform(-1.0, 1.0), 10 ** rng.uniform(-2, 1))
    reach = abs(view) + 2.0 * np.arctan(slope)
    turned = rng.uniform(0.0, 6.3)
    width = rng.uniform(0.1, 0.5) * np.linalg.norm(sides)
    if slope * np.tan(min(reach, 1.5)) >= 0.95:
        return None
    e, at = rays.to_eye(view, turned), {"view": view, "reach": reach}
    shape = _numbers(periods, basis, relief)
    bounds = [flat_shape_error(shape, *bands, **at), bump_shape_error(shape, *bands, **at),
              brdf_shape_error(shape, *bands, width=width, **at)]  # fmt: skip
    return _errors(periods, u, relief, e, bands, width), [float(b) for b in bounds]


def _numbers(periods, basis, relief) -> Relief:
    h, m, c, rms_h, rms_m = relief.numbers(rays.cell(periods, 160))
    f, more = np.linalg.norm(basis[:, 0]), 1.001  # between the places
    across = abs(np.linalg.det(basis)) / f
    return Relief(h * more, m * more, c * more, f, across, rms_height=rms_h, rms_slope=rms_m)


def _errors(periods, u, relief, e, bands, width) -> list[float]:
    """Largest errors of flat mirrors, bumps and a BRDF, of waves along which rays lie far apart."""
    true = rays.traced(u, relief, e)
    found = []
    for by in (rays.flat, rays.bumped):
        other = by(u, relief, e)
        pair = _worst(true, other, bands)
        found.append(np.abs(rays.wave(true, *pair) - rays.wave(other, *pair)).max())
    pair = _worst(true, rays.flat(u, relief, e), bands)
    light = rays.wave(true, *pair) * np.exp(-2j * np.pi * u @ pair[0])
    mean = rays.wave(true, 0.0 * pair[0], pair[1]).mean()
    return [*found, rays.pixels(light, periods, pair[0], width, mean)]


def _worst(true, other, bands):
    """Frequencies up to the cutoffs along the largest difference of two sets of rays."""
    moved, turned = ((a - b).reshape(-1, a.shape[-1]) for a, b in zip(true, other, strict=True))
    far = bands[1] * np.linalg.norm(moved, axis=-1) + bands[0] * np.linalg.norm(turned, axis=-1)
    pair = moved[far.argmax()], turned[far.argmax()]
    return [b * a / max(np.linalg.norm(a), 1e-300) for b, a in zip(bands[::-1], pair, strict=True)]


def draw_patterns(ax, errors, bounds):
    for name, e, b, colour in zip(NAMES, errors, bounds, COLOURS, strict=True):
        ax.loglog(b, e, "o", color=colour, markersize=2.0, linestyle="none", label=name)
    ax.loglog([1e-6, 2.0], [1e-6, 2.0], "-", color="0.4", linewidth=0.8)
    ax.set(xlabel="bound", ylabel="error by rays", xlim=(1e-5, 3.0), ylim=(1e-6, 3.0))
    ax.set_title("g) relief in space, patterns at random", loc="left")
    ax.legend()


def pattern_claims(errors, bounds) -> list[Statement | Measurement]:
    claims: list[Statement | Measurement] = []
    for name, e, b in zip(NAMES, errors, bounds, strict=True):
        told = b > RESOLVED
        small = told & (b < 0.5) & (e > 0.0)
        claims += [
            Statement(f"{name} for relief in space: error over its bound, at most", None,
                      float(np.max((e / b)[told])), at_most(1.0, "a bound"), OURS,
                      scanned=f"{told.sum()} patterns, slopes 0.001 to 0.3, eyes up to 1 rad"),
            Measurement("... bound over its error where it is below 0.5, median",
                        float(np.median((b / e)[small]))),
        ]  # fmt: skip
    return claims


# --- the mirror --------------------------------------------------------------------------------


def mirror(count: int) -> dict[str, np.ndarray]:
    """Chords by which facets turn the mirrored direction, over twice the slope."""
    azimuth, slope = np.linspace(0.0, 0.5 * np.pi, count), 1e-4
    rise = slope * np.stack([np.cos(azimuth), np.sin(azimuth)], -1)
    found = {"azimuth": azimuth}
    for view in (0.0, 0.7, 1.2):
        e = rays.to_eye(view, 0.0)
        turned = np.linalg.norm(rays.mirrored(rise, e) - rays.mirrored(0.0 * rise, e), axis=-1)
        found[f"turned_{view}"] = turned / (2.0 * slope)
    return found


def draw_mirror(ax, found):
    azimuth = found["azimuth"]
    for view, colour in zip((0.0, 0.7, 1.2), COLOURS, strict=True):
        formula = np.sqrt(np.cos(azimuth) ** 2 + (np.sin(azimuth) * np.cos(view)) ** 2)
        ax.plot(azimuth, formula, "-", color=colour, label=f"view {view} rad")
        ax.plot(azimuth[::4], found[f"turned_{view}"][::4], "o", color=colour, markersize=2.5)
    ax.set(xlabel="azimuth of the slope (rad)", ylabel="turn / (2 slope)", ylim=(0.0, 1.1))
    ax.set_title("h) a facet turns the mirror", loc="left")
    ax.legend()


# --- pits that light themselves ----------------------------------------------------------------


def grooves(count: int, places: int) -> dict[str, np.ndarray]:
    """Errors of a BRDF for each place, and of one BRDF, of rough grooves and of mirrors.

    Walls that lean by 0.6 rad from upright, one groove beside the other; waves of light by their
    cycles per groove.
    """
    D = 2.0 * np.tan(LEAN)
    u = D * ((np.arange(places) + 0.5) / places - 0.5)
    cycles = np.geomspace(1e-3, 0.5, count)
    half = 0.5 * D
    shown = pit_rays.followed(u, VIEW, np.array([[-half, 0.0], [0.0, -1.0], [half, 0.0]]), ALBEDO)
    found = {"cycles": cycles}
    for kind in ("rough", "mirrors"):
        rows = [_groove(c / D, D, u, None if kind == "rough" else shown) for c in cycles]
        found[f"{kind}_texture"], found[f"{kind}_brdf"] = np.array(rows).T
    found["bound_texture"] = np.asarray(pit_texture_error(D, cycles / D, albedo=ALBEDO))
    found["bound_brdf"] = np.asarray(
        pit_brdf_error(D, 1.0 / D, cycles / D, width=PERIODS * D, albedo=ALBEDO)
    )
    return found


def _groove(Bx, D, u, mirrors, B=0.7):
    """Largest errors for one wave of light, over places and over pixels."""
    if mirrors is None:
        light, texture = (
            pit_rays.groove_light(
                u, VIEW, LEAN, ALBEDO, lambda x, a, k=k: np.exp(2j * np.pi * (k * x + B * a))
            )
            for k in (Bx, 0.0)
        )
        light = light * np.exp(-2j * np.pi * Bx * u)
    else:
        x, theta, weight = mirrors
        texture = weight * np.exp(2j * np.pi * B * theta)
        light = texture * np.exp(2j * np.pi * Bx * (x - u))
    k = np.fft.fftfreq(u.size, D / u.size)
    kept = np.exp(-2.0 * (np.pi * PERIODS * D * (k + Bx)) ** 2)
    pixels = np.fft.ifft(np.fft.fft(light) * kept) - texture.mean() * kept[0]
    return np.abs(light - texture).max(), np.abs(pixels).max()


def draw_grooves(ax, found):
    cycles = found["cycles"]
    for name, colour in zip(("texture", "brdf"), COLOURS[1:], strict=True):
        label = {"texture": "a BRDF for each place", "brdf": "one BRDF"}[name]
        ax.loglog(cycles, found[f"bound_{name}"], "-", color=colour, label=label)
        for kind, mark in (("mirrors", "o"), ("rough", "x")):
            ax.loglog(cycles, found[f"{kind}_{name}"], mark, color=colour, markersize=3,
                      linestyle="none")  # fmt: skip
    ax.plot([], [], "o", color="0.3", markersize=3, linestyle="none", label="mirrors")
    ax.plot([], [], "x", color="0.3", markersize=3, linestyle="none", label="rough walls")
    ax.set(xlabel="waves of light per groove", ylim=(2e-6, 5.0))
    ax.set_title("i) grooves that light themselves", loc="left")
    ax.legend(loc="lower right")


def groove_claims(found) -> list[Statement | Measurement]:
    claims: list[Statement | Measurement] = []
    words = {"texture": "A BRDF for each place of grooves that light themselves",
             "brdf": "One BRDF for them, averaged over a pixel of half a groove"}  # fmt: skip
    for name, said in words.items():
        ratio = np.concatenate([
            found[f"{kind}_{name}"] / found[f"bound_{name}"] for kind in ("rough", "mirrors")
        ])  # fmt: skip
        claims += [
            Statement(f"{said}: error over its bound, at most", None, float(ratio.max()),
                      at_most(1.0, "a bound"), OURS,
                      scanned="rough walls and mirrors, 0.001 to 0.5 waves of light per groove"),
            Measurement("... median", float(np.median(ratio))),
        ]  # fmt: skip
    return claims
