"""E11 §3 to §7 and its captions in words: slopes, bands, the way of a shear, means of depths."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.shadowfield.plane.filters import (
    SCENE,
    _filter,
    _offsets,
    d1,
    far,
    near,
    printed,
    scale,
    shear,
)
from derivations.transport.shading._shading import gauss
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Counterexample, Row, na

PLANE = "firstorder.shadowfield.plane"
DEPTHS = (0.25, 0.5)

# --- §3.1: waves on planes -----------------------------------------------------------------------


def wave(d2, receiver=None):
    """Frequencies of a unit wave on the plane at d2: over (y, v); with a receiver over (x, y)."""
    x, y, v = sp.symbols("x y v", real=True)
    if receiver is None:
        u = y + d2 * v
        return u.diff(y), u.diff(v)
    u = sp.expand(y + d2 * (x - y) / receiver)
    return u.diff(x), u.diff(y)


def slopes_of_the_wedge():
    """Omega_y per Omega_v is 1 / d2, less for the farther plane."""
    (y1, v1), (y2, v2) = wave(near), wave(far)
    gap = sp.Symbol("gap", positive=True)
    lower = (y2 / v2).subs(far, near + gap) - y1 / v1
    return [y1 / v1 - 1 / near, sp.simplify(lower + gap / (near * (near + gap)))]


def slope_of_waves(which):
    """The least, or the largest, Omega_y per Omega_v of waves on planes in between, by steps."""
    slopes = []
    for d2 in np.linspace(*DEPTHS, 9):
        u = lambda y, v, d2=d2: y + d2 * v  # noqa: E731
        slopes.append((u(1.0, 0.0) - u(0.0, 0.0)) / (u(0.0, 1.0) - u(0.0, 0.0)))
    return float(min(slopes) if which == "least" else max(slopes))


def directions_of_waves(receiver=None) -> float:
    """The library's directions against steps across a wave."""
    from firstorder.shadowfield import Wedge

    wedge, worst = Wedge(*DEPTHS), 0.0
    for d2 in np.linspace(*DEPTHS, 5):
        if receiver is None:
            true = np.array([1.0, d2])
        else:
            u = lambda x, y, d2=d2: y + d2 * (x - y) / receiver  # noqa: E731
            true = np.array([u(1.0, 0.0) - u(0.0, 0.0), u(0.0, 1.0) - u(0.0, 0.0)])
        worst = max(worst, normwise(wedge.direction(d2, receiver), true))
    return worst


def directions_by_autodiff() -> float:
    """The same against the gradient of the place where a ray (y, v) meets the plane."""
    import jax
    import jax.numpy as jnp

    from firstorder.shadowfield import Wedge

    found = [jax.grad(lambda q, d2=d2: q[0] + d2 * q[1])(jnp.zeros(2)) for d2 in DEPTHS]
    return normwise(np.stack([Wedge(*DEPTHS).direction(d2) for d2 in DEPTHS]), np.stack(found))


def band_along_the_direction():
    """A wave of frequency Omega_g on the plane at d2: Omega_y is Omega_g, Omega_v d2 times that."""
    g, v, y = sp.symbols("Omega_g v y", positive=True)
    phase = g * (y + near * v)
    return [phase.diff(y) - g, phase.diff(v) - near * g]


def band_of_samples(Omega_g, d2):
    """Where the transform over v of a sampled wave on that plane has its peak."""
    n, span = 4096, 64.0
    v = (np.arange(n) / n - 0.5) * span
    power = np.abs(np.fft.rfft(np.cos(2.0 * np.pi * Omega_g * d2 * v)))
    return float(np.argmax(power) / span)


# --- §3.1, §3.2: on the receiver -----------------------------------------------------------------


def compressed():
    """Omega_x of a wave falls as 1 / d1, and is that of its own plane where d1 is d2."""
    x, _ = wave(near, d1)
    return [sp.simplify(x.diff(d1) * d1 + x), sp.simplify(x.subs(d1, near) - 1)]


def compressed_by_autodiff() -> float:
    """The power of d1 in the library's largest Omega_x."""
    import jax
    import jax.numpy as jnp

    from firstorder.shadowfield.plane.rates import wedge_corners

    def largest(s):
        return jnp.log(jnp.max(wedge_corners(jnp.exp(s), *DEPTHS, 4.0)[:, 0]))

    return abs(float(jax.grad(largest)(0.3)) + 1.0)


