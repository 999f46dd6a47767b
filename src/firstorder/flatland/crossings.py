"""Where shapes cross each other: found once on the host, followed by Newton's method.

What an eye sees changes at a crossing without any silhouette there. Which pairs cross is looked for
when a scene is made of concrete shapes; the point itself is computed from the shapes wherever it is
needed, so that it moves with them and has derivatives.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder.errors import is_concrete

PIECES = 128  # chords by which a curve is searched


class Crossings(eqx.Module):
    """Pairs of shapes that cross, and where on each of them, roughly.

    Attributes:
        pairs: numbers of the two shapes.
        near: start of the search: the parameters on both.
    """

    pairs: Int[Array, "c 2"]
    near: Float[Array, "c 2"]


def find(groups: list) -> Crossings:
    """All crossings of concrete shapes, by their chords; none for traced ones.

    Ends that merely touch are no crossings: an end is an event of its own.
    """
    chords = _chords(groups) if is_concrete(groups) else None
    pairs, near = ([], []) if chords is None else _crossed(*chords)
    return Crossings(
        jnp.asarray(np.asarray(pairs, dtype=np.int32).reshape(-1, 2)),
        jnp.asarray(np.asarray(near, dtype=float).reshape(-1, 2)),
    )


def _chords(groups: list):
    """Starts and ends of all chords, their shape, its being open, and their parameters."""
    start, end, shape, ends, s0, s1, first = [], [], [], [], [], [], 0
    for group in groups:
        straight = not hasattr(group, "cosines") and hasattr(group, "end")
        s = np.linspace(0.0, 1.0, 2 if straight else PIECES + 1)
        path = jax.vmap(lambda one, s=s: jax.vmap(lambda t: one.motion(t)[0])(jnp.asarray(s)))
        points = np.asarray(path(group))
        for i, p in enumerate(points):
            start.append(p[:-1])
            end.append(p[1:])
            shape.append(np.full(len(s) - 1, first + i))
            ends.append(np.full(len(s) - 1, not group.closed))
            s0.append(s[:-1])
            s1.append(s[1:])
        first += group.count
    return tuple(np.concatenate(a) for a in (start, end, shape, ends, s0, s1))


def _crossed(start, end, shape, ends, s0, s1):
    """Pairs of chords of different shapes that cross in their interiors."""
    edge = end - start
    low, high = np.minimum(start, end), np.maximum(start, end)
    pairs, near = [], []
    for i in range(len(start)):
        others = np.flatnonzero(
            (shape > shape[i]) & np.all(low <= high[i], axis=1) & np.all(high >= low[i], axis=1)
        )
        if not others.size:
            continue
        f, q = edge[others], start[others] - start[i]
        det = edge[i, 0] * f[:, 1] - edge[i, 1] * f[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (q[:, 0] * f[:, 1] - q[:, 1] * f[:, 0]) / det
            b = (q[:, 0] * edge[i, 1] - q[:, 1] * edge[i, 0]) / det
        inside = (a >= 0.0) & (a < 1.0) & (b >= 0.0) & (b < 1.0)
        for k in np.flatnonzero(inside):
            j = others[k]
            sa = s0[i] + a[k] * (s1[i] - s0[i])
            sb = s0[j] + b[k] * (s1[j] - s0[j])
            if not (_is_end(sa, ends[i]) or _is_end(sb, ends[j])):
                pairs.append((shape[i], shape[j]))
                near.append((sa, sb))
    return pairs, near


def _is_end(s: float, has_ends: bool) -> bool:
    """Whether a parameter is one of an end, at which a shape is cut or touches."""
    return bool(has_ends) and not 1e-9 < s < 1.0 - 1e-9
