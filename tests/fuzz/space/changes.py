"""Changes of scenes of space that leave irradiance as it is."""

from __future__ import annotations

import numpy as np

from tests.fuzz.changes import Rng, copied, power_of_ten, power_of_two, shift
from tests.fuzz.space.layout import LAMP, SPARE, Space


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


def split(s: Space, rng: Rng) -> Space:
    """The lamp in two: its second half is the spare rectangle."""
    s, share = copied(s), rng.uniform(0.05, 0.95, (len(s.at), 1))
    middle, u, v = np.moveaxis(s.rectangles[:, LAMP].copy(), 1, 0)
    s.rectangles[:, LAMP] = np.stack([middle - (1.0 - share) * u, share * u, v], 1)
    s.rectangles[:, SPARE] = np.stack([middle + share * u, (1.0 - share) * u, v], 1)
    s.emission[:, SPARE] = s.emission[:, LAMP]
    return s


CHANGES = (order, mirror, turn, shift, power_of_two, power_of_ten, split)
