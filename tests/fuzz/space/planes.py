"""Classes of nasty scenes with planes, among balls, a box, a cylinder, a disc and flat shapes.

A plane hides things, cuts their outlines at its horizon and may shine. Dark planes go through dark
things; what shines is apart from all whose light is unlike its own, as `irradiance` asks, but for
planes, which may meet.
"""

from __future__ import annotations

import numpy as np

from tests.fuzz.classes import Classes
from tests.fuzz.space import classes
from tests.fuzz.space.classes import hairs
from tests.fuzz.space.layout import BALLS, LAMP, ROUNDS, SHEET, SKY, SOLID, Space, spared, unit

Rng = np.random.Generator
COUNT = 2  # planes
PLANES = slice(SKY - COUNT, SKY)  # rows of emission
# Names of all classes of space; those of scenes without planes are listed there.
CLASSES = Classes(classes.CLASSES)
nasty = CLASSES.nasty


def drawn(name: str, rng: Rng, count: int) -> Space:
    """So many scenes of a class, with planes or without."""
    if name in classes.CLASSES:
        return classes.drawn(name, rng, count)
    s = general(rng, count)
    CLASSES[name](s, rng)
    return spared(s)


def general(rng: Rng, count: int) -> Space:
    """Those without planes, a cylinder, a disc, two dark planes anyhow, and mostly a sky.

    Planes pass beside the lamp.
    """
    s = classes.general(rng, count)
    way = unit(s.rectangles[:, LAMP, 0] - s.at)
    toward = unit(way[:, None] + 0.8 * rng.normal(size=(count, 2, 3)))
    middles = s.at[:, None] + toward * rng.uniform(1.2, 2.5, (count, 2, 1))
    axes = np.linalg.qr(rng.normal(size=(count, 2, 3, 3)))[0]
    axes *= rng.uniform(0.02, 0.6, (count, 2, 3, 1))
    rounds = np.concatenate([middles[:, :, None], axes], 2)
    emission = np.zeros((count, s.emission.shape[1] + 2 + COUNT, 2))
    emission[:, LAMP] = s.emission[:, LAMP]
    emission[np.arange(count) % 4 > 0, SKY, 0] = 0.5
    s = s._replace(
        emission=emission,
        cylinders=rounds[:, :1],
        discs=rounds[:, 1:, :3],
        planes=np.zeros((count, COUNT, 3)),
        ups=rng.normal(size=(count, COUNT, 3)),
    )
    heights = 10.0 ** rng.uniform(-1.5, 0.5, (count, COUNT)) * rng.choice([-1, 1], (count, COUNT))
    for k in range(COUNT):
        put(s, rng, k, heights[:, k])
    return s


def put(s: Space, rng: Rng, k: int, height: np.ndarray) -> None:
    """Moves a plane to heights above receivers along its normal; beside the lamp if it is in it."""
    up = unit(s.ups[:, k])
    middle, *edges = np.moveaxis(s.rectangles[:, LAMP], 1, 0)
    half = sum(np.abs(np.sum(e * up, -1)) for e in edges) + rng.uniform(0.1, 0.3, len(up))
    aside = height - np.sum((middle - s.at) * up, -1)
    inside = np.abs(aside) < half
    height = height + inside * (np.copysign(half, aside) - aside)
    along = np.cross(up, rng.normal(size=up.shape))
    s.planes[:, k] = s.at + height[:, None] * up + along


def beyond(s: Space, k: int) -> np.ndarray:
    """How high all things are above receivers, as the normal of a plane goes, or less."""
    up = unit(s.ups[:, k])

    def top(middles, edges=()):
        heights = np.sum((middles - s.at[:, None]) * up[:, None], -1)
        return np.max(heights + sum(np.abs(np.sum(e * up[:, None], -1)) for e in edges), -1)

    balls = s.spheres.copy()
    balls[..., :3] += balls[..., 3:] * up[:, None]
    solids = np.concatenate([s.box[:, None], s.cylinders], 1)
    sheets = np.concatenate([s.rectangles[:, :1], s.discs], 1)
    bodies = [np.moveaxis(a, 2, 0) for a in (solids, sheets)]
    tops = [top(balls[..., :3]), top(s.triangle), *(top(m, edges) for m, *edges in bodies)]
    return np.max([*tops, np.zeros(len(up))], 0)