def compressed_by_waves() -> float:
    """That largest Omega_x against steps across waves."""
    from firstorder.shadowfield.plane.rates import wedge_corners

    worst = 0.0
    for receiver in (0.6, 1.2, 3.0):
        true = max(4.0 * d2 / receiver for d2 in np.linspace(*DEPTHS, 9))
        ours = float(np.max(np.asarray(wedge_corners(receiver, *DEPTHS, 4.0))[:, 0]))
        worst = max(worst, abs(ours / true - 1.0))
    return worst


def slope_on_the_receiver():
    x, y = wave(near, d1)
    return [sp.simplify(y / x - (d1 / near - 1))]


def slopes_by_waves() -> float:
    """The library's two slopes against waves on the nearest and the farthest plane."""
    from firstorder.shadowfield import Wedge

    found = np.array([float(s) for s in Wedge(*DEPTHS).slopes(1.2)])
    return normwise(found, np.array([1.2 / d2 - 1.0 for d2 in reversed(DEPTHS)]))


def slopes_by_autodiff() -> float:
    """Their derivative by d1: 1 / d2."""
    import jax
    import jax.numpy as jnp

    from firstorder.shadowfield import Wedge

    rates = jax.jacfwd(lambda d: jnp.stack(Wedge(*DEPTHS).slopes(d)))(1.2)
    return normwise(rates, np.array([1.0 / d2 for d2 in reversed(DEPTHS)]))


# --- footnote 1 ----------------------------------------------------------------------------------


def soler_and_sillion():
    """Their shadow, by similar triangles from the blocker: alpha = d1 / d2 - 1, squared in space.

    A ray from y through u on the blocker goes on by (d1 - d2) / d2 of its way: x = (1 + alpha) u -
    alpha y. So h is g((x + alpha y) / (1 + alpha)) against l, a convolution in x' = x + alpha y.
    """
    x, y, u, d2, W = sp.symbols("x y u d2 Omega", positive=True)
    alpha = d1 / d2 - 1
    lands = u + (u - y) * (d1 - d2) / d2
    back = sp.solve(sp.Eq(lands, x), u)[0]
    magnified = sp.simplify(back - (x + alpha * y) / (1 + alpha))
    # exp(-2 pi i W x) over x = (1 + alpha) u - alpha y: (1 + alpha) G((1 + alpha) W) L(-alpha W).
    phase = sp.expand(
        W * ((1 + alpha) * u - alpha * y) - ((1 + alpha) * W * u + (1 - d1 / d2) * W * y)
    )
    jacobian = sp.diff((1 + alpha) * u - alpha * y, u) - d1 / d2
    return [magnified, sp.simplify(phase), sp.simplify(jacobian)]


def convolved_shadow() -> float:
    """The library's shadow spectrum against their convolution, sampled and summed."""
    from firstorder.fields import GaussianProfile, Separable
    from firstorder.shadowfield import PLANE as LINE
    from firstorder.shadowfield.plane.spectra import PlanarShadowSpectrum

    receiver, d2 = 1.2, 0.5
    alpha = receiver / d2 - 1.0
    G, light = (
        Separable([c], (GaussianProfile(s, LINE.coordinates[0], LINE),))
        for c, s in ((0.1, 0.2), (-0.05, 0.3))
    )
    H = PlanarShadowSpectrum(G.spectrum(), light.spectrum(), receiver, d2)
    x = np.linspace(-6.0, 6.0, 6001)
    step = x[1] - x[0]
    blocker = gauss(x / (1 + alpha) - 0.1, 0.2)
    lamp = gauss(-x / alpha + 0.05, 0.3) / alpha
    h = np.convolve(blocker, lamp, mode="same") * step
    worst = 0.0
    for W in (0.0, 0.3, 0.8):
        true = np.sum(h * np.exp(-2j * np.pi * W * x)) * step
        worst = max(worst, abs(complex(H(W)) - true))
    return float(worst)


# --- §4 and Fig. 6: the filter -------------------------------------------------------------------


def printed_direction(Omega_y):
    """Height over the mean of the offsets: the shear that the text calls Omega_y per Omega_x."""
    ends = _offsets() * Omega_y / SCENE["Omega_y_max"]
    return float(Omega_y / (0.5 * (ends.min() + ends.max())))


def true_direction(Omega_y):
    """How far the filter's middle has moved along Omega_x at that height, for each unit of it."""
    ends = _offsets() * Omega_y / SCENE["Omega_y_max"]
    return float(0.5 * (ends.min() + ends.max()) / Omega_y)


