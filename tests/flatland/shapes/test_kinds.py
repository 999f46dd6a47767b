import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import direction
from firstorder.flatland import Arcs, Circles, Ellipses, Scene, Segments, primitive
from firstorder.flatland.shapes._base import Shape
from tests.flatland.worlds import bean

SHAPES = {
    "segment": Segments((0.2, -0.3), (1.1, 0.4)),
    "circle": Circles((0.3, 0.1), 0.8),
    "arc": Arcs((0.3, 0.1), 0.8, 2.1, -4.0),
    "ellipse": Ellipses((0.3, 0.1), (0.9, 0.4), 0.7),
    "curve": bean(0.3, 0.1, 0.8),
}
EVERY = pytest.mark.parametrize("name", SHAPES)


def only(shape):
    return jax.tree.map(lambda a: a[0], shape)


@EVERY
def test_one_shape_counts_as_one(name):
    assert SHAPES[name].count == 1
    assert Scene.of(primitive(SHAPES[name])).count == 1


@EVERY
def test_motion_has_its_own_derivatives(name):
    shape = only(SHAPES[name])
    s = jnp.linspace(0.05, 0.95, 7)
    _, v, a = jax.vmap(shape.motion)(s)
    position = lambda s: shape.motion(s)[0]  # noqa: E731
    assert jnp.allclose(v, jax.vmap(jax.jacfwd(position))(s), rtol=0.0, atol=1e-12)
    assert jnp.allclose(a, jax.vmap(jax.jacfwd(jax.jacfwd(position)))(s), rtol=0.0, atol=1e-10)


@EVERY
def test_a_ray_aimed_at_a_point_meets_it_or_something_nearer(name):
    shape, eye = only(SHAPES[name]), jnp.array([-1.5, 2.0])

    @jax.jit
    @jax.vmap
    def aimed(s):
        target = shape.motion(s)[0]
        far = jnp.linalg.norm(target - eye)
        t, found = shape.hit(eye, (target - eye) / far, jnp.array(False))
        return t - far, jnp.linalg.norm(shape.motion(found)[0] - eye) - t

    beyond, apart = aimed(jnp.linspace(0.02, 0.98, 49))
    assert jnp.max(beyond) < 1e-7
    assert jnp.min(jnp.abs(beyond)) < 1e-12
    assert jnp.max(jnp.abs(apart)) < 1e-10


@EVERY
def test_silhouettes_are_the_ends_of_what_is_seen(name):
    shape, eye = only(SHAPES[name]), jnp.array([-1.5, 2.0])
    points, valid = shape.silhouettes(eye, jnp.array(False))
    u = np.asarray(points - eye)[np.asarray(valid)]
    angles = np.arctan2(u[:, 1], u[:, 0])
    outline = np.asarray(jax.vmap(lambda s: shape.motion(s)[0])(jnp.linspace(0, 1, 20001)) - eye)
    seen = np.arctan2(outline[:, 1], outline[:, 0])
    assert abs(angles.min() - seen.min()) < 1e-7
    assert abs(angles.max() - seen.max()) < 1e-7


@pytest.mark.parametrize("name", ["circle", "ellipse", "curve"])
def test_closed_shapes_have_outward_normals(name):
    shape = only(SHAPES[name])
    c, v, _ = shape.motion(jnp.array(0.13))
    outward = c + 1e-3 * jnp.array([-v[1], v[0]]) / jnp.linalg.norm(v)
    inside = shape.hit(outward, jnp.array([0.6, 0.8]), jnp.array(False))[0]
    back = shape.hit(outward, (c - outward) / jnp.linalg.norm(c - outward), jnp.array(False))[0]
    assert abs(back - 1e-3) < 1e-12
    assert not jnp.isfinite(inside) or inside > 1e-3


@EVERY
def test_a_miss_is_infinite_with_a_gradient_of_zero(name):
    shape = only(SHAPES[name])

    def t(x):
        found = shape.hit(jnp.array([x, 5.0]), jnp.array([1.0, 0.0]), jnp.array(False))
        return jnp.where(jnp.isfinite(found[0]), found[0], 0.0) + found[1]

    assert jax.grad(t)(0.0) == 0.0


