"""E'' where a line of a cylinder's wall lies in a plane with edges, against exact derivatives.

`derivations/space/discontinuities/walls.py` has a brute force for a column before a lamp.
"""

import functools

import numpy as np
import pytest

from firstorder.space import Scene, box, cylinder, disc, primitive, rectangle, sphere
from firstorder.space.discontinuities import _plane_bends, _strips, _wall_ends
from tests.space.discontinuities.exact import PLANE, REACH, START, WAY, derivatives, found

X, Y, Z = np.eye(3)
NEON = cylinder((0.3, 1.5, 0.6), (0.3, 1.5, 1.4), 0.1)
COLUMN = cylinder((-0.3, 0.6, 0.0), (-0.3, 0.6, 0.8), 0.2)
CRATE = box((0.2, 1.4, 0.6), (0.5, 1.6, 1.4))


def scene_of(lamp, *shapes):
    return Scene.of(primitive(lamp, emission=1.0), *map(primitive, shapes))


SCENES = {
    "a column before a tube": scene_of(NEON, COLUMN),
    "a column before a crate": scene_of(CRATE, COLUMN),
    "two that lean": scene_of(
        cylinder((0.3, 1.2, 0.5), (0.6, 1.3, 1.4), 0.15),
        cylinder((-0.3, 0.6, 0.1), (0.0, 0.7, 1.0), 0.2),
        box((-0.6, 0.2, 0.1), (-0.5, 0.3, 0.9)),
    ),
    "things between": scene_of(
        NEON,
        cylinder((-0.3, 0.6, 0.3), (-0.3, 0.6, 1.0), 0.2),
        box((-0.3, 0.9, 0.2), (-0.1, 1.05, 0.95)),
        sphere((0.0, 0.55, 0.6), 0.08),
        cylinder((-0.15, 1.2, 0.3), (-0.1, 1.25, 0.9), 0.1),
    ),
    "a disc and a plate between": scene_of(
        CRATE,
        COLUMN,
        disc((0.1, 1.0, 0.7), (1.0, 0.2, 0.0), 0.25),
        rectangle((-0.1, 0.8, 0.5), 0.2 * X + 0.1 * Y, 0.1 * Y + 0.15 * Z),
    ),
    "a ball between": scene_of(
        rectangle((0.0, 1.5, 1.0), 0.3 * X, 0.5 * Z),
        cylinder((-0.3, 0.6, 0.3), (-0.3, 0.6, 1.0), 0.2),
        rectangle((-0.15, 0.4, 0.7), 0.05 * X + 0.02 * Y, 0.15 * Z),
        sphere((-0.2, 0.9, 0.9), 0.1),
    ),
}


def kinks(scene, start=START, way=WAY):
    table = found(scene, start=start, way=way)
    return table.take((table.kind == PLANE) & (np.abs(table.jump_E1) > 1e-5))


@functools.cache
def kinks_of(name):
    return kinks(SCENES[name])


def beyond_roots(scene, table):
    """Jumps of what E'' is without the roots that a table tells of, which must leave a jump."""
    s, powers = 1e-5 * np.arange(1.0, 6.0), 0.5 * np.arange(5.0)
    sides = []
    for side, roots in ((-1.0, table.root_before), (1.0, table.root_after)):
        second = derivatives(scene, (table.x[:, None] + side * s).ravel())[1].reshape(-1, len(s))
        rest = second - roots[:, None] / np.sqrt(s)
        sides.append(np.linalg.solve((s[:, None] / s[0]) ** powers, rest.T)[0])
    return sides[1] - sides[0]


@pytest.mark.parametrize("name", SCENES)
def test_jumps_and_roots_are_those_of_exact_derivatives(name):
    table = kinks_of(name)
    np.testing.assert_allclose(
        table.jump_E2, beyond_roots(SCENES[name], table), rtol=0.0, atol=2e-5
    )
    assert np.sum(np.abs(table.jump_E2) > 0.01) > 2


