"""Silhouettes as edges: where their levels vanish and how light jumps there, traced by NumPy."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.flatland import Arcs, Circles, Receiver, Scene, Segments, light_field, primitive
from tests.flatland.traced import ARC, COUNT, direction, limbs, met, place, scene, unit
from tests.flatland.worlds import bean

LEAVING, LEAVING_SLOPE = (Frame((*c.coordinates,), "outgoing") for c in (FLATLAND, FLATLAND_SLOPE))
FRAMES = {"in": FLATLAND, "slopes": FLATLAND_SLOPE, "out": LEAVING, "out, slopes": LEAVING_SLOPE}


class TwoSkies(eqx.Module):
    """Darker between two angles."""

    breaks: np.ndarray = eqx.field(default_factory=lambda: np.array([0.3, 2.9]))

    def __call__(self, angle):
        inside = (angle > self.breaks[0]) & (angle < self.breaks[1])
        return jnp.where(inside, 0.4 + 0.2 * jnp.sin(angle), 0.2 + 0.1 * jnp.cos(angle))


def uneven(number, s, front, along):
    """Light that varies over every shape and with direction."""
    return jnp.where(front, 1.0 + 0.5 * jnp.sin(3.0 * s) + 0.2 * number + 0.1 * along[0], 0.3 + s)


# A line among the shapes, none of which it crosses from x = -0.1 to 0.1; and one on a wall.
LINES = {
    "between": Receiver((0.4, 0.5), 0.15),
    "backwards": Receiver((0.4, 0.5), np.pi - 0.2),
    "on a wall": Receiver((0.3, 0.0), 0.0, 0),
}
TURN = 2.0 * np.pi
CASES = [(a, b) for a in LINES for b in FRAMES if "out" not in b or a != "on a wall"]


@functools.cache
def field(line, frame):
    world = scene(environment=TwoSkies())
    return light_field(world, LINES[line], frame=FRAMES[frame], radiance=uneven)


def eye_at(line, x):
    at = LINES[line]
    n = float(at.n)
    return np.asarray(at.position) + x * np.array([np.cos(n), np.sin(n)])


def facing(frame):
    return -1.0 if "out" in frame else 1.0


def angle_of(line, frame, w):
    """The label of light that comes from a direction."""
    n, w = float(LINES[line].n), facing(frame) * np.asarray(w)
    across = -np.array([np.cos(n), np.sin(n)])
    return np.arctan2(w @ across, w @ direction(n))


def silhouettes(line, x):
    """Points in the scene's order: ends of walls; limbs and ends of the arc; limbs of ovals."""
    eye, on = eye_at(line, x), int(LINES[line].on)
    found = [(shape, s, place(shape, s)) for shape in range(5) for s in (0.0, 1.0)]
    for shape in (5, 6, 7):
        for point in limbs(shape, eye):
            p = unit(shape, point, 1)
            turn = np.arctan2(p[0], p[1])
            s = np.mod(turn + ARC[2], 2 * np.pi) / abs(ARC[3]) if shape == 5 else turn / (2 * np.pi)
            found.append((shape, np.mod(s, 1.0) if shape > 5 else s, point))
        if shape == 5:
            found += [(5, s, place(5, s)) for s in (0.0, 1.0)]
    return eye, on, found


def nearest(eye, on, w):
    """Shape, distance, parameter and side that a ray meets first; -1 for the sky."""
    found = -1, np.inf, 0.0, 0
    for shape in set(range(COUNT)) - {on}:
        for t, s, side in met(shape, eye, w[None]):
            if t[0] < found[1]:
                found = shape, t[0], s[0], side[0]
    return found


def jump(line, frame, k, x):
    """Label of the k-th edge, and light beyond it less that before it."""
    eye, on, found = silhouettes(line, x)
    owner, own, point = found[k] if k < len(found) else (-2, 0.0, None)
    to = direction(TwoSkies().breaks[k - len(found)]) if point is None else point - eye
    label, far, light = angle_of(line, frame, to), np.hypot(*to), []
    for hair in (-1e-7, 1e-7):
        w = facing(frame) * direction(float(LINES[line].n) + label + hair)
        shape, t, s, side = nearest(eye, on, w)
        if shape < 0:
            light.append(TwoSkies()(np.arctan2(-w[0], w[1])))
            continue
        s = own if shape == owner and abs(t - far) < 2e-3 * far else s
        light.append(uneven(shape, s, side == 0, to / far))
    return label, float(light[1] - light[0])


# --- levels --------------------------------------------------------------------------------------


@eqx.filter_jit
def at_all(one, rays):
    return jax.vmap(one.at)(rays)


