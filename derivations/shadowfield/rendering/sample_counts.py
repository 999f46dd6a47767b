"""E11's Appendix B in words: how many samples, and how far the blockers' spectrum reaches."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.shadowfield import sheared_filter, wedge_corners
from firstorder.shadowfield.plane.rates import SamplingRates, samples_per_receiver

D1, NEAR, FAR, Y_MAX, PIXELS = 1.0, 0.25, 0.5, 2.0, 16.0


def on_a_line(rate, length):
    """Samples of a grid in an interval, on average over where the grid begins.

    With u of its spacings before it, k + u <= end has its last k at whole(end) as long as u is
    at most the rest of the end, and at one less beyond.
    """
    first, rest, last = sp.symbols("first rest last", real=True)
    u = sp.Symbol("u", real=True)

    def reached(whole, rest):
        return sp.integrate(whole, (u, 0, rest)) + sp.integrate(whole - 1, (u, rest, 1))

    end = first + rest + rate * length
    return sp.expand(reached(last, end - last) - reached(first, rest))


def in_a_parallelogram():
    """Samples in one of any lean: in each of its rows as many, wherever the row begins.

    That is the product of rates and area in space, and the product over the area of its dual, which
    is the cell in frequency. In (x_1, x_2, y_1, y_2) it is the square: both subspaces are alike.
    """
    x, y, width, height, lean = sp.symbols("rate_x rate_y width height lean", positive=True)
    count = on_a_line(x, width) * on_a_line(y, height)
    space = sp.Matrix([[width, lean * height], [0, height]])
    frequency = space.inv().T
    volumes = [sp.diag(m, m).det() for m in (space, frequency)]
    return [
        count - x * y * space.det(),
        count - x * y / frequency.det(),
        count**2 - x**2 * y**2 * volumes[0],
        count**2 - x**2 * y**2 / volumes[1],
    ]


def _filter():
    return sheared_filter(D1, NEAR, FAR, Omega_y_max=Y_MAX, Omega_pix=PIXELS)


def footprint() -> float:
    """Area of the filter's footprint in space: one over that in frequency, from its corners."""
    x, y = np.asarray(_filter().corners()).T
    around = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return 2.0 / abs(around)


def printed_count(rate_x, rate_y) -> float:
    """Product of the rates, divided by the volume in space."""
    return rate_x * rate_y / footprint()


def counted(rate_x, rate_y, seed=3) -> float:
    """Samples of a grid that fall into a parallelogram of the footprint's area, on average."""
    rng = np.random.default_rng(seed)
    width = 0.7
    height, lean, total, tries = footprint() / width, 0.6, 0, 400
    x = np.arange(-4.0, 4.0, 1.0 / rate_x)
    y = np.arange(-4.0, 4.0, 1.0 / rate_y)
    X, Y = np.meshgrid(x, y)
    for u, v in rng.uniform(0.0, 1.0, (tries, 2)):
        a, b = X + u / rate_x, Y + v / rate_y
        inside = (np.abs(b) < 0.5 * height) & (np.abs(a - lean * b) < 0.5 * width)
        total += np.count_nonzero(inside)
    return total / tries


def ours_against_counting() -> float:
    """The library's count against samples counted."""
    ours = samples_per_receiver(_filter(), SamplingRates(40.0, 60.0))
    return abs(float(ours) / counted(40.0, 60.0) - 1.0)


def wave_on_a_plane():
    """A wave `cos(2 pi g p)` at depth d from the light, met at p = x d / d1 + y (1 - d / d1)."""
    x, y, d, d1, g = sp.symbols("x y d d_1 g", positive=True)
    t = sp.Symbol("t")
    along = sp.solve(t - (y + (x - y) * d / d1), t)[0]  # the ray from y at the light to x
    phase = g * along
    return [
        sp.simplify(sp.diff(phase, x) - g * d / d1),
        sp.simplify(sp.diff(phase, y) - g * (1 - d / d1)),
    ]


def reach(omega, near, far) -> float:
    """Largest Omega_x of waves on planes between two depths, by a transform of samples."""
    n, worst = 1024, 0.0
    x = np.arange(n) / n * 8.0
    for depth in np.linspace(near, far, 5):
        F = np.abs(np.fft.rfft(np.hanning(n) * np.cos(2.0 * np.pi * omega * x * depth / D1)))
        worst = max(worst, float(np.argmax(F)) / 8.0)
    return worst


def ours_against_the_transform() -> float:
    """The wedge's corner against the peak of the transform (a bin is 1/8)."""
    corners = np.asarray(wedge_corners(D1, NEAR, FAR, jnp.array(16.0)))
    return abs(float(np.max(corners[:, 0])) - reach(16.0, NEAR, FAR))


HERE = "firstorder.shadowfield.plane.rates"

ROWS = [
    Row(
        "E11.sBa",
        "misprint",
        f"{HERE}.samples_per_receiver",
        in_a_parallelogram,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(ours_against_counting, 0.02),
        corrected="the product times the filter's volume in space, or over that in frequency",
        counterexample=Counterexample({"rate_x": 40.0, "rate_y": 60.0}, printed_count, counted),
        note="Shown for one pair of coordinates; the count in space is the square.",
    ),
    Row(
        "E11.sBb",
        "misprint",
        f"{HERE}.wedge_corners",
        wave_on_a_plane,
        autodiff=na("no derivative"),
        fourier=Check(ours_against_the_transform, 0.126),
        brute_force=na("one route"),
        corrected="Omega_x_max = Omega_g_max d_2max / d_1, Omega_g the blockers' own band limit",
        counterexample=Counterexample(
            {"omega": 16.0, "near": NEAR, "far": FAR}, lambda omega, near, far: omega, reach
        ),
        note="Printed with Omega_x_max on both sides, which would need d_2max = d_1.",
    ),
]
