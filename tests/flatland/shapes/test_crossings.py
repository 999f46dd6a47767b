import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Circles, Receiver, Scene, Segments, irradiance, polyline, primitive
from firstorder.flatland.shapes._crossings import any_crossing, find_crossings


def cross_of(x):
    return primitive(Segments([(x - 0.4, 0.4), (x - 0.4, 1.0)], [(x + 0.4, 1.0), (x + 0.4, 0.4)]))


def test_what_crosses_is_found_and_what_touches_is_not():
    assert Scene.of(cross_of(0.0)).crossings.pairs.tolist() == [[0, 1]]
    assert Scene.of(primitive(polyline([(0, 0), (1, 0), (1, 1), (0, 0)]))).crossings.pairs.size == 0
    beam = primitive(Segments((-1.0, 0.5), (1.0, 0.5)))
    disc = primitive(Circles((0.0, 0.5), 0.3))
    assert Scene.of(beam, disc).crossings.pairs.tolist() == [[0, 1], [0, 1]]
    post = primitive(Segments((0.0, 0.5), (0.0, 1.0)))  # stands on the beam
    assert Scene.of(beam, post).crossings.pairs.size == 0


def test_circles_that_touch_up_to_rounding_do_not_cross():
    """From outside, or one within the other; a ten-thousandth further in, or out, they do."""
    rng = np.random.default_rng(0)
    r, turn = rng.uniform(0.1, 1.0, (200, 2)), rng.uniform(0.0, 2.0 * np.pi, (200, 1))
    way = np.concatenate([np.cos(turn), np.sin(turn)], -1)
    place = 30.0 * np.stack([way[::-1], way[::-1]], 1)
    apart = np.stack([0.0 * way, way], 1)

    @jax.jit
    @jax.vmap
    def crosses(center, radius):
        return any_crossing([Circles(center, radius)], jnp.ones(2, bool))

    for far, step in ((r[:, 0] + r[:, 1], -1e-4), (np.abs(r[:, 0] - r[:, 1]), 1e-4)):
        assert not jnp.any(crosses(place + far[:, None, None] * apart, r))
        assert jnp.all(crosses(place + (far + step)[:, None, None] * apart, r))


def test_light_past_two_crossed_blades():
    lamp = primitive(Segments((3.0, 1.2), (-3.0, 1.2)), emission=1.0)
    bright = primitive(Segments((-0.4, 0.4), (0.4, 1.0)), emission=(0.0, 0.5))
    dark = primitive(Segments((-0.4, 1.0), (0.4, 0.4)))
    scene = Scene.of(lamp, bright, dark)

    @jax.jit
    def exact(x):
        return irradiance(scene, Receiver((x, 0.0), 0.0))

    def sines(x, *points):
        return [(px - x) / np.hypot(px - x, py) for px, py in points]

    x = 0.1
    a, b, c, d, e = sines(x, (-3.0, 1.2), (-0.4, 0.4), (0.0, 0.7), (0.4, 0.4), (3.0, 1.2))
    assert e > d > c > b > a
    # From below: lamp, the bright blade's lower side, the dark one in front from the crossing on.
    expected = (b - a) + 0.5 * (c - b) + (e - d)
    assert abs(exact(x) - expected) < 1e-12
    slope = jax.jit(jax.grad(exact))(x)
    h = 1e-6
    assert abs(slope - (exact(x + h) - exact(x - h)) / (2.0 * h)) < 1e-8


def test_a_crossing_moves_with_its_shapes():
    start = Scene.of(cross_of(0.0))

    def height(x):
        scene = Scene.of(cross_of(x), crossings=start.crossings)
        points, valid = scene.silhouettes(jnp.array([0.0, 0.0]))
        return jnp.where(valid[-1], points[-1, 0], jnp.nan)

    assert abs(height(0.3) - 0.3) < 1e-12
    assert abs(jax.grad(height)(0.3) - 1.0) < 1e-12


def test_traced_shapes_that_cross_unannounced_are_nan():
    lamp = primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0)
    others = {
        "segments": lambda y: primitive(Segments((-0.5, 0.4), (0.5, y)), emission=0.5),
        "circles": lambda y: primitive(Circles((0.5, y), 0.3), emission=0.5),
        "black": lambda y: primitive(Circles((0.5, y), 0.3)),
    }
    fixed = [primitive(Segments((0.2, 0.2), (0.2, 1.0))), primitive(Circles((0.5, 1.5), 0.25))]

    @jax.jit
    def E(y):
        at = Receiver((0.0, 0.0), 0.0)
        return [irradiance(Scene.of(lamp, *fixed, make(y)), at) for make in others.values()]

    # A blade through the post; a disc that cuts the other disc; then neither.
    assert jnp.isnan(E(0.5)[0])
    assert jnp.isnan(E(1.3)[1])
    assert jnp.isfinite(E(3.0)[1])
    assert jnp.isfinite(E(1.3)[2])  # black before black has no edge inside


