"""R07 §9 in words: which gradient, the density of samples, differences, interpolation."""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.checks.tolerance import fitted_order
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.reconstruction.importance import (
    QuadtreeCells,
    ShadedSamples,
    by_differences,
    by_gradient,
)

# --- §9.1: the name of the gradient --------------------------------------------------------------


def by_pixel_or_by_normal():
    """`I_u = I_n n_u` where the picture knows the normal alone: I_n is another quantity."""
    u, n = sp.symbols("u n", real=True)
    turn, shade = sp.Function("N")(u), sp.Function("I")
    picture = shade(turn)
    by_normal = shade(n).diff(n).subs(n, turn)
    return sp.simplify((picture.diff(u) - by_normal * turn.diff(u)).doit())


RADIUS = 40.0  # pixels, of a ball whose normal turns as asin(u / RADIUS)


def shade(n):
    """Diffuse shading of the ball by its normal's angle."""
    return np.cos(n - 0.4)


def slope_by_normal(u):
    """|dI/dn|, as I_n would read with the paper's n."""
    n = np.arcsin(u / RADIUS)
    return float(abs(shade(n + 1e-6) - shade(n - 1e-6)) / 2e-6)


def slope_by_pixel(u):
    """|dI/du|."""
    f = [shade(np.arcsin((u + s * 1e-5) / RADIUS)) for s in (1, -1)]
    return float(abs(f[0] - f[1]) / 2e-5)


def importance_by_pixel() -> float:
    """The library's metric of a square: its area times |I_u|, by differences of a picture."""
    at = np.array([[3.0, 5.0], [-7.0, 2.0]])
    slopes = np.array([[np.cos(x), 0.5 * y] for x, y in at])
    cells = QuadtreeCells(np.array([4.0, 2.0]), ShadedSamples(np.ones(2), slopes), np.zeros((2, 2)))
    h = 1e-5
    picture = lambda x, y: np.sin(x) + 0.25 * y**2  # noqa: E731
    x, y = at.T
    along = picture(x + h, y) - picture(x - h, y), picture(x, y + h) - picture(x, y - h)
    true = cells.size**2 * np.hypot(*along) / (2.0 * h)
    return float(np.max(np.abs(by_gradient(cells) / true - 1.0)))


# --- §9.1: where samples end ---------------------------------------------------------------------


def even_importance():
    """Squares of one importance, `|grad I| a^2 = c`: one sample each, so |grad I| / c per area."""
    slope, c, a = sp.symbols("slope c a", positive=True)
    side = sp.solve(sp.Eq(slope * a**2, c), a)[0]
    density = 1 / side**2
    return [sp.simplify(density - slope / c), sp.simplify(density.diff(slope) * slope - density)]


def density_of_samples() -> float:
    """Samples per area of a tree over two halves of a picture, of slopes 1 and 4: four times.

    The budget is that of squares of one importance, halved twice and three times: with the samples
    of all levels, which stay, 21 and 85 in the place of each first one.
    """
    from firstorder.reconstruction.quadtree import sample_image

    def shade_(p):
        steep = p[:, 0] >= 32.0
        slope = np.where(steep, 4.0, 1.0)
        return ShadedSamples(slope * p[:, 1], np.stack([0.0 * slope, slope], -1))

    found = sample_image(shade_, 64, 64, 32 * (21 + 85), by_gradient, block=8)
    right = np.sum(found.p[:, 0] >= 32.0)
    return abs(float(right) / (len(found.p) - right) / 4.0 - 1.0)


# --- §9.2: differences ---------------------------------------------------------------------------


def central_difference():
    """Of two neighbours: the slope in their middle to second order; the variance, its square."""
    m, h = sp.symbols("m h", real=True)
    f = sum(sp.Symbol(f"c{k}") * m**k for k in range(5))
    low, high = (f.subs(m, s * h / 2) for s in (-1, 1))
    slope = f.diff(m).subs(m, 0)
    difference = sp.expand((high - low) / h)
    variance = ((low - high) / 2) ** 2 * 2  # unbiased, of two
    return [
        sp.simplify(difference - slope - h**2 / 24 * f.diff(m, 3).subs(m, 0)),
        sp.simplify(sp.expand(variance - (high - low) ** 2 / 2)),
    ]


