import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.conventions import Frame
from firstorder.fields import GaussianProfile, Grid, Separable
from firstorder.shadowfield import (
    PLANE,
    PlanarShadowSpectrum,
    ShadowSpectrum,
    Wedge,
    blocker_spectrum,
    energy_outside,
    power_spectrum,
    two_plane_spectrum,
    zero_outside,
)
from firstorder.shadowfield.plane import spectra

D1, D2 = 1.3, 0.5
# Off-centre bells: transparency, light, and the window over v. Written out again below.
G = Separable([0.13], (GaussianProfile(0.11, "y", PLANE),)).spectrum()
L = Separable([-0.07], (GaussianProfile(0.19, "y", PLANE),)).spectrum()
W = Separable([0.05], (GaussianProfile(0.6, "v", Frame(("v",))),)).spectrum()


def bell(t, middle, sigma):
    return np.exp(-0.5 * ((t - middle) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))


def g(u):
    return bell(u, 0.13, 0.11)


def light(y):
    return bell(y, -0.07, 0.19)


def window(v):
    return bell(v, 0.05, 0.6)


def transform(values, first, second, Omega):
    """Riemann sum of a function that dies out: exponentially accurate."""
    cell = (first[1] - first[0]) * (second[1] - second[0])
    wave = np.exp(-2j * np.pi * (Omega[0] * first[:, None] + Omega[1] * second))
    return np.sum(values * wave) * cell


OMEGAS = [(1.2, 0.7), (-0.8, -0.3), (2.0, 1.1), (0.4, -0.2)]


@pytest.mark.smoke
def test_a_layer_under_a_window_is_its_line_smeared():
    y, v = np.linspace(-3.6, 3.6, 601), np.linspace(-5.5, 5.5, 601)
    values = g(y[:, None] + D2 * v) * window(v)
    F = blocker_spectrum(G, D2, W)
    for Omega in OMEGAS:
        assert abs(F(*Omega) - transform(values, y, v, Omega)) < 1e-9


def test_the_receiver_sees_the_sheared_spectrum():
    x, y = np.linspace(-6.5, 6.5, 901), np.linspace(-3.6, 3.6, 501)
    v = (x[:, None] - y) / D1
    values = g(y + D2 * v) * window(v)
    F = two_plane_spectrum(blocker_spectrum(G, D2, W), D1)
    for Omega in OMEGAS:
        assert abs(F(*Omega) - transform(values, x, y, Omega)) < 1e-9


def test_the_shadow_is_the_overlap_of_light_and_blockers():
    x, y = np.linspace(-6.5, 6.5, 1301), np.linspace(-1.7, 1.5, 801)
    v = (x[:, None] - y) / D1
    h = np.sum(g(y + D2 * v) * window(v) * light(y), axis=1) * (y[1] - y[0])
    F = two_plane_spectrum(blocker_spectrum(G, D2, W), D1)
    H = ShadowSpectrum(F, L, 8.0, 1024)
    for Omega in (0.0, 0.6, -1.1, 2.3):
        truth = np.sum(h * np.exp(-2j * np.pi * Omega * x)) * (x[1] - x[0])
        assert abs(H(Omega) - truth) < 1e-9


def planes(x):
    """The shadow of one plane, ray by ray."""
    y = np.linspace(-1.7, 1.5, 1601)
    rays = g(y + (x[:, None] - y) * D2 / D1) * light(y)
    return np.sum(rays, axis=1) * (y[1] - y[0])


@pytest.mark.smoke
def test_parallel_planes_multiply_spectra():
    x = np.linspace(-5.0, 5.0, 2001)
    h, H = planes(x), PlanarShadowSpectrum(G, L, D1, D2)
    for Omega in (0.0, 0.6, -1.1, 1.7):
        truth = np.sum(h * np.exp(-2j * np.pi * Omega * x)) * (x[1] - x[0])
        assert abs(H(Omega) - truth) < 1e-11


def test_parallel_planes_convolve_blocker_and_light():
    """In space: the magnified blocker, with the light mirrored and scaled by d1/d2 - 1."""
    x = np.linspace(-6.0, 6.0, 2401)
    step, ratio = x[1] - x[0], D1 / D2
    blocker, source = g(x / ratio), light(-x / (ratio - 1.0)) / (ratio - 1.0)
    convolved = np.convolve(blocker, source, mode="same") * step
    near = np.abs(x) < 4.0
    np.testing.assert_allclose(convolved[near], planes(x[near]), rtol=0.0, atol=1e-12)


