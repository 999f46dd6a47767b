import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks import _meetings, certificates, certified
from firstorder.checks._interval import exact
from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    Ellipses,
    GaussianSky,
    PointLights,
    Receiver,
    Scene,
    Segments,
    irradiance,
    primitive,
)
from firstorder.flatland.library import fig15, named_scene, scene_a, scene_b
from firstorder.flatland.shapes._crossings import Crossings
from tests.checks.certified_scenes import (
    Receivers,
    aligned,
    anywhere,
    nasty,
    shipped,
    together,
    trial,
)
from tests.checks.forty_digits import exact_irradiance

NASTY = (0, 1)


def true_error(scene, at):
    """The error of `irradiance`, by forty digits."""
    E = float(irradiance(scene, at))
    return abs(float(exact_irradiance(scene, at.position, at.n, int(at.on)) - E))


def crossed(crossings=None):
    """A lamp seen past a disc and an arc that cross each other and a strip."""
    return Scene.of(
        primitive(Segments((1.0, 1.5), (-1.0, 1.5)), emission=1.0),
        primitive(Segments((-0.6, 0.7), (0.6, 0.8)), emission=(0.0, 0.5)),
        primitive(Circles((0.2, 0.75), 0.2), emission=2.0),
        primitive(Arcs((-0.1, 0.7), 0.3, 0.2, 2.5), emission=(0.3, 0.7)),
        crossings=crossings,
    )


# --- certificates hold ----------------------------------------------------------------------------


def test_certificates_of_shipped_scenes_hold_and_nearly_all_are_given():
    rng = np.random.default_rng(0)
    scenes = dict(shipped())
    assert len(scenes) >= 13
    names = ("scene_b", "scene_d", "fig15", "e11_fig03", "shadow.toml")
    found = together([trial(scenes[n], anywhere(scenes[n], 60, rng)) for n in names])
    assert found.wrong == 0
    assert np.mean(found.certified) >= 0.99
    assert np.max(found.bound) < 1e-12


@pytest.mark.parametrize("seed", NASTY)
def test_certificates_of_nasty_scenes_hold(seed):
    scene = nasty(seed)
    found = trial(scene, aligned(scene, 40, np.random.default_rng(seed)))
    assert found.wrong == 0
    assert 0.3 < np.mean(found.certified) < 1.0


def test_shapes_that_cross_are_certified_and_a_hundredth_of_the_bound_is_refuted():
    scene = crossed()
    found = trial(scene, anywhere(scene, 60, np.random.default_rng(1)))
    assert found.wrong == 0
    assert np.all(found.certified)
    assert found._replace(bound=found.bound / 100.0).wrong > 0


# --- and wrong ones are refuted -------------------------------------------------------------------


def without_crossings(*shapes):
    """The pairs of shapes that may meet, with none of those that cross."""
    none = np.zeros((0, 2), np.int32)
    return _meetings.meetings(*shapes)._replace(straight=none, mixed=none, round=none)


def test_crossings_that_both_leave_out_are_refuted_and_those_of_the_scene_alone_are_noticed(
    monkeypatch,
):
    """Where `irradiance` errs the bound is as large, since it does not use the same crossings."""
    scene = crossed(Crossings((), jnp.zeros((0, 2))))
    at = anywhere(scene, 40, np.random.default_rng(2))
    found = trial(scene, at)
    assert found.wrong == 0
    assert np.max(found.error) > 1e-3
    monkeypatch.setattr(certificates, "meetings", without_crossings)
    assert trial(scene, at).wrong > 0


def just_behind(angle):
    """A dark wall, and behind it, by a little more than rounding, a lamp."""
    way = np.array([np.cos(angle), np.sin(angle)])
    ends = [np.array([0.0, 1.0]) + s * way for s in (-1.0, -0.3, 0.4, 1.0)]
    behind = [end + np.array([0.0, 1e-15]) for end in ends[1:3]]
    wall = primitive(Segments(ends[0], ends[3]), albedo=0.5)
    return Scene.of(wall, primitive(Segments(*behind), emission=1.0, two_sided=True))


def brightest(world, met):
    """The most that may be first, as if that were sure."""
    reach = jnp.min(jnp.where(met.sure, met.t.hi, jnp.inf))
    L = jnp.where(met.sure & (met.t.lo <= reach), jnp.max(world.emission[met.number], -1), 0.0)
    return exact(jnp.max(L)), jnp.array(True)


def test_an_order_in_depth_that_is_not_checked_is_refuted(monkeypatch):
    """`irradiance` sees the lamp, since it takes both to be in one place."""
    rows = np.linspace(-0.3, 0.3, 12)
    at = Receivers(np.stack([rows, 0.0 * rows], -1), 0.0 * rows, np.full(rows.size, -1))
    scene = just_behind(0.3)
    found = trial(scene, at)
    assert found.wrong == 0
    assert np.max(found.error) > 0.1
    assert not np.any(found.certified)
    monkeypatch.setattr(certificates, "_first", brightest)
    assert trial(scene, at).wrong > 0


def test_an_irradiance_that_is_off_is_noticed(monkeypatch):
    scene, at = scene_b(), Receiver((0.3, 0.0), 0.0)
    E = irradiance(scene, at)
    monkeypatch.setattr(certificates, "irradiance", lambda scene, at: E * (1.0 + 1e-9))
    assert 1.0001 > certified(scene, at).error / (1e-9 * E) > 0.9999


