"""Occlusion: products, the lines on which planar blockers have their energy, and what leaves them.

D05 §3.2, §3.4 and Table 1.
"""

from __future__ import annotations

import functools

import numpy as np

from derivations.squares import square_error
from derivations.transport.events import _occlusion_proofs as proofs
from firstorder.ledger import Check, Counterexample, Row, na

# ---------------------------------------------------------------- quadrature, split at the edges


def _pieces(ends, nodes=80):
    """Gauss-Legendre on each interval between neighbouring ends."""
    t, w = np.polynomial.legendre.leggauss(nodes)
    half, middle = 0.5 * np.diff(ends)[:, None], 0.5 * (ends[1:] + ends[:-1])[:, None]
    return (middle + half * t).ravel(), (half * w).ravel()


def _dimmed_transform(ends, through, Omega) -> complex:
    """Transform of the light of the cases behind a planar blocker, by quadrature split at its ends.

    `through[k]` is the transparency between ends k and k + 1.
    """
    from firstorder.checks.cases import bell

    X, wx = _pieces(np.asarray(ends))
    V, wv = _pieces(np.array([-4.0, 0.0, 4.0]))
    share = np.repeat(through, 80)
    light = bell(X[:, None], V)
    wave = np.exp(-2j * np.pi * (Omega[0] * X[:, None] + Omega[1] * V))
    return complex((wx * share) @ (light * wave) @ wv)


OMEGAS = ((0.3, -0.2), (-0.45, 0.1), (1.6, 0.2))


def half_plane_by_quadrature() -> float:
    """Spectrum behind a semi-transparent half-plane at the plane itself."""
    from firstorder.checks.cases import light
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Grid
    from firstorder.transport.events.occlusion import half_plane_blocker

    window = Grid.spanning((192, 192), (6.0, 6.0))
    blocker = half_plane_blocker(0.1, FLATLAND_SLOPE, 0.25, window)
    F = blocker(light(FLATLAND_SLOPE).spectrum())
    truth = [_dimmed_transform([-5.0, 0.1, 5.0], [0.25, 1.0], W) for W in OMEGAS]
    return max(abs(complex(F(*W)) - t) for W, t in zip(OMEGAS, truth, strict=True))


def grating_by_quadrature() -> float:
    """Spectrum behind an endless grating of transparency 0.25, period 0.6, 40 % open."""
    from firstorder.checks.cases import light
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Grid
    from firstorder.transport.events.occlusion import grating_blocker

    window = Grid.spanning((96, 96), (6.0, 6.0))
    F = grating_blocker(0.6, FLATLAND_SLOPE, 0.4, 0.25, 0.0, window)(
        light(FLATLAND_SLOPE).spectrum()
    )
    ends = np.sort([0.6 * k + side * 0.12 for k in range(-7, 8) for side in (-1, 1)])
    through = [1.0 if k % 2 == 0 else 0.25 for k in range(ends.size - 1)]
    worst = 0.0
    for W in OMEGAS:
        worst = max(worst, abs(complex(F(*W)) - _dimmed_transform(ends, through, W)))
    return worst


def planar_energy_off_the_line() -> float:
    """Largest sample of a planar comb's FFT off the row Omega_v = 0, relative to the largest."""
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Grid
    from firstorder.transport.events.occlusion import comb_blocker

    V = comb_blocker(0.6, 3, FLATLAND_SLOPE).transparency
    power = np.abs(np.fft.fft2(np.asarray(Grid.spanning((64, 64), (2.0, 2.0)).sample(V))))
    return float(np.max(power[:, 1:]) / np.max(power))


def planar_series_off_the_line() -> float:
    """Largest angular frequency in its closed-form series."""
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Grid
    from firstorder.transport.events.occlusion import comb_blocker

    V = comb_blocker(0.6, 3, FLATLAND_SLOPE).transparency
    return float(np.max(np.abs(V.series(Grid.spanning((64, 64), (2.0, 2.0))).frequencies[:, 1])))


def layers_off_the_line() -> float:
    """Largest distance of the series of one layer at depth 1.3 from the line s (1, -1.3)."""
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Grid
    from firstorder.fields.mask import half_plane
    from firstorder.transport.events.occlusion import Occlusion

    V = Occlusion(half_plane(0.1, frame=FLATLAND_SLOPE), 1.3).law(FLATLAND_SLOPE).factor
    found = V.series(Grid.spanning((64, 64), (2.0, 2.0))).frequencies
    return float(np.max(np.abs(found[:, 1] + 1.3 * found[:, 0])))


