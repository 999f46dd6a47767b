"""What R07 says visibility gradients are bounded by, against difference quotients of the light."""

from __future__ import annotations

import numpy as np

from firstorder.checks.tolerance import normwise

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
    excess = [abs(_quotient(ends)) - np.sum(1.0 / ends[..., 1]) for ends, _ in _slabs(trials)]
    return max(0.0, *excess)


def _slabs(trials: int):
    """Random ends of slabs, and whether two are in line seen from x = 0."""
    rng = np.random.default_rng(7)
    for _ in range(trials):
        ends = np.stack([rng.uniform(-2, 2, (4, 2)), rng.uniform(0.2, 2.0, (4, 2))], -1)
        aligned = rng.random() < 0.33
        if aligned:
            ends[1, 0] = 2.0 * ends[0, 0]
        yield ends, aligned


def _quotient(ends, h=1e-7):
    return (_sky(h, ends) - _sky(-h, ends)) / (2.0 * h)


def gradient_error(trials: int = 200) -> float:
    """The library's B_x before such slabs against difference quotients, where none are in line."""
    import jax
    import jax.numpy as jnp

    import firstorder.visibility as vis

    def slope(ends):
        edges = vis.visible_edges(*(vis.point_edge_angle(ends[:, k]) for k in (0, 1)))
        T = lambda p, w: jnp.cos(w) + 0.0 * p[0]  # noqa: E731
        return vis.shading_derivatives(T, jnp.zeros(2), edges).gradient.total[0]

    several = np.stack([ends for ends, aligned in _slabs(trials) if not aligned])
    ours = jax.jit(jax.vmap(slope))(jnp.asarray(several))
    return normwise(ours, np.array([_quotient(ends) for ends in several]))


def edge_sum_error() -> float:
    """The library's sum over edges before tilted slabs against difference quotients."""
    import jax.numpy as jnp

    import firstorder.visibility as vis

    worst = 0.0
    for tilt in (0.0, 0.6):
        ends = np.array([[[0.0, 1.0], _far(tilt)]])
        e = vis.visible_edges(
            *(vis.point_edge_angle(jnp.asarray(ends[:, k])) for k in (0, 1))
        ).edges
        ours = float(jnp.sum(e.jump * jnp.cos(e.value) * e.gradient[:, 0]))
        worst = max(worst, abs(ours - _quotient(ends, 1e-5)))
    return worst


def _sky(x, ends):
    """Integral of cos over what the slabs leave visible: sorted intervals, in NumPy."""
    angles = np.sort(np.arctan((x - ends[..., 0]) / ends[..., 1]), -1)
    total, reach = 0.0, -0.5 * np.pi
    for low, high in angles[np.argsort(angles[:, 0])]:
        total += np.sin(max(low, reach)) - np.sin(reach)
        reach = max(reach, high)
    return total + 1.0 - np.sin(reach)


# --- the metric of §6.2 --------------------------------------------------------------------------


def _far(tilt):
    """The other end of a slab from (0, 1)."""
    return -60.0 * np.cos(tilt), 1.0 + 60.0 * np.sin(tilt)


def tilted_gradient(one, two):
    """B_x before a slab from (0, 1) that leans by `one`, over that before one that leans by `two`.

    By differences of B; both reach far to the left.
    """

    def slope(tilt):
        far = _far(tilt)
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
