"""BRDFs of fine relief, against the mean of rays that meet it one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import jv

from derivations.bandwidth import _relief_rays as rays
from derivations.bandwidth import _relief_space_rays as space
from firstorder.bandwidth import relief_transfer, shape_transfer, shape_transfer_in_space
from firstorder.bandwidth.relief_brdf import _sinh_over

U = np.arange(512) / 512.0  # of a period


def mean_light(B, slope, view):
    """Share of a flat mirror's distant light that a whole wave of the frequency 1 sends on."""
    _, theta = rays.traced(U, slope / (2.0 * np.pi), 1.0, view)
    return np.mean(np.exp(2j * np.pi * B * (theta + view)))


def configurations(count, seed):
    """Frequencies, slopes and views; steeper, the mean of rays converges more slowly."""
    rng = np.random.default_rng(seed)
    table = 10 ** rng.uniform(-1.0, 1.0, count), 10 ** rng.uniform(-3.0, -0.3, count)
    rows = zip(*table, rng.uniform(-1.0, 1.0, count), strict=True)
    return [(B, m, v) for B, m, v in rows if m * abs(np.tan(v)) < 0.5]


@pytest.mark.smoke
def test_the_transfer_is_the_mean_of_exact_rays():
    for B, slope, view in configurations(20, 4):
        ours = complex(relief_transfer(B, slope, view))
        assert abs(ours - mean_light(B, slope, view)) < 1e-9
        given = complex(shape_transfer(B, slope * np.cos(2.0 * np.pi * U), view))
        assert abs(given - ours) < 1e-9


def test_the_transfer_in_space_is_the_mean_of_exact_rays():
    rng = np.random.default_rng(7)
    for _ in range(8):
        k = rng.integers(-2, 3, (3, 2)).astype(float)
        relief = space.Cosines(k, 0.02 * rng.uniform(-1.0, 1.0, 3), rng.uniform(0.0, 6.0, 3))
        e = space.to_eye(rng.uniform(-0.8, 0.8), rng.uniform(0.0, 6.0))
        Omega, at = rng.normal(size=(4, 3)), space.cell(np.eye(2), 128)
        _, w = space.traced(at, relief, e)
        flat = space.flat(at[0, 0], relief, e)[1]
        mean = np.mean(np.exp(2j * np.pi * (w - flat) @ Omega.T), (0, 1))
        ours = shape_transfer_in_space(Omega, relief.slope(at), e)
        np.testing.assert_allclose(ours, mean, rtol=0.0, atol=1e-9)


def test_grooves_in_space_are_waves_in_flatland():
    """In the plane of incidence, for light that turns with the angle there: a chord for an arc."""
    view, slope, B = 0.6, 1e-3, 20.0
    rise = slope * np.cos(2.0 * np.pi * U)
    e = np.array([-np.sin(view), 0.0, np.cos(view)])
    w = np.array([np.sin(view), 0.0, np.cos(view)])
    Omega = B * np.array([-w[2], 0.0, w[0]])  # of directions (-sin, cos), by their angle
    ours = shape_transfer_in_space(Omega, np.stack([rise, 0.0 * rise], -1), e)
    np.testing.assert_allclose(ours, shape_transfer(B, rise, view), rtol=0.0, atol=1e-3)


def test_the_transfer_of_shallow_waves_is_bessels():
    Omega, m, view = np.array([0.3, 40.0, 400.0]), 1e-3, 0.8
    z = 4.0 * np.pi * Omega * m
    expected = jv(0, z) + 1j * m * np.tan(view) * jv(1, z)
    np.testing.assert_allclose(
        relief_transfer(Omega, m, view), expected, rtol=0.0, atol=z[-1] * m**2
    )


