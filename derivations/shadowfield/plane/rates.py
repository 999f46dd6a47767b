"""Sampling rates: where replicas of the wedge meet the filter, corner by corner.

E11 Appendix B. With a = d1/d2_max - 1 < b = d1/d2_min - 1, the filter has its corners at
(high/b, high), (high/a, high) and their mirror images; the wedge is bounded by slopes a and b.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Counterexample, Row, na

a, b, high, tip = sp.symbols("a b Omega_y_max Omega_x_max", positive=True)


def along_the_receiver():
    """The replica begins at its own mirrored tip; the filter ends at its upper right corner.

    And the tip: a wave of the band limit on the farthest plane.
    """
    shift = sp.Symbol("shift")
    touching = sp.solve(sp.Eq(shift - tip, high / a), shift)[0]
    x, y, d1, far, g = sp.symbols("x y d1 d2_max Omega_g", positive=True)
    u = y + far * (x - y) / d1
    return sp.simplify(touching - (tip + high / a)), sp.simplify(g * u.diff(x) - g * far / d1)


def along_the_light():
    """The shift at which the replica's lower edge passes each of the filter's upper left corners.

    Left of its apex the lower edge has the slope b, right of it the slope a. The left corner asks
    for more: the difference to the printed rate is a sum of positive terms.
    """
    shift, more = sp.symbols("shift more", positive=True)
    left = sp.solve(sp.Eq(b * (-high / a) + shift, -high), shift)[0]
    right = sp.solve(sp.Eq(a * (high / b) + shift, high), shift)[0]
    corrected = high * b * (1 / a - 1 / b)
    printed = high * a * (1 / a - 1 / b)
    gap = sp.factor((left - right).subs(b, a + more))
    positive = gap - high * more**2 / (a * (a + more))
    return sp.simplify(left - corrected), sp.simplify(right - printed), sp.simplify(positive)


def nothing_in_between():
    """Between its corners the filter's upper edge is straight, of slope 1/s with a < 1/s < b.

    Left of the apex it falls slower than the replica's edge, right of it it rises faster: the two
    corners decide.
    """
    more = sp.Symbol("more", positive=True)
    steep = (2 * a * b / (a + b)).subs(b, a + more)
    low, high_ = sp.factor(steep - a), sp.factor(a + more - steep)
    return (
        sp.simplify(low - a * more / (2 * a + more)),
        sp.simplify(high_ - more * (a + more) / (2 * a + more)),
    )


# ---------------------------------------------------------------- numeric routes

D1, NEAR, FAR, HIGH, PIX, BAND = 1.0, 1 / 3, 2 / 3, 1.0, 16.0, 60.0


def _scene():
    from firstorder.shadowfield import sheared_filter, wedge_corners

    return sheared_filter(D1, NEAR, FAR, HIGH, PIX), wedge_corners(D1, NEAR, FAR, BAND)


def _bisected(overlaps, low, high) -> float:
    """The rate at which replicas begin to overlap, between one that does and one that does not."""
    for _ in range(34):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if overlaps(middle) else (low, middle)
    return 0.5 * (low + high)


def light_rate_by_bisection() -> float:
    """`light_rate_of_endless_wedge` against polygons that overlap or do not."""
    from firstorder.shadowfield import SamplingRates, light_rate_of_endless_wedge, replicas_overlap

    k, corners = _scene()
    found = _bisected(lambda t: replicas_overlap(k, corners, SamplingRates(1e6, t), 1), 0.5, 9.0)
    return abs(found / float(light_rate_of_endless_wedge(D1, NEAR, FAR, HIGH)) - 1.0)


def receiver_rate_by_bisection() -> float:
    """`receiver_rate` against the same, with the replica slid to where the two tips are level."""
    from firstorder.shadowfield import SamplingRates, receiver_rate, replicas_overlap

    k, corners = _scene()
    tip_ = np.asarray(corners)[np.argmax(np.asarray(corners)[:, 0])]
    level = HIGH + float(tip_[1])  # slides the mirrored tip to the height of the filter's corner
    found = _bisected(lambda t: replicas_overlap(k, corners, SamplingRates(t, level), 1), 1.0, 99.0)
    return abs(found / float(receiver_rate(k, corners)) - 1.0)


def _alias(rate_x, rate_y, wave, count=4096) -> np.ndarray:
    """Where samples of a wave put it: the peaks of two transforms, one along each axis."""
    found = []
    for rate, w in zip((rate_x, rate_y), wave, strict=True):
        t = np.arange(count) / rate
        samples = np.exp(2j * np.pi * w * t)
        peak = np.argmax(np.abs(np.fft.fft(samples)))
        found.append(np.fft.fftfreq(count, 1 / rate)[peak])
    return np.array(found)


def receiver_alias() -> float:
    """At this rate the mirrored tip is seen, in samples, on the filter's edge Omega_y_max / a."""
    from firstorder.shadowfield import receiver_rate

    k, corners = _scene()
    rate = float(receiver_rate(k, corners))
    seen = _alias(rate, 1.0, (-float(np.max(np.asarray(corners)[:, 0])), 0.0))[0]
    edge = float(np.max(np.asarray(k.corners())[:, 0]))
    return abs((seen - edge + 0.5 * rate) % rate - 0.5 * rate) / rate


