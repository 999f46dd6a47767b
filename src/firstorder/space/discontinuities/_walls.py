"""Walls of cylinders: planes that touch them, lines in which they do, and where a wall is endwise.

A plane with the unit normal n, at right angles to the axis, touches the wall along a line. Such
planes that touch another body too are a few, by the angle of n about the axis.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import dot, unit
from firstorder.space.discontinuities._rounds import ANGLES, Rounds, form, frame_across

HALVINGS = 60


def changes_of_sign(off) -> tuple[np.ndarray, np.ndarray]:
    """Angles, and sides, at which a function changes its sign; or becomes infinite."""
    angle, side = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, ANGLES + 1), [1.0, -1.0])
    negative = off(angle, side) < 0.0
    k, i = np.nonzero(negative[:, 1:] != negative[:, :-1])
    low, high, side = angle[k, i], angle[k, i + 1], side[k, i]
    below = negative[k, i]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = (off(middle, side) < 0.0) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, side


def across(wall: Rounds) -> Float[np.ndarray, "*b 3 3"]:
    """S of cross sections of walls [m^2]."""
    b = wall.axes[..., :2]
    return b @ np.swapaxes(b, -1, -2)


def line_of_wall(wall: Rounds, n) -> tuple[np.ndarray, np.ndarray]:
    """Lines in which planes with outward normals touch a wall: start and way to the end [m]."""
    S, a = across(wall), wall.axes[..., 2]
    foot = wall.center + np.einsum("...ij,...j->...i", S, n) / np.sqrt(form(S, n))[..., None]
    return foot - a, np.broadcast_to(2.0 * a, foot.shape)


def radius_of_wall(wall: Rounds, n) -> Float[np.ndarray, "*b"]:
    """Radii of curvature of walls, across their axes, where planes with outward normals touch [m].

    `det(S) / (n S n)^(3/2)`, for S in the plane across the axis.
    """
    b, a = wall.axes[..., :2], wall.axes[..., 2]
    section = dot(np.cross(b[..., 0], b[..., 1]), unit(a))
    return section**2 / form(across(wall), n) ** 1.5


def planes_of_wall(wall: Rounds, center, spread) -> Float[np.ndarray, "n 3"]:
    """Outward unit normals of planes that touch a wall and another body.

    Args:
        wall: one of them.
        center: of the other body [m].
        spread: its S, that of the cross section of a wall along the first; zero for a point [m^2].
    """
    frame, S, v = frame_across(wall.axes[:, 2]), across(wall), center - wall.center

    def normals(angle):
        return np.stack([np.cos(angle), np.sin(angle)], -1) @ frame

    def apart(angle, side) -> Any:
        n = normals(angle)
        return n @ v - np.sqrt(form(S, n)) + side * np.sqrt(np.maximum(form(spread, n), 0.0))

    angle, side = changes_of_sign(apart)
    return normals(angle if np.any(spread) else angle[side > 0.0])
