"""Spectra of a planar blocker, on the light and on the receiver, and of its shadow.

E11 eqs. 3-8 and Appendix A. Diracs are judged under a window over v: its transform takes their
place, has mass one for any width and narrows to a point.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

x, y, v, u = sp.symbols("x y v u", real=True)
Ox, Oy, Ov = sp.symbols("Omega_x Omega_y Omega_v", real=True)
d1, d2 = sp.symbols("d1 d2", positive=True)


def window_is_a_dirac():
    """A window of height one: its transform has mass one at any width, and no width in the end."""
    s = sp.Symbol("sigma", positive=True)
    hat = sp.sqrt(2 * sp.pi) * s * sp.exp(-2 * sp.pi**2 * s**2 * Ov**2)
    back = sp.integrate(hat * sp.cos(2 * sp.pi * Ov * v), (Ov, -sp.oo, sp.oo))
    second = sp.integrate(Ov**2 * hat, (Ov, -sp.oo, sp.oo))
    return sp.simplify(back - sp.exp(-(v**2) / (2 * s**2))), sp.limit(second, s, sp.oo)


def line():
    """g(d2 v + y) w(v), for every g and w: y = u - d2 v separates the integral into G and W."""
    before = u - d2 * v
    phase = (v * Ov + y * Oy).subs(y, before) - (u * Oy + v * (Ov - d2 * Oy))
    jacobian = sp.Matrix([v, before]).jacobian([v, u]).det() - 1
    return sp.expand(phase), jacobian, *window_is_a_dirac()


def on_receiver():
    """X = d1 v + y in the integral over (x, y), for every f."""
    across = v * d1 + y
    phase = (x * Ox + y * Oy).subs(x, across) - (v * d1 * Ox + y * (Oy + Ox))
    jacobian = sp.Matrix([across, y]).jacobian([v, y]).det() - d1
    return sp.expand(phase), jacobian


def overlap():
    """For waves f = exp 2 pi i (a x + b y), l = exp 2 pi i c y the y-integral lives at b + c = 0.

    There L(-Omega_y), at Omega_y = b, is asked at c. And the whole on correlated Gaussians.
    """
    b, c = sp.symbols("b c", real=True)
    sign = sp.solve(b + c, c)[0] - (-b)
    f, light = sp.exp(-sp.pi * ((x - y) ** 2 + y**2)), sp.exp(-sp.pi * y**2)
    h = sp.integrate(f * light, (y, -sp.oo, sp.oo))
    H = sp.integrate(h * sp.cos(2 * sp.pi * x * Ox), (x, -sp.oo, sp.oo))
    F = sp.exp(-sp.pi * Ox**2) * sp.exp(-sp.pi * (Oy + Ox) ** 2)  # by x = u + y
    both = sp.integrate(F * sp.exp(-sp.pi * Oy**2), (Oy, -sp.oo, sp.oo))
    return sign, sp.simplify(H - both)


def dirac_resolved():
    """Int phi(Omega_y) delta(d1 Omega_x - d2 (Omega_y + Omega_x)) for every phi, by its zero."""
    inside = d1 * Ox - d2 * (Oy + Ox)
    zero = sp.solve(inside, Oy)[0]
    weight = 1 / sp.Abs(inside.diff(Oy))
    return (
        sp.simplify(zero - (d1 / d2 - 1) * Ox),
        weight - 1 / d2,
        sp.simplify((Oy + Ox).subs(Oy, zero) - d1 / d2 * Ox),
    )


def dirac_in_place():
    """(4) with (3) in it: the first argument of F is d1 Omega_x, the second Omega_y + Omega_x."""
    swapped = (Ov - d2 * Oy).subs({Ov: d1 * Ox, Oy: Oy + Ox}, simultaneous=True)
    return (sp.expand(swapped - (d1 * Ox - d2 * (Oy + Ox))), *on_receiver())


def parallel():
    """h(x) = int g(s x + (1 - s) y) l(y) dy, s = d2 / d1: u = s x + (1 - s) y for every g and l."""
    s = d2 / d1
    across = (u - (1 - s) * y) / s
    phase = x * Ox
    phase = phase.subs(x, across) - (u * Ox * d1 / d2 + y * (1 - d1 / d2) * Ox)
    jacobian = sp.Matrix([across, y]).jacobian([u, y]).det() - d1 / d2
    where = sp.expand(y + d2 * (x - y) / d1 - (s * x + (1 - s) * y))
    return sp.simplify(phase), sp.simplify(jacobian), sp.simplify(where)


# ---------------------------------------------------------------- numeric routes

D1, D2 = 1.3, 0.5
BELL_G, BELL_L, BELL_W = (0.13, 0.11), (-0.07, 0.19), (0.05, 0.6)
OMEGAS = ((1.2, 0.7), (-0.8, -0.3), (2.0, 1.1))


def _bell(t, middle, sigma):
    return np.exp(-0.5 * ((t - middle) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))


def _library(sigma_v=BELL_W[1], middle=BELL_W[0], height=1.0):
    """Spectra of blocker, light and window as the library has them."""
    from firstorder.conventions import Frame
    from firstorder.fields import GaussianProfile, Separable
    from firstorder.shadowfield import PLANE

    def spectrum(center, sigma, frame, weight=1.0):
        profile = GaussianProfile(sigma, frame.coordinates[0], frame, weight)
        return Separable([center], (profile,)).spectrum()

    V = Frame(("v",))
    return spectrum(*BELL_G, PLANE), spectrum(*BELL_L, PLANE), spectrum(middle, sigma_v, V, height)


def _sum(values, first, second, Omega) -> complex:
    cell = (first[1] - first[0]) * (second[1] - second[0])
    wave = np.exp(-2j * np.pi * (Omega[0] * first[:, None] + Omega[1] * second))
    return complex(np.sum(values * wave) * cell)


@functools.cache
def line_by_sum() -> float:
    """`blocker_spectrum` against a Riemann sum over rays that meet the plane."""
    from firstorder.shadowfield import blocker_spectrum

    Y, V = np.linspace(-3.6, 3.6, 401), np.linspace(-5.5, 5.5, 401)
    rays = _bell(Y[:, None] + D2 * V, *BELL_G) * _bell(V, *BELL_W)
    G, _, W = _library()
    F = blocker_spectrum(G, D2, W)
    return max(abs(complex(F(*o)) - _sum(rays, Y, V, o)) for o in OMEGAS)


@functools.cache
def line_by_transform() -> float:
    """The same against the library's transform of the sampled field, a layer times its window."""
    import equinox as eqx

    from firstorder.conventions import Frame
    from firstorder.fields import GaussianProfile, Grid, Separable, discrete_transform
    from firstorder.laws import Move, Multiply
    from firstorder.shadowfield import ON_LIGHT, PLANE, blocker_spectrum, planar_blocker

    grid = Grid.spanning((240, 240), (3.6, 5.5))
    g = Separable([BELL_G[0]], (GaussianProfile(BELL_G[1], "y", PLANE),))
    window = Separable([BELL_W[0]], (GaussianProfile(BELL_W[1], "v", Frame(("v",))),))
    whole = Multiply(Move([[0.0, 1.0]], to=ON_LIGHT)(window))(planar_blocker(g, D2))
    samples = eqx.filter_jit(grid.sample)(whole)
    G, _, W = _library()
    F, axes = blocker_spectrum(G, D2, W), [np.array([o[i] for o in OMEGAS]) for i in (0, 1)]
    truth = np.diag(np.asarray(discrete_transform(samples, grid, *axes)))
    return float(np.max(np.abs(np.asarray(F(*axes)) - truth)))


