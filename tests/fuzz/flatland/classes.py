"""Classes of nasty scenes of flatland, drawn by the batch: each changes scenes of a general kind.

A class takes scenes and a generator of random numbers, and puts what is nasty into the scenes.
"""

from __future__ import annotations

import numpy as np

from tests.fuzz.classes import Classes
from tests.fuzz.flatland.layout import (
    ARC,
    BACK,
    CIRCLE,
    FIRST,
    FRONT,
    LAMP,
    SECOND,
    Flat,
    direction,
    spared,
)

Rng = np.random.Generator
CLASSES = Classes()
nasty = CLASSES.nasty


def drawn(name: str, rng: Rng, count: int) -> Flat:
    """So many scenes of a class."""
    s = general(rng, count)
    CLASSES[name](s, rng)
    return spared(s)


def general(rng: Rng, count: int) -> Flat:
    """Blockers of all sizes around the receiver, and a lamp beyond them that faces it mostly."""
    segments = rng.uniform(-1.5, 1.5, (count, 4, 2, 2))
    middle = direction(rng.uniform(-np.pi, np.pi, count)) * rng.uniform(3.0, 4.0, (count, 1))
    half = rng.normal(size=(count, 2)) * rng.uniform(0.05, 0.5, (count, 1))
    segments[:, LAMP] = np.stack([middle + half, middle - half], 1)
    emission = np.zeros((count, 4, 2))
    emission[:, LAMP] = FRONT, BACK
    radii = 10.0 ** rng.uniform(-2.0, -0.1, (count, 2, 1))
    circles = np.concatenate([rng.uniform(-1.5, 1.5, (count, 2, 2)), radii], -1)
    turns = rng.uniform(-1.0, 1.0, (count, 2)) * [np.pi, 2.0 * np.pi]
    sizes = 10.0 ** rng.uniform(-2.0, 0.0, (count, 1))
    arc = np.concatenate([rng.uniform(-1.0, 1.0, (count, 2)), sizes, turns], -1)
    facing = np.arctan2(-middle[:, 0], middle[:, 1]) + rng.normal(size=count)
    at = np.concatenate([rng.uniform(-1.0, 1.0, (count, 2)), facing[:, None]], -1)
    return Flat(segments, emission, circles, arc, at, np.full(count, -1.0))


@nasty
def random(s, rng):
    """As they come."""


@nasty
def quarters(s, rng):
    """All coordinates on a grid, so that much coincides; lamps may be crossed."""
    for a in (s.segments, s.circles, s.arc[:, :3], s.at[:, :2]):
        a[:] = np.round(a * 2.0) / 4.0
    s.circles[..., 2] = np.maximum(s.circles[..., 2], 0.25)
    s.arc[:, 2] = np.maximum(s.arc[:, 2], 0.25)
    for a in (s.arc[:, 3:], s.at[:, 2:]):
        a[:] = np.round(a / (np.pi / 4)) * (np.pi / 4)
    s.arc[:, 4] = np.where(s.arc[:, 4] == 0.0, np.pi / 2, s.arc[:, 4])


@nasty
def shared_ends(s, rng):
    """Walls that begin where the lamp ends, and where each other ends."""
    s.segments[:, FIRST, 0] = s.segments[:, LAMP, 1]
    s.segments[:, SECOND, 0] = s.segments[:, FIRST, 1]
    radius = direction(s.arc[:, 3]) * s.arc[:, 2:3]
    s.arc[:, :2] = s.segments[:, SECOND, 1] - radius


@nasty
def touching(s, rng):
    """Circles that touch each other, and a wall that touches the first."""
    way = direction(rng.uniform(-np.pi, np.pi, len(s.at)))
    s.circles[:, 1, :2] = s.circles[:, 0, :2] + way * np.sum(s.circles[..., 2], -1)[:, None]
    side = direction(rng.uniform(-np.pi, np.pi, len(s.at)))
    along = np.stack([-side[:, 1], side[:, 0]], -1)
    middle = s.circles[:, 0, :2] + side * s.circles[:, 0, 2:]
    reach = rng.uniform(0.1, 1.0, (len(s.at), 2, 1)) * [[1.0], [-1.0]]
    s.segments[:, FIRST] = middle[:, None] + reach * along[:, None]


