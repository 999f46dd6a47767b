"""Classes of nasty scenes of space, drawn by the batch: each changes scenes of a general kind."""

from __future__ import annotations

import numpy as np

from tests.fuzz.classes import Classes
from tests.fuzz.space.layout import BACK, BALL, FRONT, LAMP, Space, spared, unit

Rng = np.random.Generator
CLASSES = Classes()
nasty = CLASSES.nasty


def drawn(name: str, rng: Rng, count: int) -> Space:
    """So many scenes of a class."""
    s = general(rng, count)
    CLASSES[name](s, rng)
    return spared(s)


def general(rng: Rng, count: int) -> Space:
    """Blockers around the receiver that it is not in, and a lamp beyond them that faces it."""
    way = unit(rng.normal(size=(count, 3)))
    middle = way * rng.uniform(4.5, 5.5, (count, 1))
    u = rng.normal(size=(count, 3)) * rng.uniform(0.2, 1.0, (count, 1))
    v = np.cross(u, way) * rng.uniform(0.2, 1.0, (count, 1))
    v = v * np.sign(np.sum(np.cross(u, v) * -way, -1, keepdims=True))
    lamp = np.stack([middle, u, v], 1)
    emission = np.zeros((count, 7, 2))
    emission[:, LAMP] = FRONT, BACK
    at, normal = rng.uniform(-0.5, 0.5, (count, 3)), unit(way + 0.7 * rng.normal(size=(count, 3)))
    radii = 10.0 ** rng.uniform(-2.0, -0.2, (count, 2, 1))
    toward = unit(way[:, None] + 0.6 * rng.normal(size=(count, 2, 3)))
    reach = radii * (1.0 + rng.uniform(0.05, 2.0, (count, 2, 1))) + 0.3
    balls = np.concatenate([at[:, None] + toward * reach, radii], -1)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0] * rng.uniform(0.02, 0.4, (count, 3, 1))
    toward = unit(way + 0.6 * rng.normal(size=(count, 3)))
    box = np.concatenate([(at + toward * rng.uniform(0.9, 1.8, (count, 1)))[:, None], axes], 1)
    corners = at[:, None] + rng.uniform(0.2, 2.0, (count, 1, 1)) * unit(
        way[:, None] + 0.8 * rng.normal(size=(count, 3, 3))
    )
    lamps = np.stack([lamp, lamp], 1)
    none = [np.zeros((count, 0, *shape)) for shape in ((4, 3), (3, 3), (3,), (3,))]
    return Space(lamps, emission, balls, box, corners, *none, at, normal, np.full(count, -1.0))


@nasty
def random(s, rng):
    """As they come."""


@nasty
def quarters(s, rng):
    """All coordinates on a grid, along the axes."""
    for a in s.lengths:
        a[:] = np.round(a * 4.0) / 4.0
    s.spheres[..., 3] = np.maximum(s.spheres[..., 3], 0.25)
    sizes = np.maximum(np.abs(s.box[:, 1:]).max(-1), 0.25)
    s.box[:, 1:] = sizes[..., None] * np.eye(3)
    s.rectangles[:, LAMP, 1:] += 0.25 * np.eye(3)[:2]
    s.normal[:] = np.eye(3)[rng.integers(0, 3, len(s.at))] * rng.choice([-1.0, 1.0], (len(s.at), 1))


@nasty
def touching(s, rng):
    """A ball that touches the other one, and a box."""
    way = unit(rng.normal(size=(len(s.at), 3)))
    s.spheres[:, 1, :3] = s.spheres[:, 0, :3] + way * np.sum(s.spheres[..., 3], -1)[:, None]
    out = unit(s.box[:, 1])
    s.box[:, 0] = s.spheres[:, 0, :3] + s.spheres[:, 0, 3:] * out + s.box[:, 1]


@nasty
def equal(s, rng):
    """Two balls in one place, and a triangle on the lamp's or the box's plane."""
    s.spheres[:, 1] = s.spheres[:, 0]
    corner, edges = s.box[:, 0] - s.box[:, 1:].sum(1), 2.0 * s.box[:, 1:]
    s.triangle[:] = np.stack([corner, corner + edges[:, 0], corner + edges[:, 1]], 1)