@functools.cache
def receiver_by_sum() -> float:
    """`two_plane_spectrum` against a sum over rays named by (x, y)."""
    from firstorder.shadowfield import blocker_spectrum, two_plane_spectrum

    X, Y = np.linspace(-6.5, 6.5, 701), np.linspace(-3.6, 3.6, 401)
    V = (X[:, None] - Y) / D1
    rays = _bell(Y + D2 * V, *BELL_G) * _bell(V, *BELL_W)
    G, _, W = _library()
    F = two_plane_spectrum(blocker_spectrum(G, D2, W), D1)
    return max(abs(complex(F(*o)) - _sum(rays, X, Y, o)) for o in OMEGAS)


@functools.cache
def receiver_by_line() -> float:
    """The same against d1 G(Oy + Ox) W(d1 Ox - d2 (Oy + Ox)), the bells' transforms by hand."""
    from firstorder.shadowfield import blocker_spectrum, two_plane_spectrum

    def hat(Omega, middle, sigma):
        return np.exp(-2j * np.pi * Omega * middle - 2 * (np.pi * sigma * Omega) ** 2)

    G, _, W = _library()
    F = two_plane_spectrum(blocker_spectrum(G, D2, W), D1)
    worst = 0.0
    for a, b in OMEGAS:
        truth = D1 * hat(a + b, *BELL_G) * hat(D1 * a - D2 * (a + b), *BELL_W)
        worst = max(worst, abs(complex(F(a, b)) - truth))
    return worst


