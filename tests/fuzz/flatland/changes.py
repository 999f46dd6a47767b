"""Changes of scenes of flatland that leave irradiance as it is."""

from __future__ import annotations

import numpy as np

from tests.fuzz.changes import Rng, copied, power_of_ten, power_of_two, shift
from tests.fuzz.flatland.layout import CIRCLE, FIRST, LAMP, SPARE, Flat


def order(s: Flat, rng: Rng) -> Flat:
    """Segments and circles in another order."""
    s, swapped = copied(s), rng.permutation(4)
    circles = np.where(s.on == CIRCLE, CIRCLE + 1, np.where(s.on == CIRCLE + 1, CIRCLE, s.on))
    place = np.append(np.argsort(swapped), -1)
    on = np.where((s.on >= 0) & (s.on < 4), place[np.minimum(s.on, 4).astype(int)], circles)
    return s._replace(
        segments=s.segments[:, swapped],
        emission=s.emission[:, swapped],
        circles=s.circles[:, ::-1].copy(),
        on=on,
    )


def mirror(s: Flat, rng: Rng) -> Flat:
    """Seen in a mirror: x is -x, what turned left turns right; without rounding."""
    s = copied(s)
    s.segments[..., 0] *= -1.0
    s = s._replace(segments=s.segments[:, :, ::-1].copy())
    s.circles[..., 0] *= -1.0
    s.arc[:, [0, 3, 4]] *= -1.0
    s.at[:, [0, 2]] *= -1.0
    return s


def turn(s: Flat, rng: Rng) -> Flat:
    """About the origin by any angle."""
    s, angle = copied(s), rng.uniform(-np.pi, np.pi)
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for places in s.places:
        places[:] = places @ R.T
    s.arc[:, 3] += angle
    s.at[:, 2] += angle
    return s


def split(s: Flat, rng: Rng) -> Flat:
    """The lamp in two, or a wall: its second half is the spare segment."""
    s, which = copied(s), np.where(np.arange(len(s.at)) % 2 == 0, LAMP, FIRST)
    row, share = np.arange(len(which)), rng.uniform(0.05, 0.95, (len(which), 1))
    start, end = s.segments[row, which, 0], s.segments[row, which, 1]
    middle = start + share * (end - start)
    whole = s.on == which  # the receiver lies on it, and can name one half only
    s.segments[row, SPARE] = np.where(whole[:, None, None], s.segments[row, SPARE],
                                      np.stack([middle, end], 1))  # fmt: skip
    s.segments[row, which, 1] = np.where(whole[:, None], end, middle)
    s.emission[row, SPARE] = s.emission[row, which]
    return s


CHANGES = (order, mirror, turn, shift, power_of_two, power_of_ten, split)
