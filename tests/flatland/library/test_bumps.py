import jax
import numpy as np
import pytest

from firstorder.flatland.library.bumps import Bumps, ChirpBumps, SineBumps, bumpy_ground

X = np.linspace(0.05, 1.9, 23)
PROFILES = [
    SineBumps(0.05, 2.0, 0.4),
    SineBumps(),
    ChirpBumps(0.6, 1.0, 2.0),
    ChirpBumps(0.3, 2.0, 0.0),
]


@pytest.mark.parametrize("bumps", PROFILES)
def test_slope_normal_and_curvature_are_derivatives_of_the_height(bumps: Bumps):
    slope = jax.vmap(jax.grad(bumps.height))(X)
    np.testing.assert_allclose(bumps.heights(X)[1], slope, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        bumps.heights(X)[2], jax.vmap(jax.hessian(bumps.height))(X), rtol=0.0, atol=1e-10
    )
    np.testing.assert_allclose(bumps.normal(X), np.arctan(slope), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        bumps.kappa(X), jax.vmap(jax.grad(bumps.normal))(X), rtol=0.0, atol=1e-10
    )


@pytest.mark.smoke
@pytest.mark.parametrize("bumps", PROFILES)
def test_the_normals_of_a_fine_polyline_tend_to_the_normal(bumps: Bumps):
    """A chord's slope is the curve's at its middle, to second order."""
    errors = []
    for pieces in (64, 128):
        floor = bumpy_ground(bumps, 0.0, 2.0, pieces)
        edge, middle = np.asarray(floor.end - floor.start), np.asarray(floor.start + floor.end) / 2
        errors.append(
            np.max(np.abs(np.arctan2(edge[:, 1], edge[:, 0]) - bumps.normal(middle[:, 0])))
        )
    assert errors[1] < 0.3 * errors[0]


def test_the_local_frequency_of_the_chirp_rises():
    x = np.linspace(0.0, 2.0, 20001)
    crossings = x[:-1][np.diff(np.sign(ChirpBumps().height(x + 1e-9))) != 0]
    assert np.all(np.diff(np.diff(crossings)) < 1e-3)
    assert abs(len(crossings) - 2 * (1.0 * 2 + 2.0 * 2)) <= 1


def test_a_chirp_says_where_it_is_none():
    assert np.isnan(ChirpBumps(0.6, 1.0, 2.0).height(-0.6))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: SineBumps(frequency=0.0), "Argument `frequency` must be positive, but is 0.0."),
        (lambda: ChirpBumps(rate=-1.0), "Argument `rate` must not be negative, but is -1.0."),
        (
            lambda: bumpy_ground(SineBumps(), 1.0, 0.0, 8),
            "Argument `high - low` must be positive, but is -1.0.",
        ),
        (
            lambda: bumpy_ground(SineBumps(), 0.0, 1.0, 0),
            "Argument `pieces` must be positive, but is 0.",
        ),
    ],
)
def test_bad_numbers_are_one_sentence(make, sentence):
    with pytest.raises(ValueError, match="Argument") as caught:
        make()
    assert str(caught.value) == sentence