def difference_error() -> float:
    """The order of the difference, fitted; and the library's metric on planes, by four quarters."""
    h = np.array([0.2, 0.1, 0.05])
    errors = np.abs((np.sin(0.3 + h / 2) - np.sin(0.3 - h / 2)) / h - np.cos(0.3))
    size, slope = np.array([2.0, 4.0]), np.array([[0.3, -0.4], [1.2, 0.5]])
    corners = 0.25 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    values = size[:, None] * (slope @ corners.T)
    cells = QuadtreeCells(size, ShadedSamples(values.mean(1)), slope)
    # Of values at h / 4 to all four sides the unbiased variance is h^2 |grad I|^2 / 12.
    true = size * np.sqrt(12.0 * values.var(axis=1, ddof=1))
    off = np.max(np.abs(by_differences(cells) / true - 1.0))
    return float(max(abs(fitted_order(h, errors) - 2.0) / 100.0, off))


# --- §9.3: interpolation -------------------------------------------------------------------------


def left_by_interpolation():
    """Between two samples h apart a line is met, however steep; a parabola is off by h^2 / 8."""
    a, b, c, h, t = sp.symbols("a b c h t", positive=True)
    f = a + b * t + c * t**2 / 2
    line = f.subs(t, 0) + (f.subs(t, h) - f.subs(t, 0)) * t / h
    error = sp.factor(line - f)
    return [error.diff(b), sp.simplify(error.subs(t, h / 2) - c * h**2 / 8)]


def interpolated() -> float:
    """Largest miss of linear interpolation, of steep lines and of a wave: the latter of order 2."""

    def miss(f, h):
        x = np.arange(0.0, 2.0 + 0.5 * h, h)
        fine = np.linspace(0.0, 2.0, 4001)
        return np.max(np.abs(np.interp(fine, x, f(x)) - f(fine)))

    steep = miss(lambda x: 1e3 * x - 2.0, 0.1) / 1e3
    h = np.array([0.1, 0.05, 0.025])
    order = fitted_order(h, [miss(np.sin, k) for k in h])
    return max(steep / 1e-12, abs(order - 2.0) / 0.05)


METRICS = "firstorder.reconstruction.importance"
FLAT = {"fourier": na("no spectrum")}
ROWS = [
    Row(
        "R07.s9.1d",
        "misprint",
        implements=f"{METRICS}.by_gradient",
        symbolic=by_pixel_or_by_normal,
        autodiff=na("one route"),
        brute_force=Check(importance_by_pixel, 1e-6),
        **FLAT,
        corrected="|grad I| over the image, (I_u, I_v) of §5.3",
        counterexample=Counterexample({"u": 10.0}, printed=slope_by_normal, true=slope_by_pixel),
        note="n is the normal, of its angle; printed is dI/dn of a ball, true dI/du.",
    ),
    Row(
        "R07.s9.1e",
        "approximation",
        symbolic=even_importance,
        autodiff=na("scale"),
        brute_force=Check(density_of_samples, 0.02),
        **FLAT,
        note="Per area. Squares are halved, so the density is met within a factor of four at a "
        "place, and on average.",
    ),
    Row(
        "R07.s9.2a",
        "approximation",
        implements=f"{METRICS}.by_differences",
        symbolic=central_difference,
        autodiff=na("measured"),
        brute_force=Check(difference_error, 1e-4),
        **FLAT,
        note="The difference over h, to second order, I''' h^2 / 24; the variance is (h I')^2 / 2, "
        "its square: as a metric it ranks steep places higher.",
    ),
    Row(
        "R07.s9.3a",
        "identity",
        symbolic=left_by_interpolation,
        autodiff=na("no derivative"),
        brute_force=Check(interpolated, 1.0),
        **FLAT,
        note="What is left is h^2 |I''| / 8 at most.",
    ),
]
