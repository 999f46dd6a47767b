"""Shapes that touch the receiver almost, that have no area, or that run into each other."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics import _roots
from firstorder.space import (
    Boxes,
    Scene,
    boundary_gradient,
    box,
    cylinder,
    derivatives,
    disc,
    ellipsoid,
    irradiance,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    triangle,
    vector_irradiance,
)
from firstorder.space.silhouettes import _collisions, _crossings
from firstorder.space.silhouettes._collisions import check_apart, find_collisions

AT = receiver((0.0, 0.0, 0.0))


# --- almost on a ball ----------------------------------------------------------------------------


def behind_two_balls(lamp, gap):
    """Irradiance from a lamp, a ball overhead and a ball beside the receiver, middle at horizon."""
    scene = [primitive(lamp, emission=1.0), primitive(sphere((-0.1, 0.2, 0.8), 0.3))]
    if gap is not None:
        scene.append(primitive(sphere((0.0625 + gap, 0.0, 0.0), 0.0625)))
    return irradiance(Scene.of(*scene), AT)


def assert_a_near_ball_hides_half_of_the_sky():
    """Its outline is almost the plane x = 0: all that is left of the lamp lies at x < 0."""
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    half = rectangle((-0.25, 0.0, 2.0), (0.0, 0.5, 0.0), (0.25, 0.0, 0.0))
    found = jax.jit(lambda gap: behind_two_balls(lamp, gap))
    left = jax.jit(lambda: behind_two_balls(half, None))()
    for gap in 10.0 ** -np.arange(6.0, 16.0):
        # The outline lies as far from the plane as the angle to the horizon of the ball.
        assert 0.0 <= found(gap) - left < np.sqrt(2.0 * gap / 0.0625)


def test_a_ball_as_near_as_rounding_hides_half_of_the_sky():
    assert_a_near_ball_hides_half_of_the_sky()


def test_fault_two_steps_to_an_extremum_all_around_lose_crossings(monkeypatch):
    def all_around(c, a, b):
        return _roots.even(_crossings.SAMPLES, c.dtype)

    monkeypatch.setattr(_roots, "STEPS", 2)
    monkeypatch.setattr(_crossings, "_in_front", all_around)
    with pytest.raises(AssertionError):
        assert_a_near_ball_hides_half_of_the_sky()


# --- without area --------------------------------------------------------------------------------

CORNERS = {
    "a point": [(0.0, 0.0, 1.0)] * 3,
    "two corners in one": [(0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.3, 0.3, 1.0)],
    "a line": [(0.25, 0.5, 1.0), (0.5, 0.25, 1.0), (0.75, 0.0, 1.0)],
    "a line through the receiver": [(0.0, 0.0, 1.0), (0.0, 0.0, 1.5), (0.0, 0.0, 3.0)],
}


def with_flat(shape):
    """Irradiance from a lamp behind a ball, and perhaps something more that shines."""
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    scene = [primitive(lamp, emission=1.0), primitive(sphere((0.1, 0.2, 1.0), 0.2))]
    more = [] if shape is None else [primitive(shape, emission=(0.5, 0.5))]
    return irradiance(Scene.of(*scene, *more), AT)


@pytest.mark.parametrize("where", CORNERS)
def test_a_traced_triangle_without_area_is_not_there(where):
    asked = jax.jit(jax.value_and_grad(lambda c: with_flat(triangle(*c))))
    value, slope = asked(np.array(CORNERS[where]))
    np.testing.assert_allclose(value, with_flat(None), rtol=1e-14)
    assert np.all(np.isfinite(slope))


def test_a_traced_rectangle_without_area_is_not_there():
    found = jax.jit(lambda u: with_flat(rectangle((0.2, 0.1, 1.5), u, 2.0 * u)))
    np.testing.assert_allclose(found(np.array([0.1, 0.2, 0.0])), with_flat(None), rtol=1e-14)


def test_rays_do_not_meet_what_has_no_area():
    along = jnp.array([0.5, 0.0, 1.0])

    def distance(c):
        return Scene.of(primitive(triangle(*c))).distance(0, jnp.zeros(3), along)

    assert jax.jit(distance)(jnp.stack([along, 2.0 * along, 3.0 * along])) == np.inf


@pytest.mark.parametrize("where", CORNERS)
def test_a_concrete_triangle_without_area_is_refused(where):
    with pytest.raises(ValueError, match="must not be parallel"):
        triangle(*CORNERS[where])


# --- run into each other -------------------------------------------------------------------------

PANEL = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
BULB = sphere((0.0, 0.0, 2.0), 0.5)
ROD = cylinder((0.0, 0.0, 0.5), (3.0, 0.0, 2.5), 0.05)
SLANTED = np.array([[0.01, 0.0, 1.5], [0.0, 0.02, 0.1], [0.0, 0.0, 1.0]])
NEEDLE, BOARD = ellipsoid((1.5, 0.0, 1.6), SLANTED), Boxes((1.5, 0.0, 1.6), SLANTED)
BEAM = box((-1.0, -0.02, 1.0), (1.0, 0.02, 1.02))
MEET = {
    "a ball through a panel": (PANEL, sphere((0.1, 0.1, 2.1), 0.2)),
    "a small ball through a panel": (PANEL, sphere((0.13, 0.17, 2.0), 1e-3)),
    "a panel half in a box": (PANEL, box((0.0, -1.0, 1.5), (1.0, 1.0, 2.5))),
    "a panel through a wall": (PANEL, rectangle((0.1, 0.0, 2.0), (0.1, 1.0, 0.0), (0.0, 0.1, 0.3))),
    "a panel through a plane": (PANEL, plane((0.2, 0.0, 0.0), (1.0, 0.0, 0.1))),
    "a panel through a disc": (PANEL, disc((0.2, 0.1, 2.0), (1.0, 0.3, 0.0), 0.2)),
    "a triangle through a panel": (PANEL, triangle((0, 0, 1.5), (0.2, 0.0, 2.5), (0.0, 0.2, 1.6))),
    "a bulb half in a ceiling": (BULB, plane((0.0, 0.0, 2.1), (0.0, 0.0, -1.0))),
    "a bulb in a cylinder's wall": (BULB, cylinder((0.4, 0.0, 1.0), (0.4, 0.0, 3.0), 0.2)),
    "a bulb's top in a great box": (BULB, box((-18.0, -17.0, 2.4), (22.0, 23.0, 42.0))),
    "two balls": (BULB, sphere((0.0, 0.7, 2.0), 0.3)),
    "a slanted rod through a plane": (ROD, plane((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))),
    "a slanted rod through a panel": (ROD, rectangle((1.0, 0.3, 1.0), (3, 0, 0), (0, 4, 0))),
    "a needle through a panel": (NEEDLE, rectangle((1.0, 0.3, 1.0), (3, 0, 0), (0, 4, 0))),
    "two beams that cross": (BEAM, box((0.31, -1.1, 0.98), (0.35, 0.9, 1.03))),
    "a rod through a beam": (BEAM, cylinder((0.43, 0.01, 0.1), (0.45, 0.0, 2.1), 0.01)),
    "a board's corner in a plane": (BOARD, plane((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))),
}
APART = {
    "a ball that touches a panel": (PANEL, sphere((0.1, 0.1, 1.8), 0.2)),
    "a box that stands on a panel": (PANEL, box((0.1, 0.1, 2.0), (0.3, 0.3, 2.4))),
    "a panel at a wall": (PANEL, rectangle((0.5, 0.0, 2.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.5))),
    "a panel on a ceiling": (PANEL, plane((0.0, 0.0, 2.0), (0.0, 0.0, -1.0))),
    "a panel in a corner of walls": (PANEL, triangle((0.5, 0.5, 2.0), (0.5, 0.5, 3.0), (2, 1, 1))),
    "a panel inside of a ball": (PANEL, sphere((0.0, 0.0, 2.0), 0.8)),
    "two balls that touch": (BULB, sphere((0.0, 0.8, 2.0), 0.3)),
    "a slanted rod over a panel": (ROD, rectangle((1.0, 0.3, 0.45), (3, 0, 0), (0, 4, 0))),
    "a beam that lies on another": (BEAM, box((0.31, -1.1, 1.02), (0.35, 0.9, 1.06))),
    "a rod that passes a beam": (BEAM, cylinder((0.43, 0.04, 0.1), (0.45, 0.04, 2.1), 0.01)),
    "a bulb in a box": (BULB, box((-1.0, -1.0, 1.0), (1.0, 1.0, 3.0))),
    "a board on its corner": (BOARD, plane((0.0, 0.0, 0.6), (0.0, 0.0, 1.0))),
    "a bulb on a slanted rod's axis": (BULB, cylinder((0.6, 0.0, 2.6), (1.6, 0.0, 3.6), 0.3)),
}


def between(pair, emission=1.0, at=AT):
    lamp, body = pair
    return irradiance(Scene.of(primitive(lamp, emission=emission), primitive(body)), at)


def somewhere_on(kind, u):
    """Points of a canonical surface, from uniform numbers: a body's on rays from its middle."""
    p = 2.0 * u - 1.0
    across, flat = np.hypot(p[:, 0], p[:, 1]), np.array([1.0, 1.0, 0.0])
    return {
        "Ellipsoids": p / np.linalg.norm(p, axis=1)[:, None],
        "Boxes": p / np.max(abs(p), 1)[:, None],
        "Cylinders": p / np.maximum(across, abs(p[:, 2]))[:, None],
        "Discs": p * flat / np.maximum(across, 1.0)[:, None],
        "Rectangles": p * flat,
        "Triangles": np.where(u[:, :1] + u[:, 1:2] < 1.0, u, 1.0 - u) * flat,
    }[kind]