def dirac_mass() -> float:
    """Under a window 400 wide, int F dOmega_y is that of the Dirac: (d1/d2) G((d1/d2) Omega_x)."""
    from firstorder.shadowfield import PlanarShadowSpectrum, blocker_spectrum, two_plane_spectrum

    sigma = 400.0
    G, _, W = _library(sigma, 0.0, sigma * np.sqrt(2 * np.pi))
    F = two_plane_spectrum(blocker_spectrum(G, D2, W), D1)

    class One(type(G)):
        """A light that is a point: its spectrum is 1."""

        def at(self, Omega):
            return 1.0 + 0.0j * Omega[0]

    H, worst = PlanarShadowSpectrum(G, One(G.light), D1, D2), 0.0
    for a in (0.3, -0.7, 1.1):
        near = (D1 / D2 - 1) * a + np.linspace(-8, 8, 401) / (2 * np.pi * sigma * D2)
        mass = np.sum(np.asarray(F(a, near))) * (near[1] - near[0])
        worst = max(worst, abs(mass - complex(H(a))))
    return float(worst)


def dirac_place() -> float:
    """... and its energy lies about Omega_y = (d1/d2 - 1) Omega_x."""
    from firstorder.shadowfield import blocker_spectrum, two_plane_spectrum

    G, _, W = _library(400.0, 0.0)
    F, worst = two_plane_spectrum(blocker_spectrum(G, D2, W), D1), 0.0
    for a in (0.3, -0.7, 1.1):
        w = (D1 / D2 - 1) * a + np.linspace(-0.02, 0.02, 4001)
        power = np.abs(np.asarray(F(a, w))) ** 2
        worst = max(worst, abs(np.sum(power * w) / np.sum(power) - (D1 / D2 - 1) * a))
    return float(worst)


def _irradiance(X, window):
    Y = np.linspace(-1.7, 1.5, 801)
    V = (X[:, None] - Y) / D1
    rays = _bell(Y + D2 * V, *BELL_G) * _bell(Y, *BELL_L) * window(V)
    return np.sum(rays, axis=1) * (Y[1] - Y[0])


def _spectrum_error(H, h, X) -> float:
    worst = 0.0
    for a in (0.0, 0.6, -1.1):
        truth = np.sum(h * np.exp(-2j * np.pi * a * X)) * (X[1] - X[0])
        worst = max(worst, abs(complex(H(a)) - truth))
    return float(worst)


@functools.cache
def overlap_by_sum() -> float:
    """`ShadowSpectrum` against the transform of the shadow, ray by ray."""
    from firstorder.shadowfield import ShadowSpectrum, blocker_spectrum, two_plane_spectrum

    X = np.linspace(-6.5, 6.5, 901)
    G, L, W = _library()
    H = ShadowSpectrum(two_plane_spectrum(blocker_spectrum(G, D2, W), D1), L, 8.0, 801)
    return _spectrum_error(H, _irradiance(X, lambda V: _bell(V, *BELL_W)), X)


