import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from figures.j12.shared.scenes import counted
from firstorder.checks.statistics import LEVEL, chi_square, error_slope, z_test, z_test_of
from firstorder.flatland import Circles, PointLights, Receiver, Scene, Segments, box, primitive
from firstorder.flatland.bounces import _scatter as scattering
from firstorder.flatland.bounces import pathtrace
from firstorder.flatland.bounces._scatter import Surface, scatter
from firstorder.flatland.bounces.pathtrace import path_irradiance, path_radiance, tree_irradiance
from firstorder.flatland.library._scenes import scene_b, scene_d
from firstorder.flatland.skies import ConstantSky, GaussianSky
from firstorder.sampling import estimate
from tests.flatland.worlds import two_rooms
from tests.precision import as_dtype

X = np.array([-0.9, -0.35, 0.0, 0.13, 0.6])
FLOOR = Receiver(np.stack([X, 0 * X], -1), 0 * X, jnp.zeros(5, int))


def lamp_minus_blocker(x, blocked):
    """Scenes A and B in closed form: differences of sines, the blocker's shadow on the lamp."""

    def sine(a, h=1.0):
        return (a - x) / np.hypot(a - x, h)

    E = sine(0.5) - sine(-0.5)
    if blocked:
        low, high = (np.clip(x + 2.0 * (b - x), -0.5, 0.5) for b in (-0.2, 0.2))
        E = E - (sine(high) - sine(low))
    return E


# --- direct light --------------------------------------------------------------------------------


@functools.cache
def line_light(blocked):
    """Scene B, or A as a scene of the same structure, its blocker out of the way."""
    scene = scene_b()
    if not blocked:
        away = jnp.zeros_like(scene.groups[0].start).at[2].add(jnp.array([0.0, -9.0]))
        lines = Segments(scene.groups[0].start + away, scene.groups[0].end + away)
        scene = eqx.tree_at(lambda s: s.groups, scene, (lines,))
    return scene


@pytest.mark.smoke
@pytest.mark.parametrize("blocked", [False, True])
@pytest.mark.parametrize("next_event", [False, True])
def test_scenes_a_and_b_are_their_closed_forms(blocked, next_event, key):
    E = path_irradiance(
        line_light(blocked), FLOOR, key=key, paths=20_000, next_event=next_event, lanes=500
    )
    assert z_test_of(E, lamp_minus_blocker(X, blocked)).passed
    assert not z_test_of(E, lamp_minus_blocker(X, not blocked)).passed
    assert E.mean.dtype == jnp.float64
    assert float(jnp.max(E.error)) < 0.01


def test_the_error_falls_with_the_square_root(key):
    """And the error bar says how large it is."""
    counts, truth = (500, 2000, 8000, 32_000), lamp_minus_blocker(X, True)
    runs = [path_irradiance(line_light(True), FLOOR, key=key, paths=n, lanes=500) for n in counts]
    fit = error_slope(counts, [np.sqrt(np.mean(np.square(E.error))) for E in runs])
    assert abs(fit.slope + 0.5) < 0.02
    z = np.stack([E.z(truth) for E in runs])
    assert z_test(z, 1.0, 0.0).passed


# --- light after many reflections ----------------------------------------------------------------

E0, RHO = 0.7, 0.6


@functools.cache
def furnace(circles=1):
    """A closed room in which everything shines and reflects alike: `L = e / (1 - rho)`."""
    room = primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), emission=E0, albedo=RHO)
    return Scene.of(room, primitive(Circles((0.4, 0.6), 0.2), emission=E0, albedo=RHO))


INSIDE = Receiver([[0.02, 0.0], [0.5, 0.0], [0.7, 0.3]], [0.0, 0.0, 2.0], jnp.array([0, 0, -1]))
ROOM = {"lanes": 256}
FURNACE = 2.0 * E0 / (1.0 - RHO)


@pytest.mark.parametrize("how", [{}, {"next_event": False}, {"survival": 0.3}])
def test_a_furnace_is_even(how, key):
    E = path_irradiance(furnace(), INSIDE, key=key, paths=20_000, **ROOM, **how)
    assert z_test_of(E, FURNACE).passed
    assert float(jnp.max(E.error)) < 0.1


@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_a_furnace_after_so_many_reflections(bounces, key):
    E = path_irradiance(furnace(), INSIDE, key=key, paths=20_000, bounces=bounces, **ROOM)
    truth = 2.0 * E0 * (1.0 - RHO ** (bounces + 1)) / (1.0 - RHO)
    assert z_test_of(E, truth).passed
    assert not z_test_of(E, truth / RHO).passed