def sheared_box() -> float:
    """The library's matrix against the box that it must make of the simple filter, by waves."""
    A = np.asarray(_filter().frequency_matrix)
    ends = _offsets()
    true = np.array([[0.5 * np.ptp(ends) / SCENE["Omega_pix"], true_direction(1.0)], [0.0, 1.0]])
    return normwise(A, true)


def mean_depth():
    """The footprint's slope over (v, y) is that of a plane at a depth between the two.

    A band of the plane at d2 has the slope `-m`, `m = 1 / (d1 / d2 - 1)`, over (x, y), so that
    d2 = d1 m / (1 + m), which rises with m; (10) takes the mean of both m.
    """
    m1, m2 = (1 / (d1 / d - 1) for d in (near, far))
    m = -printed()[1]
    p, q = sp.symbols("p q", positive=True)

    def depth(m):
        return d1 * m / (1 + m)

    return [
        sp.simplify(depth(m1) - near),
        sp.simplify(depth(m2) - far),
        sp.simplify(m - (m1 + m2) / 2),
        sp.simplify(depth(p + q) - depth(p) - d1 * q / ((1 + p) * (1 + p + q))),
        *np.atleast_1d(shear()),
    ]


def slope_in_storage() -> float:
    """The library's footprint over (y, v), whose line is y = -d_avg v, against a bisection.

    The depth whose band over (x, y) has the mean slope of both ends.
    """
    from scipy.optimize import brentq

    edge = np.asarray(_filter().light_matrix(SCENE["d1"]))[:, 0]
    depth = -edge[0] / edge[1]

    def band(d2):
        return d2 / (SCENE["d1"] - d2)

    mean = 0.5 * (band(SCENE["d2_min"]) + band(SCENE["d2_max"]))
    found = brentq(lambda d: band(d) - mean, SCENE["d2_min"], SCENE["d2_max"], xtol=1e-15)
    return float(abs(depth / found - 1.0) + (not SCENE["d2_min"] < depth < SCENE["d2_max"])
                 + abs(edge[1] * SCENE["d1"] / _filter().primal_scale
                       - (1.0 - _filter().primal_shear)))  # fmt: skip


# --- §7: the light's band, and matched bars ------------------------------------------------------


def smaller_scale():
    """(9) falls as one over the light's band."""
    Oy = sp.Symbol("Omega_y_max", positive=True)
    s = printed()[0]
    return [sp.simplify(s.diff(Oy) * Oy + s), *scale()]


def scale_by_autodiff() -> float:
    import jax
    import jax.numpy as jnp

    from firstorder.shadowfield import sheared_filter

    def logarithm(s):
        given = SCENE | {"Omega_y_max": jnp.exp(s)}
        return jnp.log(sheared_filter(**given).primal_scale)

    return abs(float(jax.grad(logarithm)(0.4)) + 1.0)


def scale_by_offsets() -> float:
    """Two bands: pixels over the width of the offsets of waves."""
    from firstorder.shadowfield import sheared_filter

    worst = 0.0
    for band in (1.0, 5.0):
        width = np.ptp(_offsets()) * band / SCENE["Omega_y_max"]
        ours = sheared_filter(**SCENE | {"Omega_y_max": band}).primal_scale
        worst = max(worst, abs(float(ours) * width / (2.0 * SCENE["Omega_pix"]) - 1.0))
    return worst


def triangle():
    """Two combs, half open, one slid by s of a period: they share 1/2 - |s|, a triangle wave."""
    s = sp.Symbol("s", positive=True)
    t = sp.Symbol("t", real=True)
    # Openings from -1/4 to 1/4 and from s - 1/4 to s + 1/4, and the next one a period before.
    own = sp.integrate(1, (t, s - sp.Rational(1, 4), sp.Rational(1, 4)))
    return [
        own - (sp.Rational(1, 2) - s),
        own.subs(s, 0) - sp.Rational(1, 2),
        own.subs(s, sp.Rational(1, 2)),
    ]


def bars_by_rays(period=0.1) -> float:
    """The library's wave against rays from points of a wide light past both planes of bars."""
    from firstorder.shadowfield import moire

    receiver, one, two = 1.0, 0.25, 0.5
    other = period * (receiver - two) / (receiver - one)  # in proportion to the way to the receiver
    common = period * receiver / (receiver - one)
    x = np.array([0.0, 0.013, 0.04, 0.07, 0.11])
    y = (np.arange(60_000) + 0.5) / 60_000 * 50.0 * common - 25.0 * common

    def free(d, p):
        u = y + (x[:, None] - y) * d / receiver
        return np.abs(u / p - np.round(u / p)) < 0.25

    traced = np.mean(free(one, period) & free(two, other), axis=1)
    return float(np.max(np.abs(np.asarray(moire(x, period, receiver, one, two)) - traced)))