@EVERY
def test_the_distance_that_a_search_asks_for_is_that_of_the_hit(name):
    """From outside, from inside, and from the shape itself."""
    shape, rng = only(SHAPES[name]), np.random.default_rng(0)
    own = np.asarray(jax.vmap(shape.motion)(jnp.asarray(rng.uniform(0.05, 0.95, 400)))[0])
    origin = jnp.asarray(np.concatenate([rng.uniform(-1.5, 1.5, (800, 2)), own]))
    along = direction(jnp.asarray(rng.uniform(-np.pi, np.pi, 1200)))
    on = jnp.arange(1200) >= 800
    ask = jax.jit(jax.vmap(lambda *ray: (shape.distance(*ray), shape.hit(*ray)[0])))
    found, hit = (np.asarray(t) for t in ask(origin, along, on))
    assert 50 < np.isfinite(hit).sum() < 1150
    assert np.allclose(found, hit, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("past", [1e-3, 1e-15])
def test_a_near_miss_of_a_segment_keeps_the_place_that_it_misses(past):
    """Rounding may decide in two ways whether it is one, and 0 would be taken for a distance."""
    wall = jax.tree.map(lambda a: a[0], Segments((0.0, 2.0), (1.0, 2.0)))
    hit = jax.jit(lambda o: wall.hit(o, jnp.array([0.0, 1.0]), jnp.asarray(False)))
    for x, s in ((-past, -past), (1.0 + past, 1.0 + past)):
        t, at = hit(jnp.array([x, 0.0]))
        assert jnp.isinf(t)
        np.testing.assert_allclose(at, s, rtol=1e-12)


def test_from_inside_a_circle_the_far_side_is_met():
    t, _ = only(Circles((0.0, 0.0), 1.0)).hit(
        jnp.array([0.5, 0.0]), jnp.array([1.0, 0.0]), jnp.array(False)
    )
    assert t == 0.5


def test_an_arc_is_met_only_where_it_is():
    bowl = only(Arcs((0.0, 0.0), 1.0, 0.5 * np.pi, np.pi))  # lower half
    up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
    assert bowl.hit(jnp.zeros(2), down, jnp.array(False))[0] == 1.0
    assert not jnp.isfinite(bowl.hit(jnp.zeros(2), up, jnp.array(False))[0])
    # From above the open half, the near side is not there, the far one is.
    assert abs(bowl.hit(jnp.array([0.1, 2.0]), down, jnp.array(False))[0] - 2.0) < 1.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Circles((0.0, 0.0), -1.0), "`radius` must be positive, but is -1"),
        (lambda: Segments((0.0, np.nan), (1.0, 0.0)), "`start` must be finite"),
        (lambda: Ellipses((0.0, 0.0), (1.0, 0.0)), "`semi` must be positive"),
        (lambda: Arcs((0.0, 0.0), 1.0, 0.0, 0.0), "sweep.* must be positive"),
        (lambda: Circles([(0.0, 0.0), (1.0, 1.0)], [1.0] * 3), "`radius` must hold 2 shapes"),
    ],
)
def test_bad_shapes_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@EVERY
def test_the_side_that_is_met_is_that_of_the_normal_at_the_hit(name):
    """Its own rule against hit and motion: from outside, from inside, and from the shape itself."""
    shape = only(SHAPES[name])
    start = jnp.concatenate([jnp.array([[-1.5, 2.0]]), jax.vmap(shape.motion)(jnp.array([0.3]))[0]])
    middle = jnp.mean(jax.vmap(shape.motion)(jnp.linspace(0.0, 0.75, 4))[0], 0)
    eyes, own = jnp.concatenate([start, middle[None]]), jnp.array([False, True, False])
    along = direction(jnp.linspace(-3.1, 3.1, 400))

    def sides(eye, on):
        met = jax.vmap(lambda d: jnp.isfinite(shape.hit(eye, d, on)[0]))(along)
        mine = jax.vmap(lambda d: shape.front(eye, d, on))(along)
        return met, mine, jax.vmap(lambda d: Shape.front(shape, eye, d, on))(along)

    met, mine, true = (np.asarray(a) for a in jax.jit(jax.vmap(sides))(eyes, own))
    assert met.any()
    np.testing.assert_array_equal(mine[met], true[met])


@EVERY
def test_shapes_that_are_ready_stay_so_in_another_unit(name):
    """A curve once kept its pieces in metres."""
    shape, unit = SHAPES[name], jnp.asarray(0.25)
    found, plain = (only(s.in_unit(unit)) for s in (shape.ready(), shape))
    origin, along, on = jnp.array([-3.0, 0.4]), jnp.array([1.0, 0.0]), jnp.asarray(False)
    hits, seen = (
        [ask(shape) for shape in (found, plain)]
        for ask in (lambda s: s.hit(origin, along, on), lambda s: s.silhouettes(origin, on))
    )
    for ours, right in (hits, seen):
        for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(right), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12)