def test_a_tree_is_the_same_light_cut_off(key):
    """J12 (28) with one reflection; lights are met by chance."""
    E = tree_irradiance(furnace(), INSIDE, key=key, branches=(4, 2), runs=400)
    # In a furnace every ray finds the same: no noise at all (the ledger has a noisy tree).
    np.testing.assert_allclose(E.mean, 2.0 * E0 * (1.0 + RHO), rtol=1e-12)
    assert float(jnp.max(E.error)) < 1e-12


def test_a_tree_counts_the_sky_once(key):
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), albedo=RHO)
    scene = Scene.of(floor, environment=ConstantSky(0.5))
    E = tree_irradiance(scene, Receiver((0.3, 0.0), 0.0, on=0), key=key, branches=(4, 2), runs=9)
    np.testing.assert_allclose(E.mean, 2.0 * 0.5, rtol=1e-12)


def wrong(change):
    """A scatter that is wrong in one place."""

    def twin(surface, out, u, glossy):
        return change(scatter(surface, out, u, glossy), surface, out)

    return twin


def twin(**changes):
    return lambda right, surface, out: dataclasses.replace(right, **{
        k: f(right, surface, out) for k, f in changes.items()
    })  # fmt: skip


FAULTS = {
    # Paths that do not know how probable their length was: roulette without its weight.
    "the length's probability is left out of pdf_i": twin(
        weight=lambda t, s, o: t.weight * jnp.where(s.albedo > 1.0, 1.0, 0.6)
    ),
    "a density twice as high in the balance": twin(density=lambda t, s, o: 2.0 * t.density),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_path_is_noticed(fault, key):
    E = path_irradiance(
        furnace(), INSIDE, key=key, paths=20_000, scatter=wrong(FAULTS[fault]), **ROOM
    )
    assert bool(jnp.all(jnp.isfinite(E.mean)))
    assert not z_test_of(E, FURNACE).passed


def _unweighted(right):
    def roulette(u, chance):
        on, _, again = right(u, chance)
        return on, jnp.ones_like(chance), again

    return roulette


def test_a_roulette_without_its_weight_is_noticed(key, monkeypatch):
    monkeypatch.setattr(pathtrace, "roulette", _unweighted(pathtrace.roulette))
    plain = pathtrace._traced.__wrapped__  # pyright: ignore[reportFunctionMemberAccess]
    monkeypatch.setattr(pathtrace, "_traced", eqx.filter_jit(lambda *a: plain(*a)))  # trace again
    E = path_irradiance(furnace(), INSIDE, key=key, paths=20_000, **ROOM)
    assert not z_test_of(E, FURNACE).passed
    # Where the number of reflections is given there is no roulette to get wrong.
    E = path_irradiance(furnace(), INSIDE, key=key, paths=20_000, bounces=3, **ROOM)
    assert z_test_of(E, FURNACE * (1.0 - RHO**4)).passed


def test_both_ways_to_look_for_light_agree(key):
    """Glossy, mirror, sky, emitting circle, point light: two estimators that share few terms."""
    scene, at = _mixed(), _around(_mixed(), 0)
    with_lights = path_irradiance(scene, at, key=key, paths=500, lanes=32)
    by_chance = path_irradiance(
        scene, at, key=jax.random.key(1), paths=500, next_event=False, lanes=32
    )
    error = np.hypot(with_lights.error, by_chance.error)
    assert z_test(with_lights.mean, error, by_chance.mean).passed
    total = np.sum(by_chance.mean), np.sqrt(np.sum(error**2))
    assert z_test(np.sum(with_lights.mean), total[1], total[0]).passed
    assert total[1] < 0.03 * total[0]


def _around(scene, index):
    """Receivers along a shape, in the middles of 64 strata."""
    s = (jnp.arange(64) + 0.5) / 64
    frame = _frames(scene, jnp.asarray(index), s)
    return Receiver(frame.position, frame.n, np.full(64, index))


@eqx.filter_jit
def _frames(scene, index, s):
    return jax.vmap(lambda t: scene.frame(index, t))(s)


def _mixed():
    return Scene.of(
        primitive(Segments((-1.0, 0.0), (2.0, 0.0)), albedo=0.4, specular=0.5, exponent=20.0),
        primitive(Segments((1.2, 0.0), (1.2, 1.0)), albedo=0.1, mirror=0.8),
        primitive(Circles((0.4, 0.8), 0.15), emission=1.0, albedo=0.5),
        points=PointLights((-0.5, 0.5), 0.3),
        environment=GaussianSky(0.3, 0.4),
    )


def test_reciprocity_between_two_surfaces(key):
    """What A sends B, B sends A, past a glossy floor and a mirror: `L_A int_B E = L_B int_A E`."""
    scene = _mixed()
    scene = eqx.tree_at(
        lambda s: (s.points.intensity, s.environment.radiance), scene, replace_fn=lambda a: 0.0 * a
    )
    sent = []
    for light, lit in ((2, 0), (0, 2)):
        emission = jnp.zeros((3, 2)).at[light, 0].set(1.0)
        there = eqx.tree_at(lambda s: s.material.emission, scene, emission)
        E = path_irradiance(there, _around(there, lit), key=key, paths=500, lanes=32)
        length = float(there.length(lit))
        sent.append((length * E.mean.mean(), length * np.sqrt(np.mean(E.error**2) / 64)))
    (ab, error_ab), (ba, error_ba) = sent
    assert z_test(ab, np.hypot(error_ab, error_ba), ba).passed
    assert np.hypot(error_ab, error_ba) < 0.04 * ab


def test_scene_d_is_what_counted_rays_make_of_it(key):
    """The radiosity solution at 10^6 paths is in figures/j12_fig03; here NumPy counts rays."""
    x = np.array([0.06, 0.3, 0.5, 0.9])
    fine, direct = counted(x, True, 64, 2880)
    bound = np.max(np.abs(fine - counted(x, True, 48, 2160)[0]))
    at = Receiver(np.stack([x, 0 * x], -1), 0 * x, jnp.zeros(4, int))
    E = path_irradiance(scene_d(), at, key=key, paths=20_000)
    assert bound < 2e-3
    assert z_test_of(E, fine, truth_error=bound).passed
    assert not z_test_of(E, direct).passed


# --- surfaces ------------------------------------------------------------------------------------

ANGLES = np.array([-1.3, -0.6, 0.0, 0.9])
reflect = eqx.filter_jit(scattering.reflect)


def surface(specular=0.5, exponent=7.0, albedo=0.3, mirror=0.0):
    return Surface(*(jnp.asarray(v) for v in (albedo, mirror, specular, exponent, 0.0)))


def direction(a):
    return np.sin(a), np.cos(a)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 7.0, 200.0])
