"""What R07 says visibility gradients are bounded by, against difference quotients of the light."""

from __future__ import annotations

import numpy as np

# --- footnote 3 ----------------------------------------------------------------------------------


def aligned(x, gap=0.0):
    """Light under cos; the ends (0, 1) of one slab and (gap, 2) of another are in line at x = 0."""
    near, far = np.arctan(x / 1.0), np.arctan((x - gap) / 2.0)
    return 1.0 + np.sin(min(near, far))


def true_reciprocal(h):
    """1 / |B_x| where two edges are in line, by the steeper one-sided difference quotient."""
    return 1.0 / max(abs(aligned(h) - aligned(0.0)), abs(aligned(0.0) - aligned(-h))) * h


def largest_excess(trials: int = 2000) -> float:
    """Search: |difference quotient| of B minus the bound sum of 1 / y over the ends, its largest.

    Random slabs, a third of them with an end placed in line with another; uniform light.
    """
    rng = np.random.default_rng(7)
    worst = -np.inf
    for _ in range(trials):
        ends = np.stack([rng.uniform(-2, 2, (4, 2)), rng.uniform(0.2, 2.0, (4, 2))], -1)
        if rng.random() < 0.33:
            ends[1, 0] = 2.0 * ends[0, 0]  # seen from x = 0, in line with the first
        quotient = (_sky(1e-7, ends) - _sky(-1e-7, ends)) / 2e-7
        worst = max(worst, abs(quotient) - np.sum(1.0 / ends[..., 1]))
    return max(0.0, worst)


def _sky(x, ends):
    """Integral of cos over what the slabs leave visible: sorted intervals, in NumPy."""
    angles = np.sort(np.arctan((x - ends[..., 0]) / ends[..., 1]), -1)
    total, reach = 0.0, -0.5 * np.pi
    for low, high in angles[np.argsort(angles[:, 0])]:
        total += np.sin(max(low, reach)) - np.sin(reach)
        reach = max(reach, high)
    return total + 1.0 - np.sin(reach)


# --- the metric of §6.2 --------------------------------------------------------------------------


def tilted_gradient(one, two):
    """B_x before a slab from (0, 1) that leans by `one`, over that before one that leans by `two`.

    By differences of B; both reach far to the left.
    """

    def slope(tilt):
        far = (-60.0 * np.cos(tilt), 1.0 + 60.0 * np.sin(tilt))
        ends = np.array([[[0.0, 1.0], far]])
        # The far end is an edge too; it is taken away, as if the slab went on to the horizon.
        whole = [_sky(x, ends) for x in (1e-5, -1e-5)]
        rest = [1.0 - np.sin(np.arctan((x - far[0]) / far[1])) for x in (1e-5, -1e-5)]
        near = np.sin(np.arctan(1e-5)) + 1.0  # what the near edge leaves
        assert abs(whole[0] - rest[0] - near) < 1e-12
        return (whole[0] - rest[0] - whole[1] + rest[1]) / 2e-5

    return slope(one) / slope(two)


def tilted_mean(one, two):
    """The same ratio by the harmonic mean of all blocker distances over the directions."""

    def inverse(tilt):
        # Distance along omega to the line through (0, 1) with that tilt, from the origin.
        w = np.linspace(0.0, np.arctan2(60.0 * np.cos(tilt), 1.0 + 60.0 * np.sin(tilt)), 4001)
        along = np.stack([-np.sin(w), np.cos(w)], -1)
        normal = np.array([np.sin(tilt), np.cos(tilt)])
        return np.trapezoid(along @ normal / normal[1], w)

    return inverse(one) / inverse(two)
