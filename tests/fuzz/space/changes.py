"""Changes of scenes of space that leave irradiance as it is."""

from __future__ import annotations

import numpy as np

from tests.fuzz.changes import Rng, copied, power_of_ten, power_of_two, shift
from tests.fuzz.space.layout import BALL, BALLS, LAMP, SKY, SPARE, Space, unit


def order(s: Space, rng: Rng) -> Space:
    """Kinds from the last to the first, and triangle and planes from another of their points."""
    s, planes = copied(s), s.planes.shape[1]
    aside = unit(s.ups) * s.size[:, None, None]
    emission = s.emission
    for some in (slice(LAMP, SPARE + 1), BALLS, slice(SKY - planes, SKY)):
        emission[:, some] = emission[:, some][:, ::-1].copy()
    on = _from_the_end(s.on, BALL, s.spheres.shape[1])
    return s._replace(
        rectangles=s.rectangles[:, ::-1].copy(),
        spheres=s.spheres[:, ::-1].copy(),
        triangle=np.roll(s.triangle, 1, 1),
        planes=(s.planes + np.cross(rng.normal(size=s.planes.shape), aside))[:, ::-1].copy(),
        ups=(s.ups * rng.uniform(0.1, 10.0, (*s.ups.shape[:2], 1)))[:, ::-1].copy(),
        on=_from_the_end(on, s.plane_number, planes),
    )


def _from_the_end(on: np.ndarray, first: int, count: int) -> np.ndarray:
    """Numbers of shapes, those of one kind counted from its end."""
    return np.where((on >= first) & (on < first + count), 2 * first + count - 1 - on, on)


def mirror(s: Space, rng: Rng) -> Space:
    """Seen in a mirror: x is -x, and what is a front stays one; without rounding."""
    s = copied(s)
    for a in (*s.places, *s.edges):
        a[..., 0] *= -1.0
    return s._replace(
        rectangles=s.rectangles[:, :, [0, 2, 1]].copy(),
        triangle=s.triangle[:, [0, 2, 1]].copy(),
        discs=s.discs[:, :, [0, 2, 1]].copy(),
    )


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
