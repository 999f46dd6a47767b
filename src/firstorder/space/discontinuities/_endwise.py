"""Walls of cylinders that are seen endwise: the rims touch each other there."""

from __future__ import annotations

import numpy as np

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import apart_above, quadratic_roots, taken
from firstorder.space.discontinuities._round_lines import NODES
from firstorder.space.discontinuities._rounds import WALL, Rounds, outline_at
from firstorder.space.discontinuities._tangents import Tangents
from firstorder.space.receiver import Receiver


def endwise_at(edges: Edges, rounds: Rounds, at: Receiver, place, wall):
    """Lines of sight from places on walls made longer, along them, and which there are.

    The two rims touch each other, and behind these places the farther one shows from behind the
    nearer. What opens is their hull less the nearer one, which is more than a lens.
    """
    one = rounds.take(wall)
    q = np.linalg.solve(one.axes, (place - one.center)[..., None])
    above, z, a = q[:, 2, 0] > 0.0, np.abs(q[:, 2]), one.axes[..., 2]
    u = unit(np.where(above[:, None], -a, a))
    flat = q * np.array([[1.0], [1.0], [0.0]])
    m = unit(np.linalg.solve(np.swapaxes(one.axes, -1, -2), flat)[..., 0])
    r = np.linalg.norm(a, axis=-1)[:, None] * (z + np.array([-1.0, 1.0]))
    # Of a cylinder the rim where its axis ends, that where it starts, and the wall follow.
    rims = np.where(above, wall - 2, wall - 1), np.where(above, wall - 1, wall - 2)
    near, far = (outline_at(rounds.take(rim), place, u).curvature for rim in rims)
    with np.errstate(invalid="ignore", divide="ignore"):  # from a rim that is in the floor
        fill = 0.5 * (near + far) / -np.sqrt(near * far)
    there = (z[:, 0] > 1.0) & apart_above(edges, at, u, r)
    return Tangents(place, u, m, r, near - far, 0.5 * (near + far), fill), there


def endwise_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see a wall endwise, and how far along."""
    walls = np.flatnonzero(rounds.kind == WALL)
    axes, off = rounds.axes[walls], np.asarray(at.position) - rounds.center[walls]
    o, d = (np.linalg.solve(axes, a)[:, :2, 0] for a in (off[..., None], along[:, None]))
    places = o + NODES[:, None, None] * reach * d
    t, row = quadratic_roots(dot(places, places) - 1.0)
    on = (t > 0.0) & (t < 1.0)
    t, row = reach * t[on], row[on]
    place = np.asarray(at.position) + t[:, None] * along
    rows, there = endwise_at(edges, rounds, at, place, walls[row])
    return t[there], taken(rows, there)
