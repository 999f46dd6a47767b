"""What D05's Figs. 16 and 17 shade by: nodes of the sky and of lobes, against closed forms."""

import numpy as np
import pytest

from figures import _d05_creatures as creatures
from figures import _d05_sampling as sampling


@pytest.mark.parametrize("which", [creatures.LAMP, creatures.FILL])
def test_nodes_of_a_lobe_have_its_flux_and_its_mean_direction(which):
    """Of a lobe of von Mises and Fisher, kappa = 1 / sigma^2: the mean is coth(k) - 1 / k long."""
    w, whole = creatures.lobe_nodes(which, 256)
    k = which["sigma"] ** -2
    m = np.array(which["center"]) / np.linalg.norm(which["center"])
    mean = (1.0 / np.tanh(k) - 1.0 / k) * m
    assert float(whole) == pytest.approx(2.0 * np.pi / k * which["radiance"], rel=1e-6)
    np.testing.assert_allclose(np.mean(np.asarray(w), 0), mean, atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(np.asarray(w), axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 20.0, 250.0])
def test_directions_about_an_axis_have_the_density_of_the_lobe(exponent):
    """The mean of cos^2 under (s + 1) cos^s / 2 pi is (s + 1) / (s + 3)."""
    w = np.asarray(creatures.about(512, exponent))
    assert np.mean(w[:, 2] ** 2) == pytest.approx((exponent + 1.0) / (exponent + 3.0), rel=1e-3)
    np.testing.assert_allclose(np.mean(w[:, :2], 0), 0.0, atol=5e-3)


def test_an_open_floor_has_the_irradiance_of_the_sky():
    """Far from everything: the lamp's vector irradiance, the constant's, and most of the lobe's."""
    world = creatures.world(True)
    p = np.array([[0.95, -0.55]])
    at = creatures.view_at(world, p, (1,))
    floor = world.scene.named("floor")[0]
    assert at.shows[0] == floor
    found = creatures.shade(world, at.at, at.shows)[0, 0]
    E = np.pi * creatures.AMBIENT
    for which in (creatures.LAMP, creatures.FILL):
        k, m = which["sigma"] ** -2, np.array(which["center"])
        flux = 2.0 * np.pi / k * which["radiance"] * (1.0 / np.tanh(k) - 1.0 / k)
        E += flux * m[2] / np.linalg.norm(m)
    assert found == pytest.approx(creatures.FLOOR["albedo"] / np.pi * E, rel=0.05)


def test_samples_are_as_many_as_asked_and_keep_their_values():
    density = np.random.default_rng(0).random((40, 30)) + 0.1
    assert sampling.chosen(density, 123).shape == (123, 2)
    fine = np.arange(16.0).reshape(4, 4)
    assert sampling.averaged(fine).tolist() == [[2.5, 4.5], [10.5, 12.5]]


def test_errors_know_the_same_image_and_a_darker_one():
    a = np.random.default_rng(0).random((32, 32))
    assert sampling.errors(a, a, 1.0) == (0.0, 0.0, pytest.approx(1.0))
    rms, screen, like = sampling.errors(0.5 * a, a, 1.0)
    assert rms == pytest.approx(0.5 * np.sqrt(np.mean(a**2)))
    assert screen > 0.0
    assert like < 1.0
