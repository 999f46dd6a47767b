import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Scene,
    box,
    cylinder,
    disc,
    nearest,
    primitive,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.bounces._radiance_maps import (
    RadianceMaps,
    cell_centers,
    face_layout,
    refine_maps,
    trace_maps,
)
from firstorder.space.library import _scenes


def everything():
    """One shape of every kind that has faces."""
    return Scene.of(
        primitive(sphere((0.0, 0.0, 1.0), 0.3), name="a"),
        primitive(box((0.5, -0.2, 0.8), (0.8, 0.2, 1.1)), name="b"),
        primitive(cylinder((-0.8, 0.0, 0.7), (-0.7, 0.1, 1.2), 0.2), name="c"),
        primitive(disc((0.0, 0.8, 1.0), (0.0, 0.3, -1.0), 0.3), name="d"),
        primitive(rectangle((0.0, -0.8, 1.0), (0.0, 0.3, 0.1), (0.3, 0.0, 0.0)), name="e"),
        primitive(triangle((0.5, 0.5, 1.0), (0.6, 0.9, 1.1), (0.9, 0.6, 1.0)), name="f"),
    )


def fan(count=4000):
    d = np.random.default_rng(1).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1)[:, None]


@pytest.mark.smoke
def test_a_cast_meets_what_the_search_meets():
    scene, d = everything(), jnp.asarray(fan())
    cells = len(face_layout(scene).shape)
    seen = trace_maps(
        RadianceMaps(scene, jnp.ones((cells, 2, 2))),
        tuple(jnp.zeros(len(d)) for _ in range(3)),
        (d[:, 0], d[:, 1], d[:, 2]),
        -1,
    )
    hits = nearest(scene, jnp.zeros_like(d), d)
    same = np.asarray(seen.index == hits.index)
    assert np.mean(same) > 0.999  # a ray that grazes may fall to either side
    assert len(set(np.asarray(hits.index).tolist())) == 7
    ok = same & np.asarray(hits.index >= 0)
    np.testing.assert_allclose(seen.distance[ok], hits.t[ok], rtol=2e-5)
    facing = sum(n * a for n, a in zip(seen.normal, d.T, strict=True))
    assert np.all(np.asarray(facing)[ok] < 0.0)


def test_the_middle_of_a_cell_shows_that_cell():
    """Look at every node from aside, and find the number that was put there."""
    scene, k = everything(), 3
    point, normal = cell_centers(scene, k)
    values = jnp.arange(point.shape[0] * k * k, dtype=float).reshape(-1, k, k) + 1.0
    kinds, shown = face_layout(scene).kind, jax.jit(trace_maps)
    aside = jnp.cross(normal, jnp.array([0.5, -0.9, 0.8])) + normal
    away = aside / jnp.linalg.norm(aside, axis=-1, keepdims=True)
    for face in range(point.shape[0]):
        at, along = point[face] + 0.1 * away[face], -away[face]
        seen = shown(RadianceMaps(scene, values), tuple(at.T), tuple(along.T), -1).radiance
        met = np.asarray(seen) == np.asarray(values[face]).ravel()
        # Discs, caps and triangles do not fill their squares.
        fills = kinds[face] in ("Boxes", "Rectangles", "Ellipsoids")
        assert np.all(met) if fills else np.mean(met) > 0.4, kinds[face]


@pytest.mark.parametrize(
    "room",
    [
        sphere((0.1, 0.0, 0.2), 1.0),
        box((-1.0, -1.0, -1.0), (1.0, 1.2, 1.0)),
        cylinder((0.0, 0.0, -1.0), (0.1, 0.0, 1.0), 1.0),
    ],
    ids=["ball", "box", "cylinder"],
)
def test_the_inside_of_a_closed_shape_sends_nothing_and_faces_who_looks(room):
    """The maps are of its outside."""
    scene, d = Scene.of(primitive(room)), fan(200)
    maps = RadianceMaps(scene, jnp.ones((len(face_layout(scene).shape), 2, 2)))
    hits = trace_maps(maps, (jnp.zeros(200),) * 3, tuple(jnp.asarray(d.T)), -1)
    np.testing.assert_array_equal(hits.index, 0)
    np.testing.assert_array_equal(hits.radiance, 0.0)
    assert np.all(sum(n * a for n, a in zip(hits.normal, d.T, strict=True)) < 0.0)


