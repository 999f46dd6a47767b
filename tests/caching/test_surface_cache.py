"""Caches with normals: the order of their error on a ball, and what the rotation is for."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import caching
from firstorder.caching import (
    Cache,
    Candidates,
    SurfaceCache,
    circular_regions,
    derivative_norm,
    displacement,
    fill_surface,
    hessian_along,
    radius_for,
)
from firstorder.space import Derivatives, Receiver, Scene, derivatives, disc, irradiance, primitive

LAMPS = np.array([[0.5, 0.3, 3.0], [-1.0, 0.8, 2.5]])


def lit(at):
    """Irradiance from two points, a smooth function of place and normal while they are seen."""
    away = LAMPS - at.position
    square = jnp.sum(away**2, -1)
    return jnp.sum(away @ at.normal / square**1.5)


@jax.jit
def known(at):
    """All derivatives of it, in a row of receivers."""
    return jax.vmap(lambda at: derivatives(lit, at))(at)


def on_ball(angles, R=1.0):
    """Receivers on top of a ball, by their angles along x and y from its pole."""
    angles = np.atleast_2d(angles)
    a = np.linalg.norm(angles, axis=-1, keepdims=True)
    aside = np.divide(angles, a, out=np.zeros_like(angles), where=a > 0.0)
    n = np.concatenate([np.sin(a) * aside, np.cos(a)], -1)
    return Receiver.at(R * n, n, S=-np.eye(2) / R)


def error_at(h, order, change=lambda d: d):
    """Largest error of one record at the pole, all around at angle h."""
    phi = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    around = on_ball(h * np.stack([np.cos(phi), np.sin(phi)], -1))
    pole = on_ball([0.0, 0.0])
    cache = SurfaceCache(pole, change(known(pole)), jnp.array([5.0]), order=order)
    return np.max(np.abs(cache(around).value - jax.vmap(lit)(around)))


def slope(order, change=lambda d: d):
    """Of the error's logarithm over that of the step."""
    h = 0.02 * np.array([1.0, 2.0, 4.0])
    errors = [error_at(step, order, change) for step in h]
    return np.polyfit(np.log(h), np.log(errors), 1)[0]


def without_turns(d):
    """Derivatives of a record that does not know of the rotation."""
    return eqx.tree_at(lambda d: d.gradient, d, d.gradient.at[..., 3:].set(0.0))


@pytest.mark.smoke
@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_error_on_a_ball_falls_by_one_order_more_than_the_expansion(order):
    assert abs(slope(order) - (order + 1.0)) < 0.15


def test_without_the_rotation_the_first_order_is_lost():
    assert abs(slope(1, without_turns) - 1.0) < 0.15
    assert error_at(0.02, 1) < error_at(0.02, 1, without_turns)


def test_without_the_mixed_derivatives_the_second_order_is_lost():
    def unmixed(d):
        return eqx.tree_at(lambda d: d.hessian, d, d.hessian.at[..., :3, 3:].set(0.0))

    assert abs(slope(2, unmixed) - 2.0) < 0.15


def test_the_missing_hessian_is_the_error_of_first_order():
    """`d^T H d / 2` against what the expansion of order 1 lacks, as the step shrinks."""
    pole, h, aside = on_ball([0.0, 0.0]), 1e-3, np.array([0.6, 0.8])
    d = known(pole)
    cache = SurfaceCache(pole, d, jnp.array([5.0]))
    there = on_ball(h * aside)
    missing = (jax.vmap(lit)(there) - cache(there).value)[0] / (0.5 * h**2)
    predicted = aside @ hessian_along(d, pole.S)[0] @ aside
    assert abs(missing / predicted - 1.0) < 5e-3
    # The whole second derivative along the ball also counts the fall away from the plane.
    whole = aside @ d.along(pole.S).hessian[0] @ aside
    assert abs(whole / predicted - 1.0) > 0.05