# --- events ---------------------------------------------------------------------------------------


@pytest.mark.smoke
def test_two_edges_in_line_are_not_certified_but_bounded_and_beside_the_line_they_are():
    scene = scene_b()
    for x in (-0.1, 0.1):
        at = Receiver((x, 0.0), 0.0)
        proof = certified(scene, at)
        assert not proof.certified
        assert true_error(scene, at) <= proof.error < 1e-13
    for x in (-0.1 - 1e-13, -0.1 + 1e-13):
        assert certified(scene, Receiver((x, 0.0), 0.0)).certified


def test_corners_that_two_shapes_share_are_no_events():
    scene = fig15()
    on_floor = lambda x: certified(scene, Receiver.on_shape(scene, 0, x))  # noqa: E731
    proofs = jax.jit(jax.vmap(on_floor))(jnp.linspace(0.013, 0.987, 50))
    assert jnp.all(proofs.certified)
    assert jnp.max(proofs.error) < 2e-14


def test_of_segments_on_one_line_the_lamp_is_seen():
    wall = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), albedo=0.5)
    lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    for things in ((wall, lamp), (lamp, wall)):
        scene, at = Scene.of(*things), Receiver((0.2, 0.0), 0.1)
        proof = certified(scene, at)
        assert proof.certified
        assert true_error(scene, at) <= proof.error < 1e-14


def test_a_receiver_says_on_what_it_lies():
    slanted = primitive(Segments((-1.0, -0.3), (1.1, 0.4)), albedo=0.5)
    lamp = primitive(Segments((0.5, 1.5), (-0.5, 1.5)), emission=1.0)
    scene = Scene.of(slanted, lamp)
    proofs = []
    for s in np.linspace(0.1, 0.9, 9):
        at = Receiver.on_shape(scene, 0, s)
        assert certified(scene, at).certified
        proofs.append(certified(scene, Receiver(at.position, at.n)).certified)
    assert not all(proofs)


def test_the_end_of_a_shape_is_no_place_to_certify():
    proof = certified(scene_a(), Receiver((0.5, 1.0), 3.0))
    assert not proof.certified
    assert proof.error >= 0.1


@pytest.mark.parametrize("place", [(0.3, 0.2), (0.75, 0.2)])
def test_a_point_light_is_in_doubt_only_at_the_edge_of_its_shadow(place):
    blocker = primitive(Segments((0.25, 0.5), (0.5, 0.5)))
    scene = Scene.of(blocker, points=PointLights((0.25, 1.0), 1.0))
    at = Receiver(place, 0.3)
    proof = certified(scene, at)
    assert proof.certified
    assert true_error(scene, at) <= proof.error < 1e-14
    edge = certified(scene, Receiver((0.75, 0.0), 0.3))
    assert not edge.certified
    assert edge.error > 0.5


# --- how it is asked ------------------------------------------------------------------------------


def test_each_band_has_its_bound():
    lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=[[1.0, 2.0, 0.0], [0.0] * 3])
    sky = ConstantSky((0.0, 0.5, 0.0))
    at = Receiver((0.2, 0.0), 0.1)
    both = Scene.of(lamp, environment=sky)
    proof = certified(both, at)
    alone = [certified(both.band(k), at) for k in range(3)]
    assert proof.error.tolist() == [a.error.item() for a in alone]
    assert proof.certified.tolist() == [True] * 3
    assert proof.error[2] == 0.0


def test_receivers_may_be_traced_and_mapped():
    scene = scene_b()
    x = jnp.linspace(-0.4, 0.4, 5)
    ask = lambda x: certified(scene, Receiver(jnp.stack([x, 0.0]), 0.1))  # noqa: E731
    rows = jax.jit(jax.vmap(ask))(x)
    for k in range(5):
        assert rows.certified[k] == ask(x[k]).certified
        np.testing.assert_allclose(rows.error[k], ask(x[k]).error, rtol=0.5)


def test_single_precision_is_certified_by_its_own_rounding():
    with jax.enable_x64(False):
        scene = named_scene("e11_fig03")
        at = anywhere(scene, 60, np.random.default_rng(5))
        found = trial(scene, Receivers(*(a.astype(t) for a, t in zip(at, "ffi", strict=True))))
    assert found.wrong == 0
    assert np.mean(found.certified) > 0.9
    assert 1e-8 < np.max(found.bound) < 1e-3


def test_nowhere_is_not_certified():
    scene = scene_a()
    proof = jax.jit(lambda x: certified(scene, Receiver(jnp.stack([x, x]), 0.0)))(jnp.nan)
    assert jnp.isnan(proof.error)
    assert not proof.certified


def test_what_no_proof_is_known_for_is_refused():
    at = Receiver((0.0, 0.0), 0.0)
    lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
    with pytest.raises(ValueError, match="arcs alone, but holds Ellipses"):
        certified(Scene.of(lamp, primitive(Ellipses((0.0, 0.5), (0.2, 0.1)))), at)
    with pytest.raises(ValueError, match="black or a constant sky, but has a GaussianSky"):
        certified(Scene.of(lamp, environment=GaussianSky()), at)
    with pytest.raises(ValueError, match="must be concrete, but is traced"):
        jax.jit(lambda scene: certified(scene, at))(scene_a())
    with pytest.raises(ValueError, match="one receiver, but holds"):
        certified(scene_a(), Receiver(jnp.zeros((3, 2)), 0.0))