def level(s: Space, points: np.ndarray, k: int) -> np.ndarray:
    """Points at their distances from receivers in the horizon of a plane."""
    up, way = unit(s.ups[:, k]), points - s.at
    flat = way - np.sum(way * up, -1, keepdims=True) * up
    return s.at + np.linalg.norm(way, axis=-1, keepdims=True) * unit(flat)


@nasty
def planes_anyhow(s, rng):
    """As they come."""


@nasty
def floor(s, rng):
    """A floor along the axes, seen from above by receivers that face it, the side or the sky."""
    s.ups[:, 0] = [0.0, 0.0, 1.0]
    put(s, rng, 0, -(10.0 ** rng.uniform(-2.0, 0.0, len(s.at))))
    facing = rng.integers(0, 4, len(s.at))
    for which, normal in ((0, [0.0, 0.0, 1.0]), (1, [1.0, 0.0, 0.0]), (2, [0.0, 0.0, -1.0])):
        s.normal[facing == which] = normal


@nasty
def shining_planes(s, rng):
    """Two parallel planes that shine, beyond all things on both sides."""
    s.ups[:, 1] = -s.ups[:, 0]
    s.emission[:, PLANES] = rng.uniform(0.1, 1.0, (len(s.at), COUNT, 2))
    for k in range(COUNT):
        put(s, rng, k, beyond(s, k) + rng.uniform(0.1, 1.0, len(s.at)))


@nasty
def planes_that_meet(s, rng):
    """Two planes that shine, beyond all things, at any angle or all but parallel."""
    near = 10.0 ** rng.uniform(-4.0, 0.0, (len(s.at[::2]), 1))
    s.ups[::2, 1] = unit(s.ups[::2, 0]) + near * rng.normal(size=s.ups[::2, 0].shape)
    s.emission[:, PLANES] = rng.uniform(0.1, 1.0, (len(s.at), COUNT, 2))
    for k in range(COUNT):
        put(s, rng, k, beyond(s, k) + rng.uniform(0.1, 1.0, len(s.at)))
    # The normals of every third are turned away from the receiver.
    s.ups[::3] *= -1.0


@nasty
def all_shine(s, rng):
    """Everything shines, and is apart from all else: a thing on each side of the receiver."""
    count = len(s.at)
    turn = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    ways = np.concatenate([turn, -turn], 1)
    spots = s.at[:, None] + ways * rng.uniform(1.2, 2.0, (count, 6, 1))
    s.spheres[:, :, :3] = spots[:, :2]
    s.spheres[..., 3] = np.minimum(s.spheres[..., 3], 0.5)
    for k, solid in ((2, s.box), (3, s.cylinders[:, 0]), (4, s.discs[:, 0])):
        solid[:, 0] = spots[:, k]
        solid[:, 1:] *= 0.7
    s.triangle[:] = spots[:, 5:] + 0.5 * unit(rng.normal(size=(count, 3, 3)))
    for rows in (BALLS, [SOLID], [SHEET], slice(ROUNDS, ROUNDS + 2)):
        many = s.emission[:, rows].shape[1]
        s.emission[:, rows] = rng.uniform(0.1, 1.0, (count, many, 2))
    s.normal[:] = unit(rng.normal(size=(count, 3)))
    shining_planes(s, rng)


@nasty
def corner(s, rng):
    """A wall that stands on a floor, and a receiver that may be near both."""
    s.ups[:, 0] = s.normal
    s.ups[::2, 0] = unit(rng.normal(size=s.ups[::2, 0].shape))
    s.ups[:, 1] = np.cross(s.ups[:, 0], s.ups[:, 1])
    for k in range(COUNT):
        put(s, rng, k, -(10.0 ** rng.uniform(-3.0, 0.0, len(s.at))))


@nasty
def plane_in_the_horizon(s, rng):
    """A plane with the normal of the receiver, before or behind it, and one on edge before it."""
    s.ups[:, 0] = s.normal * rng.choice([-1.0, 1.0], (len(s.at), 1))
    s.ups[:, 1] = np.cross(s.normal, s.ups[:, 1])
    for k in range(COUNT):
        sides = rng.choice([-1.0, 1.0], len(s.at))
        put(s, rng, k, sides * 10.0 ** rng.uniform(-2.0, 0.5, len(s.at)))