@pytest.mark.parametrize("seed", range(3))
def test_a_displacement_leads_from_one_receiver_to_the_other(seed):
    p, n = np.random.default_rng(seed).normal(size=(2, 2, 3))
    start, end = Receiver.at(p[0], n[0]), Receiver.at(p[1], n[1])
    there = start.displaced(displacement(start, end))
    np.testing.assert_allclose(there.position, end.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(there.normal, end.normal, rtol=0.0, atol=1e-12)


def test_a_displacement_undoes_one_with_both_derivatives_at_no_turn_too():
    at = Receiver.at((0.1, 0.2, 0.3), (0.3, 0.2, 1.0))

    def back(u):
        return displacement(at, at.displaced(u))

    @jax.jit
    @jax.vmap
    def both(u):
        return jax.jacfwd(back)(u), jax.hessian(back)(u)

    tilt = np.array([[0.0, 0.0], [1e-13, 0.0], [2e-6, 1e-6], [0.3, -0.2]])
    slope, bend = both(jnp.asarray(np.pad(tilt, ((0, 0), (3, 0)))))
    np.testing.assert_allclose(slope, np.broadcast_to(np.eye(5), (4, 5, 5)), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(bend, np.zeros((4, 5, 5, 5)), rtol=0.0, atol=1e-6)


def test_weights_are_one_over_the_distance_and_the_sine_of_the_turn():
    """Two records of values 1 and 3, on the spot and aside, turned by 30 and by 45 degrees."""
    at = Receiver.at(np.zeros((2, 3)), [(0.5, 0.0, np.sqrt(0.75)), (0.0, 1.0, 1.0)])
    d = jax.tree.map(jnp.zeros_like, known(at))
    d = eqx.tree_at(lambda d: d.value, d, jnp.array([1.0, 3.0]))
    cache = SurfaceCache(at, d, jnp.array([1.0, 0.5]), order=0)
    near, far = Receiver.at((0.1, 0.0, 0.0)), Receiver.at((0.6, 0.0, 0.0))
    first, second = 1.0 / (0.1 + 0.5), 1.0 / (0.2 + np.sqrt(0.5))
    np.testing.assert_allclose(cache(near).value, (first + 3.0 * second) / (first + second))
    assert cache(near).covered
    assert not cache(far).covered  # 0.6 + 0.5, though within the radius


def test_half_a_turn_is_a_turn():
    up, down = (Receiver.at((0.0, 0.0, 0.0), (0.0, 0.0, z)) for z in (1.0, -1.0))
    assert abs(np.linalg.norm(displacement(up, down)) - np.pi) < 1e-12
    np.testing.assert_array_equal(displacement(up, up), np.zeros(5))
    gradient = jax.jacfwd(lambda x: displacement(up, Receiver(x, up.axes, up.S)))(up.position)
    assert np.all(np.isfinite(gradient))


def test_on_a_tilted_floor_it_is_the_cache_of_the_plane():
    """Same records, circles and weights, in coordinates of the plane."""
    n = np.array([0.3, -0.2, 1.0])
    frame = Receiver.at((0.1, 0.2, -0.5), n)
    x = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 2))

    def place(x):
        return Receiver.at(frame.position + x @ frame.axes[:, :2].T, n)

    radius, d = jnp.linspace(0.3, 0.6, 5), known(place(x[:5]))
    assert d.gradient.shape == (5, 5)
    flat = Candidates.of(x[:5], d.value, d.gradient[:, :2], d.hessian[:, :2, :2])
    for order in (0, 1, 2):
        plane = Cache.of(flat, circular_regions(radius, 1e-3, 10.0, dims=2), order=order)
        found = SurfaceCache(place(x[:5]), d, radius, order=order)(place(x[5:]))
        np.testing.assert_allclose(found.value, plane(x[5:]).value, rtol=1e-10)
        np.testing.assert_array_equal(found.covered, plane(x[5:]).covered)


# --- a filled cache ------------------------------------------------------------------------------


def cap(count, reach=0.9, seed=2):
    """Receivers all over the top of a ball."""
    u, v = np.random.default_rng(seed).uniform(size=(2, count))
    a, phi = reach * np.sqrt(u), 2.0 * np.pi * v
    return on_ball(a[:, None] * np.stack([np.cos(phi), np.sin(phi)], -1))


def radii(at, d, tolerance):
    size = derivative_norm(hessian_along(d, at.S), 2)
    return np.clip(radius_for(size, tolerance, dims=2), 0.05, 1.0)


def filled(tolerance, change=lambda d: d, turn=True):
    """RMS error of a cache on a ball, and its number of records."""
    at, asked = cap(600), cap(300, seed=3)
    d = known(at)
    R = radii(at, d, tolerance)
    seen = at if turn else Receiver.at(at.position, (0.0, 0.0, 1.0))
    chosen = fill_surface(seen, R, np.arange(600))
    cache = SurfaceCache.of(at, change(d), R, chosen)
    return np.sqrt(np.mean((cache(asked).value - jax.vmap(lit)(asked)) ** 2)), cache.count


def test_a_filled_cache_needs_the_rotation():
    right, count = filled(1e-3)
    wrong, same = filled(1e-3, without_turns)
    assert count == same
    assert 5 < count < 60
    assert wrong > 2.0 * right


def test_the_turn_makes_records_denser_where_the_surface_bends():
    _, count = filled(1e-2)
    _, fewer = filled(1e-2, turn=False)
    assert count > fewer