@pytest.mark.parametrize("kind", [k for k in _collisions.SURFACES if k.__name__ != "Planes"])
def test_points_by_which_collisions_are_found_are_all_over_each_surface(kind):
    """Each place has one within a tenth of the shape's size, and none is elsewhere."""
    points = _collisions.SURFACES[kind]
    places = somewhere_on(kind.__name__, np.random.default_rng(0).uniform(size=(2000, 3)))
    apart = np.linalg.norm(places[:, None] - points, axis=2)
    assert apart.min(1).max() < 0.2
    on = _collisions._gauge(kind, places)
    if np.any(points[:, 2]):  # a body
        np.testing.assert_allclose(on, 1.0, rtol=1e-12)
        np.testing.assert_allclose(_collisions._gauge(kind, points), 1.0, rtol=1e-12)
        np.testing.assert_allclose(_collisions._gauge(kind, 0.7 * points), 0.7, rtol=1e-12)
    else:
        assert np.all(on <= 1.0 + 1e-12)
        assert np.all(_collisions._gauge(kind, points) <= 1.0 + 1e-12)
        np.testing.assert_array_equal(points[:, 2], 0.0)
        x, y = 2.0 * places[:, :2].T - 0.5
        inside = {
            "Discs": x * x + y * y < 1.0,
            "Rectangles": (abs(x) < 1.0) & (abs(y) < 1.0),
            "Triangles": (x > 0.0) & (y > 0.0) & (x + y < 1.0),
        }[kind.__name__]
        anywhere = np.stack([x, y, 0.0 * x], 1)
        np.testing.assert_array_equal(_collisions._gauge(kind, anywhere) < 1.0, inside)


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("which", MEET)
def test_concrete_shapes_that_run_into_each_other_are_refused(which, turn):
    lamp, body = (turned(shape, turn) for shape in MEET[which])
    assert len(find_collisions(Scene.of(primitive(lamp, emission=1.0), primitive(body)))) == 1
    assert len(find_collisions(Scene.of(primitive(lamp), primitive(body, emission=1.0)))) == 1
    if turn == 0:
        with pytest.raises(ValueError, match="run into each other"):
            between(MEET[which], emission=(1.0, 1.0))


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("which", APART)
def test_shapes_that_touch_are_apart(which, turn):
    lamp, body = (turned(shape, turn) for shape in APART[which])
    assert find_collisions(Scene.of(primitive(lamp, emission=1.0), primitive(body))) == []