def test_touching_is_no_crossing_for_traced_shapes_either():
    @jax.jit
    def E(x):
        roof = primitive(
            polyline(jnp.stack([jnp.stack([-x, 0.5]), jnp.stack([0.0, 1.0]), jnp.stack([x, 0.5])]))
        )
        lamp = primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0)
        return irradiance(Scene.of(lamp, roof), Receiver((0.0, 0.0), 0.0))

    assert jnp.isfinite(E(0.3))


def test_a_post_on_a_slanted_beam_does_not_cross_it_whichever_end_stands_there():
    rng = np.random.default_rng(1)
    a, b, top = rng.uniform(-1.0, 1.0, (3, 64, 2))
    foot = a + rng.uniform(0.2, 0.8, (64, 1)) * (b - a)  # off the beam by its rounding

    @jax.jit
    @jax.vmap
    def crosses(*ends):
        start, end = jnp.stack(ends).reshape(2, 2, 2)
        return any_crossing([Segments(start, end)], jnp.ones(2, bool))

    assert not jnp.any(crosses(a, foot, b, top))
    assert not jnp.any(crosses(a, top, b, foot))
    assert jnp.all(crosses(a, foot + 0.01 * (foot - top), b, top))


@pytest.mark.parametrize("shift", [0.0, 5.0, 1000.0])
@pytest.mark.parametrize("bits", [32, 64])
def test_a_crossing_is_one_wherever_the_scene_lies(shift, bits):
    with jax.enable_x64(bits == 64):
        ends = np.array([[-0.4, 0.4], [-0.4, 1.0], [0.4, 1.0], [0.4, 0.4]], f"float{bits}") + shift
        scene = Scene.of(primitive(Segments(ends[:2], ends[2:])))
        points, valid = scene.silhouettes(jnp.asarray(ends[0] - 1.0))
        assert valid[-1]
        assert points.dtype == f"float{bits}"
        assert jnp.max(jnp.abs(points[-1] - shift - jnp.array([0.0, 0.7]))) < 1e-4 * (1 + shift)


def test_a_crossing_goes_on_past_the_top_of_a_circle():
    def build(x):
        ring, post = Circles((0.0, 0.0), 1.0), Segments((x, 0.5), (x, 2.0))
        return primitive(post, name="post"), primitive(ring)

    start = Scene.of(*build(0.05))
    for x in (0.05, -0.02, -0.2):
        points, valid = Scene.of(*build(x), crossings=start.crossings).silhouettes(jnp.zeros(2) - 3)
        assert valid[-1]
        assert jnp.max(jnp.abs(points[-1] - jnp.array([x, np.sqrt(1.0 - x**2)]))) < 1e-12


def test_every_crossing_of_a_symmetric_scene_is_found_once():
    """Through the centre, and of equal circles, at simple fractions of a turn."""
    rng = np.random.default_rng(1)
    for turn in np.repeat(np.arange(16), 24):
        u = np.array([np.cos(np.pi * turn / 8.0), np.sin(np.pi * turn / 8.0)])
        center, radius = rng.normal(size=2).round(1), round(rng.uniform(0.1, 1.0), 2)
        bar = Segments(center - (radius + 0.5) * u, center + (radius + 0.5) * u)
        found = find_crossings([bar, Circles(center, radius)])
        assert found.numbers == ((0, 1), (0, 1))
        assert np.all((found.near >= 0.0) & (found.near < 1.0))
        for apart in (1.0, np.sqrt(2.0)):
            pair = Circles([center, center + apart * radius * u], radius)
            assert find_crossings([pair]).numbers == ((0, 1), (0, 1))


def test_far_from_the_origin_rounding_makes_no_crossing_and_hides_none():
    """Pieces of one line, that overlap: their ends are off it by what their numbers hold."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, np.pi, (200, 1))
    along = np.stack([np.cos(angle), np.sin(angle)], -1)
    across = np.stack([-np.sin(angle), np.cos(angle)], -1)
    place = rng.uniform(-1e6, 1e6, (200, 1, 2))

    @jax.jit
    @jax.vmap
    def crosses(start, end):
        return any_crossing([Segments(start, end)], jnp.ones(2, bool))

    start, end = (place + s[:, None] * along for s in (np.array([0.0, 0.3]), np.array([1.0, 1.5])))
    aside = np.array([[0.0], [0.3]]) * across
    assert not jnp.any(crosses(start, end))
    assert jnp.all(crosses(start - aside, end + aside))


def test_a_small_cross_beside_a_large_circle_is_one():
    ends = 1e-3 * np.array([[-0.4, -0.3], [-0.4, 0.3], [0.4, 0.3], [0.4, -0.3]], np.float32)
    groups = [Segments(ends[:2], ends[2:]), Circles(np.float32([3.0, 0.0]), np.float32(1.0))]
    assert jax.jit(lambda g: any_crossing(g, jnp.ones(3, bool)))(groups)
