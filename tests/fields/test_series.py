"""Masks as factors: the product's spectrum is exact wherever the edge lies and however it leans."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Affine, Grid, HalfPlane, SoftEdge, gaussian, half_plane
from firstorder.laws import Move, Multiply
from firstorder.transport import Travel

WINDOW = Grid.spanning((240, 201), (3.1, 2.7), (0.4, 0.2))
OMEGA = np.array([[0.3, -0.4], [0.8, 0.5], [0.0, 0.0]])


def light():
    return gaussian((0.21, -0.13), (0.3, 0.35), 0.35, 1.3, FLATLAND_SLOPE)


def product_spectrum(mask):
    """By the series, at `OMEGA`."""
    F = Multiply(mask, WINDOW)(light().spectrum())
    return jax.jit(jax.vmap(F.at))(jnp.asarray(OMEGA))


def quadrature(crossing, below, above, along=0):
    """Gauss-Legendre on both sides of `crossing(other coordinate)`, trapezoid along that one."""
    t, w = np.polynomial.legendre.leggauss(60)
    other = np.linspace(-3.4, 3.4, 401)
    cut = np.clip(crossing(other), -3.4, 3.4)[:, None]
    total = np.zeros(len(OMEGA), complex)
    for low, high, height in ((-3.4, cut, below), (cut, 3.4, above)):
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        s = middle + half * t
        x, v = (s, other[:, None] + 0 * s) if along == 0 else (other[:, None] + 0 * s, s)
        f = np.asarray(light()(x, v)) * half * w * height * (other[1] - other[0])
        wave = np.exp(-2j * np.pi * (OMEGA[:, 0, None, None] * x + OMEGA[:, 1, None, None] * v))
        total += np.sum(f * wave, axis=(1, 2))
    return total


EDGE = half_plane(0.5, 0.2, 0.9, "x", FLATLAND_SLOPE)
ALONG = half_plane(0.15, 0.2, 0.9, "v", FLATLAND_SLOPE)
TILTED = HalfPlane(Affine([0.7, -1.1], 0.2, FLATLAND_SLOPE), 0.2, 0.9)


@pytest.mark.parametrize(
    ("mask", "crossing", "along"),
    [
        (EDGE, lambda v: 0.5 + 0 * v, 0),
        (ALONG, lambda x: 0.15 + 0 * x, 1),
        (TILTED, lambda v: (1.1 * v - 0.2) / 0.7, 0),
        (Travel(0.8).law(FLATLAND_SLOPE)(EDGE), lambda v: 0.5 + 0.8 * v, 0),
        (Move([[1.0, -0.8], [0.3, 1.0]], [0.3, -0.2])(TILTED),
         lambda v: (0.7 * 0.8 * v - 0.21 - 0.2 + 1.1 * (v - 0.2)) / (0.7 - 0.33), 0),
    ],
    ids=["x", "v", "tilted", "sheared", "moved"],
)  # fmt: skip
def test_product_with_an_edge(mask, crossing, along):
    truth = quadrature(crossing, 0.2, 0.9, along)
    np.testing.assert_allclose(product_spectrum(mask), truth, rtol=0.0, atol=1e-9)


def test_an_edge_off_the_window_is_a_constant():
    for edge, height in ((9.0, 0.2), (-9.0, 0.9)):
        mask = half_plane(edge, 0.2, 0.9, "x", FLATLAND_SLOPE)
        truth = height * np.asarray(jax.vmap(light().spectrum().at)(jnp.asarray(OMEGA)))
        np.testing.assert_allclose(product_spectrum(mask), truth, rtol=0.0, atol=1e-12)


def test_a_soft_edge_that_hardens():
    level = Affine([1.0, 0.0], -0.5, FLATLAND_SLOPE)
    hard = np.asarray(product_spectrum(HalfPlane(level, 0.0, 1.0)))
    errors = [
        np.max(np.abs(np.asarray(product_spectrum(SoftEdge(level, w))) - hard))
        for w in (0.04, 0.02)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_the_spectrum_behind_a_blocker_is_differentiable_in_its_depth():
    def part(d):
        mask = Travel(d).law(FLATLAND_SLOPE)(EDGE)
        return jnp.abs(Multiply(mask, WINDOW)(light().spectrum()).at(jnp.asarray(OMEGA[0])))

    part = jax.jit(part)
    slope = (part(0.8 + 1e-5) - part(0.8 - 1e-5)) / 2e-5
    assert jax.grad(part)(0.8) == pytest.approx(float(slope), rel=1e-6)
