"""Irradiance of a few scenes with 30 digits, from plane geometry alone, for the derivations.

A receiver is moved by q = (step along its tangent, along its normal, turn). Nothing of the library
is used: these are the references against which its forms are judged.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np

DIGITS = 30
LIGHT = (-0.5, 0.5)  # scenes A and B: a line light of radiance 1 at y = 1, facing down
BLOCKER = (-0.2, 0.2)  # scene B: at y = 0.5
# A wall at y = 1 whose radiance grows along x, behind a black disc.
WALL, LEVEL, RISE = (-1.5, 1.5), 1.2, 0.5
CENTRE, RADIUS = (0.1, 0.5), 0.15


class Place:
    """A receiver after the motion q."""

    def __init__(self, x, n, q):
        c, s = mp.cos(n), mp.sin(n)
        self.x = x[0] + q[0] * c - q[1] * s
        self.y = x[1] + q[0] * s + q[1] * c
        self.n = n + q[2]

    def sine(self, px, py):
        """Sine of the local angle of a point, counter-clockwise from the normal."""
        dx, dy = px - self.x, py - self.y
        return -(mp.cos(self.n) * dx + mp.sin(self.n) * dy) / mp.sqrt(dx**2 + dy**2)

    def through(self, px, py, height=1):
        """Where the line through a point meets a height."""
        return self.x + (px - self.x) * (height - self.y) / (py - self.y)


def scene_a(place):
    """The whole light: counter-clockwise its right end comes first."""
    return place.sine(LIGHT[0], 1) - place.sine(LIGHT[1], 1)


def scene_b(place):
    """The light without the shadow of the blocker on it."""
    low, high = (place.through(b, 0.5) for b in BLOCKER)
    left = (LIGHT[0], max(LIGHT[0], min(low, LIGHT[1])))
    right = (min(LIGHT[1], max(high, LIGHT[0])), LIGHT[1])
    return sum(place.sine(a, 1) - place.sine(b, 1) for a, b in (left, right))


def disc_before_wall(place):
    """The wall beside the disc, by quadrature along it; the disc hides what lies between tangents.

    Seen from (x, y) the disc fills `asin(R / D)` to both sides of its centre.
    """
    dx, dy = CENTRE[0] - place.x, CENTRE[1] - place.y
    half = mp.asin(RADIUS / mp.sqrt(dx**2 + dy**2))
    middle = mp.atan2(dx, dy)  # towards +x
    low, high = (place.x + (1 - place.y) * mp.tan(middle + s * half) for s in (-1, 1))

    def light(p):
        u, v = p - place.x, 1 - place.y
        cosine = (-mp.sin(place.n) * u + mp.cos(place.n) * v) / mp.sqrt(u**2 + v**2)
        return (LEVEL + RISE * p) * cosine * v / (u**2 + v**2)

    return mp.quad(light, [WALL[0], low]) + mp.quad(light, [high, WALL[1]])


SCENES = {"A": scene_a, "B": scene_b, "disc": disc_before_wall}


def motion(name, x, n):
    """Value, gradient and Hessian by q, by central differences with many digits."""
    with mp.workdps(DIGITS):
        h = mp.mpf(10) ** -6

        def f(*q):
            return SCENES[name](Place(tuple(map(mp.mpf, x)), mp.mpf(n), [h * c for c in q]))

        unit = np.eye(3, dtype=int)
        middle = f(0, 0, 0)
        up, down = [f(*e) for e in unit], [f(*-e) for e in unit]
        gradient = [(a - b) / (2 * h) for a, b in zip(up, down, strict=True)]
        hessian = np.zeros((3, 3))
        for i in range(3):
            hessian[i, i] = float((up[i] - 2 * middle + down[i]) / h**2)
            for j in range(i):
                a, b = unit[i], unit[j]
                cross = f(*(a + b)) - f(*(a - b)) - f(*(b - a)) + f(*(-a - b))
                hessian[i, j] = hessian[j, i] = float(cross / (4 * h**2))
        return float(middle), np.array([float(g) for g in gradient]), hessian


# --- the same scenes in the library -------------------------------------------------------------


def built(name):
    """The scene, its radiance function (or None) for the library's forms."""
    import jax.numpy as jnp

    from firstorder.flatland import Circles, Scene, Segments, primitive

    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    lamp = primitive(Segments((LIGHT[1], 1.0), (LIGHT[0], 1.0)), name="lamp", emission=1.0)
    if name == "A":
        return Scene.of(floor, lamp), None
    if name == "B":
        blocker = primitive(Segments((BLOCKER[1], 0.5), (BLOCKER[0], 0.5)), name="blocker")
        return Scene.of(floor, lamp, blocker), None
    wall = primitive(Segments((WALL[1], 1.0), (WALL[0], 1.0)), name="wall")
    disc = primitive(Circles(CENTRE, RADIUS), name="disc")

    def radiance(index, s, front, along):
        x = WALL[1] + s * (WALL[0] - WALL[1])
        return jnp.where(index == 1, LEVEL + RISE * x, 0.0)

    return Scene.of(floor, wall, disc), radiance
