"""Chi-square on samplers whose numbers can be undone: where they came from must be uniform."""

import numpy as np

from firstorder.checks.statistics import chi_square

COUNT = 20_000  # samples: a density that is off by a tenth on a half of its range is seen


def uniform_p_value(u, bins=8):
    """The chance that points of the unit cube are uniform; 0 if one lies outside of it.

    Args:
        u: shape (n,) or (n, d).
        bins: along each axis.
    """
    u = np.asarray(u, float)
    u = u.reshape(len(u), -1)
    counts = np.histogramdd(u, bins, [(0.0, 1.0)] * u.shape[1])[0]
    if counts.sum() < len(u):
        return 0.0
    return chi_square(counts, np.full(counts.shape, len(u) / counts.size))


def disc_place(xy):
    """From places of the unit disc to the unit square: the squared radius, and the azimuth."""
    x, y = np.asarray(xy, float).T
    return np.stack([x**2 + y**2, turn_share(np.arctan2(y, x))], -1)


def turn_share(angle):
    """An angle as a share of the whole turn."""
    return np.mod(np.asarray(angle, float) / (2.0 * np.pi), 1.0)


def biased(u, column, power=1.1):
    """The same uniform numbers, but for one column in which small ones are too many."""
    u = np.array(u, float)
    u[:, column] **= power
    return u
