"""Critical lines: tangent where they say so, through their points, and none missing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Arcs, Circles, Ellipses, Scene, Segments, box, primitive
from firstorder.flatland.discontinuities import _critical_lines as critical
from firstorder.flatland.discontinuities._critical_lines import critical_lines, point_edges
from firstorder.flatland.shapes.build import closed_curve


def bean(shift=(0.0, 0.0)):
    a = 2.0 * np.pi * np.arange(64) / 64
    return closed_curve(np.stack([np.cos(a), np.sin(a) + 0.5 * np.cos(2 * a)], -1) + shift, 4)


SCENES = {
    "circles": [Circles([(0.0, 0.0), (3.0, 0.4), (1.0, 2.5)], [1.0, 0.5, 0.2])],
    "arc and segment": [Arcs((0.0, 0.0), 1.0, 0.5, -2.0), Segments((2.0, 0.3), (2.5, 1.7))],
    "ellipse, circle, box": [
        Ellipses((0.0, 0.0), (1.0, 0.6), 0.3),
        Circles((2.5, 0.2), 0.4),
        box((0.0, 2.0), (0.5, 2.4)),
    ],
    "a bean, which bends both ways, and a circle": [bean(), Circles((3.0, 0.5), 0.3)],
}


def off_tangent(scene, edges, u):
    """Sine of the angle between the line and the curve at its edge."""
    _, v, _ = jax.vmap(scene.motion)(jnp.asarray(edges.shape), jnp.asarray(edges.s))
    v = np.asarray(v)
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / np.linalg.norm(v, axis=1)


def worst(scene):
    """How far lines are from tangency, and edges from where their parameter says."""
    a, b = critical_lines(scene)
    u = b.point - a.point
    u /= np.linalg.norm(u, axis=1)[:, None]
    error = 0.0
    for edges in (a, b):
        sine = np.where(edges.tangent, off_tangent(scene, edges, u), 0.0)
        place = critical.positions(scene, edges.shape, edges.s)
        error = max(error, np.abs(sine).max(), np.abs(place - edges.point).max())
    return error


@pytest.mark.parametrize("name", SCENES)
def test_lines_touch_what_they_say(name):
    assert worst(Scene.of(*map(primitive, SCENES[name]))) < 1e-7


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("circles", 12),  # four for each of three pairs, none meeting another circle's inside
        ("ellipse, circle, box", 4 + 4 * 4 + 6),
    ],
)
def test_no_line_is_missing(name, count):
    assert len(critical_lines(Scene.of(*map(primitive, SCENES[name])))[0]) == count


def test_a_curve_that_bends_both_ways_has_a_tangent_of_its_own():
    a, b = critical_lines(Scene.of(primitive(bean())))
    assert len(a) == 1  # the bridge over its hollow
    np.testing.assert_allclose(a.point[0, 1], b.point[0, 1], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(a.point[0, 0], -b.point[0, 0], rtol=0.0, atol=1e-9)


def test_circles_agree_with_ellipses_that_are_circles():
    """The closed form against the Newton solve of curves."""
    circles = Scene.of(primitive(Circles([(0.0, 0.0), (3.0, 0.4)], [1.0, 0.5])))
    ellipses = Scene.of(
        primitive(Ellipses([(0.0, 0.0), (3.0, 0.4)], [(1.0, 1.0), (0.5, 0.5)], [0.0, 0.0]))
    )
    a, b = (np.sort(critical_lines(s)[0].point, axis=0) for s in (circles, ellipses))
    np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-9)


def test_a_common_end_is_one_edge():
    assert len(point_edges(Scene.of(primitive(box((0.0, 0.0), (1.0, 1.0)))))) == 4


def test_fault_inner_and_outer_tangents_mixed_is_noticed(monkeypatch):
    right = critical._of_circles

    def wrong(a, b):
        touch_a, touch_b = right(a, b)
        return touch_a, 2.0 * np.asarray(b.center) - touch_b

    monkeypatch.setattr(critical, "_of_circles", wrong)
    assert worst(Scene.of(primitive(SCENES["circles"][0]))) > 1e-3
