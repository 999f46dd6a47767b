"""Panels: which sides have them, where they are cut, how fine they are, and their polynomials."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import (
    Circles,
    ConstantSky,
    PointLights,
    Scene,
    Segments,
    box,
    primitive,
)
from firstorder.flatland.bounces._panels import Discretization, Panels, cut_into_panels


@pytest.fixture(autouse=True, scope="module")
def _double():
    with jax.enable_x64(True):
        yield


LAMP = PointLights((2.1, 1.7), 1.0)


def hall(*things, **lit):
    """A room of four by three metres and what is in it; light is a lamp unless told otherwise."""
    walls = primitive(box((0, 0), (4, 3), inward=True))
    return Scene.of(walls, *map(primitive, things), **lit or {"points": LAMP})


def ends_of(scene, fineness):
    """First and last parameters of the panels of each sheet (shape, side), in order."""
    panels, _ = cut_into_panels(scene, fineness)
    found = {}
    for shape, side, ends in zip(panels.shape, panels.side, np.asarray(panels.ends), strict=True):
        found.setdefault((int(shape), int(side)), []).append(ends)
    return {sheet: np.array(ends) for sheet, ends in found.items()}


# --- which sides ---------------------------------------------------------------------------------

ROOM = [(i, 0) for i in range(4)]
SIDES = {
    "a room with a closed box": (hall(box((0.7, 0.5), (1.3, 1.0))), [(i, 0) for i in range(8)]),
    "a lamp inside the box": (
        hall(box((0.7, 0.5), (1.3, 1.0)), points=PointLights((1.0, 0.7), 1.0)),
        [(i, 1) for i in range(4, 8)],
    ),
    "a board has two sides": (hall(Segments((1.0, 1.0), (3.0, 1.2))), [*ROOM, (4, 0), (4, 1)]),
    "the sky is outside": (hall(environment=ConstantSky(1.0)), [(i, 1) for i in range(4)]),
    "a lamp in the next room": (
        hall(box((5, 0), (6, 1), inward=True), points=PointLights((5.5, 0.5), 1.0)),
        [(i, 0) for i in range(4, 8)],
    ),
    "by way of other walls": (  # the lamp is behind a screen and sees neither of its back's ends
        hall(Segments((0.0, 1.5), (3.5, 1.5)), points=PointLights((0.5, 2.5), 1.0)),
        [*ROOM, (4, 0), (4, 1)],
    ),
}


@pytest.mark.parametrize("name", SIDES)
def test_the_sides_that_light_reaches_have_panels_and_no_others(name):
    scene, sides = SIDES[name]
    found = ends_of(scene, Discretization(2, 0.3))
    assert list(found) == sides
    for ends in found.values():  # from end to end, in order, without a gap
        assert ends[0, 0] == 0.0
        assert ends[-1, 1] == 1.0
        np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
        assert np.all(ends[:, 0] < ends[:, 1])


def test_a_surface_that_shines_lights_what_it_sees():
    walls = primitive(box((0, 0), (4, 3), inward=True))
    lamp, coarse = primitive(Circles((2.0, 1.5), 0.3), emission=1.0), Discretization(2, 0.3)
    assert list(ends_of(Scene.of(walls, lamp), coarse)) == [*ROOM, (4, 0)]
    assert list(ends_of(Scene.of(walls), coarse)) == [(0, 0)]  # dark


# --- where and how fine --------------------------------------------------------------------------


@pytest.mark.parametrize("smallest", [0.1, 1e-3, 1e-7])
def test_panels_of_an_empty_square_shrink_towards_its_corners_by_a_constant_factor(smallest):
    """Both halves of a wall are cut at 0.35 of what is left, until that is small enough."""
    walls = primitive(box((-2, -2), (2, 2), inward=True))
    scene = Scene.of(walls, points=PointLights((0.0, 0.0), 1.0))
    count = int(np.ceil(np.log(smallest / 0.5) / np.log(0.35)))
    half = [0.0, *(0.5 * 0.35 ** np.arange(count, -1, -1))]
    knots = [*half, *(1.0 - np.array(half[-2::-1]))]
    for ends in ends_of(scene, Discretization(4, smallest)).values():
        np.testing.assert_allclose(ends, list(itertools.pairwise(knots)), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("halvings", [1, 3])
def test_halvings_cut_every_panel_into_equal_parts(halvings):
    scene = hall(Circles((1.0, 1.0), 0.4))
    coarse, fine = (ends_of(scene, Discretization(4, 0.1, k)) for k in (0, halvings))
    for sheet, ends in coarse.items():
        share = np.arange(2**halvings + 1) / 2**halvings
        knots = ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])
        parts = np.stack([knots[:, :-1], knots[:, 1:]], -1).reshape(-1, 2)
        np.testing.assert_allclose(fine[sheet], parts, rtol=0.0, atol=1e-14)


def test_the_most_nodes_are_those_of_all_walls_together():
    """Each wall has 6 panels before halvings; one after another they come to 1536, of 2500."""
    fine = Discretization(8, 0.1, 8)
    walls = primitive(box((-2, -2), (2, 2), inward=True))
    with pytest.raises(ValueError, match=r"at most 20000 nodes on all surfaces .* shape 1 takes"):
        cut_into_panels(Scene.of(walls, points=PointLights((0.0, 0.0), 1.0)), fine)


def test_panels_are_cut_where_shapes_stand_on_each_other_cross_and_end_a_shadow():
    """A box stands on the floor, a board crosses it, another hangs below the lamp."""
    lamp = PointLights((2.0, 2.5), 1.0)
    scene = hall(
        box((0.5, 0.0), (1.5, 1.0)), Segments((3.0, 0.5), (3.5, -0.5)),
        Segments((1.8, 1.5), (2.4, 1.5)), points=lamp,
    )  # fmt: skip
    knots = 4.0 * ends_of(scene, Discretization(2, 0.1))[0, 0].ravel()
    # Feet of the box; the crossing; shadows of the hanging board's ends, 2.5 times as far out.
    for place in (0.5, 1.5, 3.25, 2.0 - 0.2 * 2.5, 2.0 + 0.4 * 2.5):
        assert np.min(np.abs(knots - place)) < 1e-9


def test_panels_are_no_longer_than_their_distance_to_what_they_do_not_touch():
    """A disc hovers over a long floor; on the disc the normal turns by 0.9 at most."""
    center, radius = np.array([1.0, 0.45]), 0.4
    scene = Scene.of(
        primitive(Segments((-4.0, 0.0), (6.0, 0.0))), primitive(Circles(center, radius)),
        points=PointLights((1.2, 4.0), 1.0),
    )  # fmt: skip
    found = ends_of(scene, Discretization(2, 1e-4))
    ends = -4.0 + 10.0 * found[0, 0]
    away = np.maximum(0.0, np.maximum(ends[:, 0] - center[0], center[0] - ends[:, 1]))
    gap, length = np.hypot(away, center[1]) - radius, ends[:, 1] - ends[:, 0]
    assert np.max(length / gap) < 1.3
    assert np.max(length / gap) > 0.8  # and no shorter than that asks for
    ends = 2.0 * np.pi * found[1, 0]  # counter-clockwise from the top
    turn, inside = np.diff(ends)[:, 0], np.linspace(ends[:, 0], ends[:, 1], 99)
    gap = np.min(center[1] + radius * np.cos(inside), 0)
    assert 0.6 < turn.max() <= 0.9
    assert 0.8 < np.max(radius * turn / gap) < 1.3


def test_panels_do_not_depend_on_the_unit_of_length():
    numbers = []
    for unit in (2.0**-40, 1.0):
        room, body = (
            box((0, 0), (4 * unit, 3 * unit), inward=True),
            Circles((unit, unit), 0.5 * unit),
        )
        scene = Scene.of(primitive(room, emission=1.0), primitive(body))
        numbers.append(len(cut_into_panels(scene, Discretization(4, 0.01))[0].shape))
    assert numbers[0] == numbers[1]


# --- polynomials on panels -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def three():
    """Two panels on the front of shape 1, one on the back of shape 2."""
    ends = jnp.array([[0.0, 0.3], [0.3, 1.0], [0.0, 1.0]])
    return Panels(jnp.array([1, 1, 2]), jnp.array([0, 0, 1]), ends, 5)


def test_nodes_and_weights_integrate_polynomials_of_twice_the_degree(three):
    s, w = three.rule()
    for k in range(10):
        first, last = np.asarray(three.ends).T
        true = (last ** (k + 1) - first ** (k + 1)) / (k + 1)
        np.testing.assert_allclose(jnp.sum(w * s**k, 1), true, rtol=1e-13)


@pytest.mark.parametrize("panel", range(3))
@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_basis_gives_back_a_polynomial_and_its_slope(three, panel, count):
    panels = Panels(three.shape, three.side, three.ends, count)
    powers = np.polynomial.Polynomial(np.random.default_rng(0).normal(size=count))
    known = powers(np.asarray(panels.rule()[0])[panel])
    for s in (0.1, 0.37, 0.9):
        value, slope = panels.basis(jnp.array(panel), jnp.array(s))
        assert value @ known == pytest.approx(powers(s), rel=1e-10)
        assert slope @ known == pytest.approx(powers.deriv()(s), rel=1e-10, abs=1e-11)


def test_a_parameter_of_a_sheet_lies_on_one_panel_or_on_none(three):
    sheets = jnp.array([2, 2, 2, 5, 5, 3, 0, 4, 6])  # twice the shape, and one more for the back
    s = jnp.array([0.0, 0.29, 0.31, 0.0, 0.9, 0.5, 0.5, 0.2, 0.2])
    panel, there = three.holding(sheets, s)
    np.testing.assert_array_equal(there, [True] * 5 + [False] * 4)
    np.testing.assert_array_equal(panel[:5], [0, 0, 1, 2, 2])