def turned(shape, seed):
    """A shape after a turn and a move of the world; none for the first seed."""
    if seed == 0:
        return shape
    rng = np.random.default_rng(seed)
    turn, away = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-5.0, 5.0, 3)
    return type(shape)(np.asarray(shape.center) @ turn.T + away, turn @ np.asarray(shape.axes))


def test_what_makes_no_difference_is_not_refused():
    """Black in black, a lamp's dark back, what lies below the horizon, a light of one's own."""
    pair = MEET["a panel half in a box"]
    dark = Scene.of(*(primitive(shape) for shape in pair), environment=1.0)
    assert irradiance(dark, AT) > 0.0
    lit = Scene.of(*(primitive(s, emission=e) for s, e in zip(pair, ((0, 1), 0), strict=True)))
    over = Scene.of(*(primitive(s, emission=1.0) for s in pair), environment=1.0)
    below = receiver((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    for scene, at in ((lit, AT), (over, AT), (lit, below)):
        check_apart(scene, at)
    check_apart(over, AT, radiance=lambda index, along: along[2])


@pytest.mark.parametrize("turn", range(8))
def test_a_dome_and_the_floor_on_which_the_receiver_lies_meet_in_its_horizon(turn):
    """However the world is turned: rounding puts the floor's points above and below itself."""
    dome, floor = sphere((0.0, 0.0, 0.0), 0.3), rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    where = sphere((1.1, 0.3, 0.0), 1.0)
    dome, floor, where = (turned(shape, turn) for shape in (dome, floor, where))
    scene = Scene.of(primitive(dome, emission=1.0), primitive(floor))
    at = receiver(where.center[0], where.axes[0, :, 2], on=1)
    # Half of its cap of half-angle a, by rings about the normal.
    a, n = np.arcsin(0.3 / np.hypot(1.1, 0.3)), 400
    theta = 0.5 * np.pi - a * (np.arange(n) + 0.5) / n
    half = np.arccos(np.cos(a) / np.sin(theta))
    expected = np.sum(2.0 * half * np.cos(theta) * np.sin(theta)) * a / n
    np.testing.assert_allclose(irradiance(scene, at), expected, rtol=1e-3)


def test_derivatives_and_the_contour_form_are_refused_too():
    scene = Scene.of(
        *(primitive(s, emission=e) for s, e in zip(MEET["two balls"], (1.0, 2.0), strict=True))
    )
    for asked in (vector_irradiance, boundary_gradient, lambda *a: derivatives(irradiance, *a)):
        with pytest.raises(ValueError, match="0 and 1 run into each other"):
            asked(scene, AT)


def test_a_traced_receiver_is_warned_of_concrete_shapes_that_run_into_each_other():
    shapes = zip(MEET["two balls"], (1.0, 2.0), strict=True)
    scene = Scene.of(*(primitive(s, emission=e) for s, e in shapes))
    for asked in (irradiance, vector_irradiance, boundary_gradient):
        with pytest.warns(UserWarning, match="0 and 1 run into .* wrong where that line is seen"):
            jax.vmap(lambda x, asked=asked: asked(scene, AT.moved(x)))(jnp.zeros((2, 2)))


def test_a_receiver_on_one_of_them_or_under_equal_light_is_not_warned():
    floor, bulb = plane((0, 0, 0), (0, 0, 1)), sphere((2.0, 0.0, 0.2), 0.5)
    scene = Scene.of(primitive(floor), primitive(bulb, emission=1.0))
    alike = Scene.of(primitive(floor, emission=(1.0, 1.0)), primitive(bulb, emission=1.0))
    off = receiver((0.0, 0.0, 0.1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        at = receiver((0.0, 0.0, 0.0), on=1)  # the plane comes after the ball
        found = jax.vmap(lambda x: irradiance(scene, at.moved(x)))(jnp.zeros((2, 2)))
        equal = jax.vmap(lambda x: irradiance(alike, off.moved(x)))(jnp.zeros((2, 2)))
    assert np.all(found > 0.0)
    assert np.all(equal > 0.0)


def test_fault_light_that_passes_through_a_body_unseen(monkeypatch):
    monkeypatch.setattr(_collisions, "_entered", lambda a, body: np.zeros((0, 3)))
    with pytest.raises(AssertionError):
        test_concrete_shapes_that_run_into_each_other_are_refused("a panel half in a box", 1)


def test_light_below_zero_is_none():
    """Of traced shapes that run into each other; the numbers are from a random search."""
    lamp = (0.59, 0.34, 1.18), (-0.09, 0.45, -0.5), (0.25, 0.35, 0.36)
    center = 0.45, 0.39, 0.87
    light = jax.jit(lambda lamp, radius: between((rectangle(*lamp), sphere(center, radius))))
    assert np.isnan(light(jnp.array(lamp), 0.36))
    assert light(jnp.array(lamp), 0.01) >= 0.0