def test_a_wide_window_tends_to_the_parallel_planes():
    """The Dirac is the limit: the windowed shadow differs by the window's own width, to order 2."""
    H, errors, sizes = PlanarShadowSpectrum(G, L, D1, D2), [], np.array([2.0, 4.0, 8.0])
    for s in sizes:
        height = s * np.sqrt(2 * np.pi)  # a window of height one
        Wide = Separable([0.0], (GaussianProfile(s, "v", Frame(("v",))),)).spectrum()
        F = two_plane_spectrum(blocker_spectrum(G, D2, Wide), D1)
        wide = ShadowSpectrum(F, L, 6.0, 2048)
        errors.append(max(abs(height * wide(w) - H(w)).item() for w in (0.0, 0.5, 1.0)))
    slopes = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    assert np.all(np.abs(slopes + 2.0) < 0.2)


# --- the wedge -----------------------------------------------------------------------------------


def test_the_wedge_lies_between_the_lines_of_its_ends():
    wedge = Wedge(0.3, 0.6)
    np.testing.assert_allclose(wedge.slopes(D1), [D1 / 0.6 - 1.0, D1 / 0.3 - 1.0])
    for d2, inside in ((0.29, False), (0.31, True), (0.59, True), (0.61, False)):
        for sign in (1.0, -1.0):
            # A wave exp(2 pi i s u) on the plane, u = y (1 - d2/d1) + x d2/d1.
            on = sign * np.array([d2 / D1, 1.0 - d2 / D1])
            assert wedge.contains(*on, D1) == inside
            assert wedge.contains(sign, sign * d2) == inside


def test_the_wedge_of_a_receiver_among_the_blockers_still_has_an_answer():
    low, high = Wedge(0.4, 0.8).slopes(0.6)
    assert low < 0.0 < high
    assert Wedge(0.4, 0.8).contains(1.0, 0.0, 0.6)


def _wave(d2, Omega_u, x, y):
    u = y * (1.0 - d2 / D1) + x[:, None] * d2 / D1
    return 1.0 - 0.5 * (1.0 + np.cos(2 * np.pi * Omega_u * u))


GRID = Grid.spanning((128, 128), (2.0, 2.0))
AXES = [jnp.asarray(GRID.frequencies(i)) for i in range(2)]
MESH = jnp.meshgrid(*AXES, indexing="ij")


def leak(samples, margin=0.5):
    inside = Wedge(0.3, 0.6).contains(*MESH, D1, margin)
    return float(energy_outside(power_spectrum(samples, GRID), inside))


def test_sums_of_layers_stay_in_the_wedge_and_products_leave_it():
    """Two gratings whose waves on the light are alike: their difference has Omega_y = 0."""
    x, y = GRID.axis(0), GRID.axis(1)
    first = _wave(0.3, 4.0 / (1.0 - 0.3 / D1), x, y)
    second = _wave(0.6, 4.0 / (1.0 - 0.6 / D1), x, y)
    assert leak(first + second) < 1e-3
    assert leak(first * second) > 0.02


def test_energies_are_those_of_the_samples():
    rng = np.random.default_rng(4)
    f = rng.normal(size=GRID.size)
    assert abs(jnp.sum(power_spectrum(f, GRID, False, True)) - np.sum(f**2) * GRID.cell) < 1e-9
    assert abs(energy_outside(power_spectrum(f, GRID), jnp.zeros(GRID.size, bool)) - 1.0) < 1e-12
    with_mean, without = (power_spectrum(f + 3.0, GRID, True, m)[64, 64] for m in (True, False))
    assert without < 1e-12 * with_mean


def test_the_energies_of_a_product_are_products_of_energies():
    """Under windows too, on grids that are not square."""
    rng = np.random.default_rng(6)
    grids = [Grid((n,), (step,)) for n, step in ((8, 0.5), (5, 0.3), (6, 0.2))]
    factors = [rng.normal(size=grid.size) for grid in grids]
    grid = Grid(*(tuple(getattr(g, a)[0] for g in grids) for a in ("size", "step")))
    found = power_spectrum(np.einsum("i,j,k->ijk", *factors), grid, mean=True)
    each = [power_spectrum(f, g, mean=True) for f, g in zip(factors, grids, strict=True)]
    np.testing.assert_allclose(found, np.einsum("i,j,k->ijk", *each), rtol=1e-12)