@pytest.mark.parametrize(("line", "frame"), CASES)
def test_a_level_vanishes_at_its_silhouette_alone_and_is_positive_beyond_it(line, frame):
    edges = field(line, frame).edges()
    eye, _, found = silhouettes(line, 0.05)
    seen = [point - eye for _, _, point in found] + list(direction(TwoSkies().breaks))
    labels, zeros = np.linspace(-1.5, 1.49, 61), 0
    for edge, to in zip(edges, seen, strict=True):
        zero = angle_of(line, frame, to)
        asked = np.append(labels, zero if abs(zero) < 1.5 else 0.0)
        second = np.tan(asked) if "slopes" in frame else asked
        rays = np.stack([np.full(len(asked), 0.05), second], -1)
        level = np.asarray(at_all(edge.level, rays))
        if abs(zero) < 1.5:
            assert level[-1] == pytest.approx(0.0, abs=1e-12)
            np.testing.assert_array_equal(np.sign(level[:-1]), np.sign(labels - zero))
            zeros += 1
        elif abs(zero) < np.pi - 1.5:  # not even for rays that lead away from it
            assert len(set(np.sign(level[:-1]))) == 1
    assert zeros >= 3


def test_levels_of_points_are_distances_to_the_right_of_the_ray_and_their_jets_closed_forms():
    """`(a - x) cos + h sin`, and in slopes `a - x + h v`, for a point at (a, h) from the line."""
    for frame in FRAMES:
        edge = field("between", frame).edges()[2]
        gap, n = place(1, 0.0) - [0.4, 0.5], 0.15
        a, h = gap @ [np.cos(n), np.sin(n)], gap @ direction(n)
        sign, (x, theta) = facing(frame), (0.07, 0.4)
        if "slopes" in frame:
            expected = a - x + h * np.tan(theta)
            assert edge.level(x, np.tan(theta)) == pytest.approx(sign * expected, rel=1e-13)
            continue
        c, s, gap = np.cos(theta), np.sin(theta), a - x
        jet = edge.level.jet(jnp.array([x, theta]))
        assert edge.level(x, theta) == pytest.approx(sign * (gap * c + h * s), rel=1e-13)
        assert jet.value == pytest.approx(sign * (gap * c + h * s), rel=1e-13)
        np.testing.assert_allclose(jet.gradient, [-sign * c, sign * (h * c - gap * s)], rtol=1e-13)
        bend = [[0.0, sign * s], [sign * s, -sign * (gap * c + h * s)]]
        np.testing.assert_allclose(jet.hessian, bend, rtol=1e-13, atol=1e-15)


def test_the_level_of_a_circle_is_how_far_the_ray_passes_it_by_over_its_squared_radius():
    center, radius, x, theta = np.array([-0.6, 1.2]), 0.3, 0.05, 0.2
    w = center - eye_at("between", x)
    u = direction(0.15 + theta)
    right = w[0] * u[1] - w[1] * u[0]  # how far the centre is to the right of the ray
    levels = [e.level(x, theta) for e in field("between", "in").edges()[14:16]]
    expected = np.array([right - radius, right + radius]) / radius**2
    np.testing.assert_allclose(levels, expected, rtol=1e-13)


