"""Circles by depth: the view of many is that of rays, in every gap and wherever the receiver is."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp

from firstorder.flatland import (
    Arcs,
    Circles,
    Ellipses,
    Receiver,
    Scene,
    Segments,
    _depth_order,
    irradiance,
    primitive,
    view,
)
from firstorder.flatland._reference import reference_nearest
from tests.flatland.worlds import everything

COUNT = 48


def discs(rng, count=COUNT, low=(-1.0, -0.7), high=(1.0, 1.7)):
    """Centres and radii of discs that do not overlap; some nearly touch."""
    center, radius = np.zeros((0, 2)), np.zeros(0)
    while len(radius) < count:
        c = rng.uniform(low, high)
        free = np.min(np.linalg.norm(center - c, axis=1) - radius, initial=0.2)
        if free > 0.01:
            r = rng.choice([0.999, 0.5]) * min(free, 0.15)
            center, radius = np.vstack([center, c]), np.append(radius, r)
    return center, radius


def cluttered(seed=0, **options):
    """Discs among shapes of other kinds, before them and behind them in the scene's list."""
    rng = np.random.default_rng(seed)
    center, radius = discs(rng, **options)
    start = rng.uniform((-1.0, 0.0), (1.0, 1.5), (3, 2))
    return Scene.of(
        primitive(Segments((1.5, 2.0), (-1.5, 2.0)), emission=1.0),
        primitive(Segments(start, start + rng.normal(scale=0.1, size=(3, 2))), albedo=0.5),
        primitive(Arcs((0.3, 0.9), 0.3, 0.4, 2.0), albedo=0.5),
        primitive(Circles(center, radius), emission=rng.uniform(size=COUNT)),
        primitive(Ellipses((-0.6, 0.8), (0.2, 0.1), 0.5), emission=0.5),
    )


def assert_seen_as_by_rays(scene, at):
    """No gap of any width shows another shape than the first that a ray meets."""
    seen = view(scene, at)
    ends = np.asarray(seen.angles)
    wide = np.flatnonzero(np.diff(ends) > 1e-9)
    middle = 0.5 * (ends[wide] + ends[wide + 1]) + float(at.n)
    along = np.stack([-np.sin(middle), np.cos(middle)], -1)
    origins = np.broadcast_to(np.asarray(at.position), along.shape)
    truth = reference_nearest(scene, origins, along, int(at.on))[1]
    assert np.array_equal(truth, seen.seen[wide])
    return set(truth.tolist())


def test_the_power_is_the_product_of_both_distances_on_every_ray():
    x, y, angle, r, t = sp.symbols("x y angle r t", real=True)
    ray = (x + t * sp.cos(angle)) ** 2 + (y + t * sp.sin(angle)) ** 2 - r**2
    leading, _, last = sp.Poly(sp.expand(ray), t).all_coeffs()
    assert sp.simplify(last / leading - (x**2 + y**2 - r**2)) == 0  # Vieta
    assert not sp.simplify(last / leading).has(angle)


@pytest.mark.parametrize("seed", range(6))
def test_a_view_among_many_discs_is_that_of_rays(seed):
    scene = cluttered(seed)
    rng = np.random.default_rng(100 + seed)
    shown = set()
    for _ in range(8):
        at = Receiver(rng.uniform((-1.2, -0.8), (1.2, 1.8)), rng.uniform(-np.pi, np.pi))
        shown |= assert_seen_as_by_rays(scene, at)
    assert len(shown) > 15


@pytest.mark.parametrize("share", [0.0, 0.4, 0.75])
def test_on_a_disc(share):
    scene = cluttered(1)
    for number in range(5, 5 + COUNT, 9):
        assert_seen_as_by_rays(scene, Receiver.on_shape(scene, number, share))


def test_the_shape_on_which_a_receiver_lies_is_known_by_its_number_in_the_scene():
    # Behind the discs: it is not met where the receiver stands. A disc: no other shape is taken
    # for it that has its number among those that are no discs.
    center, radius = discs(np.random.default_rng(7), low=(-1.0, 0.6), high=(1.0, 1.7))
    scene = Scene.of(
        primitive(Segments((1.5, 2.0), (-1.5, 2.0)), emission=1.0),
        primitive(Segments((-1.0, -1.0), (1.0, -1.0))),  # in the ellipse
        primitive(Circles((0.0, 0.3), 0.1), albedo=0.5),
        primitive(Circles(center, radius), albedo=0.5),
        primitive(Ellipses((0.0, -1.0), (3.0, 1.05), 0.1)),
    )
    behind = 3 + COUNT
    assert_seen_as_by_rays(scene, Receiver.on_shape(scene, behind, 0.86))
    assert behind in assert_seen_as_by_rays(scene, Receiver.on_shape(scene, 2, 0.5))


def test_in_a_disc_only_its_wall_and_what_is_in_it_is_seen():
    scene = cluttered(2)
    index = 5 + int(np.argmax(scene.groups[2].radius))
    center = scene.groups[2].center[index - 5]
    assert assert_seen_as_by_rays(scene, Receiver(center + 0.01, 1.0)) >= {index}


def test_on_a_rim_that_the_receiver_does_not_name_a_ray_decides():
    far = 3.0 + 3.0 * np.arange(COUNT - 1.0)
    center = np.concatenate([[[0.0, 0.0]], np.stack([0.0 * far, far], -1)])
    scene = Scene.of(primitive(Circles(center, np.ones(COUNT)), emission=1.0))
    outward, inward = (view(scene, Receiver((0.0, 1.0), n)) for n in (0.0, np.pi))
    assert 1 in outward.seen
    assert 0 not in outward.seen
    assert set(np.asarray(inward.seen)[np.diff(inward.angles) > 0.0].tolist()) == {0}