def windowed_corner(z1, z2, Omega_x, Omega_v) -> float:
    """|transform| of two half-planes' product under a Gaussian window of deviation 2.

    H(x - z_1 v) H(x - z_2 v): for each v the opening is x > max(z_1 v, z_2 v); split there.
    """
    t, w = np.polynomial.legendre.leggauss(120)
    total = 0.0 + 0.0j
    for low, high in ((-14.0, 0.0), (0.0, 14.0)):
        for panel in np.linspace(low, high, 9)[:-1]:
            V = panel + (high - low) / 16.0 * (t + 1.0)
            start = np.maximum(z1 * V, z2 * V)
            reach = np.maximum(14.0 - start, 0.0)
            for k in range(8):
                X = start[:, None] + reach[:, None] * (k + 0.5 * (t + 1.0)) / 8.0
                window = np.exp(-(X**2 + V[:, None] ** 2) / 8.0)
                wave = np.exp(-2j * np.pi * (Omega_x * X + Omega_v * V[:, None]))
                inner = (window * wave) @ w * reach / 16.0
                total += (w * inner).sum() * (high - low) / 16.0
    return float(abs(total))


@functools.cache
def corner_against_quadrature() -> float:
    """Relative departure of the windowed corner from its sharp limit, outside the wedge.

    `1 / (4 pi^2 |a b| |z_1 - z_2|)` with Omega = a (1, -z_1) + b (1, -z_2); the window changes it
    by the square of its spectral width, (1 / (4 pi a))^2 and the like.
    """
    z1, z2, a, b = 1.0, 2.0, 3.2, -3.1
    W = (a + b, -(a * z1 + b * z2))
    sharp = 1.0 / (4.0 * np.pi**2 * abs(a * b) * abs(z1 - z2))
    return abs(windowed_corner(z1, z2, *W) / sharp - 1.0)


def empty_closed_form() -> float:
    """Largest spectrum behind both halves, for any number of waves: parallel edges are merged."""
    return max(complementary_spectrum(n) for n in (50, 200))


def complementary_spectrum(harmonics: int) -> float:
    """Largest |spectrum| behind x < 0 and then x > 0, relative to behind the first alone."""
    from firstorder.checks.cases import light
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Affine, Grid, HalfPlane
    from firstorder.transport.events.occlusion import Occlusion, PlanarBlockers

    window = Grid.spanning((2 * int(harmonics), 8), (6.0, 6.0))
    edge = Affine([1.0, 0.0], 0.0, FLATLAND_SLOPE)
    left, right = HalfPlane(edge, 0.0, 1.0), HalfPlane(edge, 1.0, 0.0)
    F = light(FLATLAND_SLOPE).spectrum()
    mesh = np.meshgrid([-0.4, 0.0, 0.3], [0.0], indexing="ij")
    both = np.abs(PlanarBlockers((left, right), [0.0, 0.0], window)(F)(*mesh))
    one = np.abs(Occlusion(left, 0.0, window)(F)(*mesh))
    return float(np.max(both) / np.max(one))


def empty_samples() -> float:
    """Largest sample of the light behind both blockers, hence of its FFT."""
    from firstorder.checks.cases import GRID, light
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import Affine, HalfPlane
    from firstorder.transport.events.occlusion import PlanarBlockers

    edge = Affine([1.0, 0.0], 0.0, FLATLAND_SLOPE)
    both = PlanarBlockers((HalfPlane(edge, 0.0, 1.0), HalfPlane(edge, 1.0, 0.0)), [0.0, 0.0])
    return float(np.max(np.abs(GRID.sample(both(light(FLATLAND_SLOPE))))))


def highest_frequency(f1, f2):
    """Highest frequency in the product of two soft gratings (1 + cos) / 2, from samples."""
    t = np.arange(4096) / 256.0
    product = 0.25 * (1.0 + np.cos(2 * np.pi * f1 * t)) * (1.0 + np.cos(2 * np.pi * f2 * t))
    power = np.abs(np.fft.rfft(product)) / t.size
    return float(np.fft.rfftfreq(t.size, 1.0 / 256.0)[power > 1e-9].max())


def sum_is_reached() -> float:
    """Distance of the highest frequency from the sum of the two."""
    pairs = ((2.0, 3.0), (5.0, 5.0), (1.0, 7.0))
    return max(abs(highest_frequency(a, b) - (a + b)) for a, b in pairs)


def sum_by_quadrature() -> float:
    """The product's Fourier coefficients at the sum, 1 / 16, and just above it, zero.

    Of the library's product of two gratings.
    """
    import jax
    from scipy.integrate import quad

    from firstorder.laws import Multiply
    from firstorder.transport.events.texture import wave

    soft = [wave(f, 0.5, mean=0.5) for f in (2.0, 3.0)]
    product = jax.jit(lambda t: Multiply(soft[0])(soft[1])(t, 0.0))

    def coefficient(f):
        turn = 2.0 * np.pi * f
        return quad(lambda t: float(product(t)) * np.cos(turn * t), 0.0, 1.0, limit=200)[0]

    return max(abs(coefficient(5.0) - 1.0 / 16.0), abs(coefficient(6.0)), abs(coefficient(9.0)))