def test_every_candidate_is_a_record_or_covered_by_one():
    at = cap(300)
    d = known(at)
    R = radii(at, d, 1e-2)
    chosen = fill_surface(at, R, np.random.default_rng(0).permutation(300))
    cache = SurfaceCache.of(at, d, R, chosen)
    assert np.all(cache(at).covered | chosen)
    np.testing.assert_allclose(
        cache(jax.tree.map(lambda a: a[chosen], at)).value, d.value[chosen], rtol=1e-6
    )


def test_exact_irradiance_of_a_disc_is_cached_on_a_ball():
    """The records that `space.derivatives` gives, and a curved surface under an area lamp."""
    lamp = disc((0.4, 0.2, 2.5), (-0.1, 0.0, -1.0), 0.5)
    scene = Scene.of(primitive(lamp, emission=1.0))
    pole, near = on_ball([0.0, 0.0]), on_ball([[0.03, 0.04], [0.06, 0.08]])
    d = jax.jit(jax.vmap(lambda at: derivatives(irradiance, scene, at)))(pole)
    E = jax.jit(jax.vmap(lambda at: irradiance(scene, at)))(near)
    for order in (1, 2):
        cache = SurfaceCache(pole, d, jnp.array([2.0]), order=order)
        one, two = np.abs(cache(near).value - E)
        assert 0.8 * 2.0 ** (order + 1) < two / one < 1.25 * 2.0 ** (order + 1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda at, d: SurfaceCache(at, d.translation(), jnp.ones(3)), "`derivatives` must be by"),
        (lambda at, d: SurfaceCache(at, d, jnp.zeros(3)), "`radius` must be positive"),
        (lambda at, d: SurfaceCache(at, d, jnp.ones(2)), "`derivatives`"),
        (lambda at, d: SurfaceCache(at, d, jnp.ones(3), order=3), "`order`"),
        (lambda at, d: SurfaceCache.of(at, d, np.ones(3), np.zeros(3, bool)), "at least one"),
        (
            lambda at, d: SurfaceCache.of(
                at, jax.tree.map(lambda a: a[:2], d), np.ones(3), np.array([False, False, True])
            ),
            r"`derivatives` must have shape \(3, 5\), but has \(2, 5\)",
        ),
        (lambda at, d: fill_surface(at, np.ones(2), [0]), "`radius`"),
        (lambda at, d: fill_surface(at, -np.ones(3), [0]), "`radius`"),
        (lambda at, d: hessian_along(d.rotation(), 0.0), "`derivatives` must be by"),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    at = cap(3)
    with pytest.raises(ValueError, match=words):
        make(at, known(at))


@pytest.mark.parametrize("visits", [[0, 2], [-1], [[0, 1]]])
def test_visits_are_numbers_of_receivers(visits):
    edge = Receiver.at(np.zeros((2, 3)), [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
    with pytest.raises(ValueError, match="`visits` must hold numbers"):
        fill_surface(edge, np.ones(2), visits)


def test_radii_may_be_a_list_and_receivers_are_a_row():
    zeros = jnp.ones(2), jnp.zeros((2, 5)), jnp.zeros((2, 5, 5))
    known = Derivatives(*zeros, Receiver.freedoms)
    row = Receiver.at(np.eye(3)[:2])
    assert caching.SurfaceCache(row, known, [1.0, 2.0])(row).value.tolist() == [1.0, 1.0]
    alone = Receiver.at((0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="must be a row of receivers"):
        caching.fill_surface(alone, np.ones(3), [0])
    with pytest.raises(ValueError, match="must be a row of receivers"):
        caching.SurfaceCache.of(alone, known, np.ones(2))
    with pytest.raises(ValueError, match="Argument `radius` must have shape"):
        caching.SurfaceCache(row, known, 1.0)


def test_in_single_precision_receivers_that_are_left_out_are_covered():
    """Filling once took the rim of double precision, and left out what no record covers."""
    x = np.zeros((64, 3), np.float32)
    x[:, 0] = 0.1 * np.arange(64, dtype=np.float32)
    x[1, 0] = 0.1 * (1.0 - 3e-7)
    at = Receiver.at(jnp.asarray(x), jnp.asarray([0.0, 0.0, 1.0], jnp.float32))
    zero = [jnp.zeros((64, *shape), jnp.float32) for shape in ((), (5,), (5, 5))]
    radius = jnp.full(64, 0.1, jnp.float32)
    chosen = fill_surface(at, radius, np.arange(64))
    cache = SurfaceCache.of(at, Derivatives(*zero, Receiver.freedoms), radius, chosen)
    assert np.all(chosen | np.asarray(cache(at).covered))
