import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import direction
from firstorder.flatland import (
    Circles,
    Scene,
    Segments,
    first_shape,
    intersect,
    nearest,
    occluded,
    primitive,
)
from firstorder.flatland._reference import reference_nearest
from tests.flatland.worlds import bean, everything

RNG = np.random.default_rng(7)
ORIGINS = RNG.uniform((-3.0, 0.05), (3.0, 3.5), (120, 2))
ANGLES = RNG.uniform(0.0, 2.0 * np.pi, 120)
ALONG = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)


@pytest.fixture(scope="module")
def slowly():
    return reference_nearest(everything(), ORIGINS, ALONG)


@pytest.mark.parametrize("chunk", [1, 16], ids=["one by one", "many at once"])
@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_the_fast_tracer_is_its_slow_twin(slowly, dtype, chunk, monkeypatch):
    monkeypatch.setattr(intersect, "_chunk", lambda groups: chunk)
    scene = everything(dtype)
    hits = jax.jit(lambda o, d: nearest(scene, o, d))(
        jnp.asarray(ORIGINS, dtype), jnp.asarray(ALONG, dtype)
    )
    t, index = slowly
    same = np.asarray(hits.index) == index
    # A ray that grazes an edge may pass it on the other side in single precision.
    assert np.mean(same) >= (1.0 if dtype == jnp.float64 else 0.99)
    far = np.where(np.isfinite(t), t, 0.0)[same]
    ours = np.where(np.isfinite(hits.t), hits.t, 0.0)[same]
    # Distances through a tangent lose half the digits.
    worst = np.max(np.abs(ours - far))
    assert worst < (1e-9 if dtype == jnp.float64 else 1e-3)
    assert hits.t.dtype == dtype


def test_blocks_and_the_rest_make_the_whole(slowly, monkeypatch):
    monkeypatch.setattr(intersect, "_block", lambda groups: 50)
    scene = everything()
    found = jax.jit(lambda o, d: intersect.first_shape(scene, o, d))(ORIGINS, ALONG)
    assert jnp.array_equal(found, slowly[1])


def test_a_hit_moves_with_the_ray():
    scene, o, d = everything(curve=False), jnp.asarray(ORIGINS[::6]), jnp.asarray(ALONG[::6])

    @jax.jit
    def distances(shift):
        t = nearest(scene, o + shift * jnp.array([0.6, -0.3]), d).t
        return jnp.where(jnp.isfinite(t), t, 0.0)

    h = 1e-6
    slopes = jax.jit(jax.jacfwd(distances))(0.0)
    by_differences = (distances(h) - distances(-h)) / (2.0 * h)
    assert jnp.max(jnp.abs(slopes - by_differences)) < 1e-6 * jnp.max(jnp.abs(slopes))


def test_between_two_points():
    scene = Scene.of(primitive(Segments((-1.0, 1.0), (1.0, 1.0))))
    a = jnp.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    b = jnp.array([[0.0, 2.0], [0.0, 0.9], [0.5, 1.0]])
    assert occluded(scene, a, b).tolist() == [True, False, False]
    # Beyond the last point by rounding: only what lies on a shape may end there.
    past = b.at[2, 1].add(1e-11)
    assert occluded(scene, a, past).tolist() == [True, False, True]
    ends = jnp.array([-1, -1, 0])
    assert occluded(scene, a, past, -1, ends).tolist() == [True, False, False]


def test_a_ray_does_not_meet_its_own_start():
    scene = everything()

    @jax.jit
    @jax.vmap
    def up(index):
        at = scene.frame(index, 0.3)
        hits = nearest(scene, at.position[None], at.normal[None], index)
        return hits.index[0], hits.t[0]

    index, t = up(jnp.arange(scene.count))
    assert jnp.all((index != jnp.arange(scene.count)) | (t > 1e-3))


CORNERS = np.random.default_rng(0).uniform(-1.0, 1.0, (256, 2))
MANY = Segments(CORNERS, CORNERS + 0.01)


@pytest.mark.parametrize(("shapes", "few"), [([MANY], 64), ([bean(0.4, 1.5, 0.4), MANY], 128)])
def test_rays_times_shapes_are_not_kept(shapes, few):
    """Nor are, where there is a curve, a ray's many brackets."""
    scene, o = Scene.of(*map(primitive, shapes)), jnp.zeros((1 << 15, 2))
    search = jax.jit(intersect.first_shape).lower(scene, o, o + 1.0).compile()
    memory = search.memory_analysis()
    assert memory is not None
    needed = memory.temp_size_in_bytes
    assert needed < few * o.size  # a few numbers a ray; rays times shapes would be 512 times o.size


def test_no_rays_meet_nothing():
    scene = Scene.of(primitive(Segments((-1.0, 1.0), (1.0, 1.0))))
    assert nearest(scene, jnp.zeros((0, 2)), jnp.zeros((0, 2))).t.shape == (0,)


def test_parallel_rays_miss_without_nan():
    scene = Scene.of(primitive(Segments((0.0, 0.0), (1.0, 0.0))))

    def distance(y):
        o = jnp.array([[-1.0, 0.0]]) + jnp.array([0.0, 1.0]) * y
        hits = nearest(scene, o, jnp.eye(2)[:1])
        return jnp.where(jnp.isfinite(hits.t[0]), hits.t[0], 0.0)

    assert distance(0.0) == 0.0
    assert jax.grad(distance)(0.0) == 0.0


def test_search_and_hit_agree_on_rays_that_graze():
    """Directions bisected to rounding between a hit and a miss, and their neighbours."""
    rng = np.random.default_rng(3)
    centers, radii = rng.uniform((-2.0, 1.0), (2.0, 3.0), (200, 2)), rng.uniform(0.1, 0.6, 200)
    for shapes in (Circles(centers, radii), Segments(centers, centers + rng.normal(size=(200, 2)))):
        for k in range(200):
            scene = Scene.of(primitive(jax.tree.map(lambda a, k=k: a[k : k + 1], shapes)))
            searched, hit = _grazing(scene)
            np.testing.assert_array_equal(searched, hit)


# As a user's program is compiled, whatever the tests are: rounding is what this is about.
@functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 3})
def _grazing(scene):
    """Whether grazing rays are hits for the search, and for the shape that it would find."""

    def met(angles):
        return first_shape(scene, jnp.zeros((angles.size, 2)), direction(angles)) >= 0

    angles = jnp.linspace(-np.pi, np.pi, 256)
    k = jnp.argmax(met(angles))

    def halve(_, ends):
        middle = 0.5 * (ends[0] + ends[1])
        hit = met(middle[None])[0]
        return jnp.where(hit, middle, ends[0]), jnp.where(hit, ends[1], middle)

    dark, _ = jax.lax.fori_loop(0, 60, halve, (angles[k], angles[k - 1]))
    near = dark + jnp.arange(-20, 21) * 1e-16
    t, _ = jax.vmap(lambda d: scene.hit(jnp.array(0), jnp.zeros(2), d))(direction(near))
    return met(near), jnp.isfinite(t)