def test_lines_that_end_beside_the_edges_make_no_roots():
    """The crate's upright edges lie between directions to the ends of the column's lines."""
    inner, outer = (kinks_of(f"a column before a {name}") for name in ("crate", "tube"))
    assert not np.any(inner.root_before + inner.root_after)
    assert np.all(outer.root_before + outer.root_after != 0.0)


def test_a_wall_is_seen_farther_out_than_an_edge():
    """By the circle that a ray from the height of the eye touches."""
    eye, rho, D = 1e-3, 0.2, 0.9
    slope = np.arctan2(rho + eye, D) - np.arcsin(rho / np.hypot(rho + eye, D))  # of the ray
    risen = eye - D * np.tan(slope)
    here = _strips.in_plane(*_upright(rho, D))
    np.testing.assert_allclose(0.5 * here.lifts(-Y)[0] * eye**2, -risen, rtol=3e-3)
    np.testing.assert_allclose(here.lifts(Y), -here.lifts(-Y))


def _upright(rho, D):
    """A plane that touches an upright column, with the receiver at the distance D."""
    from firstorder.space import Receiver
    from firstorder.space.discontinuities._edges import edges_of
    from firstorder.space.discontinuities._rounds import rounds_of

    scene = scene_of(cylinder((D, -rho, 0.3), (D, -rho, 1.0), rho))
    at = Receiver.at((0.0, 0.0, 0.0))
    return edges_of(scene, at), rounds_of(scene), at, np.zeros(3), Y


def test_a_line_that_is_walked_back_has_the_same_roots_in_reverse():
    scene = SCENES["things between"]
    there, end = kinks_of("things between"), START + REACH * WAY / np.linalg.norm(WAY)
    back = kinks(scene, start=end, way=-WAY)
    np.testing.assert_allclose(back.root_before[::-1], there.root_after, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(back.root_after[::-1], there.root_before, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(-back.jump_E2[::-1], there.jump_E2, rtol=1e-5)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_they_do_not_depend_on_the_unit_of_length(size):
    def column(k):
        lamp = cylinder(k * np.array((0.3, 1.5, 0.6)), k * np.array((0.3, 1.5, 1.4)), 0.1 * k)
        post = cylinder(k * np.array((-0.3, 0.6, 0.0)), k * np.array((-0.3, 0.6, 0.8)), 0.2 * k)
        table = found(scene_of(lamp, post), start=k * START, reach=k * REACH)
        return table.take(table.kind == PLANE)

    one, other = column(1.0), column(size)
    np.testing.assert_allclose(size**2 * other.jump_E2, one.jump_E2, rtol=1e-5)
    np.testing.assert_allclose(size**1.5 * other.root_after, one.root_after, rtol=1e-5)


# --- faults --------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", ["end_bends", "tip_bends", "lifts"])
def test_a_part_that_is_left_out_is_seen(monkeypatch, part):
    right = kinks_of("a column before a tube").jump_E2
    if part == "lifts":
        whole = _strips.InPlane.lifts
        monkeypatch.setattr(_strips.InPlane, part, lambda *a: 0.0 * whole(*a))
    else:
        whole = getattr(_plane_bends, part)
        none = {"end_bends": lambda *_: 0.0, "tip_bends": lambda *a: 0.0 * whole(*a)}
        monkeypatch.setattr(_plane_bends, part, none[part])
    spoilt = kinks(SCENES["a column before a tube"]).jump_E2
    assert np.max(np.abs(spoilt - right)) > 1e-3


def test_a_rim_that_goes_the_other_way_is_seen(monkeypatch):
    """The outline goes on beyond the end of the line, not back along it."""
    whole = _wall_ends.wall_ends

    def spoilt(*args):
        ends = whole(*args)
        return ends._replace(v=-ends.v, m=-ends.m, q=-ends.q, height=-ends.height)

    right = kinks_of("a column before a tube")
    monkeypatch.setattr(_plane_bends, "wall_ends", spoilt)
    other = kinks(SCENES["a column before a tube"])
    assert np.max(np.abs(other.root_after - right.root_after)) > 1e-3