FLAT = {"fourier": na("no spectrum")}
SPECTRAL = {"autodiff": na("spectral")}
ROWS = [
    Row(
        "E11.s3.1a",
        "misprint",
        implements=f"{PLANE}.spectra.Wedge.direction",
        symbolic=slopes_of_the_wedge,
        autodiff=Check(directions_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(directions_of_waves, 1e-14),
        corrected="[1 / d2_max, 1 / d2_min]",
        counterexample=Counterexample(
            {"which": "least"},
            printed=lambda which: 1.0 / DEPTHS[0],
            true=slope_of_waves,
        ),
        note="The interval's ends are exchanged.",
    ),
    Row(
        "E11.s3.1b",
        "misprint",
        implements=f"{PLANE}.spectra.Wedge.direction",
        symbolic=band_along_the_direction,
        autodiff=Check(directions_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(directions_of_waves, 1e-14),
        corrected="it bounds F(Omega_v, Omega_y) along Omega_y; along Omega_v the bound is "
        "d2_max Omega_g",
        counterexample=Counterexample(
            {"Omega_g": 4.0, "d2": 0.25},
            printed=lambda Omega_g, d2: Omega_g + 0.0 * d2,
            true=band_of_samples,
        ),
        note="In the text extraction, which has F(Omega_v, Omega_v) too (look at the page).",
    ),
    Row(
        "E11.s3.1c",
        "identity",
        implements=f"{PLANE}.rates.wedge_corners",
        symbolic=compressed,
        autodiff=Check(compressed_by_autodiff, 1e-12),
        fourier=na("two routes"),
        brute_force=Check(compressed_by_waves, 1e-12),
        note="At fixed depth of the blockers; where the receiver meets them the shadow has all of "
        "their band.",
    ),
    Row(
        "E11.s3.2a",
        "identity",
        implements=f"{PLANE}.spectra.Wedge.slopes",
        symbolic=slope_on_the_receiver,
        autodiff=Check(slopes_by_autodiff, 1e-12),
        fourier=na("two routes"),
        brute_force=Check(slopes_by_waves, 1e-12),
        note="Omega_y per Omega_x.",
    ),
    Row(
        "E11.fn1",
        "identity",
        implements=f"{PLANE}.spectra.PlanarShadowSpectrum",
        symbolic=soler_and_sillion,
        fourier=Check(convolved_shadow, 1e-9),
        brute_force=na("one route"),
        **SPECTRAL,
        note="One dimension; in space the same in each of two, so the factor d1 / d2 is squared.",
    ),
    Row(
        "E11.s4a",
        "misprint",
        implements=f"{PLANE}.filters.RayFilter.frequency_matrix",
        symbolic=lambda: [*scale(), shear()],
        autodiff=na("no derivative"),
        brute_force=Check(sheared_box, 1e-12),
        **FLAT,
        corrected="in Omega_x per unit Omega_y: the mean of the offsets over the height",
        counterexample=Counterexample(
            {"Omega_y": 1.0}, printed=printed_direction, true=true_direction
        ),
        note="(10) is right; its primal shear is in y per x, the dual.",
    ),
    Row(
        "E11.fig6",
        "identity",
        implements=f"{PLANE}.filters.RayFilter.light_matrix",
        symbolic=mean_depth,
        autodiff=na("no derivative"),
        brute_force=Check(slope_in_storage, 1e-12),
        **FLAT,
        note="d_avg = d1 m / (1 + m), m the mean of d2 / (d1 - d2) at both ends.",
    ),
    Row(
        "E11.s7a",
        "identity",
        implements=f"{PLANE}.filters.RayFilter.primal_scale",
        symbolic=smaller_scale,
        autodiff=Check(scale_by_autodiff, 1e-12),
        brute_force=Check(scale_by_offsets, 1e-12),
        **FLAT,
    ),
    Row(
        "E11.fig18a",
        "identity",
        implements=f"{PLANE}.periodic.moire",
        symbolic=triangle,
        autodiff=na("no derivative"),
        brute_force=Check(bars_by_rays, 2e-4),
        **FLAT,
        note="Half open, under an endless light; of one height however fine the bars are.",
    ),
]
