import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.flatland import (
    Circles,
    PointLights,
    Receiver,
    Scene,
    Segments,
    derivatives,
    derivatives_on_shape,
    irradiance,
    point_light_irradiance,
    primitive,
    receiver,
    weighted_irradiance,
)
from firstorder.flatland._reference import reference_nearest
from tests.flatland.worlds import everything

LAMP = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)


def test_irradiance_is_the_integral_of_what_is_seen():
    scene = everything(curve=False)
    at = receiver(scene, 0, 0.45)
    n = 1000
    a = (np.arange(n) + 0.5) / n * np.pi - 0.5 * np.pi
    rays = np.stack([-np.sin(a), np.cos(a)], -1)
    _, index = reference_nearest(
        scene, np.broadcast_to(np.asarray(at.position), rays.shape), rays, 0
    )
    emission = np.asarray(scene.material.emission[:, 0])
    dense = np.sum(np.where(index >= 0, emission[index], 0.0) * np.cos(a)) * np.pi / n
    # Each of some ten edges is off by at most half a step.
    assert abs(jax.jit(irradiance)(scene, at) - dense) < 10 * 0.5 * np.pi / n


def test_a_sky_shines_between_the_shapes():
    sky = lambda a: 1.0 + 0.5 * jnp.sin(a)  # noqa: E731
    scene = Scene.of(primitive(Circles((0.0, 2.0), 1.0)), environment=sky)
    edge = np.arcsin(0.5)
    free = lambda a: (1.0 + 0.5 * np.sin(a)) * np.cos(a)  # noqa: E731
    expected = quad(free, -np.pi / 2, -edge)[0] + quad(free, edge, np.pi / 2)[0]
    assert abs(irradiance(scene, Receiver((0.0, 0.0), 0.0)) - expected) < 1e-12


def test_a_point_light_falls_off_with_the_distance():
    scene = Scene.of(LAMP, points=PointLights((0.3, 0.4), 2.0))
    lit = irradiance(scene, Receiver((0.0, 0.0), 0.0)) - irradiance(
        Scene.of(LAMP), Receiver((0.0, 0.0), 0.0)
    )
    assert abs(lit - 2.0 * 0.8 / 0.5) < 1e-12


def test_radiance_can_be_given():
    scene = Scene.of(LAMP)
    at = Receiver((0.2, 0.0), 0.1)
    twice = irradiance(scene, at, radiance=lambda index, s, front, d: 2.0 * jnp.ones(()), nodes=8)
    assert abs(twice - 2.0 * irradiance(scene, at)) < 1e-12


def test_turning_in_place():
    scene = Scene.of(LAMP)
    d = derivatives(irradiance, scene, Receiver((0.2, 0.0), 0.1), freedoms=("n",))
    # An emitter wholly in view: E = L (sin(b - n) - sin(a - n)).
    a, b = np.arctan2(-0.3, 1.0), np.arctan2(0.7, 1.0)
    assert abs(d.value - (np.sin(b - 0.1) - np.sin(a - 0.1))) < 1e-12
    assert abs(d.first + (np.cos(b - 0.1) - np.cos(a - 0.1))) < 1e-12
    assert abs(d.second + d.value) < 1e-12


def test_along_a_curve_it_moves_and_turns():
    scene = Scene.of(LAMP, primitive(Circles((0.0, -0.5), 0.4)))
    places, h = jnp.array([0.03, 0.1, 0.93]), 1e-4 / (0.8 * np.pi)

    def E(r):
        return irradiance(scene, r)

    @jax.jit
    @jax.vmap
    def everything_at(s):
        at = receiver(scene, 1, s)
        near = jax.vmap(lambda k: E(receiver(scene, 1, s + k * h)))(jnp.arange(-1.0, 2.0))
        kappa = scene.frame(1, s).kappa
        whole = derivatives(E, at)
        on_it = derivatives_on_shape(E, scene, 1, s)
        return on_it, whole.translation(), whole.rotation(), kappa, near

    total, moved, turned, kappa, near = everything_at(places)
    assert jnp.max(jnp.abs(total.first - (moved.first + kappa * turned.first))) < 1e-10
    slope, bend = (near[:, 2] - near[:, 0]) / 2e-4, (near @ jnp.array([1.0, -2.0, 1.0])) / 1e-8
    assert jnp.max(jnp.abs(total.first - slope)) < 1e-5
    assert jnp.max(jnp.abs(total.second - bend)) < 1e-4


