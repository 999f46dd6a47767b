"""A small world traced by NumPy: walls, a hollow arc and two ovals, with formulas by hand.

Shapes are numbered as the scene numbers them: five segments, the arc, two ellipses (of which the
first is round).
"""

import numpy as np

from firstorder.flatland import Arcs, Ellipses, Scene, Segments, primitive

COUNT = 8
WALLS = np.array([
    [[-2.0, 0.0], [3.0, 0.0]],
    [[3.0, 0.2], [2.6, 2.5]],
    [[-1.5, 2.6], [-2.2, 0.1]],
    [[0.6, 1.7], [1.7, 1.9]],  # a screen: from below its back is seen
    [[3.0, 3.0], [-2.5, 3.2]],
])  # fmt: skip
ARC = (0.0, 2.4), 0.35, 1.2, -2.6  # centre, radius, start, sweep: hollow below
# Centre, half-axes and tilt; of the arc those of its circle.
ROUND = {
    5: ((0.0, 2.4), (0.35, 0.35), 0.0),
    6: ((-0.6, 1.2), (0.3, 0.3), 0.0),
    7: ((1.6, 1.0), (0.4, 0.2), 0.5),
}


def scene(**lit):
    """The world as a scene."""
    walls = Segments(*WALLS.transpose(1, 0, 2))
    ovals = Ellipses(*map(np.array, zip(ROUND[6], ROUND[7], strict=True)))
    return Scene.of(primitive(walls), primitive(Arcs(*ARC)), primitive(ovals), **lit)


def direction(a):
    return np.stack([-np.sin(a), np.cos(a)], -1)


def turned_by(angle, p):
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]], -1)


def place(shape, s):
    """Where the parameter of a shape is."""
    if shape < 5:
        start, end = WALLS[shape]
        return start + s * (end - start)
    if shape == 5:
        center, radius, start, sweep = ARC
        return center + radius * direction(start + s * sweep)
    center, semi, tilt = ROUND[shape]
    a = 2.0 * np.pi * s
    return center + turned_by(tilt, np.array(semi) * [np.sin(a), np.cos(a)])


def unit(shape, p, is_place):
    """In the frame in which an oval is the unit circle about the origin."""
    center, semi, tilt = ROUND[shape]
    return turned_by(-tilt, p - np.array(center) * is_place) / semi


def met(shape, eye, u):
    """Distance along each ray, parameter and side, nearest first; infinity where it passes by."""
    if shape < 5:
        a, e = WALLS[shape, 0] - eye, WALLS[shape, 1] - WALLS[shape, 0]
        size = u[:, 0] * e[1] - u[:, 1] * e[0]
        t = (a[0] * e[1] - a[1] * e[0]) / size
        s = (a[0] * u[:, 1] - a[1] * u[:, 0]) / size
        there = (t > 1e-12) & (s >= 0.0) & (s <= 1.0)
        yield np.where(there, t, np.inf), s, np.where(size < 0.0, 1, 0)
        return
    w, d = unit(shape, eye, 1), unit(shape, u, 0)
    dd, wd, ww = np.sum(d * d, -1), d @ w, w @ w
    root = np.sqrt(np.maximum(wd**2 - dd * (ww - 1.0), 0.0))
    for far in (-1, 1):
        t = (-wd + far * root) / dd
        p = w + t[:, None] * d
        turn = np.arctan2(p[:, 0], p[:, 1])  # clockwise from the top
        if shape == 5:
            turn, sweep = turn + ARC[2], abs(ARC[3])
        else:
            sweep = 2.0 * np.pi
        s = np.mod(turn, 2.0 * np.pi) / sweep
        there = (root > 0.0) & (t > 1e-12) & (s <= 1.0)
        yield np.where(there, t, np.inf), s, np.full(len(u), far > 0)


def limbs(shape, eye):
    """Points of an oval, or the arc's circle, that rays touch; the counter-clockwise one first."""
    w = unit(shape, eye, 1)
    if (far := np.hypot(*w)) <= 1.0:
        return []
    center, semi, tilt = ROUND[shape]
    turns = np.arctan2(w[1], w[0]) + np.arccos(1.0 / far) * np.array([-1.0, 1.0])
    on_circle = np.stack([np.cos(turns), np.sin(turns)], -1)
    return list(center + turned_by(tilt, on_circle * semi))