@pytest.mark.parametrize("frame", [FLATLAND, LEAVING_SLOPE])
def test_levels_of_a_curve_are_angles_and_slopes_past_its_tangents(frame):
    """Those are where the angle turns back at which its places are seen one after the other."""
    slopes, sign = "v" in frame.coordinates, 1.0 if frame.sense == "incoming" else -1.0
    line = Receiver((0.1, 0.0), 0.2 if sign > 0.0 else 0.2 + np.pi)
    scene = Scene.of(primitive(bean(0.4, 1.5, 0.4), emission=1.0))
    found = light_field(scene, line, frame=frame).edges()
    levels = eqx.filter_jit(lambda level, u: jax.vmap(level.at)(u))
    a = np.linspace(0.0, 2.0 * np.pi, 200_001)
    places = 0.4 * np.stack([np.cos(a), 0.7 * np.sin(a) + 0.35 * np.cos(2.0 * a)], 1) + (0.4, 1.5)
    met = set()
    for x in sign * np.array([0.3, -2.0, 4.0]):
        eye = np.asarray(line.position + x * line.tangent)
        # Light comes from the place, or goes towards it.
        back = sign * (places - eye) @ np.asarray([line.tangent, line.normal]).T
        theta = np.arctan2(-back[:, 0], back[:, 1])
        turns = theta[1:-1][np.diff(np.sign(np.diff(theta))) != 0.0]
        true = np.sort(np.tan(turns) if slopes else turns)
        u = np.array([[x, 0.05], [x, 0.3]])
        values = np.stack([levels(e.level, u) for e in found])
        there = values[:, 0] != values[:, 1]
        assert np.all(values[~there] == 1.0)
        np.testing.assert_allclose(np.sort(0.05 - values[there, 0]), true, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(np.sort(0.3 - values[there, 1]), true, rtol=0.0, atol=1e-8)
        met.add(len(true))
    assert met == {2, 4}  # the dent is seen from some places only


def test_where_a_board_goes_through_a_disc_each_crossing_is_an_edge():
    board, disc = Segments((-1.0, 1.5), (1.0, 1.5)), Circles((0.0, 1.5), 0.3)
    scene, x = Scene.of(primitive(board), primitive(disc, emission=0.7)), 0.1
    f = light_field(scene, Receiver((0.0, 0.0), 0.0))
    rays = np.arctan2(x - np.array([-0.3, 0.3]), 1.5)
    levels = np.array([[e.level(x, angle).item() for angle in rays] for e in f.edges()[-2:]])
    met = np.abs(levels) < 1e-12
    assert met.sum(0).tolist() == [1, 1]
    assert met.sum(1).tolist() == [1, 1]


# --- jumps ---------------------------------------------------------------------------------------


@eqx.filter_jit
def with_slope(jumps, rays):
    """Jumps of one kind at their rays, and their derivatives in x."""

    def one(jump, u):
        return jax.jvp(lambda x: jump.at(u.at[0].set(x)), (u[0],), (jnp.ones_like(u[0]),))

    return jax.vmap(one)(jumps, rays)


def by_kind(edges):
    """Numbers of the edges of points, of limbs and of the sky, and the jumps of each stacked."""
    kinds = [getattr(e.jump, "limb", "sky") for e in edges]
    for kind in (False, True, "sky"):
        numbers = [k for k, one in enumerate(kinds) if one == kind]
        yield (
            numbers,
            jax.tree.map(lambda *leaves: jnp.stack(leaves), *(edges[k].jump for k in numbers)),
        )


@pytest.mark.parametrize(("line", "frame"), [("between", "in"), ("backwards", "out, slopes")])
def test_light_jumps_as_a_tracer_sees_it_and_so_does_its_derivative(line, frame):
    edges, x, h, sizeable = field(line, frame).edges(), 0.05, 1e-4, 0
    for numbers, jumps in by_kind(edges):
        true = np.array([[jump(line, frame, k, x + d) for d in (0.0, -h, h)] for k in numbers])
        labels, value = true[:, 0, 0], true[:, 0, 1]
        slope = (true[:, 2, 1] - true[:, 1, 1]) / (2.0 * h)
        there = np.abs(labels) < 1.5
        second = np.where(there, np.tan(labels) if "slopes" in frame else labels, 0.0)
        rays = jnp.asarray(np.stack([np.full(len(numbers), x), second], -1))
        found, change = with_slope(jumps, rays)
        np.testing.assert_allclose(np.asarray(found)[there], value[there], rtol=0.0, atol=3e-6)
        np.testing.assert_allclose(np.asarray(change)[there], slope[there], rtol=1e-4, atol=1e-4)
        if frame == "in":  # for rays that lead away from the edge there is none
            away, _ = with_slope(jumps, rays + jnp.array([0.0, np.pi]))
            np.testing.assert_array_equal(np.asarray(away)[there], 0.0)
        sizeable += np.sum(np.abs(value[there]) > 0.05)
    assert sizeable > 5


@eqx.filter_jit
def jet_of(one, u):
    return one.jet(u)


@pytest.mark.parametrize("R", [0.2, 30.0])
def test_light_jumps_at_a_limb_by_that_of_the_place_that_the_sight_touches(R):
    """On a disc that is brighter towards its right; from near, a hair beside the limb is far on it.

    The place touched is turned from the eye by `arccos(R / D)`, where D is the centre's distance.
    """
    disc = Scene.of(primitive(Circles((0.3, R + 1.0), R)))
    light = light_field(
        disc, Receiver((0.0, 0.0), 0.0), radiance=lambda i, s, front, way: 2.0 + jnp.sin(TURN * s)
    )

    def touched(x, side):
        w = np.array([x - 0.3, -R - 1.0])
        turn = np.arctan2(w[1], w[0]) - side * np.arccos(R / np.hypot(*w))
        to = np.array([0.3, R + 1.0]) + R * np.array([np.cos(turn), np.sin(turn)]) - [x, 0.0]
        return np.arctan2(-to[0], to[1]), -side * (2.0 + np.cos(turn))

    x, h = 0.05, 1e-5
    for edge, side in zip(light.edges(), (1.0, -1.0), strict=True):
        label, value = touched(x, side)
        slope = (touched(x + h, side)[1] - touched(x - h, side)[1]) / (2.0 * h)
        assert edge.level(x, label) == pytest.approx(0.0, abs=1e-12)
        found = jet_of(edge.jump, np.array([x, label]))
        assert found.value == pytest.approx(value, rel=1e-9)
        np.testing.assert_allclose(found.gradient, [slope, 0.0], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("far", [2.0, 1e3, 1e5])
def test_light_jumps_at_the_end_of_an_arc_from_its_outside_to_its_inside(far):
    bowl = Arcs((0.0, far), 0.1, np.pi, 1.5 * np.pi)  # open on the lower left, normals inward
    light = light_field(
        Scene.of(primitive(bowl)),
        Receiver((0.0, 0.0), 0.0),
        radiance=lambda number, s, front, along: jnp.where(front, 1.0, 0.25) + 0.0 * s,
    )
    start = light.edges()[2]
    ahead = jnp.zeros(2)
    assert abs(start.level.at(ahead)) < 1e-12 * far
    assert start.jump.at(ahead) == 0.75
