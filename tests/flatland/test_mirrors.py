import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    irradiance,
    mirror_irradiance,
    primitive,
)

LAMP = primitive(Segments((-0.5, 1.0), (-1.5, 1.0)), emission=1.0)
GLASS = primitive(Segments((1.0, 0.0), (1.0, 3.0)), mirror=0.8)


def beyond(x, lamp=(-0.5, -1.5), top=3.0):
    """The lamp's image at 2 - x, through the opening of the mirror: sines towards +x."""
    sine = lambda px, py: (px - x) / np.hypot(px - x, py)  # noqa: E731
    low, high = sine(2.0 - lamp[0], 1.0), sine(2.0 - lamp[1], 1.0)
    return 0.8 * max(min(high, 1.0) - max(low, sine(1.0, top)), 0.0)


def test_a_lamp_in_a_mirror_is_a_lamp_behind_it():
    scene = Scene.of(LAMP, GLASS)
    E = jax.jit(
        lambda x: mirror_irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0), mirrors=(1,))
    )
    for x in (-1.0, 0.0, 0.7):
        assert abs(E(x) - beyond(x)) < 1e-13


def test_the_edge_of_a_low_mirror_is_an_edge_of_the_light():
    low = primitive(Segments((1.0, 0.0), (1.0, 0.3)), mirror=0.8)
    scene = Scene.of(LAMP, low)

    @jax.jit
    def E(x):
        return mirror_irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0), mirrors=(1,))

    x, h = 0.2, 1e-5
    assert abs(E(x) - beyond(x, top=0.3)) < 1e-13
    assert 0.0 < E(x) < beyond(x)
    slope = (beyond(x + h, top=0.3) - beyond(x - h, top=0.3)) / (2.0 * h)
    assert abs(jax.jit(jax.grad(E))(x) - slope) < 1e-8


def test_a_blocker_is_seen_in_the_mirror_too():
    disc = primitive(Circles((0.0, 0.75), 0.1))
    scene = Scene.of(LAMP, GLASS, disc)
    # Without the mirror, but with the images of lamp and disc: both on the way of the light.
    images = Scene.of(
        primitive(Segments((3.5, 1.0), (2.5, 1.0)), emission=0.8),
        primitive(Circles((2.0, 0.75), 0.1)),
        disc,
    )

    @jax.jit
    def both(x):
        at = Receiver(jnp.stack([x, 0.0]), 0.0)
        return mirror_irradiance(scene, at, mirrors=(1,)), irradiance(images, at)

    for x in (-0.4, -0.1, 0.5):
        one, other = both(x)
        assert abs(one - other) < 1e-13


def test_a_mirror_reflects_the_sky():
    scene = Scene.of(GLASS, environment=lambda a: 1.0 + 0.3 * jnp.sin(a))
    E = jax.jit(lambda at: mirror_irradiance(scene, at, mirrors=(0,), nodes=24))(
        Receiver((0.0, 0.0), 0.0)
    )
    # Towards +x at the sine s, angle -arcsin(s); reflected, the sky's angle is +arcsin(s).
    low = 1.0 / np.hypot(1.0, 3.0)
    expected = 0.8 * ((1.0 - low) + 0.15 * (1.0 - low**2))
    assert abs(E - expected) < 1e-12


@pytest.mark.parametrize(("unit", "bits"), [(1e9, 64), (1e6, 32), (1e-6, 32)])
def test_where_the_reflected_sky_breaks_does_not_depend_on_the_unit_of_length(unit, bits):
    class Halves:
        breaks = np.array([0.5])

        def __call__(self, angle):
            return jnp.where(angle > 0.5, 0.0, 1.0)

    def reflected(unit):
        ends = unit * np.array([[4.0, 2.0], [4.2, 5.0]])
        scene = Scene.of(primitive(Segments(*ends), mirror=0.8), environment=Halves())
        at = Receiver(unit * np.array([3.0, 2.0]), 0.1)
        return float(mirror_irradiance(scene, at, mirrors=(0,)))

    metres = reflected(1.0)
    assert metres > 0.1
    with jax.enable_x64(bits == 64):
        assert abs(reflected(unit) / metres - 1.0) < 32.0 * np.finfo(f"float{bits}").eps


def test_only_segments_are_mirrors():
    with pytest.raises(ValueError, match="`mirrors` must hold numbers of segments, but holds 2"):
        mirror_irradiance(Scene.of(LAMP, GLASS), Receiver((0.0, 0.0), 0.0), mirrors=(2,))
