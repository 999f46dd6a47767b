import numpy as np
import pytest

from firstorder.errors import Refused
from firstorder.fields import Affine, Grid, HalfPlane, SoftEdge, autodiff_jet, half_plane
from firstorder.transport import half_plane_blocker


@pytest.mark.parametrize("axis", ["x", "theta"])
def test_sides_and_the_mean_between(axis):
    mask = half_plane(0.5, 0.2, 0.9, axis)
    x = np.array([0.4, 0.5, 0.6])
    values = mask(x, 0.0) if axis == "x" else mask(0.0, x)
    np.testing.assert_allclose(values, [0.2, 0.55, 0.9])


def test_an_edge_refuses_spectrum_and_covariance_with_the_reason():
    mask = half_plane(0.5)
    with pytest.raises(Refused, match="on a window"):
        mask.spectrum()
    with pytest.raises(Refused, match="falls off as 1 / Omega\\^2"):
        mask.covariance()


def test_a_series_has_as_many_harmonics_as_the_window():
    series = half_plane(0.5).series(Grid((8, 13), (0.5, 0.5)))
    assert series.coefficients.shape == (13,)
    assert np.count_nonzero(series.frequencies[:, 1]) == 0


def test_a_soft_edge_is_the_blurred_hard_one():
    level = Affine([0.8, -0.5], -0.1)
    soft, u = SoftEdge(level, 0.3, 0.2, 0.9), (0.4, 0.1)
    s = 0.8 * 0.4 - 0.5 * 0.1 - 0.1
    shifts = np.linspace(-3.0, 3.0, 60001)
    hard = np.where(s - shifts > 0, 0.9, 0.2)
    blur = np.exp(-0.5 * (shifts / 0.3) ** 2) / (0.3 * np.sqrt(2 * np.pi))
    assert float(soft(*u)) == pytest.approx(np.sum(hard * blur) * 1e-4, abs=1e-4)


def test_the_jet_of_a_soft_edge_between_two_transparencies():
    soft, u = SoftEdge(Affine([0.8, -0.5], -0.1), 0.3, 0.2, 0.9), np.array([0.4, 0.1])
    jet, oracle = soft.jet(u), autodiff_jet(soft.at, u, soft.frame)
    np.testing.assert_allclose(jet.gradient, oracle.gradient, rtol=1e-12)
    np.testing.assert_allclose(jet.hessian, oracle.hessian, rtol=1e-11)


def test_a_soft_edge_has_the_coefficients_that_sums_give():
    """c_k = integral over a period of the edge exp(-2 pi i k s / period) ds / period."""
    soft = SoftEdge(Affine([1.0, 0.0], 0.0), 0.05, 0.2, 0.9)
    series = soft.series(Grid((16, 16), (0.5, 0.5)))
    frequencies = np.asarray(series.frequencies[:, 0])
    period = 1.0 / (frequencies[1] - frequencies[0])
    s = ((np.arange(20_000) + 0.5) / 20_000 - 0.5) * period  # the window's middle is the edge
    waves = np.exp(-2j * np.pi * frequencies[:, None] * s)
    wanted = np.mean(np.asarray(soft(s, 0.0)) * waves, 1)
    np.testing.assert_allclose(series.coefficients, wanted, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SoftEdge(Affine([1.0, 0.0], 0.0), 0.0), "`width` must be positive, but is 0.0"),
        (lambda: SoftEdge(Affine([1.0, 0.0], 0.0), np.nan), "`width` must be positive, but is nan"),
        (lambda: half_plane(0.0, axis="y"), "`axis` must be one of x, theta, but is 'y'"),
        (lambda: half_plane(np.nan), "`edge` must be finite, but is nan"),
        (lambda: HalfPlane(Affine([0.0, 0.0], 1.0), 0.0, 1.0), "`level` must have a normal"),
        (lambda: half_plane_blocker(0.0, half_plane(0.0).frame, 1.5), r"must lie in \[0, 1\]"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()