def test_surfaces_reflect_their_share_and_reciprocally(exponent):
    a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)
    m = surface(exponent=exponent)
    for out in ANGLES:
        f, density = reflect(m, direction(out), *direction(a))
        share, drawn = np.trapezoid(f, a), np.trapezoid(density, a)
        assert share <= 0.8 + 1e-6
        assert drawn <= 1.0 + 1e-6
        if out == 0.0:
            assert abs(share - 0.8) < 1e-4
    theta, phi = np.meshgrid(ANGLES, ANGLES)
    f = reflect(m, direction(phi), *direction(theta))[0] / np.cos(theta)
    np.testing.assert_allclose(f, f.T, rtol=1e-12)


def test_scattered_directions_follow_their_density(key):
    """And weight times density is the BRDF times the cosine."""
    u = jax.random.uniform(key, (50_000, 3))
    out = direction(np.full(50_000, 0.7))
    m = jax.tree.map(lambda a: np.full(50_000, a), surface(exponent=12.0))
    turned = eqx.filter_jit(scatter)(m, out, u)
    above = np.asarray(turned.cosine) > 0.0
    a = np.arctan2(turned.sine, turned.cosine)
    edges = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 41)
    middle = (edges[:-1, None] + (edges[1] - edges[0]) * (np.arange(50) + 0.5) / 50).ravel()
    f, density = reflect(surface(exponent=12.0), direction(0.7), *direction(middle))
    inside = np.asarray(density).reshape(40, 50).mean(1) * (edges[1] - edges[0])
    seen = [*np.histogram(a[above], edges)[0], (~above).sum()]
    assert chi_square(seen, 50_000 * np.append(inside, 1 - inside.sum())) > LEVEL
    other = reflect(surface(exponent=12.0), direction(-0.7), *direction(middle))[1]
    mirrored = np.asarray(other).reshape(40, 50).mean(1) * (edges[1] - edges[0])
    wrong = 50_000 * np.append(mirrored, 1 - mirrored.sum())
    assert chi_square(seen, wrong) < LEVEL
    share = estimate(turned.weight)
    assert z_test_of(share, np.sum(f) * (middle[1] - middle[0]), truth_error=1e-5).passed