def test_a_weight_that_is_no_function_is_refused_in_a_sentence():
    with pytest.raises(TypeError, match=r"`weight` must be a function of the local|type hint"):
        weighted_irradiance(everything(), Receiver((0.0, 0.0), 0.0), weight=0.5)


def test_light_is_gathered_under_any_weight():
    scene = Scene.of(
        LAMP,
        primitive(Circles((0.2, 0.5), 0.1)),
        points=PointLights((-0.6, 0.5), 0.7),
        environment=lambda a: 0.2 + 0.0 * a,
    )
    at = Receiver((0.1, 0.0), 0.2)
    assert (
        abs(weighted_irradiance(scene, at, weight=jnp.cos, nodes=24) - irradiance(scene, at))
        < 1e-12
    )
    lobe = lambda a: jnp.cos(a) ** 5  # noqa: E731
    below = primitive(Segments((-1.0, -9.0), (1.0, -9.0)))
    bare = Scene.of(below, environment=lambda a: 1.0 + 0.0 * a)
    assert abs(weighted_irradiance(bare, at, weight=lobe, nodes=24) - 16.0 / 15.0) < 1e-9


def test_a_receiver_that_is_nowhere_receives_nan():
    scene = Scene.of(LAMP)
    assert jnp.isnan(jax.jit(irradiance)(scene, Receiver((jnp.nan, 0.0), 0.0)))
    assert jnp.isnan(jax.jit(irradiance)(scene, Receiver((0.0, 0.0), jnp.nan)))


def test_from_point_lights_too_and_past_a_shape_that_is_none():
    def light(x, n, radius):
        disc = primitive(Circles((0.0, 0.5), radius))
        scene = Scene.of(disc, points=PointLights((0.0, 1.0), 1.0))
        return point_light_irradiance(scene, Receiver(jnp.stack([x, 0.0]), n))

    asked = jax.jit(light)
    assert jnp.isnan(asked(jnp.nan, 0.0, 0.1))
    assert jnp.isnan(asked(1.0, jnp.nan, 0.1))
    assert jnp.isnan(asked(1.0, 0.0, -0.1))
    assert abs(asked(1.0, 0.0, 0.1) - 0.5) < 1e-15


def test_the_jump_of_a_plain_sky_is_an_edge_and_angles_come_wrapped():
    def sky(a):
        return jnp.where(a > 0.3, 2.0, 1.0)

    setattr(sky, "breaks", [0.3])  # noqa: B010
    scene = Scene.of(primitive(Segments((-1.0, -9.0), (1.0, -9.0))), environment=sky)
    E = jax.jit(lambda n: irradiance(scene, Receiver((0.0, 0.0), n)))
    for n in (0.0, 0.2, 2.0 * np.pi):
        local = 0.3 - n if n < 1.0 else 0.3
        assert abs(E(n) - (3.0 - np.sin(local))) < 1e-12
    assert abs(jax.grad(E)(0.1) - np.cos(0.2)) < 1e-12


def test_single_precision_stays_single():
    scene = Scene.of(
        primitive(
            Segments(np.array([[0.5, 1.0]], np.float32), np.array([[-0.5, 1.0]], np.float32)),
            emission=np.float32(1.0),
        )
    )
    at = Receiver(np.zeros(2, np.float32), np.float32(0.0))
    assert abs(irradiance(scene, at) - 2 * 0.5 / np.sqrt(1.25)) < 1e-6


def test_a_traced_point_light_of_negative_intensity_gives_nan():
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))

    def E(power):
        scene = Scene.of(floor, points=PointLights((0.0, 1.0), power))
        return point_light_irradiance(scene, Receiver((0.3, 0.0), 0.0, 0))

    assert np.isnan(jax.jit(E)(-1.0))
