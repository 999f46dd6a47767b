import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import light
from firstorder.checks.cases.moves.incidence import trace
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Constant, Gaussian, autodiff_jet, gaussian
from firstorder.transport.events.incidence import Incidence, Outgoing
from firstorder.transport.events.travel import Arrival

LEAVING = Frame(("x", "theta"), "outgoing")
angles = st.floats(-1.3, 1.3)


@pytest.mark.smoke
@given(angles, st.floats(-1.0, 1.0), st.floats(-1.2, 1.2))
def test_the_exact_frames_trace_every_ray(angle, x, theta):
    if abs(theta - angle) > 1.4:
        return
    s, local = trace(x, theta, angle)
    onto = Incidence(angle, exact=True).law(FLATLAND)
    np.testing.assert_allclose(onto.map(jnp.array([x, theta])), [s, local], rtol=0.0, atol=1e-12)
    # What leaves the plane across the ray meets the surface where it came from.
    away = Outgoing(angle, exact=True).law(LEAVING)
    np.testing.assert_allclose(away.map(jnp.array([s, local])), [x, theta], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("angle", [0.0, 0.5, -1.1])
def test_the_move_touches_the_warp_at_the_central_ray(angle):
    for event, frame, at in (
        (Incidence, FLATLAND, [0.0, angle]),
        (Outgoing, LEAVING, [0.0, 0.0]),
    ):
        move = event(angle).law(frame)
        touching = event(angle, exact=True).linearised(jnp.array(at)).law(frame)
        np.testing.assert_allclose(move.M, touching.M, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(move.c, touching.c, rtol=0.0, atol=1e-14)


def test_it_leaves_the_warp_in_second_order():
    exact, radii = Incidence(0.8, exact=True), np.array([0.02, 0.04, 0.08])
    at = jnp.array([0.0, 0.8])
    errors = [float(exact.linearised(at, r).error(FLATLAND)) for r in radii]
    assert abs(fitted_order(radii, errors) - 2.0) < 0.1


@pytest.mark.parametrize(("event", "frame"), [(Incidence, FLATLAND), (Outgoing, LEAVING)])
def test_the_exact_jet_away_from_the_central_ray(event, frame):
    seen, u = event(0.7, exact=True)(light(frame)), jnp.array([0.6, 0.3])
    oracle = autodiff_jet(seen.at, u, frame)
    np.testing.assert_allclose(seen.jet(u).gradient, oracle.gradient, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(seen.jet(u).hessian, oracle.hessian, rtol=0.0, atol=1e-12)


def test_outgoing_undoes_incidence():
    u, L = jnp.array([0.3, -0.2]), light(FLATLAND)
    M, c = (getattr(Incidence(0.7).law(FLATLAND), k) for k in ("M", "c"))
    back = Outgoing(0.7).law(LEAVING)
    np.testing.assert_allclose(M @ (back.M @ u + back.c) + c, u, rtol=0.0, atol=1e-15)
    assert Incidence(0.0)(L)(*u) == L(*u)


def test_power_on_the_surface_is_power_across_the_ray():
    """The footprint grows by 1 / cos, so what one integrates over it does: F(0) / cos."""
    L = light(FLATLAND)
    ratio = Incidence(1.0)(L).spectrum()(0.0, 0.0) / L.spectrum()(0.0, 0.0)
    assert abs(ratio - 1.0 / np.cos(1.0)) < 1e-14


def test_energy_moves_out_as_section_6_uses_it():
    """An outgoing band limit W_x becomes W_x / cos(theta1); (10) as printed has W_x cos(theta1)."""
    M = Outgoing(1.0).law(LEAVING).M
    np.testing.assert_allclose(M.T @ jnp.array([1.0, 0.0]), [1.0 / np.cos(1.0), 0.0])


def test_light_that_left_a_surface_arrives_first():
    L = light(LEAVING)
    with pytest.raises(ValueError, match="needs incoming light"):
        Incidence(0.3)(L)
    seen = (Arrival() >> Incidence(0.3))(L)
    assert abs(seen(0.4, 0.5) - L(-0.4 * np.cos(0.3), 0.2)) < 1e-15


def test_in_space_one_position_is_scaled():
    frame = Frame(("x", "y", "theta", "phi"))
    L = Gaussian(np.zeros(4), np.diag([1.0, 2.0, 3.0, 4.0]), 1.0, frame)
    seen = Incidence(0.4)(L)(0.5, 0.1, 0.6, -0.2)
    assert abs(seen - L(0.5 * np.cos(0.4), 0.1, 0.2, -0.2)) < 1e-15
    with pytest.raises(ValueError, match="flatland light to be exact"):
        Incidence(0.4, exact=True)(L)


def test_below_the_surface_there_is_nothing():
    with pytest.raises(ValueError, match="`theta0` must lie above the surface"):
        Incidence(2.0)
    with pytest.raises(ValueError, match="`theta1` must lie above the surface"):
        Outgoing(-1.7)
    L = light(FLATLAND)
    assert np.isnan(jax.jit(lambda a: Incidence(a)(L).at(jnp.zeros(2)))(2.0))
    with pytest.raises(ValueError, match="needs angles"):
        Incidence(0.1)(Constant(1.0, FLATLAND_SLOPE))


def test_the_warp_refuses_a_spectrum():
    with pytest.raises(Refused):
        Incidence(0.5, exact=True)(light(FLATLAND).spectrum())


def test_the_angle_is_differentiable():
    L, u = light(FLATLAND), jnp.array([0.3, 0.4])
    slope = jax.grad(lambda a: Incidence(a)(L).at(u))(0.5)
    inner = L.jet(jnp.array([0.3 * np.cos(0.5), 0.4 - 0.5])).gradient
    assert abs(slope - (-0.3 * np.sin(0.5) * inner[0] - inner[1])) < 1e-14


@pytest.mark.parametrize(("event", "sense"), [(Incidence, "incoming"), (Outgoing, "outgoing")])
def test_many_central_rays_are_mapped_over(event, sense):
    light = gaussian((0.0, 0.0), (1.0, 1.0), frame=Frame(sense=sense))
    with pytest.raises(ValueError, match=r"^Argument `theta\d` must be one number, but has shape"):
        event(np.array([0.1, 0.2]))(light)