def test_a_large_disc_hides_a_small_one_whose_middle_is_nearer():
    others = np.stack([np.linspace(-9.0, 9.0, COUNT - 2), np.full(COUNT - 2, 9.0)], -1)
    behind = 1.9 * np.array([np.sin(np.pi / 3.0), np.cos(np.pi / 3.0)])
    center = np.concatenate([[behind, [0.0, 2.2]], others])
    radius = np.array([0.05, 2.0, *np.full(COUNT - 2, 0.1)])
    scene = Scene.of(primitive(Circles(center, radius), emission=1.0))
    assert _depth_order.do_not_overlap(scene.groups[0])
    assert 0 not in assert_seen_as_by_rays(scene, Receiver((0.0, 0.0), 0.0))


def test_discs_that_come_to_overlap_are_seen_by_rays():
    scene = cluttered(3)
    grown = eqx.tree_at(lambda s: s.groups[2].radius, scene, scene.groups[2].radius * 1.4)
    assert _depth_order.do_not_overlap(scene.groups[2])
    assert not _depth_order.do_not_overlap(grown.groups[2])
    # Where they cross, the kept crossings do not say: each gap still shows what its middle shows.
    for x in (-0.5, 0.1, 0.8):
        assert_seen_as_by_rays(grown, Receiver((x, -0.75), 0.0))


def test_a_disc_in_a_disc_overlaps():
    nested = Circles(np.array([[0.0, 0.0], [0.1, 0.0]]), np.array([1.0, 0.1]))
    touching = Circles(np.array([[0.0, 0.0], [1.1, 0.0]]), np.array([1.0, 0.1]))
    assert not _depth_order.do_not_overlap(nested)
    assert _depth_order.do_not_overlap(touching)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_light_and_both_derivatives_are_those_by_rays(dtype, monkeypatch):
    rng = np.random.default_rng(4)
    center, radius = discs(rng)
    lamp = primitive(
        Segments(np.array([[1.5, 2.0]], dtype), np.array([[-1.5, 2.0]], dtype)), emission=1.0
    )
    scene = Scene.of(lamp, primitive(Circles(center.astype(dtype), radius.astype(dtype))))
    x = jnp.linspace(-1.0, 1.0, 40, dtype=dtype)

    def jets():
        def E(x):
            position = jnp.stack([x, jnp.asarray(-0.9, dtype)])
            return irradiance(scene, Receiver(position, jnp.zeros((), dtype)))

        each = (E, jax.grad(E), jax.grad(jax.grad(E)))
        return [jax.jit(jax.vmap(f))(x) for f in each]

    by_depth = jets()
    jax.clear_caches()
    monkeypatch.setattr(_depth_order, "MANY", COUNT + 1)
    by_rays = jets()
    jax.clear_caches()
    assert float(jnp.max(by_depth[0])) > 0.01
    for one, other in zip(by_depth, by_rays, strict=True):
        assert np.allclose(one, other, rtol=1e-5 if dtype == np.float32 else 1e-13, atol=0.0)


def test_a_row_of_scenes_is_each_of_them():
    scene = cluttered(5)
    at = Receiver((0.2, -0.8), 0.1)

    def seen(shift):
        moved = scene.groups[2].center + shift
        return view(eqx.tree_at(lambda s: s.groups[2].center, scene, moved), at)

    shifts = jnp.array([0.0, 1e-3, 2e-3])
    rows = jax.vmap(seen)(shifts)
    for k, shift in enumerate(shifts):
        assert np.array_equal(rows.seen[k], seen(shift).seen)


def test_one_scene_of_a_row_that_overlaps_is_asked_with_the_others():
    circles = cluttered(5).groups[2]

    def free(center, radius):
        return _depth_order.do_not_overlap(Circles(center, radius))

    radii = jnp.stack([circles.radius, 1.4 * circles.radius])
    center = jnp.stack([circles.center, circles.center])
    assert jax.vmap(free, (None, 0))(circles.center, radii).tolist() == [False, False]
    assert jax.vmap(free, (0, None))(center, circles.radius).tolist() == [True, True]
    assert jax.vmap(jax.vmap(free, (0, None)), (None, 0))(center, radii).tolist() == [
        [False, False],
        [False, False],
    ]


@pytest.mark.parametrize("places", [1, 2, 7, 64, 65])
def test_the_first_cover_is_that_of_a_loop(places):
    rng = np.random.default_rng(places)
    for n in (1, 3, 40):
        first = rng.integers(0, places, n)
        stop = np.minimum(first + rng.integers(-2, places + 1, n), places)
        truth = np.full(places, n)
        for k in reversed(range(n)):
            truth[first[k] : max(stop[k], first[k])] = k
        found = _depth_order.first_cover(jnp.asarray(first), jnp.asarray(stop), places)
        assert np.array_equal(found, truth)


def test_each_kind_says_how_many_silhouettes_it_gives():
    scene = everything()
    assert len(scene.groups) == 5
    expected = sum(group.count * group.silhouette_count for group in scene.groups)
    points, _ = scene.silhouettes(jnp.array([0.1, 0.2]))
    assert len(points) == expected + len(scene.crossings.pairs)