@nasty
def one_cone(s, rng):
    """Two balls behind each other with one outline, as seen by the receiver."""
    k = rng.uniform(0.3, 3.0, (len(s.at), 1))
    s.spheres[:, 1, :3] = s.at + k * (s.spheres[:, 0, :3] - s.at)
    s.spheres[:, 1, 3:] = k * s.spheres[:, 0, 3:]


@nasty
def overhead(s, rng):
    """A ball, a box and the lamp's middle straight above the receiver."""
    distance = np.linalg.norm(s.spheres[:, 0, :3] - s.at, axis=-1, keepdims=True)
    s.spheres[:, 0, :3] = s.at + distance * s.normal
    s.box[:, 0] = s.at + 1.5 * s.normal
    s.rectangles[:, LAMP, 0] = s.at + 5.0 * s.normal


@nasty
def horizon(s, rng):
    """The middles of a ball and the lamp, and a corner of the triangle, in the horizon."""

    def level(points):
        return points - np.sum((points - s.at) * s.normal, -1, keepdims=True) * s.normal

    s.normal[::2] = [0.0, 0.0, 1.0]
    distance = np.linalg.norm(s.spheres[:, 0, :3] - s.at, axis=-1, keepdims=True)
    s.spheres[:, 0, :3] = s.at + distance * unit(level(s.spheres[:, 0, :3]) - s.at)
    s.rectangles[:, LAMP, 0] = s.at + 5.0 * unit(level(s.rectangles[:, LAMP, 0]) - s.at)
    s.triangle[:, 0] = level(s.triangle[:, 0])


@nasty
def edge_on(s, rng):
    """The triangle's plane, and every other lamp's, goes through the receiver."""
    s.triangle[:, 2] = s.at + rng.uniform(0.3, 0.9, (len(s.at), 1)) * (s.triangle[:, 0] - s.at)
    way = s.rectangles[::2, LAMP, 0] - s.at[::2]
    s.rectangles[::2, LAMP, 2] = 0.1 * way


@nasty
def in_line(s, rng):
    """Corners of triangle and box in one line with one of the lamp's."""
    lamp = s.rectangles[:, LAMP]
    way = lamp[:, 0] + lamp[:, 1] + lamp[:, 2] - s.at
    s.triangle[:, 0] = s.at + rng.uniform(0.05, 0.15, (len(way), 1)) * way
    s.box[:, 0] = s.at + rng.uniform(0.3, 0.5, (len(way), 1)) * way + s.box[:, 1:].sum(1)


@nasty
def edges_in_line(s, rng):
    """An edge of the triangle that covers one of the lamp's."""
    middle, u, v = np.moveaxis(s.rectangles[:, LAMP], 1, 0)
    k = rng.uniform(0.1, 0.4, (len(s.at), 1))
    s.triangle[:, 0] = s.at + k * (middle + u + v - s.at)
    s.triangle[:, 1] = s.at + k * (middle + u - v - s.at)


@nasty
def sliver(s, rng):
    """A triangle, and every other lamp, that is a thousand to a billion times as long as wide."""
    thin = 10.0 ** rng.uniform(-9.0, -3.0, (len(s.at), 1))
    s.triangle[:, 2] = s.triangle[:, 1] + thin * (s.triangle[:, 2] - s.triangle[:, 1])
    s.rectangles[::2, LAMP, 2] *= thin[::2]


@nasty
def without_area(s, rng):
    """A triangle whose corners lie in a line, or are one point."""
    share = rng.choice([0.0, 0.5, 1.0, 2.0], (len(s.at), 1))
    s.triangle[:, 2] = s.triangle[:, 0] + share * (s.triangle[:, 1] - s.triangle[:, 0])


@nasty
def lamp_on_a_wall(s, rng):
    """A lamp drawn on a triangle that is larger."""
    middle, u, v = np.moveaxis(s.rectangles[:, LAMP], 1, 0)
    s.triangle[:] = np.stack([middle - 3.0 * (u + v), middle + 5.0 * u, middle + 5.0 * v], 1)


