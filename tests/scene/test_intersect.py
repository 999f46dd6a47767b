"""The search for the first hit: few shapes, many shapes, blocks that do not come out even."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Circles
from firstorder.numerics._batching import in_blocks
from firstorder.scene import _intersect as intersect
from firstorder.space import Ellipsoids, Rectangles

rng = np.random.default_rng(3)
BALLS = rng.uniform(-2.0, 2.0, (9, 3)), rng.uniform(0.1, 0.5, 9)
GROUPS = (
    Ellipsoids(BALLS[0], BALLS[1][:, None, None] * np.eye(3)),
    Rectangles([[0.0, 0.0, -3.0], [0.0, 0.0, 3.0]], np.stack([np.eye(3) * 3.5] * 2)),
)
ORIGINS = jnp.asarray(rng.uniform(-4.0, 4.0, (70, 3)))
ALONG = rng.normal(size=(70, 3))
ALONG = jnp.asarray(ALONG / np.linalg.norm(ALONG, axis=1, keepdims=True))
RANK = jnp.arange(11, dtype=jnp.int32)
NOWHERE = jnp.full(70, intersect.MISS)


def by_hand(along=ALONG):
    """Distances to all shapes in NumPy."""
    o, d = np.asarray(ORIGINS), np.asarray(along)
    t = np.full((70, 11), np.inf)
    for k, (c, r) in enumerate(zip(*BALLS, strict=True)):
        b = np.sum((o - c) * d, 1)
        square = b * b - np.sum((o - c) ** 2, 1) + r * r
        for root in (-1.0, 1.0):
            s = -b + root * np.sqrt(np.where(square > 0, square, np.nan))
            t[:, k] = np.minimum(t[:, k], np.where(s > 0, s, np.inf))
    for k, z in ((9, -3.0), (10, 3.0)):
        s = (z - o[:, 2]) / d[:, 2]
        q = o + s[:, None] * d
        inside = (s > 0) & np.all(np.abs(q[:, :2]) <= 3.5, 1)
        t[:, k] = np.where(inside, s, np.inf)
    return t


@pytest.mark.parametrize("chunk", [16, 4, 2, 1])
def test_the_nearest_shape_is_found(chunk):
    t = by_hand()
    true = np.where(np.isfinite(t.min(1)), t.argmin(1), intersect.MISS)
    assert {9, 10, intersect.MISS} < set(true)
    np.testing.assert_array_equal(
        intersect.first_of_block(GROUPS, RANK, (ORIGINS, ALONG, NOWHERE), chunk), true
    )


def test_blocks_do_not_change_the_answer():
    rays = ORIGINS, ALONG, NOWHERE
    whole = intersect.first_of_block(GROUPS, RANK, rays)
    cut = in_blocks(lambda r: intersect.first_of_block(GROUPS, RANK, r), rays, 32)
    np.testing.assert_array_equal(whole, cut)


@pytest.mark.parametrize("block", [None, 32, 7])
def test_blocks_that_do_not_come_out_even_have_one_answer(block):
    t = by_hand()
    true = np.where(np.isfinite(t.min(1)), t.argmin(1), intersect.MISS)
    rays = ORIGINS, ALONG, NOWHERE
    np.testing.assert_array_equal(intersect.first_shape(GROUPS, RANK, rays, block), true)


def test_the_distance_to_a_shape_is_that_of_the_one_that_is_asked():
    """To one for each ray, on which it may start, and to the same one for all."""
    k = np.arange(70)
    along = BALLS[0][k % 9] - ORIGINS
    along = along / jnp.linalg.norm(along, axis=1, keepdims=True)
    t = by_hand(along)
    near = t.argmin(1)
    on = np.where(k % 4 == 0, near, intersect.MISS)
    asked = np.where(k % 3 == 0, intersect.MISS, near)
    true = np.where((asked == intersect.MISS) | (asked == on), np.inf, t[k, asked])
    assert np.sum(np.isfinite(true)) > 20
    rays = ORIGINS, along, jnp.asarray(on)
    found = jax.jit(lambda asked: intersect.reached(GROUPS, asked, rays))(jnp.asarray(asked))
    np.testing.assert_allclose(found, true)
    one = int(near[1])
    found = jax.jit(lambda asked: intersect.reached(GROUPS, asked, rays))(jnp.asarray(one))
    np.testing.assert_allclose(found, np.where(on == one, np.inf, t[:, one]))


@pytest.mark.parametrize("chunk", [16, 4, 2, 1])
def test_far_surfaces_in_the_same_place_are_so_whatever_rounding_says(chunk):
    """Squares of one plane 1 km away, which lie in it otherwise: the highest rank counts."""
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    middle = 1000.0 * turn[:, 2]
    shifts = 3.0 * np.random.default_rng(5).normal(size=(4, 2)) @ turn[:, :2].T
    sizes = np.array([40.0, 50.0, 60.0, 70.0])
    walls = (Rectangles(middle + shifts, sizes[:, None, None] * turn),)
    ends = middle + np.random.default_rng(6).uniform(-20.0, 20.0, (70, 2)) @ turn[:, :2].T
    along = jnp.asarray(ends / np.linalg.norm(ends, axis=1, keepdims=True))
    rays = jnp.zeros((70, 3)), along, NOWHERE
    t = jax.vmap(lambda d: jax.vmap(lambda wall: wall.distance(rays[0][0], d, False))(walls[0]))
    assert np.any(np.ptp(np.asarray(t(along)), 1) > 0.0)  # rounding does tell them apart
    np.testing.assert_array_equal(
        intersect.first_of_block(walls, jnp.arange(4, dtype=jnp.int32), rays, chunk), 3
    )


def test_a_shape_does_not_meet_its_own_rays():
    t = by_hand()
    true = t.argmin(1)
    t[np.arange(70), true] = np.inf
    second = np.where(np.isfinite(t.min(1)), t.argmin(1), intersect.MISS)
    found = intersect.first_of_block(GROUPS, RANK, (ORIGINS, ALONG, jnp.asarray(true)))
    hit = np.isfinite(by_hand().min(1))
    np.testing.assert_array_equal(np.asarray(found)[hit], second[hit])


def test_what_stands_between_two_points_hides_one_from_the_other():
    t = by_hand()
    met = np.isfinite(t.min(1))
    t, a, d = t[met], ORIGINS[met], ALONG[met]
    first, near = jnp.asarray(t.argmin(1)), t.min(1)

    @jax.jit
    def hidden(share, on_a, on_b):
        return intersect.occluded(GROUPS, RANK, a, a + (share * near)[:, None] * d, on_a, on_b)

    nowhere = jnp.full(len(t), intersect.MISS)
    assert not np.any(hidden(0.99, nowhere, nowhere))
    assert np.all(hidden(1.01, nowhere, nowhere))
    assert not np.any(hidden(1.0, nowhere, first))
    assert np.all(hidden(1.01, nowhere, first))  # the front of a shape hides its back
    t[np.arange(len(t)), first] = np.inf
    np.testing.assert_array_equal(hidden(1.5, first, nowhere), t.min(1) < 1.5 * near)


def test_each_shape_answers_for_itself():
    first = intersect.picked(GROUPS, jnp.asarray(9), lambda shape: shape.center)
    np.testing.assert_allclose(first, [0.0, 0.0, -3.0])
    assert [len(numbers) for _, numbers in intersect.numbered(GROUPS)] == [9, 2]


@pytest.mark.parametrize("directions", [1, 70])
def test_free_ways_end_at_the_nearest_shape(directions):
    """Of all places in all directions, which may be the same everywhere, and of any length."""
    turned = [ALONG] if directions == 1 else [jnp.roll(ALONG, k, 0) for k in range(70)]
    rays = 3.0 * jnp.stack(turned)[:, :30]
    on = jnp.where(jnp.arange(70) % 3 == 0, 4, intersect.MISS)
    found = intersect.free_ways(GROUPS, ORIGINS, list(jnp.moveaxis(rays, -1, 0)), on)
    rays = jnp.broadcast_to(rays, (70, 30, 3))
    true = jnp.stack([
        jax.vmap(shape.distance, (0, 0, 0))(
            jnp.repeat(ORIGINS, 30, 0), rays.reshape(-1, 3), jnp.repeat(on == k, 30)
        )
        for k, shape in enumerate(each for g in GROUPS for each in rows(g))
    ])  # fmt: skip
    np.testing.assert_allclose(found, true.min(0).reshape(70, 30), rtol=1e-12)


def rows(group):
    """The shapes of a group one by one."""
    return [jax.tree.map(lambda a, k=k: a[k], group) for k in range(group.count)]


@pytest.mark.parametrize("count", [1, 5, 16, 17, 33, 50])
def test_of_shapes_close_behind_each_other_the_nearest_counts(count):
    """Squares a millionth of their distance apart, whatever their numbers and ranks."""
    draw = np.random.default_rng(count)
    order = draw.permutation(count)
    heights = 1.0 + 1e-6 * order
    walls = Rectangles(heights[:, None] * [0.0, 0.0, 1.0], np.stack([np.eye(3)] * count))
    rank = jnp.asarray(draw.permutation(count), jnp.int32)
    up = jnp.stack([jnp.zeros(40), jnp.linspace(-0.3, 0.3, 40), jnp.ones(40)], 1)
    up = up / jnp.linalg.norm(up, axis=1, keepdims=True)
    on = jnp.asarray(draw.integers(-1, count, 40))
    found = np.asarray(intersect.first_shape((walls,), rank, (jnp.zeros((40, 3)), up, on)))
    second = np.where(order == order.min(), count, order).argmin() if count > 1 else intersect.MISS
    first = order.argmin()
    # A rank stands for a shape: that which met is the rank's, and no ray meets its own shape.
    met = np.where(np.asarray(on) == first, second, first)
    np.testing.assert_array_equal(found, np.where(met < 0, -1, np.asarray(rank)[met]))


def test_of_shapes_in_one_place_the_highest_rank_counts():
    """One that shines before one that does not, and then the later one; in any chunk."""
    emission = np.zeros((20, 2))
    emission[[3, 11, 17], [0, 1, 0]] = 1.0
    rank = intersect.ranks(jnp.asarray(emission))
    true = np.arange(20) + 20 * (emission.max(1) > 0.0)
    np.testing.assert_array_equal(rank, true)
    some = np.array([2, 3, 17, 19])
    np.testing.assert_array_equal(intersect.ranks_among(rank, some), [0, 5, 6, 3])
    walls = Rectangles(np.tile([0.0, 0.0, 2.0], (20, 1)), np.stack([np.eye(3)] * 20))
    rays = (
        jnp.zeros((4, 3)),
        jnp.tile(jnp.array([0.0, 0.0, 1.0]), (4, 1)),
        jnp.array([-1, 17, 3, 19]),
    )
    for chunk in (1, 3, 16, 20):
        found = intersect.first_shape((walls,), rank, rays, chunk=chunk)
        np.testing.assert_array_equal(found, [17, 11, 17, 17])


def test_a_shape_that_is_nan_is_not_met_and_hides_nothing():
    balls = Ellipsoids(BALLS[0], BALLS[1][:, None, None] * np.eye(3))
    circles = Circles(BALLS[0][:, :2], BALLS[1])
    way = BALLS[0][np.arange(70) % 9] - ORIGINS
    for shapes, o, d in ((balls, ORIGINS, way), (circles, ORIGINS[:, :2], way[:, :2])):
        d = d / jnp.linalg.norm(d, axis=1, keepdims=True)
        unknown = jax.tree.map(lambda a: a.at[4].set(jnp.nan), shapes)
        without = jax.tree.map(lambda a: jnp.delete(a, 4, 0), shapes)
        rest = intersect.first_shape((without,), RANK[:8], (o, d, NOWHERE))
        found = jax.jit(lambda s, o, d: intersect.first_shape((s,), RANK[:9], (o, d, NOWHERE)))
        np.testing.assert_array_equal(found(unknown, o, d), rest + (rest > 3))
        assert jnp.sum(rest >= 0) > 20
        hidden = jax.jit(lambda s, o, d: intersect.occluded((s,), None, o, o + 3.0 * d))
        np.testing.assert_array_equal(hidden(unknown, o, d), hidden(without, o, d))
