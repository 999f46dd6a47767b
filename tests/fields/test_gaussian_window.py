import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp

from firstorder.checks.tolerance import normwise
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    Function,
    Grid,
    HalfPlane,
    SoftEdge,
    covariance_of_samples,
    gaussian,
    windowed_covariance,
)
from firstorder.laws import Multiply

LEVEL = Affine([0.7, -1.1], 0.2)


def window():
    return gaussian((0.21, -0.13), (0.45, 0.4), 0.35, 1.3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SoftEdge(LEVEL, 0.3, 0.2, 0.9),
        lambda: gaussian((0.3, 0.1), (0.6, 0.9), -0.2),
        lambda: Function(lambda x, t: 1.0 + 0.5 * jnp.sin(3.0 * x - t)),
    ],
    ids=["soft edge", "gaussian", "texture"],
)
def test_against_the_power_of_the_samples_of_the_product(make):
    grid = Grid.spanning((180, 181), (4.5, 4.0))
    samples = jax.jit(lambda: grid.sample(Multiply(make())(window())))()
    truth = covariance_of_samples(samples, grid, window().frame).matrix
    assert normwise(windowed_covariance(make(), window()).matrix, truth) < 1e-10


def test_sums_are_exact_for_gaussians_only():
    bell = gaussian((0.3, 0.1), (0.6, 0.9), -0.2)
    total = window().covariance().matrix + bell.covariance().matrix
    np.testing.assert_allclose(windowed_covariance(bell, window()).matrix, total, rtol=1e-12)
    edge = SoftEdge(LEVEL, 0.3)
    extra = windowed_covariance(edge, window()).matrix - window().covariance().matrix
    assert jnp.linalg.matrix_rank(extra, rtol=1e-9) == 1  # along the level's normal alone
    np.testing.assert_allclose(extra[0, 1] / extra[0, 0], -1.1 / 0.7, rtol=1e-9)


def test_a_hardening_edge_diverges_as_one_over_its_width():
    # int f'^2 of a rise of width w is 1 / (2 sqrt(pi) w), beside terms that stay finite.
    first = [
        float(windowed_covariance(SoftEdge(LEVEL, w), window(), 200).matrix[0, 0])
        for w in (0.04, 0.02, 0.01)
    ]
    assert (first[2] - first[1]) / (first[1] - first[0]) == pytest.approx(2.0, abs=0.05)


def test_an_edge_is_refused():
    with pytest.raises(Refused, match="infinite covariance"):
        windowed_covariance(HalfPlane(LEVEL, 0.0, 1.0), window())
    with pytest.raises(Refused, match="infinite covariance"):
        HalfPlane(LEVEL, 0.0, 1.0).covariance()
    with pytest.raises(Refused, match="under a stated window"):
        SoftEdge(LEVEL, 0.3).covariance()


def test_the_integration_by_parts():
    """`(f g)'^2 = g^2 (p + f'^2 - f f'') / 2` up to a derivative, for g'' = (p^2 t^2 - p) g."""
    t, p = sp.symbols("t p", positive=True)
    f, g = sp.Function("f")(t), sp.exp(-p * t**2 / 2)
    left = (f * g).diff(t) ** 2
    right = g**2 * (p * f**2 + f.diff(t) ** 2 - f * f.diff(t, 2)) / 2
    boundary = (f * f.diff(t) * g**2 - p * t * f**2 * g**2) / 2  # dies out with the window
    assert sp.simplify(left - right - boundary.diff(t)) == 0