OCCLUSION = "firstorder.transport.events.occlusion.Occlusion"
PRODUCT = {
    "implements": OCCLUSION,
    "symbolic": proofs.convolution_theorem,
    "autodiff": na("spectral"),
    "fourier": Check(lambda: square_error("shadow of a comb", "spectrum"), 1e-9),
}
ROWS = [
    Row(
        "D05.4",
        "definition",
        implements=OCCLUSION,
        symbolic=na("definition"),
        autodiff=Check(lambda: square_error("occlusion", "hessian"), 1e-10),
        fourier=na("definition"),
        brute_force=Check(lambda: square_error("occlusion, comb", "value"), 1e-10),
    ),
    Row(
        "D05.5",
        "identity",
        **PRODUCT,
        brute_force=Check(half_plane_by_quadrature, 1e-9),
        note="Edges are compared after travel and gathering (1e-9); on samples of the edge itself "
        "the grid error is 1e-3.",
    ),
    Row(
        "D05.T1.2",
        "identity",
        **(PRODUCT | {"fourier": Check(lambda: square_error("occlusion", "spectrum"), 1e-9)}),
        brute_force=Check(grating_by_quadrature, 1e-9),
    ),
    Row(
        "D05.s3.2a",
        "identity",
        implements="firstorder.transport.events.occlusion.comb_blocker",
        symbolic=proofs.planar_is_flat,
        autodiff=na("spectral"),
        fourier=Check(planar_energy_off_the_line, 1e-12),
        brute_force=Check(planar_series_off_the_line, 1e-15),
    ),
    Row(
        "D05.s3.2b",
        "over-claim",
        implements="firstorder.transport.events.occlusion.PlanarBlockers",
        symbolic=proofs.corner,
        autodiff=na("spectral"),
        fourier=Check(
            lambda: max(square_error("occlusion at two depths", p) for p in ("spectrum", "value")),
            1e-9,
        ),
        brute_force=Check(lambda: max(layers_off_the_line(), corner_against_quadrature()), 0.01),
        corrected="one layer at depth z has its energy on O_v = -z O_x (incoming light), a sum of "
        "attenuations in the wedge between its lines; a product of layers has s (1, -z_1) + "
        "t (1, -z_2), which fills the plane: two half-planes leave 1 / (4 pi^2 |s t| |z_1 - z_2|)",
        counterexample=Counterexample(
            {"z1": 1.0, "z2": 2.0, "Omega_x": 0.1, "Omega_v": 3.0},
            printed=lambda z1, z2, Omega_x, Omega_v: 0.0,
            true=windowed_corner,
        ),
        note="The wedge holds for the singular part along each edge, not at crossings of edges.",
    ),
    Row(
        "D05.s3.2c",
        "identity",
        implements="firstorder.transport.events.occlusion.half_plane_blocker",
        symbolic=proofs.semi_transparent,
        autodiff=Check(lambda: square_error("shadow of a half-plane", "gradient"), 1e-10),
        fourier=Check(lambda: square_error("shadow of a half-plane", "spectrum"), 1e-9),
        brute_force=Check(half_plane_by_quadrature, 1e-9),
    ),
    Row(
        "D05.s3.4a",
        "identity",
        implements="firstorder.transport.events.occlusion.grating_blocker",
        symbolic=proofs.comb_coefficients,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("occlusion, grating", "spectrum"), 1e-3),
        brute_force=Check(grating_by_quadrature, 1e-9),
        note="Exact for an endless grating (Fourier: stated grid error of sampled edges); N bars "
        "blur each replica by about 1 / (N p).",
    ),
    Row(
        "D05.s3.4c",
        "identity",
        implements="firstorder.transport.events.occlusion.PlanarBlockers",
        symbolic=proofs.complementary,
        autodiff=na("no derivative"),
        fourier=Check(empty_closed_form, 1e-12),
        brute_force=Check(empty_samples, 0.0),
        note="The closed form is empty to rounding: parallel edges are merged before any series.",
    ),
    Row(
        "D05.s3.4d",
        "identity",
        implements="firstorder.laws.multiply.Multiply",
        symbolic=proofs.supports_add,
        autodiff=na("spectral"),
        fourier=Check(sum_is_reached, 1e-9),
        brute_force=Check(sum_by_quadrature, 1e-10),
        note="Of bandwidths that are added at every blocker; the larger of two bounds nothing (5 "
        "and 5 cycles make 10), and (21), with one distance for all, underestimates: D05.s6.2h.",
    ),
]