def test_what_is_cut_and_what_is_left_share_the_energy():
    f = np.random.default_rng(5).normal(size=GRID.size)
    inside = Wedge(0.3, 0.6).contains(*MESH, D1)
    inside = (
        inside & (MESH[0] > AXES[0][0]) & (MESH[1] > AXES[1][0])
    )  # -Nyquist has no mirror image
    kept = zero_outside(f, inside)
    lost = energy_outside(power_spectrum(f, GRID, False, True), inside)
    assert abs(np.sum((f - kept) ** 2) / np.sum(f**2) - lost) < 1e-12
    np.testing.assert_allclose(zero_outside(kept, inside), kept, rtol=0.0, atol=1e-12)


# --- faults --------------------------------------------------------------------------------------

FAULTS = {
    "sheared the other way": lambda move: lambda M, **k: move(M.at[0, 1].multiply(-1.0), **k),
    "transposed": lambda move: lambda M, **k: move(M.T, **k),
    "unit distance": lambda move: lambda M, **k: move(M.at[0, 1].set(1.0), **k),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_line_shows(fault, monkeypatch):
    monkeypatch.setattr(spectra, "Move", FAULTS[fault](spectra.Move))
    y, v = np.linspace(-3.6, 3.6, 301), np.linspace(-5.5, 5.5, 301)
    values = g(y[:, None] + D2 * v) * window(v)
    F = np.array([complex(blocker_spectrum(G, D2, W)(*Omega)) for Omega in OMEGAS])
    assert np.all(np.isfinite(F))
    assert normwise(F, np.array([transform(values, y, v, o) for o in OMEGAS])) > 1e-2


PLANE_FAULTS = {
    "no factor": lambda r, w: G.at(r * w) * L.at((1 - r) * w),
    "light not mirrored": lambda r, w: r * G.at(r * w) * L.at((r - 1) * w),
    "distances exchanged": lambda r, w: G.at(w / r) * L.at((1 - 1 / r) * w) / r,
}


@pytest.mark.parametrize("fault", PLANE_FAULTS)
def test_a_fault_in_the_parallel_planes_shows(fault):
    x = np.linspace(-5.0, 5.0, 2001)
    truth = np.sum(planes(x) * np.exp(-2j * np.pi * 0.6 * x)) * (x[1] - x[0])
    wrong = PLANE_FAULTS[fault](D1 / D2, jnp.array([0.6]))
    assert np.isfinite(wrong)
    assert abs(wrong - truth) > 1e-2


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(
        ValueError, match=r"^Argument `d2_max` must not be less than `d2_min` = 0.6"
    ):
        Wedge(0.6, 0.3)
    with pytest.raises(ValueError, match=r"^Argument `d2_min` must be positive, but is 0.0.$"):
        Wedge(0.0, 0.3)
    with pytest.raises(ValueError, match=r"^Argument `d2` must be positive, but is -1.0.$"):
        blocker_spectrum(G, -1.0, W)
    with pytest.raises(ValueError, match="must have shape"):
        power_spectrum(np.zeros((3, 3)), GRID)
    assert np.isnan(jax.jit(lambda d: blocker_spectrum(G, d, W)(0.1, 0.2))(-1.0).real)


def test_the_wedge_of_one_depth_is_a_line():
    """With a margin a strip: not the whole plane, whose sides cannot be told apart."""
    line = Wedge(0.5, 0.5)
    assert bool(line.contains(2.0, 1.0))
    assert not bool(line.contains(2.0, 1.5))
    assert not bool(line.contains(2.0, -1.0, margin=0.5))
    assert bool(line.contains(-2.0, -1.2, margin=0.2))


@pytest.mark.parametrize("kind", [bool, int, np.uint8])
def test_the_energy_of_truth_values_is_that_of_zeros_and_ones(kind):
    seen = np.arange(8) % 5 < 2
    grid = Grid((8,), (0.5,))
    found = power_spectrum(seen.astype(kind), grid)
    np.testing.assert_allclose(found, power_spectrum(seen.astype(float), grid), rtol=1e-12)


@pytest.mark.parametrize("depths", [(-0.3, 0.6), (0.6, 0.3)])
def test_traced_depths_that_are_none_make_no_wedge(depths):
    slopes = jax.jit(lambda low, high: jnp.stack(Wedge(low, high).slopes(1.0)))
    assert np.isnan(slopes(*depths)).all()
    assert not jax.jit(lambda low, high: Wedge(low, high).contains(0.0, 0.0))(*depths)


def test_a_wedge_is_between_two_depths():
    with pytest.raises(ValueError, match="`d2_min` must be one number"):
        Wedge([0.2, 0.3], 0.5)
