import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import SPACE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    Gaussian,
    autodiff_jet,
    discrete_transform,
    gaussian,
    half_plane,
)
from firstorder.fields.spectrum import Grid
from firstorder.laws import Integrate
from firstorder.transport import Bump, Curvature, Wave, wave

L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4)
RIPPLES = wave(0.4, amplitude=0.25, phase=0.6)
RAY = jnp.array([0.3, 0.1])


@eqx.filter_jit
def jet_and_truth(field, u):
    """The jet, and the same by autodiff."""
    return field.jet(u), autodiff_jet(field.at, u, field.frame)


def test_a_bump_that_is_linear_is_a_curvature():
    a, b = Bump(Affine([0.6, 0.0], 0.0))(L).jet(RAY), Curvature(0.6)(L).jet(RAY)
    assert normwise(a.hessian, b.hessian) < 1e-14


def test_there_and_back_is_the_identity():
    same = (Bump(RIPPLES) >> Bump(RIPPLES, back=True))(L).jet(RAY)
    assert normwise(same.hessian, L.jet(RAY).hessian) < 1e-13


def test_base_shape_and_bump_add_up():
    together = Bump(Affine([0.6, 0.0], 0.0) + RIPPLES)(L).jet(RAY)
    in_turn = (Bump(RIPPLES) >> Curvature(0.6))(L).jet(RAY)
    assert normwise(together.hessian, in_turn.hessian) < 1e-13


def test_directions_of_the_normal_map_are_ignored():
    tilted = Affine([0.6, 5.0], 0.0)
    assert normwise(Bump(tilted)(L).jet(RAY).gradient, Curvature(0.6)(L).jet(RAY).gradient) < 1e-14


def test_bumps_that_move_have_derivatives_in_time():
    """A wave that runs along the surface, in light that varies in time as well."""
    moving = Frame(("x", "theta", "t"))
    light = Gaussian(jnp.array([0.2, -0.1, 0.3]), jnp.diag(jnp.array([1.0, 4.0, 2.0])), 1.0, moving)
    bumped = Bump(Wave([0.4, 0.0, 0.7], amplitude=0.25, phase=0.6, frame=moving))(light)
    ray = jnp.array([0.3, 0.1, -0.2])
    found, true = jet_and_truth(bumped, ray)
    assert normwise(found.gradient, true.gradient) < 1e-14
    assert normwise(found.hessian, true.hessian) < 1e-14


def test_in_space_each_direction_has_its_own_map():
    light = Gaussian(
        jnp.array([0.1, 0.2, -0.1, 0.0]), jnp.diag(jnp.array([1.0, 2.0, 3.0, 4.0])), 1, SPACE
    )
    maps = (wave(0.4, 0.25, axis="x", frame=SPACE), wave(0.3, 0.2, 0.5, axis="y", frame=SPACE))
    u = jnp.array([0.2, 0.3, 0.1, -0.2])
    found, true = jet_and_truth(Bump(maps)(light), u)
    assert normwise(found.hessian, true.hessian) < 1e-12


def test_spectra_are_refused_and_pass_linearised_with_second_order_error():
    with pytest.raises(Refused, match="warp"):
        Bump(RIPPLES)(L.spectrum())
    at = jnp.array([0.2, 0.1])
    sizes, errors, reported = [0.02, 0.04, 0.08], [], []
    for size in sizes:
        small = gaussian((0.2, 0.1 + float(RIPPLES(0.2, 0.0))), (size, 0.3), 0.3)
        event = Bump(RIPPLES)
        grid = Grid.spanning((64, 64), (7 * size, 2.4), (0.2, 0.1))
        Omega = (np.array([0.0, 0.1 / size]), np.array([0.2, 0.4]))
        true = discrete_transform(grid.sample(event(small)), grid, *Omega)
        touching = event.linearised(at, size)
        ours = touching(small.spectrum())(*np.meshgrid(*Omega, indexing="ij"))
        errors.append(normwise(ours, true))
        reported.append(float(touching.error(L.frame)))
    assert fitted_order(sizes, errors) == pytest.approx(2.0, abs=0.1)
    assert fitted_order(sizes, reported) == pytest.approx(2.0, abs=0.1)


def test_wrong_number_of_maps_is_one_sentence():
    with pytest.raises(ValueError, match="a normal map for each"):
        Bump(RIPPLES)(Gaussian(jnp.zeros(4), jnp.eye(4), 1.0, SPACE))


@pytest.mark.smoke
def test_height_of_a_bump_is_differentiable():
    def radiance(height):
        return Bump(wave(0.4, amplitude=height))(L)(0.3, 0.1)

    h = 1e-6
    measured = (radiance(0.25 + h) - radiance(0.25 - h)) / (2 * h)
    assert float(jax.jit(jax.grad(radiance))(0.25)) == pytest.approx(float(measured), rel=1e-8)


def test_at_a_crease_the_light_has_an_edge():
    crease = half_plane(0.2, -0.3, 0.4) + RIPPLES
    seen = Bump(crease)(L)
    (edge,) = seen.edges()
    jump = seen(0.2 + 1e-9, 0.1) - seen(0.2 - 1e-9, 0.1)
    np.testing.assert_allclose(edge.jump(0.2, 0.1), jump, rtol=1e-7)


def test_a_crease_that_moves_is_seen_by_a_pixel_over_it():
    """The derivative by its place: what the pixel loses on one side, for what it wins."""

    def pixel(place, direction):
        seen = Bump(half_plane(place, -0.3, 0.4))(L)
        return Integrate("x", -1.0, 1.0)(seen).at(direction)

    low, high = (Bump(n)(L)(0.2, 0.1) for n in (-0.3, 0.4))
    slope = jax.jit(jax.grad(pixel))(0.2, jnp.array([0.1]))
    np.testing.assert_allclose(slope, low - high, rtol=1e-10)
