import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.transport.chain4d import equator as derived
from derivations.transport.chain4d._space_tracer import spun, tilted
from firstorder.checks.tolerance import rounding
from firstorder.conventions import SPACE, SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Gaussian
from firstorder.laws import Move, Warp
from firstorder.transport.chain4d._equator import (
    Bend,
    ComposedMove,
    FromEquator,
    Oblique,
    Roll,
    ToEquator,
    Turn,
    equator_angles,
    equator_direction,
)
from firstorder.transport.event import Event

U = jnp.array([0.1, -0.2, 0.5, 0.3])
PRECISION = np.diag([9.0, 7.0, 5.0, 6.0])


def mapped(event, frame=SPACE, u=U):
    law = event.law(frame)
    return law.map(u) if isinstance(law, Warp) else law.preimage(u)


@pytest.mark.smoke
def test_angles_name_their_direction():
    theta, phi = equator_angles(equator_direction(U[2:3], U[3:4]))
    np.testing.assert_allclose(jnp.concatenate([theta, phi]), U[2:], rtol=0.0, atol=rounding(4))


def test_slopes_name_the_same_ray():
    slopes = mapped(ToEquator(), SPACE_SLOPE)
    w = np.asarray(equator_direction(U[2], U[3]))
    np.testing.assert_allclose(slopes[2:], [-w[0] / w[2], -w[1] / w[2]], rtol=1e-14)
    np.testing.assert_allclose(mapped(FromEquator(), SPACE, slopes), U, rtol=1e-14)


def test_leaving_a_surface_undoes_meeting_it():
    away = mapped(Oblique(-0.4), SPACE.turned())
    back = mapped(Oblique(-0.4), SPACE, away)
    np.testing.assert_allclose(back, U, rtol=0.0, atol=rounding(8))


@pytest.mark.parametrize("angle", [-0.4, 0.7])
def test_a_surface_is_met_where_the_ray_comes_to_its_plane(angle):
    """In the axes of the surface, which is turned about y: longitudes grow by the angle."""
    x, y, theta, phi = np.asarray(U)
    place, way = np.array([x, y, 0.0]), np.asarray(equator_direction(U[2], U[3]))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    place, way = turn @ place, turn @ way
    met = place - way * place[2] / way[2]
    found = mapped(Oblique(-angle), SPACE)
    np.testing.assert_allclose(
        found, [met[0], met[1], theta + angle, phi], rtol=0.0, atol=rounding(8)
    )


@pytest.mark.parametrize("frame", [SPACE, SPACE.turned()])
@pytest.mark.parametrize("theta", [0.4, 1.0, -1.3, 2.0])
def test_rays_from_below_the_surface_or_past_the_plane_across_are_nan(frame, theta):
    """Met at the angle 0.9: a ray counts if it runs upwards from the surface and from the plane."""
    light = Gaussian([0.1, 0.0, 0.0, 0.2], PRECISION, 1.0, frame)
    seen = Oblique(0.9)(light)(0.1, -0.2, theta, 0.3)
    there = theta - 0.9 if frame == SPACE else theta + 0.9
    above = max(abs(theta), abs(there)) < 0.5 * np.pi
    assert np.isfinite(seen) == above


@pytest.mark.parametrize(("theta", "phi"), [(2.0, 0.3), (0.3, 2.0), (-0.4, -1.8)])
def test_rays_from_below_have_no_slopes(theta, phi):
    """Those of a latitude past the pole had the slopes of the opposite ray."""
    assert float(equator_direction(jnp.array(theta), jnp.array(phi))[2]) < 0.0
    light = Gaussian(np.zeros(4), np.eye(4), 1.0, SPACE_SLOPE)
    assert np.isnan(ToEquator()(light)(0.1, -0.2, theta, phi))


@pytest.mark.parametrize("exact", [True, False])
def test_back_undoes_the_bend(exact):
    S = jnp.array([[-0.5, 0.13], [0.13, 0.3]])
    there = mapped(Bend(S, 0.4, exact=exact))
    back = mapped(Bend(S, 0.4, back=True, exact=exact), SPACE, there)
    np.testing.assert_allclose(back, U, rtol=0.0, atol=rounding(16))


def test_first_orders_touch_their_warps():
    assert derived.bend_by_autodiff() < 1e-14
    assert derived.oblique_by_autodiff() < 1e-14
    assert derived.turn_by_autodiff() < 1e-14


def test_without_the_cosine_the_shear_is_wrong_at_first_order():
    """D05's claim, at ever smaller distances: the relative error stays."""
    for y in (1e-2, 1e-4):
        true = derived.traced_latitude(1.0, 0.5, y)
        assert -0.5 * y / true == pytest.approx(1.0 / np.cos(1.0), rel=1e-4)


def test_a_turn_about_the_central_ray_rolls_the_angles():
    M = Turn(jnp.asarray(spun(0.3)), at=0.0).law(SPACE).M
    np.testing.assert_allclose(M[2:, 2:], spun(0.3)[:2, :2], rtol=0.0, atol=rounding(8))
    shifted = Turn(jnp.asarray(tilted(0.2)), at=0.0).law(SPACE)
    np.testing.assert_allclose(shifted.c, [0.0, 0.0, 0.2, 0.0], rtol=0.0, atol=rounding(8))


def test_a_roll_is_exact_in_slopes():
    light = Gaussian([0.1, 0.0, 0.0, 0.2], PRECISION, 1.0, SPACE_SLOPE)
    rolled = Roll(0.5 * np.pi)(light)
    expected = float(light(-0.1, 0.3, -0.4, 0.2))
    assert rolled(0.3, 0.1, 0.2, 0.4) == pytest.approx(expected, rel=1e-13)


class Shifted(Event):
    """A move of any matrix and any shift, into a frame of its own."""

    M: np.ndarray
    c: np.ndarray
    to: Frame = eqx.field(static=True)

    def law(self, frame):
        return Move(self.M, self.c, self.to)


def test_moves_composed_are_the_moves_one_after_the_other():
    rng, names = np.random.default_rng(0), [("p", "q", "r"), ("a", "b", "c"), ("f", "g", "h")]
    events = [Shifted(rng.normal(size=(3, 3)), rng.normal(size=3), Frame(n)) for n in names]
    start = Frame(("x", "y", "z"))
    composed, u = ComposedMove(tuple(events)).law(start), rng.normal(size=3)
    read = u
    for event in events[::-1]:  # the last moves the place that is asked for first
        read = event.M @ read + event.c
    np.testing.assert_allclose(composed.preimage(jnp.asarray(u)), read, rtol=1e-12)
    assert composed.frame(start) == Frame(names[-1])


def test_warps_have_no_spectrum_and_first_orders_have():
    L = Gaussian([0.1, 0.0, 0.0, 0.2], PRECISION, 1.0, SPACE)
    with pytest.raises(Refused):
        Oblique(0.3)(L.spectrum())
    assert np.isfinite(complex(Bend(jnp.eye(2), 0.3)(L.spectrum())(0.1, 0.2, 0.3, 0.4)))


def test_bad_arguments_are_refused_in_a_sentence():
    L = Gaussian([0.1, 0.0, 0.0, 0.2], PRECISION, 1.0, SPACE_SLOPE)
    with pytest.raises(ValueError, match="needs angles in space"):
        Oblique(0.3)(L)
    with pytest.raises(ValueError, match="`theta0` must lie above"):
        Oblique(2.0)
    with pytest.raises(ValueError, match="`S` must have shape"):
        Bend(jnp.eye(3))
    with pytest.raises(ValueError, match="`R` must have shape"):
        Turn(jnp.eye(2))
