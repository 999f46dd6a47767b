import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.tolerance import normwise, rounding
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.fields import gaussian
from firstorder.laws import Integrate, Move
from firstorder.transport import Curvature, Mirror, Travel
from firstorder.transport.events.slopes import ToSlope

L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4)
RAYS = jnp.array([[0.3, 0.1], [-0.5, 0.2], [0.0, -0.7]])


def matrix(event, frame=L.frame):
    law = event.law(frame)
    assert isinstance(law, Move)
    return law.M


KAPPA = st.floats(-3.0, 3.0)


def test_there_and_back_is_the_identity():
    same = (Curvature(0.8) >> Curvature(0.8, back=True))(L)
    a, b = jax.vmap(same.jet)(RAYS), jax.vmap(L.jet)(RAYS)
    assert normwise(a.hessian, b.hessian) < 1e-14


@given(KAPPA, KAPPA)
def test_curvatures_add(a, b):
    both = matrix(Curvature(a)) @ matrix(Curvature(b))
    np.testing.assert_allclose(both, matrix(Curvature(a + b)), rtol=0.0, atol=rounding(4))


def test_in_space_a_step_turns_each_angle_by_its_row_of_the_shape():
    """One number stands for a ball, which turns each by the step along it alone."""
    shape = np.array([[0.35, 0.06], [0.11, -0.2]])
    for kappa, rows in ((shape, shape), (0.4, 0.4 * np.eye(2))):
        for back, sign in ((False, 1.0), (True, -1.0)):
            turn = np.eye(4)
            turn[2:, :2] = sign * rows
            np.testing.assert_array_equal(matrix(Curvature(kappa, back=back), SPACE), turn)


def test_mirror_between_two_rotations_doubles_the_curvature():
    kappa = 0.45
    chain = Curvature(kappa) >> Mirror() >> Curvature(kappa, back=True)
    one = Move([[1.0, 0.0], [2 * kappa, -1.0]], to=Frame(sense="outgoing"))
    Omega = (jnp.array([0.1, -0.3, 0.4]), jnp.array([0.2, 0.5, -0.1]))
    for portrait in ("value", "gradient", "hessian"):
        a, b = (getattr(jax.vmap(s(L).jet)(RAYS), portrait) for s in (chain, one))
        assert normwise(a, b) < 1e-14
    assert normwise(chain(L.spectrum())(*Omega), one(L.spectrum())(*Omega)) < 1e-14
    assert normwise(chain(L.covariance()).matrix, one(L.covariance()).matrix) < 1e-14


def test_a_valley_has_positive_curvature_and_focuses():
    """The normals of y = x^2 / 2 turn counter-clockwise, and a beam from above meets at 1 / 2."""
    beam = gaussian((0.0, 0.0), (0.3, 0.02))
    flat = ToSlope().linearised(jnp.zeros(2))
    at_mirror = (Curvature(1.0) >> Mirror() >> Curvature(1.0, back=True) >> flat)(beam.covariance())
    irradiance = Integrate("v", -9.0, 9.0)
    bandwidth = [float(irradiance(Travel(d)(at_mirror)).matrix[0, 0]) for d in (0.25, 0.5, 0.75)]
    assert bandwidth[1] > 10 * max(bandwidth[0], bandwidth[2])


def test_curvature_in_space_is_minus_the_shape_operator():
    """On top of a sphere of radius R the normal leans outwards: kappa = -S = 1 / R."""
    R, h = 2.0, 1e-6
    shape = -1.0 / R
    normal_at = np.array([h, 0.0, np.sqrt(R * R - h * h)]) / R
    lean = np.arctan2(normal_at[0], normal_at[2])  # angles in space lean towards the axes
    assert lean / h == pytest.approx(-shape, rel=1e-9)
    assert matrix(Curvature(-shape), SPACE)[2, 0] == pytest.approx(lean / h, rel=1e-9)


@pytest.mark.parametrize("back", [False, True])
def test_time_stands_still_on_a_curved_surface(back):
    shear = matrix(Curvature(0.5, back), Frame(("x", "theta", "t")))
    plane = matrix(Curvature(0.5, back), FLATLAND)
    np.testing.assert_array_equal(shear[:2, :2], plane)
    np.testing.assert_array_equal(shear[2], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(shear[:2, 2], [0.0, 0.0])


def test_slopes_and_bad_numbers_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match="needs angles"):
        Curvature(0.5)(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE))
    with pytest.raises(ValueError, match="`kappa` must be finite"):
        Curvature(float("nan"))


@pytest.mark.smoke
def test_curvature_is_differentiable_under_jit():
    slope = jax.jit(jax.grad(lambda k: Curvature(k)(L)(0.3, 0.1)))(0.5)
    there = L.jet(jnp.array([0.3, 0.1 + 0.15])).gradient[1]
    assert float(slope) == pytest.approx(float(0.3 * there), rel=1e-12)


def test_a_curvature_that_does_not_fit_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `kappa` must have shape \(1, 1\), but"):
        Curvature(np.array([0.1, 0.2]))(gaussian((0.0, 0.0), (1.0, 1.0)))
