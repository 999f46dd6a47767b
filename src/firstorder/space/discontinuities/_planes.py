"""Planes in which parts of two outlines lie for any eye in them, where E' jumps.

Those of two edges; of a disc or a rim, its nearer and its farther half; and those that touch walls
of cylinders along lines that are parallel to edges, or to each other.
"""

from __future__ import annotations

import numpy as np

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import crossed
from firstorder.space.discontinuities._rounds import FLAT, WALL, Rounds, form
from firstorder.space.discontinuities._walls import across, line_of_wall, planes_of_wall
from firstorder.space.receiver import Receiver


def planes_of(edges: Edges, rounds: Rounds) -> tuple[np.ndarray, np.ndarray]:
    """All such planes, each once: points [m] and unit normals."""
    flat = rounds.take(rounds.kind == FLAT)
    rims = flat.center, unit(np.cross(flat.axes[..., 0], flat.axes[..., 1]))
    parts = [_of_edges(edges), rims, *_of_walls(edges, rounds)]
    return _each_once(*(np.concatenate(a) for a in zip(*parts, strict=True)), edges.size)


def _of_edges(edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.nonzero(np.triu(edges.coplanar, 1))
    way = unit(edges.along)
    start = edges.start
    # Of the ends of one edge that which is farther from the line of the other.
    ends = np.stack([start[j], start[j] + edges.along[j]]) - start[i]
    beside = np.cross(way[i], ends)
    far = np.argmax(np.linalg.norm(beside, axis=-1), axis=0)
    normal = beside[far, np.arange(len(i))]
    apart = np.linalg.norm(normal, axis=-1) > edges.near
    return start[i][apart], unit(normal[apart])


def _of_walls(edges: Edges, rounds: Rounds):
    """Planes that touch walls and hold an edge, or touch another wall."""
    walls = rounds.take(rounds.kind == WALL)
    lines = [
        (start, np.zeros((3, 3)), way) for start, way in zip(edges.start, edges.along, strict=True)
    ]
    sections = across(walls)
    for number, one in enumerate(map(walls.take, range(len(walls.center)))):
        later = slice(number + 1, None)
        others = zip(walls.center[later], sections[later], walls.axes[later, :, 2], strict=True)
        for center, spread, way in [*lines, *others]:
            normal = np.cross(unit(one.axes[:, 2]), unit(way))
            if np.linalg.norm(normal) <= edges.near / edges.size:
                normals = planes_of_wall(one, center, spread)
            else:
                normals = unit(normal) * np.array([[1.0], [-1.0]])
                away = np.abs(dot(center - line_of_wall(one, normals)[0], normals))
                normals = normals[np.abs(away - np.sqrt(form(spread, normals))) <= edges.near]
            yield line_of_wall(one, normals)[0], normals


def _each_once(point, normal, size) -> tuple[np.ndarray, np.ndarray]:
    kept: list[int] = []
    for row in range(len(point)):
        same = np.abs(normal[kept] @ normal[row]) > 1.0 - 1e-10
        same &= np.abs((point[kept] - point[row]) @ normal[row]) < 1e-6 * size
        if not np.any(same):
            kept.append(row)
    return point[kept], normal[kept]


def planes_along(
    edges: Edges, rounds: Rounds, at: Receiver, along, reach
) -> tuple[np.ndarray, np.ndarray]:
    """Where a line of receivers meets such planes: how far along, and their normals."""
    point, normal = planes_of(edges, rounds)
    t = crossed(normal, point, at, along)
    on = (t > 0.0) & (t < reach)
    return t[on], normal[on]
