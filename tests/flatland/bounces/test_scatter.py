"""What surfaces reflect, and how directions are drawn, by angles and by sums over all numbers."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland.bounces._scatter import Surface, lobe_flux, reflect, scatter
from firstorder.sampling._distributions import lobe_sine

ALBEDO, MIRROR, SPECULAR, EXPONENT = 0.3, 0.2, 0.4, 5.0
BACK = 0.7  # angle to where the ray came from


def surface(albedo=ALBEDO, mirror=MIRROR, specular=SPECULAR, exponent=EXPONENT):
    return Surface(*map(jnp.asarray, (albedo, mirror, specular, exponent, 0.0)))


def of(angle):
    return jnp.sin(jnp.asarray(angle)), jnp.cos(jnp.asarray(angle))


def lobe_integral(power):
    """`int cos^power` over the hemicircle, by the midpoint rule."""
    theta = np.pi * ((np.arange(20_000) + 0.5) / 20_000 - 0.5)
    return np.sum(np.cos(theta) ** power) * np.pi / 20_000


def by_hand(theta):
    """Each lobe's BRDF times cosine, and its density, at angles: shape (2 lobes, 2, n)."""
    up = np.maximum(np.cos(theta), 0.0)
    lobe = np.maximum(np.cos(theta + BACK), 0.0) ** EXPONENT  # mirrored, the ray goes on at -BACK
    shiny = SPECULAR * lobe
    return np.array([
        [0.5 * ALBEDO * up, 0.5 * ALBEDO * up],
        [shiny * up / lobe_integral(EXPONENT + 1.0), shiny / lobe_integral(EXPONENT) * (up > 0.0)],
    ])  # fmt: skip


ANGLES = np.array([-1.8, -1.5, -0.9, -0.7, 0.0, 0.4, 1.2, 2.5])


def test_reflected_is_a_diffuse_and_a_glossy_lobe_about_the_mirrored_direction():
    value, density = reflect(surface(), of(BACK), *of(ANGLES))
    diffuse, shiny = by_hand(ANGLES)
    np.testing.assert_allclose(value, diffuse[0] + shiny[0], rtol=1e-7, atol=1e-15)
    total = ALBEDO + MIRROR + SPECULAR
    np.testing.assert_allclose(density, (diffuse[1] + shiny[1]) / total, rtol=1e-7, atol=1e-15)
    value, density = reflect(surface(), of(BACK), *of(ANGLES), glossy=False)
    np.testing.assert_allclose(value, diffuse[0], rtol=1e-14, atol=1e-16)
    np.testing.assert_allclose(density, diffuse[1] / total, rtol=1e-14, atol=1e-16)


def test_a_black_surface_reflects_nothing():
    for one in reflect(surface(0.0, 0.0, 0.0), of(BACK), *of(ANGLES)):
        np.testing.assert_array_equal(one, 0.0)
    assert float(surface().total) == pytest.approx(ALBEDO + MIRROR + SPECULAR)


def test_the_flux_of_the_lobe_is_its_integral_under_the_cosine():
    for e in (0.0, 1.0, 4.5):
        assert float(lobe_flux(jnp.asarray(e))) == pytest.approx(lobe_integral(e + 1.0), rel=1e-6)


# --- directions ----------------------------------------------------------------------------------


def drawn(pick, u1, u2=0.5, glossy=True):
    """What is drawn for a share of the total, and its angle."""
    u = jnp.array([pick / (ALBEDO + MIRROR + SPECULAR), u1, u2])
    found = scatter(surface(), of(BACK), u, glossy)
    return found, np.arctan2(found.sine, found.cosine)


@pytest.mark.parametrize("glossy", [True, False])
@pytest.mark.parametrize("u1", [0.0, 0.2, 0.5, 0.9])
def test_a_diffuse_direction_has_a_uniform_sine(u1, glossy):
    for pick in (0.0, ALBEDO - 1e-9):
        found, angle = drawn(pick, u1, glossy=glossy)
        assert angle == pytest.approx(np.arcsin(2.0 * u1 - 1.0), abs=1e-7)
        assert not found.delta


@pytest.mark.parametrize("glossy", [True, False])
def test_a_mirror_turns_the_direction_round_its_normal_and_keeps_all(glossy):
    for pick in (ALBEDO + 1e-9, ALBEDO + MIRROR - 1e-9):
        found, angle = drawn(pick, 0.3, glossy=glossy)
        assert angle == pytest.approx(-BACK, rel=1e-12)
        assert found.delta
        assert float(found.weight) == pytest.approx(ALBEDO + MIRROR + SPECULAR, rel=1e-14)


@pytest.mark.parametrize(("u1", "u2"), [(0.2, 0.3), (0.7, 0.1), (0.9, 0.8)])
def test_a_glossy_direction_is_one_of_the_lobe_about_the_mirrored_one(u1, u2):
    for pick in (ALBEDO + MIRROR + 1e-9, ALBEDO + MIRROR + SPECULAR - 1e-9):
        found, angle = drawn(pick, u1, u2)
        off = np.arcsin(lobe_sine(jnp.asarray(EXPONENT), jnp.asarray(u1), jnp.asarray(u2)))
        assert angle == pytest.approx(-BACK + float(off), rel=1e-12)
        assert not found.delta


def test_the_weight_is_what_is_reflected_over_the_density():
    for pick, u1 in ((0.1, 0.3), (0.7, 0.6)):
        found, angle = drawn(pick, u1)
        diffuse, shiny = by_hand(angle)
        density = (diffuse[1] + shiny[1]) / (ALBEDO + MIRROR + SPECULAR)
        assert float(found.density) == pytest.approx(density, rel=1e-7)
        assert float(found.weight) == pytest.approx((diffuse[0] + shiny[0]) / density, rel=1e-7)


def test_what_is_drawn_below_the_horizon_has_no_weight():
    u = jnp.asarray(
        np.random.default_rng(0).uniform(size=(30, 3)) * [0.0, 1.0, 1.0] + [0.9, 0.0, 0.0]
    )
    slanted = scatter(surface(), of(1.5), jnp.asarray(u))
    below = np.asarray(slanted.cosine) < 0.0
    assert 0 < below.sum() < 30
    np.testing.assert_array_equal(np.asarray(slanted.weight) == 0.0, below)


def test_the_mean_of_the_weight_is_what_is_reflected_in_all_directions():
    """Over 18 shares of the total and 60 x 60 other numbers, each in the middle of its cell."""
    u = np.stack(np.meshgrid(*((np.arange(n) + 0.5) / n for n in (18, 60, 60)), indexing="ij"), -1)
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4001)
    sent = np.trapezoid(by_hand(theta)[:, 0].sum(0), theta)
    weight = scatter(surface(), of(BACK), jnp.asarray(u)).weight
    assert float(jnp.mean(weight)) == pytest.approx(sent + MIRROR, rel=2e-3)