@nasty
def lamp_in_a_body(s, rng):
    """A lamp that runs into a ball or a box."""
    middle = s.rectangles[:, LAMP, 0] + s.rectangles[:, LAMP, 1]
    s.spheres[::2, 0, :3] = middle[::2]
    s.box[1::2, 0] = middle[1::2]


def hairs(rng: Rng, count: int) -> np.ndarray:
    """How far off a wall receivers are that are near one [m]."""
    return 10.0 ** rng.uniform(-14.0, -3.0, (count, 1))


@nasty
def near_a_ball(s, rng):
    """A receiver a hair outside of a ball, which on every other one stands on its horizon."""
    way = unit(rng.normal(size=(len(s.at), 3)))
    level = unit(way - np.sum(way * s.normal, -1, keepdims=True) * s.normal)
    way[::2] = level[::2]
    s.spheres[:, 0, :3] = s.at - (s.spheres[:, 0, 3:] + hairs(rng, len(way))) * way


@nasty
def near_a_box(s, rng):
    """A receiver a hair off a box."""
    out, count = s.box[:, 1], len(s.at)
    aside = np.sum(rng.uniform(-0.9, 0.9, (count, 2, 1)) * s.box[:, 2:], 1)
    s.box[:, 0] = s.at - out - hairs(rng, count) * unit(out) + aside


@nasty
def near_a_triangle(s, rng):
    """A receiver a hair off a triangle."""
    a, b, c = np.moveaxis(s.triangle, 1, 0)
    shares = rng.dirichlet([1.0, 1.0, 1.0], len(s.at))
    foot = np.einsum("bk,bki->bi", shares, s.triangle)
    hair = hairs(rng, len(s.at)) * unit(np.cross(b - a, c - a))
    s.triangle[:] += (s.at + hair - foot)[:, None]


@nasty
def inside(s, rng):
    """A receiver in a ball or in a box."""
    s.spheres[::2, 0, :3] = s.at[::2] + 0.5 * s.spheres[::2, 0, 3:] * s.normal[::2]
    s.box[1::2, 0] = s.at[1::2] + 0.5 * s.box[1::2, 1]


@nasty
def on_a_shape(s, rng):
    """A receiver on a ball or on a triangle that it names."""
    odd = np.arange(len(s.at)) % 2 == 1
    s.spheres[~odd, 0, :3] = (s.at - s.spheres[:, 0, 3:] * s.normal)[~odd]
    a, b, c = np.moveaxis(s.triangle, 1, 0)
    normal = unit(np.cross(b - a, c - a))
    normal *= np.sign(np.sum(normal * s.normal, -1, keepdims=True))
    foot = np.einsum("bk,bki->bi", rng.dirichlet([1.0, 1.0, 1.0], len(s.at)), s.triangle)
    s.triangle[odd] += (s.at - foot)[odd, None]
    s.normal[odd] = normal[odd]
    s.on[:] = np.where(odd, s.triangle_number, BALL)


def _scaled(s: Space, scale: float) -> None:
    for a in s.lengths:
        a *= scale


@nasty
def tiny(s, rng):
    """Lengths of 1e-8."""
    _scaled(s, 1e-8)


@nasty
def small(s, rng):
    """Lengths of 1e-5."""
    _scaled(s, 1e-5)


@nasty
def huge(s, rng):
    """Lengths of 1e8."""
    _scaled(s, 1e8)


@nasty
def far_off(s, rng):
    """All of it 10,000 away from the origin."""
    shift = 1e4 * unit(rng.normal(size=(len(s.at), 3)))
    for a in s.places:
        a += shift.reshape(len(shift), *(1,) * (a.ndim - 2), 3)


@nasty
def mixed_sizes(s, rng):
    """A lamp up to 1e4 times as large and far, and a ball down to 1e-6."""
    middle = s.rectangles[:, LAMP]
    s.rectangles[:, LAMP] = middle * 10.0 ** rng.uniform(0.0, 4.0, (len(middle), 1, 1))
    s.spheres[:, 0, 3] *= 10.0 ** rng.uniform(-6.0, 0.0, len(middle))