def replicas_let_in(rate) -> float:
    """How many waves of the wedge, on a dense grid, have a replica inside the filter."""
    k, _ = _scene()
    slope, Ox, n = np.meshgrid(
        np.linspace(0.5, 2.0, 31), np.linspace(0.02, 1.99, 80), np.arange(-8, 9), indexing="ij"
    )
    passed = np.asarray(k.contains(Ox, slope * Ox - n * rate)) & (n != 0)
    return float(np.sum(passed))


def none_let_in() -> float:
    """At the corrected rate there are none; at 0.9 of it there are (or the check is blind)."""
    from firstorder.shadowfield import light_rate_of_endless_wedge

    rate = float(light_rate_of_endless_wedge(D1, NEAR, FAR, HIGH))
    return replicas_let_in(1.0001 * rate) if replicas_let_in(0.9 * rate) else float("inf")


def no_shadow(Omega_x, slope) -> float:
    """What is promised of a blocker's wave above the light's band limit: it throws no shadow."""
    return 0.0


def shadow_in_samples(Omega_x, slope) -> float:
    """What the sheared filter makes of such a wave, sampled along the light at the printed rate.

    A sum over rays. The light's spectrum is cos^2(pi Omega / 2) up to its band limit 1 and nothing
    beyond; along the receiver the rays are dense, and the kernel ends in a wide Gaussian.
    """
    rate = 0.5 * (1 / 0.5 - 1 / 2.0)  # a (1/a - 1/b) for a = 1/2, b = 2
    width, shear = 1 / 0.5 - 1 / 2.0, 0.5 * (1 / 0.5 + 1 / 2.0)
    x = np.arange(-800, 801) / 16.0
    y = np.arange(-105, 106) / rate
    kernel = width * np.sinc(width * x) * np.exp(-0.5 * (x / 15.0) ** 2)
    t = 2.0 * (y + shear * x[:, None])
    regular = np.abs(1.0 - t**2) > 1e-9
    light = np.where(regular, np.sinc(t) / np.where(regular, 1.0 - t**2, 1.0), 0.5)
    wave = np.exp(-2j * np.pi * Omega_x * (x[:, None] + slope * y))
    return float(np.abs(np.sum(kernel[:, None] * light * wave)) / 16.0 / rate)


ROWS = [
    Row(
        "E11.17",
        "identity",
        implements="firstorder.shadowfield.plane.rates.receiver_rate",
        symbolic=along_the_receiver,
        autodiff=na("no derivative"),
        fourier=Check(receiver_alias, 1e-3),
        brute_force=Check(receiver_rate_by_bisection, 1e-6),
        note="Omega_x_max = Omega_g d2_max / d1. Enough for any rate along the light, and needed "
        "where replicas slid along Omega_y may stand anywhere; Fourier: one bin of 4096.",
    ),
    Row(
        "E11.18",
        "over-claim",
        implements="firstorder.shadowfield.plane.rates.light_rate_of_endless_wedge",
        symbolic=lambda: [*along_the_light(), *nothing_in_between()],
        autodiff=na("no derivative"),
        fourier=Check(none_let_in, 0.0),
        brute_force=Check(light_rate_by_bisection, 1e-6),
        corrected="Omega_y* = Omega_y_max (d1/d2_min - 1) [1/(d1/d2_max - 1) - 1/(d1/d2_min - 1)]: "
        "d2_min in the first factor; printed, only one corner of the filter is cleared. Less is "
        "enough if the blockers' band limit cuts the wedge before that corner (`light_rate`)",
        counterexample=Counterexample(
            {"Omega_x": 1.7, "slope": 3.03 / 1.7},
            printed=no_shadow,
            true=shadow_in_samples,
        ),
        note="Also: the count of samples is the rates' product times the filter's area in space, "
        "or over its area in frequency; the text divides by its volume in space.",
    ),
]