@nasty
def in_its_horizon(s, rng):
    """The middles of round things, of the box and of the lamp, and a corner, in a plane's horizon.

    Of every fourth lamp an edge lies in it.
    """
    for bodies in (s.spheres[:, 0], s.spheres[:, 1], s.cylinders[:, 0, 0], s.discs[:, 0, 0]):
        bodies[:, :3] = level(s, bodies[:, :3], 0)
    for points in (s.box[:, 0], s.triangle[:, 0], s.rectangles[:, LAMP, 0]):
        points[:] = level(s, points, 0)
    edges = s.rectangles[:, LAMP, 1:]
    edges[::2, 1] = np.cross(edges[:, 0], unit(s.ups[:, 0]))[::2]
    s.rectangles[::4, LAMP, 0] += edges[::4, 0]
    put(s, rng, 0, rng.choice([-4.0, 4.0], len(s.at)))
    put(s, rng, 1, rng.choice([-4.0, 4.0], len(s.at)))
    s.normal[:] = unit(s.rectangles[:, LAMP, 0] - s.at + 0.7 * rng.normal(size=s.at.shape))


@nasty
def standing(s, rng):
    """Balls, box, cylinder, disc and triangle that stand or lie on a floor."""
    up, beside, around = np.moveaxis(np.linalg.qr(rng.normal(size=(len(s.at), 3, 3)))[0], 1, 0)
    s.ups[:, 0] = up
    drop = rng.uniform(0.05, 1.0, len(s.at))
    put(s, rng, 0, -drop)

    def foot(points):
        return points - np.sum((points - s.planes[:, 0]) * up, -1, keepdims=True) * up

    for k in range(2):
        s.spheres[:, k, :3] = foot(s.spheres[:, k, :3]) + s.spheres[:, k, 3:] * up
    for solid in (s.box, s.cylinders[:, 0]):
        sizes = np.linalg.norm(solid[:, 1:], axis=-1, keepdims=True)
        solid[:, 1:] = sizes * np.stack([beside, around, up], 1)
        solid[:, 0] = foot(solid[:, 0]) + solid[:, 3]
    sizes = np.linalg.norm(s.discs[:, 0, 1:], axis=-1, keepdims=True)
    s.discs[:, 0, 1:] = sizes * np.stack([beside, around], 1)
    s.discs[:, 0, 0] = foot(s.discs[:, 0, 0])
    s.triangle[:, 0], s.triangle[:, 1] = foot(s.triangle[:, 0]), foot(s.triangle[:, 1])


@nasty
def lamp_on_a_plane(s, rng):
    """A lamp drawn on a plane, which is a ceiling or a wall."""
    middle, u, v = np.moveaxis(s.rectangles[:, LAMP], 1, 0)
    s.ups[:, 0] = np.cross(u, v)
    s.planes[:, 0] = middle + u + 3.0 * v


@nasty
def near_a_plane(s, rng):
    """A receiver a hair off a plane, above it or below, which it faces or not."""
    count = len(s.at)
    put(s, rng, 0, hairs(rng, count)[:, 0] * rng.choice([-1.0, 1.0], count))
    up = unit(s.ups[:, 0])
    s.normal[::2] = up[::2] * rng.choice([-1.0, 1.0], (len(up[::2]), 1))


@nasty
def on_a_plane(s, rng):
    """A receiver on a plane that it names, along its normal or tilted."""
    s.ups[::2, 0] = s.normal[::2] * rng.uniform(0.5, 2.0, (len(s.ups[::2]), 1))
    s.planes[:, 0] = s.at
    s.planes[1::2, 0] += np.cross(s.ups[1::2, 0], rng.normal(size=s.at[1::2].shape))
    s.on[:] = s.plane_number


@nasty
def between_planes(s, rng):
    """Two parallel planes with the receiver between them or outside of both."""
    s.ups[:, 1] = s.ups[:, 0] * rng.choice([-2.0, 1.0], (len(s.at), 1))
    for k in range(COUNT):
        sides = rng.choice([-1.0, 1.0], len(s.at))
        put(s, rng, k, sides * 10.0 ** rng.uniform(-1.0, 0.3, len(s.at)))


@nasty
def planes_far_off(s, rng):
    """All of it 1,000 away from the origin, and a plane as far away from all of it."""
    put(s, rng, 1, np.full(len(s.at), 1e3))
    shift = 1e3 * unit(rng.normal(size=(len(s.at), 3)))
    for a in s.places:
        a += shift.reshape(len(shift), *(1,) * (a.ndim - 2), 3)


@nasty
def small_planes(s, rng):
    """Lengths of 1e-5."""
    for a in s.lengths:
        a *= 1e-5
