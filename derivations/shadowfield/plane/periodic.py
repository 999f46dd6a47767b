"""Small blockers: which waves of a periodic blocker reach a diffuse receiver.

D05 §3.4. The paper argues with replicas that travel pushes off the line of zero angular frequency;
here the shadow is integrated, bar by bar.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

x, y = sp.symbols("x y", real=True)
d1, d2, p, w = sp.symbols("d1 d2 p w", positive=True)
n = sp.Symbol("n", integer=True, positive=True)


def wave_of_the_shadow():
    """Wave n of the bars, met at u = y + (x - y) d2/d1, over a light of width w.

    Its height is the light's transform at (1 - d2/d1) n/p, its frequency (d2/d1) n/p. D05's
    replica: n/p in space at the blockers is met where the source has the slope frequency d n/p.
    """
    u = y + (x - y) * d2 / d1
    k = 2 * sp.pi * n / p
    along = sp.simplify(k * u.diff(x) - 2 * sp.pi * (d2 / d1) * n / p)
    across = k * u.diff(y)
    height = sp.integrate(sp.cos(across * y), (y, -w / 2, w / 2))
    Omega = (1 - d2 / d1) * n / p
    sinc = sp.sin(sp.pi * Omega * w) / (sp.pi * Omega)
    at = {d1: sp.Rational(6, 5), d2: sp.Rational(1, 2), p: sp.Rational(1, 3), w: sp.Rational(4, 5)}
    return along, sp.simplify((height - sinc).subs(at).subs(n, 2))


def worst_rest():
    """Bars open on the share c: beyond whole periods a rest r < p passes at most min(r, c p).

    Its excess over c r is largest at r = c p: c (1 - c) p.
    """
    c = sp.Symbol("c", positive=True)
    r = sp.Symbol("r", positive=True)
    before, after = r - c * r, c * p - c * r
    met = sp.solve(sp.Eq(before, after), r)[0]
    return sp.simplify(met - c * p), sp.simplify(before.subs(r, c * p) - c * (1 - c) * p)


# ---------------------------------------------------------------- numeric routes

D1, D2, OPEN, W = 1.2, 0.5, 0.3, 0.8


def _traced(X, period):
    """The uniform light through the bars: lengths of openings, by their primitive."""

    def passed(u):
        t = u / period + 0.5 * OPEN
        return period * (np.floor(t) * OPEN + np.minimum(t - np.floor(t), OPEN))

    s = D2 / D1
    return (passed(0.5 * W * (1 - s) + X * s) - passed(-0.5 * W * (1 - s) + X * s)) / (1 - s)


def harmonics_by_transform() -> float:
    """Waves 0 to 3 of the traced shadow, from its discrete transform, against `shadow_harmonic`."""
    from firstorder.fields import BoxProfile, Separable
    from firstorder.shadowfield import PLANE, shadow_harmonic

    light, worst, count = (
        Separable([0.0], (BoxProfile(0.5 * W, "y", PLANE),)).spectrum(),
        0.0,
        20000,
    )
    for period in (0.7, 0.13):
        X = (np.arange(count) + 0.5) / count * period * D1 / D2
        h = _traced(X, period)
        for k in range(4):
            truth = np.mean(h * np.exp(-2j * np.pi * k * X * D2 / (D1 * period)))
            worst = max(
                worst, abs(complex(shadow_harmonic(k, period, OPEN, light, D1, D2)) - truth)
            )
    return float(worst)


def average_within_the_bound() -> float:
    """How far the traced shadow leaves its average beyond the bound, over 60 periods of bars."""
    from firstorder.shadowfield import average_occlusion_bound

    X, worst = np.linspace(0.0, 3.0, 20001), 0.0
    for period in np.geomspace(0.02, 0.4, 60):
        error = np.max(np.abs(_traced(X, period) / (OPEN * W) - 1.0))
        bound = float(average_occlusion_bound(period, OPEN, W, D1, D2))
        worst = max(worst, error / bound - 1.0)
    return worst


ROWS = [
    Row(
        "D05.s3.4b",
        "approximation",
        implements="firstorder.shadowfield.plane.periodic.shadow_harmonic",
        symbolic=lambda: [*wave_of_the_shadow(), *worst_rest()],
        autodiff=na("no derivative"),
        fourier=Check(harmonics_by_transform, 1e-6),
        brute_force=Check(average_within_the_bound, 1e-9),
        note="Order 1 in the period: the shadow leaves its average by at most (1 - open) p / "
        "((1 - d2/d1) w), relative, for a uniform light of width w; a soft light forgets faster. "
        "One plane of bars only: two in proportion to their distance from the receiver "
        "leave a triangle wave of full height however fine they are (E11 Fig. 18a).",
    ),
]