@pytest.mark.parametrize("shape", [(3, 2, 2), (7, 2, 2), (6, 0, 0)])
def test_maps_of_another_number_of_faces_are_refused(shape):
    """Of three maps for a box its other faces once showed the last one."""
    scene = Scene.of(primitive(box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))))
    with pytest.raises(
        ValueError, match=r"^Argument `L` must have shape \(6, [12], [12]\), but has"
    ):
        RadianceMaps(scene, jnp.ones(shape))
    with pytest.raises(ValueError, match="Argument `L` must have shape"):
        jax.jit(lambda L: RadianceMaps(scene, L).L)(jnp.ones(shape))
    assert RadianceMaps(scene, jnp.ones((6, 2, 2, 3))).L.shape == (6, 2, 2, 3)


def test_finer_maps_keep_a_linear_radiance():
    scene = _scenes.j12_box()
    s = (np.arange(4) + 0.5) / 4
    L = jnp.asarray(np.broadcast_to(1.0 + s + 2.0 * s[:, None], (4, 4, 4)))
    fine = refine_maps(RadianceMaps(scene, L), 8).L
    t = (np.arange(8) + 0.5) / 8
    np.testing.assert_allclose(fine[1], 1.0 + t + 2.0 * t[:, None], rtol=1e-5)


def test_finer_maps_go_round_with_azimuth():
    def light(cells):
        azimuth = np.pi * ((np.arange(cells) + 0.5) / cells * 2.0 - 1.0)
        return 2.0 + np.cos(azimuth - 3.0)

    scene, cells, finer = everything(), 8, 32
    plan, bilinear = face_layout(scene), (2.0 * np.pi / cells) ** 2 / 8.0
    L = jnp.asarray(np.broadcast_to(light(cells), (len(plan.kind), cells, cells)))
    error = np.abs(refine_maps(RadianceMaps(scene, L), finer).L[:, 0] - light(finer)).max(1)
    round_faces = {("Ellipsoids", 0), ("Cylinders", 0)}
    expected = [face in round_faces for face in zip(plan.kind, plan.face, strict=True)]
    assert (error <= bilinear).tolist() == expected


def test_cells_of_a_ball_lie_on_it_and_face_outward():
    scene = everything()
    point, normal = cell_centers(scene, 4)
    (ball,) = (k for k, kind in enumerate(face_layout(scene).kind) if kind == "Ellipsoids")
    away = point[ball] - jnp.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(jnp.linalg.norm(away, axis=-1), 0.3, rtol=1e-12)
    np.testing.assert_allclose(normal[ball], away / 0.3, rtol=1e-12)


@pytest.mark.parametrize("bands", [False, True])
@pytest.mark.parametrize("turn", range(4))
def test_a_lamp_drawn_on_a_wall_hides_the_wall(turn, bands):
    """However the world is turned: by rounding some rays would meet the wall behind it.

    A lamp of one band hides it in all bands.
    """
    rng = np.random.default_rng(turn)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turn else np.eye(3)
    t, b, n = frame.T
    lit = np.array([0.0, 1.0, 0.0]) if bands else 1.0
    scene = Scene.of(
        primitive(rectangle(n, b, t), albedo=0.5),
        primitive(rectangle(n + 0.3 * t, 0.3 * b, 0.3 * t), emission=lit),
        primitive(sphere(0.5 * n - 0.3 * t, 0.1)),
    )
    maps = RadianceMaps(scene, jnp.ones((3, 2, 2)))
    across = rng.uniform(-0.25, 0.25, (200, 2)) + np.array([0.3, 0.0])
    along = (np.column_stack([across, np.ones(200)])) @ frame.T
    along = along / np.linalg.norm(along, axis=1)[:, None]
    hits = trace_maps(maps, (jnp.zeros(200),) * 3, tuple(jnp.asarray(along.T)), -1)
    np.testing.assert_array_equal(hits.index, 2)
    np.testing.assert_array_equal(nearest(scene, np.zeros((200, 3)), along).index, 2)
    np.testing.assert_allclose(hits.distance, 1.0 / (along @ n), rtol=1e-12)