@pytest.mark.parametrize("slope", [3.0, 10.0, 1e3])
def test_the_transfer_of_steep_waves_is_that_of_close_places(slope):
    """Between places that lie as a power of the distance to where the normal turns."""
    Omega, view = 150.0 / (4.0 * np.pi * np.arctan(slope)), 0.5 / slope
    near = np.geomspace(1e-9, 0.5 * np.pi, 200)
    ends = np.concatenate([0.5 * np.pi - near[::-1], 0.5 * np.pi + near])
    x, w = np.polynomial.legendre.leggauss(16)
    half = 0.5 * np.diff(ends)[:, None]
    rise = slope * np.cos(ends[:-1, None] + half * (1.0 + x))
    seen = 1.0 + rise * np.tan(view)
    mean = np.sum(half * w * seen * np.exp(4j * np.pi * Omega * np.arctan(rise))) / np.pi
    assert abs(relief_transfer(Omega, slope, view) - mean) < 1e-7


@pytest.mark.smoke
def test_what_is_out_of_range_is_one_sentence_or_nan():
    assert abs(relief_transfer(34.3, 0.5)) < 1.0  # 4 pi Omega arctan(m) = 199.8
    with pytest.raises(ValueError, match=r"4 pi Omega arctan\(slope\)"):
        relief_transfer(34.4, 0.5)
    with pytest.raises(ValueError, match=r"slope \* \|tan\(view\)\|"):
        relief_transfer(1.0, 0.9, 1.0)
    assert jnp.isnan(jax.jit(relief_transfer)(1.0, 0.9, 1.0))
    for below in (-1.7, 1.7, 0.5 * np.pi):  # the base's horizon
        with pytest.raises(ValueError, match=r"Argument `view` must lie in \(-1.5708, 1.5708\)"):
            relief_transfer(1.0, 0.01, below)
        with pytest.raises(ValueError, match="Argument `view` must"):
            shape_transfer(1.0, np.zeros(3), below)
    for below in (-1.7, 1.7):
        assert jnp.isnan(jax.jit(relief_transfer)(1.0, 0.01, below))
        assert jnp.isnan(jax.jit(shape_transfer)(1.0, 0.01 * U[:3], below))


def test_what_shows_its_back_to_the_eye_is_refused_or_nan():
    roof = np.array([0.9, -0.9])
    with pytest.raises(ValueError, match=r"`1 - slopes . V` must be positive"):
        shape_transfer(1.0, roof, 1.0)
    assert jnp.isnan(jax.jit(shape_transfer)(1.0, roof, 1.0))
    slopes, e = np.stack([roof, 0.0 * roof], -1), np.array([np.sin(1.0), 0.0, np.cos(1.0)])
    with pytest.raises(ValueError, match=r"`1 - slopes . V` must be positive"):
        shape_transfer_in_space(np.ones(3), slopes, e)
    seen = jax.jit(shape_transfer_in_space)
    assert jnp.isnan(seen(np.ones(3), slopes, e))
    assert jnp.isfinite(seen(np.ones(3), 0.5 * slopes, e))
    for wrong in (2.0 * e, -e):
        assert jnp.isnan(seen(np.ones(3), 0.1 * slopes, wrong))


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ("`to_eye` must be a unit vector", (np.ones(3), np.zeros((2, 2)), np.ones(3))),
        ("`slopes` must end with two axes", (np.ones(3), np.zeros((2, 3)), np.eye(3)[2])),
        ("`Omega` must have three coordinates", (np.ones(2), np.zeros((2, 2)), np.eye(3)[2])),
        (r"`to_eye\[2\]` must be positive", (np.ones(3), np.zeros((2, 2)), np.eye(3)[0])),
    ],
)
def test_what_is_no_eye_or_no_slope_is_one_sentence(words, given):
    with pytest.raises(ValueError, match=words):
        shape_transfer_in_space(*given)


@pytest.mark.parametrize("x", [1e-3, 0.0999, 0.1001, 2.0])
def test_the_series_of_sinh_goes_on_as_sinh(x):
    np.testing.assert_allclose(_sinh_over(jnp.asarray(x)), np.sinh(x) / x, rtol=1e-14)