def overlap_tends_to_planes() -> float:
    """With a window 60 wide, (5) is (8): two routes of the library that share no formula."""
    from firstorder.shadowfield import (
        PlanarShadowSpectrum,
        ShadowSpectrum,
        blocker_spectrum,
        two_plane_spectrum,
    )

    sigma = 60.0
    G, L, W = _library(sigma, 0.0, sigma * np.sqrt(2 * np.pi))
    H = ShadowSpectrum(two_plane_spectrum(blocker_spectrum(G, D2, W), D1), L, 4.0, 8001)
    planes = PlanarShadowSpectrum(G, L, D1, D2)
    return max(abs(complex(H(a)) - complex(planes(a))) for a in (0.0, 0.6, -1.1))


@functools.cache
def planes_by_sum() -> float:
    """`PlanarShadowSpectrum` against the transform of the shadow, ray by ray."""
    from firstorder.shadowfield import PlanarShadowSpectrum

    X = np.linspace(-5.0, 5.0, 901)
    G, L, _ = _library()
    return _spectrum_error(PlanarShadowSpectrum(G, L, D1, D2), _irradiance(X, np.ones_like), X)


def planes_by_convolution() -> float:
    """In space: the magnified blocker, convolved with the light mirrored and magnified."""
    X, ratio = np.linspace(-6.0, 6.0, 1201), D1 / D2
    source = _bell(-X / (ratio - 1), *BELL_L) / (ratio - 1)
    convolved = np.convolve(_bell(X / ratio, *BELL_G), source, mode="same") * (X[1] - X[0])
    near = np.abs(X) < 4.0
    return float(np.max(np.abs(convolved - _irradiance(X, np.ones_like))[near]))


LINE = {
    "implements": "firstorder.shadowfield.plane.spectra.blocker_spectrum",
    "symbolic": line,
    "autodiff": na("spectral"),
    "fourier": Check(line_by_transform, 1e-9),
    "brute_force": Check(line_by_sum, 1e-9),
}
RECEIVER = {
    "implements": "firstorder.shadowfield.plane.spectra.two_plane_spectrum",
    "autodiff": na("spectral"),
    "fourier": Check(receiver_by_line, 1e-12),
    "brute_force": Check(receiver_by_sum, 1e-9),
}

ROWS = [
    Row(
        "E11.3",
        "identity",
        **LINE,
        note="The slopes of the wedge in the text are listed upside down: 1/d2_max < 1/d2_min. The "
        "wedge itself is asymptotic: layers multiply, so lines convolve (D05.s3.2b).",
    ),
    Row("E11.4", "identity", symbolic=on_receiver, **RECEIVER),
    Row(
        "E11.5",
        "identity",
        implements="firstorder.shadowfield.plane.spectra.ShadowSpectrum",
        symbolic=overlap,
        autodiff=na("spectral"),
        fourier=Check(overlap_tends_to_planes, 1e-3),
        brute_force=Check(overlap_by_sum, 1e-9),
        note="Fourier: a window of deviation 60 stands for none, an error of order 1 / 60^2.",
    ),
    Row("E11.6", "identity", symbolic=dirac_in_place, **RECEIVER),
    Row(
        "E11.7",
        "identity",
        implements="firstorder.shadowfield.plane.spectra.PlanarShadowSpectrum",
        symbolic=dirac_resolved,
        autodiff=na("spectral"),
        fourier=Check(dirac_mass, 1e-5),
        brute_force=Check(dirac_place, 1e-4),
        note="Under a window of deviation 400 in v: mass and place of the Dirac.",
    ),
    Row(
        "E11.8",
        "identity",
        implements="firstorder.shadowfield.plane.spectra.PlanarShadowSpectrum",
        symbolic=parallel,
        autodiff=na("spectral"),
        fourier=Check(planes_by_sum, 1e-11),
        brute_force=Check(planes_by_convolution, 1e-11),
    ),
    Row("E11.13", "definition", **LINE),
    Row("E11.14", "identity", **LINE),
    Row("E11.15", "definition", symbolic=on_receiver, **RECEIVER),
    Row("E11.16", "identity", symbolic=on_receiver, **RECEIVER),
]
