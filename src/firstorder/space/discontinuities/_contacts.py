"""Where a line of receivers runs into round shapes, or out of them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import ROUND, Edges, dot
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Cylinders, Discs, Shape


def round_contacts(
    scene: Scene, edges: Edges, at: Receiver, along, reach
) -> Float[np.ndarray, " c"]:
    """How far along a line of receivers it runs into round shapes, or out of them."""
    found = [np.zeros(0)]
    for group in scene.groups:
        if isinstance(group, ROUND):
            axes = np.asarray(group.axes, float)
            off = np.asarray(at.position) - np.asarray(group.center, float)
            o, d = (np.linalg.solve(axes, a)[..., 0] for a in (off[..., None], along[:, None]))
            slack = edges.near / np.min(np.linalg.norm(axes, axis=-2), axis=-1)
            found.append(_ends(group, o, d, slack))
    t = np.concatenate(found)
    return np.unique(t[(t > 0.0) & (t < reach)])  # no place that is not finite is among them


def _ends(group: Shape, o, d, slack) -> np.ndarray:
    """Where lines enter and leave canonical shapes; not finite where they do not meet them."""
    if isinstance(group, Discs):
        t = _divided(-o[:, 2], d[:, 2])
        inside = np.linalg.norm((o + t[:, None] * d)[:, :2], axis=-1) <= 1.0
        return np.where(inside, t, np.nan)
    if isinstance(group, Cylinders):
        wall = _ball(o[:, :2], d[:, :2])
        with np.errstate(divide="ignore", invalid="ignore"):
            caps = (np.array([[-1.0], [1.0]]) - o[:, 2]) / d[:, 2]
        level, within = d[:, 2] == 0.0, np.abs(o[:, 2]) <= 1.0 + slack
        endless = np.where(within, np.inf, np.nan) * np.array([[-1.0], [1.0]])
        caps = np.where(level, endless, np.sort(caps, axis=0))
        low, high = np.maximum(wall[0], caps[0]), np.minimum(wall[1], caps[1])
        return np.where(low < high, [low, high], np.nan).ravel()
    return _ball(o, d).ravel()


def _ball(o, d) -> np.ndarray:
    """Where lines enter and leave the unit ball, shape (2, n)."""
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - 1.0
    upright = np.where(c < 0.0, np.inf, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.sqrt(b * b - a * c)
        return np.where(a > 0.0, [(-b - half) / a, (half - b) / a], [-upright, upright])


def _divided(a, b) -> np.ndarray:
    return np.where(b == 0.0, np.nan, a / np.where(b == 0.0, 1.0, b))