@nasty
def in_line(s, rng):
    """Ends of the lamp and of both walls in one line with the receiver."""
    way = s.segments[:, LAMP, 0] - s.at[:, :2]
    for wall in (FIRST, SECOND):
        s.segments[:, wall, 0] = s.at[:, :2] + rng.uniform(0.1, 0.9, (len(way), 1)) * way


@nasty
def in_line_exactly(s, rng):
    """The same without rounding: the receiver at the origin, and powers of two."""
    s.at[:, :2] = 0.0
    s.segments[:, FIRST, 0] = 0.5 * s.segments[:, LAMP, 0]
    s.segments[:, SECOND, 0] = 0.25 * s.segments[:, LAMP, 0]
    s.circles[:, 0, :2] = 0.125 * s.segments[:, LAMP, 1]


@nasty
def without_length(s, rng):
    """A wall that is a point, a tiny circle, an arc that hardly turns."""
    s.segments[:, FIRST, 1] = s.segments[:, FIRST, 0]
    s.circles[:, 0, 2] = 10.0 ** rng.uniform(-12.0, -6.0, len(s.at))
    s.arc[:, 4] = 10.0 ** rng.uniform(-12.0, -6.0, len(s.at))


@nasty
def edge_on(s, rng):
    """A wall, and every other lamp, along the line of sight."""
    for number, every in ((FIRST, 1), (LAMP, 2)):
        start = s.segments[::every, number, 0]
        shares = rng.uniform(0.5, 0.9, (len(start), 1))
        at = s.at[::every, :2]
        s.segments[::every, number, 1] = at + shares * (start - at)


@nasty
def on_one_line(s, rng):
    """A wall on the line of the lamp: beside it, end to end, or overlapping."""
    start, edge = s.segments[:, LAMP, 0], s.segments[:, LAMP, 1] - s.segments[:, LAMP, 0]
    shares = rng.uniform(-1.0, 2.0, (len(start), 2, 1))
    shares[::3, 0] = 1.0
    s.segments[:, FIRST] = start[:, None] + shares * edge[:, None]


@nasty
def lamp_on_a_wall(s, rng):
    """A lamp drawn on a longer wall."""
    start, edge = s.segments[:, LAMP, 0], s.segments[:, LAMP, 1] - s.segments[:, LAMP, 0]
    s.segments[:, FIRST] = np.stack([start - 0.5 * edge, start + 1.5 * edge], 1)


@nasty
def equal(s, rng):
    """Two of each in the same place, and an arc that is a circle."""
    s.segments[:, SECOND] = s.segments[:, FIRST]
    s.circles[:, 1] = s.circles[:, 0]
    s.arc[:, :3] = s.circles[:, 0]
    s.arc[::2, 4] = 2.0 * np.pi


@nasty
def horizon(s, rng):
    """An end of the lamp, a wall and the middle of a circle in the receiver's horizon."""
    s.at[:, 2] = 0.0
    level = s.at[:, 1]
    s.segments[:, LAMP, 0, 1] = level
    s.segments[:, FIRST, :, 1] = level[:, None]
    s.circles[:, 0, 1] = level
    far = s.at[:, 0] + (1.0 + rng.uniform(0.0, 1.0, len(level))) * s.circles[:, 0, 2]
    s.circles[:, 0, 0] = far
    s.segments[:, FIRST, :, 0] = far[:, None] + rng.uniform(1.0, 2.0, (len(level), 2))


@nasty
def inside(s, rng):
    """A receiver in a circle, whose inside is as dark as its outside."""
    s.circles[:, 0, 2] = 10.0 ** rng.uniform(-1.0, 0.5, len(s.at))
    offset = direction(rng.uniform(-np.pi, np.pi, len(s.at))) * s.circles[:, 0, 2:]
    s.circles[:, 0, :2] = s.at[:, :2] + rng.uniform(0.0, 0.99, (len(s.at), 1)) * offset


def _distances(rng: Rng, count: int) -> np.ndarray:
    return 10.0 ** rng.uniform(-14.0, -3.0, (count, 1))


@nasty
def near_a_circle(s, rng):
    """A receiver a hair outside of a circle."""
    side = direction(rng.uniform(-np.pi, np.pi, len(s.at)))
    reach = s.circles[:, 0, 2:] + _distances(rng, len(side))
    s.circles[:, 0, :2] = s.at[:, :2] - reach * side