def test_a_mirror_shows_the_lamp_and_a_gloss_its_blur(key):
    """Radiance along single rays: exact in a mirror, an integral over the lamp in a gloss."""
    lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=2.0)
    rays = jnp.array([[-1.0, 0.5], [1.0, 0.8]]), jnp.array([[1.0, -1.0], [-1.0, -1.0]]) / 2**0.5
    floor = primitive(
        Segments([(-2.0, 0.0), (0.0, 0.0)], [(0.0, 0.0), (2.0, 0.0)]),
        mirror=jnp.array([0.8, 0.0]),
        specular=jnp.array([0.0, 0.6]),
        exponent=9.0,
    )
    L = path_radiance(Scene.of(lamp, floor), *rays, key=key, paths=20_000)
    ends = np.arctan2(-(np.array([0.5, -0.5]) - 0.2), 1.0)  # from (0.2, 0)
    t, w = np.polynomial.legendre.leggauss(60)
    a = 0.5 * (ends[1] + ends[0]) + 0.5 * (ends[1] - ends[0]) * t
    f, _ = reflect(surface(0.6, 9.0, 0.0), direction(-0.25 * np.pi), *direction(a))
    truth = 2.0 * 0.5 * (ends[1] - ends[0]) * np.sum(w * np.asarray(f))
    # The mirror is met at (-0.5, 0), and throws the ray to (0.5, 1), the end of the lamp.
    assert z_test_of(L, np.array([1.6, truth])).passed
    assert float(L.error[0]) == pytest.approx(2.0 * np.sqrt(0.8 * 0.2 / 20_000), rel=0.02)


# --- manners -------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize("lamps", [(1.0,), (1.0, 1.0), (3.0, 1.0)])
def test_of_lamps_in_one_place_the_last_is_sampled(lamps, turn, key):
    """Drawn on a wall, each of length 1 at a height of 1 over the receiver."""
    T = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    start, end = np.array([0.5, 1.0]) @ T, np.array([-0.5, 1.0]) @ T
    wall = primitive(Segments(np.array([1.0, 1.0]) @ T, np.array([-1.0, 1.0]) @ T))
    scene = Scene.of(wall, *(primitive(Segments(start, end), emission=L) for L in lamps))
    at = Receiver(np.zeros(2), turn, -1)
    E = path_irradiance(scene, at, key=key, paths=8192, bounces=0)
    assert z_test_of(E, 2.0 * np.sin(np.arctan(0.5))).passed


def test_no_light_passes_a_wall_that_two_rooms_share(key):
    """Each room draws it, and neither lies along the axes."""
    scene, beside = two_rooms(0.3)
    assert path_irradiance(scene, beside, key=key, paths=4096).mean == 0.0


def test_single_precision(key):
    scene = as_dtype(line_light(True), jnp.float32)
    at = Receiver(
        jnp.asarray(FLOOR.position, jnp.float32), jnp.asarray(FLOOR.n, jnp.float32), FLOOR.on
    )
    E = path_irradiance(scene, at, key=key, paths=20_000, lanes=500)
    assert E.mean.dtype == E.error.dtype == jnp.float32
    assert z_test_of(E, lamp_minus_blocker(X, True), truth_error=1e-5).passed


def test_what_one_receiver_finds_does_not_depend_on_the_others(key):
    others = Receiver(FLOOR.position.at[1:, 0].add(0.1), FLOOR.n, FLOOR.on)
    row, other = (
        path_irradiance(line_light(True), at, key=key, paths=1000, lanes=500)
        for at in (FLOOR, others)
    )
    assert row.mean[0] == other.mean[0]
    assert bool(jnp.all(row.mean[1:] != other.mean[1:]))


def test_a_ray_may_be_given_in_whole_numbers(key):
    ray = jnp.array([0, 0]), jnp.array([0, 1])
    assert path_radiance(line_light(False), *ray, key=key, paths=2).mean == 1.0


def test_bad_arguments_are_one_sentence(key):
    scene = line_light(True)
    with pytest.raises(ValueError, match=r"^Argument `paths` must be at least 2, but is 1\.$"):
        path_irradiance(scene, FLOOR, key=key, paths=1)
    with pytest.raises(ValueError, match="`bounces` must not be negative"):
        path_irradiance(scene, FLOOR, key=key, paths=9, bounces=-1)
    with pytest.raises(ValueError, match="`survival` must lie in"):
        path_irradiance(scene, FLOOR, key=key, paths=9, survival=1.5)
    with pytest.raises(ValueError, match="`branches` must hold positive"):
        tree_irradiance(scene, FLOOR, key=key, branches=(), runs=9)
    assert scattering.scatter is scatter
