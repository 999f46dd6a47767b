"""The edges of light close: to rounding where they are all there, and not where one is missing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Receiver,
    Scene,
    boundary_gradient,
    box,
    cylinder,
    disc,
    irradiance,
    plane,
    primitive,
    rectangle,
    sphere,
    vector_irradiance,
    visible_silhouettes,
)
from firstorder.space.silhouettes._closure import chords, edges_close

EPS = float(np.finfo(np.float64).eps)
X, Y, Z = np.eye(3)
AT = Receiver.at((0.1, 0.2, 0.0), (0.0, 0.0, 1.0))


def lamp():
    return primitive(rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)


def room(*blockers, sky=0.25):
    """A lamp over a floor that shines beside blockers that do not."""
    floor = primitive(plane((0.0, 0.0, -0.5), (0.1, 0.0, 1.0)), emission=0.5)
    return Scene.of(lamp(), floor, *(primitive(b) for b in blockers), environment=sky)


SCENES = {
    "lamp and floor": lambda: room(),
    "a ball": lambda: room(sphere((0.2, 0.1, 1.0), 0.3)),
    "a box in the horizon": lambda: room(box((0.5, -0.3, -0.2), (0.9, 0.4, 0.6))),
    "a tube and a disc": lambda: room(
        cylinder((0.1, 0.5, 0.5), (0.4, -0.2, 1.2), 0.2),
        disc((-0.5, 0.3, 0.4), (1.0, 0.2, 0.5), 0.3),
    ),
    "one ball behind the other": lambda: room(
        sphere((0.3, 0.0, 1.0), 0.2), sphere((0.4, 0.0, 1.5), 0.25)
    ),
}


def jumps_and_chords(scene, at):
    """Light across each visible piece by what the scene emits, and the pieces' chords."""
    found = visible_silhouettes(scene, at)
    emission = np.asarray(scene.material.emission)
    shown = np.append(np.max(emission, 1), float(scene.environment))
    jumps = [
        np.where(s.seen, shown[s.owner] - np.where(s.cut, shown[s.behind], 0.0), 0.0)
        for s in jax.tree.map(np.asarray, (found.lines, found.rims))
    ]
    return np.concatenate([*jumps, shown[np.asarray(found.above)]]), np.asarray(found.chords)


@pytest.mark.parametrize("name", SCENES)
def test_edges_of_light_close(name):
    jump, ways = jumps_and_chords(SCENES[name](), AT)
    np.testing.assert_allclose(jump @ ways, np.zeros(3), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("name", SCENES)
def test_each_piece_across_which_light_jumps_is_missed(name):
    jump, ways = jumps_and_chords(SCENES[name](), AT)
    shown = jnp.array([1.0])
    assert edges_close([jnp.asarray(jump)], jnp.asarray(ways), shown, EPS)
    sizes = np.abs(jump) * np.max(np.abs(ways), 1)
    there = np.flatnonzero(sizes > 1e-5)
    assert len(there) > 3
    for k in there:
        without = jnp.asarray(np.where(np.arange(len(jump)) == k, 0.0, jump))
        assert not edges_close([without], jnp.asarray(ways), shown, EPS)


def test_chords_join_directions():
    lines, straight = [[[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]], [[0.0, 0.5, 1.0]]
    arcs, curved = [[[0.0, 0.0, 3.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]], [[0.0, 0.5 * np.pi]]
    azimuths = [0.0, 0.5 * np.pi, np.pi]
    found = chords(*(jnp.array(a) for a in (lines, arcs, straight, curved, azimuths)))
    half = np.sqrt(0.5)
    wanted = [[half - 1.0, half, 0.0], [-half, 1.0 - half, 0.0], [-0.8, 0.8, 0.0]]
    wanted += [[-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-15)


# --- shapes that run into each other, traced -----------------------------------------------------


def light_with_a_ball(middle, ask):
    scene = Scene.of(lamp(), primitive(sphere(middle, 0.3)))
    return ask(scene, AT)


# Balls that come through the lamp from behind, beside its middle.
THROUGH = [(0.5, 0.0, 2.2), (0.4, 0.3, 2.1), (-0.1, 0.45, 2.15), (-0.5, -0.5, 2.05)]


@pytest.mark.parametrize("ask", [irradiance, vector_irradiance, boundary_gradient])
def test_a_traced_lamp_whose_edge_runs_into_a_ball_has_no_answer(ask):
    traced = jax.jit(lambda middle: light_with_a_ball(middle, ask))
    for middle in THROUGH:
        assert np.all(np.isnan(traced(jnp.array(middle))))
    for middle in ((0.9, 0.0, 2.0), (0.3, 0.0, 1.5)):
        assert np.all(np.isfinite(traced(jnp.array(middle))))


def test_concrete_ones_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match="run into each other"):
        light_with_a_ball(THROUGH[0], irradiance)


def test_derivatives_of_what_has_no_answer_are_not_numbers():
    gradient = jax.grad(lambda m: light_with_a_ball(m, irradiance))
    assert not np.any(np.isfinite(gradient(jnp.array(THROUGH[0]))))
    assert np.all(np.isfinite(gradient(jnp.array([0.3, 0.1, 1.5]))))


def test_a_floor_within_rounding_is_not_half_seen():
    """In single precision some edges lie before such a floor and others behind it."""

    @jax.jit
    def light(height, normal):
        floor = primitive(plane((1.0, 0.3, 0.0), (0.0, 0.0, 1.0)), emission=0.3)
        scene = Scene.of(lamp(), floor, environment=0.7)
        return irradiance(scene, Receiver.at(jnp.stack([0.1, 0.2, height]), normal))

    normals = np.random.default_rng(7).normal(size=(40, 3))
    with jax.enable_x64(False):
        for height in (1e-9, -1e-9):
            found = np.array([light(jnp.float32(height), jnp.asarray(n, "f4")) for n in normals])
            above, below = (
                np.array([light(jnp.float32(h), jnp.asarray(n, "f4")) for n in normals])
                for h in (1e-3, -1e-3)
            )
            near = np.minimum(abs(found - above), abs(found - below))
            assert np.all((near < 0.01) | np.isnan(found))
