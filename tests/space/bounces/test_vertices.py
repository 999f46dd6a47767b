"""What paths meet, and where they go: by hand, and against densities that integrate to one."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Scene, plane, primitive, rectangle, sphere
from firstorder.space.bounces import _vertices as vertices

X, Y, Z = np.eye(3)
meet, brdf, scattered = map(eqx.filter_jit, (vertices.meet, vertices.brdf, vertices.scattered))


def scene():
    """A floor, a glossy ball above it, and a small panel that hides nothing."""
    return Scene.of(
        primitive(plane((0, 0, 0), Z), emission=(0.5, 0.7), albedo=(0.2, 0.3)),
        primitive(sphere((0, 0, 3), 1.0), emission=2.0, albedo=0.4, specular=0.3, exponent=7.0),
        primitive(rectangle((9, 0, 3), Y, Z), emission=(5.0, 6.0), albedo=(0.6, 0.1)),
        environment=9.0,
    )


def names(found):
    """Kinds by number: scenes sort shapes by kind."""
    return [type(g).__name__ for g in found.groups for _ in range(g.count)]


RAYS = {  # start, direction, kind that is met, side, emission, albedo, normal on the ray's side
    "the floor": ((2, 0, 3), -Z, "Planes", 0.5, 0.2, Z),
    "the floor from below": ((2, 0, -3), Z, "Planes", 0.7, 0.3, -Z),
    "the ball": ((-4, 0, 3), X, "Ellipsoids", 2.0, 0.4, -X),
    "the panel": ((7, 0, 3), X, "Rectangles", 6.0, 0.1, -X),
    "the front of the panel": ((12, 0, 3), -X, "Rectangles", 5.0, 0.6, X),
}


@pytest.mark.parametrize("name", RAYS)
def test_a_ray_meets_a_side_of_a_shape(name):
    start, along, kind, emission, albedo, normal = RAYS[name]
    all_of_it, start = scene(), np.array([start], float)
    here, there, L = meet(all_of_it, jnp.asarray(start), jnp.asarray([along]), -1)
    assert there.tolist() == [True]
    assert names(all_of_it)[int(here.on[0])] == kind
    np.testing.assert_allclose(L, [emission])
    np.testing.assert_allclose(here.albedo, [albedo])
    np.testing.assert_allclose(here.normal, [normal], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(here.back, [-along])
    glossy = kind == "Ellipsoids"
    np.testing.assert_allclose(here.specular, [0.3 * glossy])
    np.testing.assert_allclose(here.exponent, [7.0 * glossy])
    depth = {"Planes": 0.0, "Ellipsoids": -1.0, "Rectangles": 9.0}[kind]
    off = (here.position[0] @ jnp.abs(normal)) - depth if kind != "Planes" else here.position[0, 2]
    # The path goes on from a little before the side.
    assert 0.0 < float(off * jnp.sum(normal)) < 1e-3
    np.testing.assert_allclose(here.own, here.on)


def test_a_ray_that_meets_nothing_sees_the_sky():
    here, there, L = meet(scene(), jnp.array([[3.0, 0.0, 1.0]]), jnp.array([[0.0, 0.6, 0.8]]), -1)
    assert there.tolist() == [False]
    assert L.tolist() == [9.0]
    np.testing.assert_allclose(here.position, [[3.0, 0.0, 1.0]], rtol=0.0, atol=1e-3)


def test_rays_within_a_ball_meet_its_other_side():
    all_of_it = scene()
    ball, floor = (names(all_of_it).index(k) for k in ("Ellipsoids", "Planes"))
    on = jnp.array([ball, ball, floor, floor, -1])
    back = jnp.array([True, False, True, False, True])
    assert vertices.unmet(all_of_it, on, back).tolist() == [-1, ball, floor, floor, -1]
    here, *_ = meet(all_of_it, jnp.array([[0.0, 0.0, 3.0]]), jnp.asarray([X]), -1)
    assert here.own.tolist() == [-1]
    np.testing.assert_allclose(here.normal, [-X], rtol=0.0, atol=1e-12)


def test_steps_are_as_long_as_coordinates_are_rough():
    """A larger scene and a place far away round more."""
    small = Scene.of(primitive(sphere((0, 0, 0), 1.0)))
    large = Scene.of(primitive(sphere((0, 0, 0), 1.0)), primitive(sphere((0, 0, 1000.0), 1.0)))
    places = jnp.array([[1.0, 0.0, 0.0], [1e6, 0.0, 0.0]])
    near, far = vertices.step(small, places)[:, 0]
    assert 1e-15 < near < 1e-9
    np.testing.assert_allclose(far / near, 1e6 / 4.0, rtol=1e-6)
    np.testing.assert_allclose(vertices.step(large, places)[0, 0] / near, 1000.0, rtol=1e-6)


# --- the BRDF ------------------------------------------------------------------------------------

NORMAL = np.array([0.6, 0.0, 0.8])
BACK = np.array([0.0, 0.6, 0.8])
MIRRORED = 2.0 * 0.64 * NORMAL - BACK


def vertex(albedo, specular, exponent, count=1):
    numbers = [np.full(count, a) for a in (albedo, specular, exponent)]
    rows = [np.tile(a, (count, 1)) for a in (np.zeros(3), NORMAL, BACK)]
    none = np.full(count, -1)
    return vertices.Vertex(*map(jnp.asarray, (rows[0], rows[1], none, rows[2], *numbers, none)))


MATERIALS = {
    "matt": (0.6, 0.0, 0.0),
    "glossy": (0.0, 0.5, 20.0),
    "both": (0.5, 0.3, 3.0),
    "black": (0.0, 0.0, 0.0),
}


def sphere_nodes():
    """Directions all over the sphere with their weights, about the normal."""
    x, w = np.polynomial.legendre.leggauss(120)
    phi = 2.0 * np.pi * (np.arange(128) + 0.5) / 128
    z, f = (a.ravel() for a in np.meshgrid(x, phi, indexing="ij"))
    rho = np.sqrt(1.0 - z * z)
    frame = np.stack([[0.8, 0.0, -0.6], [0.0, 1.0, 0.0], NORMAL])
    local = np.stack([rho * np.cos(f), rho * np.sin(f), z], -1)
    return local @ frame, np.repeat(w * 2.0 * np.pi / 128, 128)


@pytest.mark.parametrize("name", MATERIALS)
def test_lobes_are_lambert_and_phong(name):
    albedo, specular, exponent = MATERIALS[name]
    along, weight = sphere_nodes()
    value, density = brdf(vertex(*MATERIALS[name], len(along)), jnp.asarray(along))
    cosine, power = along @ NORMAL, np.maximum(along @ MIRRORED, 0.0) ** exponent
    gloss = specular * (exponent + 2.0) / (2.0 * np.pi) * power
    true = (albedo / np.pi + gloss) * np.maximum(cosine, 0.0)
    np.testing.assert_allclose(value, true, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(weight @ np.asarray(density), 1.0, rtol=1e-3)
    share = specular / (albedo + specular) if albedo + specular else 0.0
    drawn = (1.0 - share) * np.maximum(cosine, 0.0) / np.pi
    drawn += share * (exponent + 1.0) / (2.0 * np.pi) * power
    np.testing.assert_allclose(density, drawn, rtol=1e-10, atol=1e-14)


def test_a_lobe_of_exponent_zero_is_smooth_where_it_ends():
    """Power 0 of nothing has no derivative that is finite: it is kept a little above."""

    def off(x):
        return brdf(vertex(0.2, 0.3, 0.0), jnp.stack([x, 0.0, 0.8])[None])[1][0]

    assert np.isfinite(jax.grad(off)(0.6))
    value, _ = brdf(vertex(0.0, 0.3, 0.0), jnp.asarray(NORMAL[None]))
    np.testing.assert_allclose(value, 0.3 / np.pi, rtol=1e-5)


@pytest.mark.parametrize(
    ("u", "axis", "cosine"),
    [
        ((0.1, 0.3, 0.4), MIRRORED, 0.3 ** (1.0 / 4.0)),
        ((0.37, 0.5, 0.9), MIRRORED, 0.5 ** (1.0 / 4.0)),
        ((0.38, 0.3, 0.4), NORMAL, np.sqrt(0.3)),
        ((0.9, 0.8, 0.1), NORMAL, np.sqrt(0.8)),
    ],
)
def test_the_first_number_picks_the_lobe_and_the_second_the_angle_from_its_axis(u, axis, cosine):
    """The glossy share of both is 0.375, of exponent 3; heights follow powers of their cosines."""
    here = vertex(*MATERIALS["both"])
    along, weight, density = scattered(here, jnp.asarray([u]))
    np.testing.assert_allclose(np.linalg.norm(along), 1.0, rtol=1e-12)
    np.testing.assert_allclose(along @ axis, [cosine], rtol=1e-12)
    value, true = brdf(here, along)
    np.testing.assert_allclose(density, true)
    np.testing.assert_allclose(weight, value / true, rtol=1e-12)


def test_the_third_number_turns_about_the_axis():
    u = np.column_stack([np.full(8, 0.9), np.full(8, 0.5), np.arange(8) / 8])
    along, *_ = scattered(vertex(*MATERIALS["both"], 8), jnp.asarray(u))
    np.testing.assert_allclose(np.mean(along, axis=0), np.sqrt(0.5) * NORMAL, rtol=0.0, atol=1e-12)
    flat = np.asarray(along) - np.sqrt(0.5) * NORMAL
    turns = np.sum(flat * np.roll(flat, -1, axis=0), -1) / 0.5
    np.testing.assert_allclose(turns, np.sqrt(0.5), rtol=1e-9)


def test_what_is_never_drawn_weighs_nothing():
    """A direction of a glossy lobe below the surface carries no light."""
    u = np.array([[0.0, 0.001, k / 16] for k in range(16)])
    along, weight, _ = scattered(vertex(0.1, 0.9, 1.0, 16), jnp.asarray(u))
    below = along @ NORMAL < 0.0
    assert np.any(below)
    assert np.all(np.asarray(weight)[below] == 0.0)
    assert np.all(np.asarray(weight)[~below] > 0.0)