@nasty
def near_a_wall(s, rng):
    """A receiver a hair off a wall."""
    way = direction(rng.uniform(-np.pi, np.pi, len(s.at)))
    along = np.stack([-way[:, 1], way[:, 0]], -1)
    reach = rng.uniform(0.0, 1.0, (len(way), 2, 1)) * [[1.0], [-1.0]]
    foot = s.at[:, :2] + _distances(rng, len(way)) * way
    s.segments[:, FIRST] = foot[:, None] + reach * along[:, None]


@nasty
def near_an_end(s, rng):
    """A receiver a hair off the end of a wall, and of an arc."""
    count = len(s.at)
    side = direction(rng.uniform(-np.pi, np.pi, (2, count)))
    s.segments[:, FIRST, 0] = s.at[:, :2] + _distances(rng, count) * side[0]
    s.arc[:, :2] = s.at[:, :2] + _distances(rng, count) * side[1]
    s.arc[:, :2] -= direction(s.arc[:, 3]) * s.arc[:, 2:3]


@nasty
def on_a_wall(s, rng):
    """A receiver on a wall that it names."""
    shares = rng.uniform(0.0, 1.0, (len(s.at), 1))
    shares[::7], shares[1::7] = 0.0, 1.0
    start, end = s.segments[:, FIRST, 0], s.segments[:, FIRST, 1]
    s.at[:, :2] = start + shares * (end - start)
    s.at[:, 2] = np.arctan2(-(start - end)[:, 1], (end - start)[:, 0]) + np.pi
    s.on[:] = FIRST


@nasty
def on_a_circle(s, rng):
    """A receiver on the outside of a circle, or on an arc, that it names."""
    angle, odd = rng.uniform(-np.pi, np.pi, len(s.at)), np.arange(len(s.at)) % 2 == 1
    angle = np.where(odd, s.arc[:, 3] + rng.uniform(0.0, 1.0, len(angle)) * s.arc[:, 4], angle)
    ring = np.where(odd[:, None], s.arc[:, :3], s.circles[:, 0])
    s.at[:, :2] = ring[:, :2] + ring[:, 2:] * direction(angle)
    s.at[:, 2] = angle + np.where(odd & (s.arc[:, 4] > 0.0), np.pi, 0.0)
    s.on[:] = np.where(odd, ARC, CIRCLE)


@nasty
def hardly_crossing(s, rng):
    """A wall that crosses the lamp, or stops before it, by a hair."""
    start, edge = s.segments[:, LAMP, 0], s.segments[:, LAMP, 1] - s.segments[:, LAMP, 0]
    foot = start + rng.uniform(0.0, 1.0, (len(start), 1)) * edge
    way = direction(rng.uniform(-np.pi, np.pi, len(start)))
    hair = 10.0 ** rng.uniform(-16.0, -1.0, (len(start), 1)) * rng.choice([-1.0, 1.0], (1, 1))
    s.segments[:, FIRST] = np.stack([foot - hair * way, foot + way], 1)


def _scaled(s: Flat, scale) -> None:
    for a in (s.segments, s.circles, s.arc[:, :3], s.at[:, :2]):
        a *= scale


@nasty
def tiny(s, rng):
    """Lengths of 1e-8."""
    _scaled(s, 1e-8)


@nasty
def huge(s, rng):
    """Lengths of 1e8."""
    _scaled(s, 1e8)


@nasty
def far_off(s, rng):
    """All of it 10,000 away from the origin."""
    shift = 1e4 * direction(rng.uniform(-np.pi, np.pi, len(s.at)))
    s.segments[:] += shift[:, None, None]
    s.circles[..., :2] += shift[:, None]
    s.arc[:, :2] += shift
    s.at[:, :2] += shift


@nasty
def mixed_sizes(s, rng):
    """A lamp up to 1e8 long behind blockers of 1, and a circle down to 1e-6."""
    half = s.segments[:, LAMP, 0] - s.segments[:, LAMP].mean(1)
    long = (
        half
        * 10.0 ** rng.uniform(0.0, 8.0, (len(half), 1))
        / np.linalg.norm(half, axis=-1)[:, None]
    )
    middle = s.segments[:, LAMP].mean(1)
    s.segments[:, LAMP] = np.stack([middle + long, middle - long], 1)
    s.circles[:, 0, 2] = 10.0 ** rng.uniform(-6.0, 0.0, len(half))
