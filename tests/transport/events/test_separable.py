from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.fields import GaussianProfile, Grid, gaussian
from firstorder.fields.field import Sum
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import AngularFactor, ClampedCosine, Fresnel, Schlick, separable

L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4)
OUT = L.frame.turned()
RAY = jnp.array([0.3, 0.4])


def test_both_factors_are_read_in_their_own_angle():
    chain = separable(GaussianProfile(0.3, frame=OUT), Fresnel(1.5), ClampedCosine(frame=OUT))

    horizons = np.array([-3.0, -np.pi / 2, np.pi / 2, 3.0])  # Fresnel reflects all below them
    true = 0.0
    for lower, upper in pairwise(horizons):
        nodes, weights = gauss_legendre(64)
        i = lower + 0.5 * (upper - lower) * (nodes + 1.0)
        lobe = np.exp(-0.5 * ((0.4 + i) / 0.3) ** 2) / (0.3 * np.sqrt(2 * np.pi))
        inside = np.asarray(Fresnel(1.5)(0.0, i) * L(0.3, i)) * lobe * np.cos(0.4)
        true += float(np.sum(inside * weights)) * 0.5 * (upper - lower)
    assert chain(L)(0.3, 0.4).item() == pytest.approx(true, rel=1e-8)


def test_sums_of_separable_brdfs_are_sums_of_light():
    """Schlick's term is a sum of two factors: 1 and (1 - cos)^5."""
    lobe = GaussianProfile(0.3, frame=OUT)
    whole, bare, grazing = (
        separable(lobe, incoming=f)(L) for f in (Schlick(0.04), Schlick(1.0), Schlick(0.0))
    )
    parts = Sum((bare, grazing), jnp.array([0.04, 0.96]))
    assert normwise(whole.at(RAY), parts.at(RAY)) < 1e-13


@pytest.mark.smoke
def test_reflected_light_is_differentiable_in_index_and_roughness():
    def radiance(p):
        chain = separable(GaussianProfile(p[1], frame=OUT), Fresnel(p[0]))
        return chain(L)(0.3, 0.4)

    p, h = jnp.array([1.5, 0.3]), 1e-6
    slope = jax.jit(jax.grad(radiance))(p)
    for i in range(2):
        step = h * jnp.eye(2)[i]
        assert float(slope[i]) == pytest.approx(
            float(radiance(p + step) - radiance(p - step)) / (2 * h), rel=1e-6
        )


@pytest.mark.parametrize(
    ("factor", "number"), [(ClampedCosine, ()), (Fresnel, (1.5,)), (Schlick, (0.04,))]
)
def test_a_factor_on_the_circle_repeats_every_turn(factor, number):
    line, circle = factor(*number), factor(*number, periodic=True)
    theta = np.array([-2.5, -0.9, 0.4, 1.3])
    for turns in (0, 1, -2):
        found, true = circle.jets(0.3, theta + 2.0 * np.pi * turns), line.jets(0.3, theta)
        for part in ("value", "gradient", "hessian"):
            np.testing.assert_allclose(getattr(found, part), getattr(true, part), 1e-13, 1e-13)


def place_on_the_circle(edge):
    """Where an edge is met in the turn that begins at 0.2."""
    begin = jnp.array(0.2)
    return edge.crossing(RAY, 1, begin, begin + 2.0 * np.pi).value


@pytest.mark.parametrize(("factor", "number"), [(ClampedCosine, ()), (Schlick, (0.04,))])
def test_the_slope_of_a_factor_on_the_circle_jumps_at_both_horizons(factor, number):
    circle, places = factor(*number, periodic=True), []
    for edge in circle.edges():
        places.append(place_on_the_circle(edge))
        before, after = circle.jets(0.3, places[-1] + np.array([-1e-7, 1e-7])).gradient[:, 1]
        rises = jnp.sign(edge.level(0.3, places[-1] + 1e-7))
        jump = edge.jump.jets(0.3, places[-1]).gradient[1]
        assert float(jump) == pytest.approx(float(rises * (after - before)), rel=1e-5)
    np.testing.assert_allclose(sorted(places), [0.5 * np.pi, 1.5 * np.pi], rtol=1e-12)


def test_total_reflection_on_the_circle_begins_at_the_critical_angle():
    places = map(place_on_the_circle, Fresnel(0.7, periodic=True).edges())
    ends = np.array([np.arcsin(0.7), 0.5 * np.pi])
    np.testing.assert_allclose(sorted(places), [*ends, *(2.0 * np.pi - ends)[::-1]], rtol=1e-12)


def test_a_factor_of_other_coordinates_is_refused():
    with pytest.raises(ValueError, match="AngularFactor needs"):
        AngularFactor(Fresnel(1.5))(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE))


def test_a_function_of_an_angle_is_none_of_time():
    light = gaussian((0.0, 0.0), (1.0, 1.0), frame=Frame(("x", "t")))
    with pytest.raises(ValueError, match="AngularFactor needs light in angles"):
        AngularFactor(jnp.cos)(light)


@pytest.mark.parametrize(("center", "turns"), [(0.0, 4), (0.0, 7), (100.0, 1)])
def test_every_turn_of_a_window_is_split(center, turns):
    def mean(window):
        found = Schlick(0.04, periodic=True).series(window)
        return found.coefficients[np.argmin(abs(found.frequencies[:, 1]))]

    wide = Grid.spanning((2, 16 * turns), (1.0, np.pi * turns), (0.0, center))
    assert abs(mean(wide) - mean(Grid.spanning((2, 16), (1.0, np.pi)))) < 1e-11
