"""Changes of scenes of space that leave irradiance as it is."""

from __future__ import annotations

import numpy as np

from tests.fuzz.space.layout import LAMP, SPARE, Space

Rng = np.random.Generator


def copied(s: Space) -> Space:
    """The same numbers in arrays of their own, in double precision."""
    return Space(*(np.array(a, float) for a in s))


def order(s: Space, rng: Rng) -> Space:
    """Lamps and balls in another order, and the triangle from another corner."""
    s = copied(s)
    return s._replace(
        rectangles=s.rectangles[:, ::-1].copy(),
        emission=s.emission[:, ::-1].copy(),
        spheres=s.spheres[:, ::-1].copy(),
        triangle=np.roll(s.triangle, 1, 1),
        on=np.where((s.on == 0) | (s.on == 1), 1.0 - s.on, s.on),
    )


def mirror(s: Space, rng: Rng) -> Space:
    """Seen in a mirror: x is -x, and the lamp's front stays its front; without rounding."""
    s = copied(s)
    for a in (*s.places, *s.edges):
        a[..., 0] *= -1.0
    return s._replace(rectangles=s.rectangles[:, :, [0, 2, 1]].copy())


def turn(s: Space, rng: Rng) -> Space:
    """About the origin, anyhow."""
    s, R = copied(s), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R = R * np.sign(np.linalg.det(R))
    for a in (*s.places, *s.edges):
        a[:] = a @ R.T
    return s


def shift(s: Space, rng: Rng) -> Space:
    """By up to ten times its size."""
    s = copied(s)
    step = rng.uniform(-10.0, 10.0, (len(s.at), 3)) * s.size[:, None]
    for a in s.places:
        a += step.reshape(len(step), *(1,) * (a.ndim - 2), 3)
    return s


def _in_unit(s: Space, unit: float) -> Space:
    s = copied(s)
    for lengths in s.lengths:
        lengths *= unit
    return s


def power_of_two(s: Space, rng: Rng) -> Space:
    """In another unit of length, without rounding."""
    return _in_unit(s, 2.0 ** rng.integers(-20, 21))


def power_of_ten(s: Space, rng: Rng) -> Space:
    """In another unit of length."""
    return _in_unit(s, 10.0 ** rng.integers(-6, 7))


def split(s: Space, rng: Rng) -> Space:
    """The lamp in two: its second half is the spare rectangle."""
    s, share = copied(s), rng.uniform(0.05, 0.95, (len(s.at), 1))
    middle, u, v = np.moveaxis(s.rectangles[:, LAMP].copy(), 1, 0)
    s.rectangles[:, LAMP] = np.stack([middle - (1.0 - share) * u, share * u, v], 1)
    s.rectangles[:, SPARE] = np.stack([middle + share * u, (1.0 - share) * u, v], 1)
    s.emission[:, SPARE] = s.emission[:, LAMP]
    return s


CHANGES = (order, mirror, turn, shift, power_of_two, power_of_ten, split)
