"""Procedural trees and ferns of any number of triangles, from a seed.

They stand on the origin and grow along z. Branches are closed and go through each other where they
fork; a leaf is two triangles that meet in its middle rib, and has no inside.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int

from firstorder._argument_checks import (
    check_count,
    check_integer,
    check_not_negative,
    check_positive,
)
from firstorder.models.primitives import join_meshes, quad_triangles
from firstorder.space.meshes.triangle_mesh import Mesh, mesh

Points = Float[np.ndarray, "n 3"]
UP = (0.0, 0.0, 1.0)


def tree(
    leaves: int = 20000,
    seed: int = 0,
    height: float | int = 4.0,
    forks: tuple[int, ...] = (9, 6, 5, 3),
    leaf: float | int = 0.09,
    sides: int = 6,
) -> tuple[Mesh, Int[np.ndarray, " f"]]:
    """A tree: a trunk that forks again and again, and leaves on the last two kinds of twigs.

    Args:
        leaves: how many, of two faces each.
        seed: of all that is random.
        height: about that of its crown's top [m].
        forks: branches on each one of the kind before, trunk first; () for a pole.
        leaf: mean length of a leaf [m].
        sides: of a branch; each has 10 times as many faces.

    Returns:
        The tree, and of each face 0 for wood and 1 for a leaf.

    Raises:
        ValueError: if there would be no branch's side, or a negative number of anything.

    Example:
        >>> from firstorder.models import tree
        >>> oak, part = tree(leaves=1000, forks=(5, 4))
        >>> oak.count, (part == 1).sum().item()  # 26 branches
        (3560, 2000)
    """
    check_integer("leaves", leaves)
    check_not_negative("leaves", leaves)
    _check_plant(height, leaf, sides)
    rng = np.random.default_rng(seed)
    trunk, thick = _trunk(0.62 * height, rng)
    lines, radii = [trunk], [thick]
    for level, count in enumerate(forks):
        check_count("forks", count)
        grown, thick = _forked(lines[-1], radii[-1], count, level, rng)
        lines.append(grown)
        radii.append(thick)
    carriers = np.concatenate(lines[-2:] if len(lines) > 2 else lines[-1:])
    parts = [_tubes(np.concatenate(lines), np.concatenate(radii), sides)]
    if leaves:
        parts.append(_foliage(carriers, leaves, leaf, rng))
    return join_meshes(parts)


def fern(
    fronds: int = 24,
    pairs: int = 40,
    seed: int = 0,
    height: float | int = 1.0,
    leaf: float | int = 0.12,
    sides: int = 5,
) -> tuple[Mesh, Int[np.ndarray, " f"]]:
    """A fern: stalks that arch outwards from one place, with thin leaflets in pairs.

    Args:
        fronds: how many stalks.
        pairs: of leaflets on each.
        seed: of all that is random.
        height: scale of the stalks: the tops of their arches reach 0.64 of it in the median, the
            highest one 0.82 to 0.87 (six seeds) [m].
        leaf: length of the longest leaflets [m].
        sides: of a stalk.

    Returns:
        The fern, and of each face 0 for a stalk and 1 for a leaflet.

    Raises:
        ValueError: if there would be no stalk.

    Example:
        >>> from firstorder.models import fern
        >>> small, part = fern(fronds=3, pairs=10)
        >>> (part == 1).sum().item()
        120
    """
    check_count("fronds", fronds)
    check_integer("pairs", pairs)
    check_not_negative("pairs", pairs)
    _check_plant(height, leaf, sides)
    rng = np.random.default_rng(seed)
    turn = 2.0 * math.pi * (np.arange(fronds) * 0.381966 + 0.1 * rng.random(fronds))
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(fronds)], -1)
    reach = height * rng.uniform(0.5, 1.1, fronds)[:, None, None]
    t = np.linspace(0.0, 1.0, 13)[:, None]
    lines = reach * (1.1 * out[:, None] * t**1.5 + np.multiply(UP, 1.9 * t - 1.2 * t**2.2))
    thick = 0.012 * height * np.linspace(1.0, 0.15, 13) * np.ones((fronds, 1))
    parts = [_tubes(lines, thick, sides)]
    if pairs:
        parts.append(_leaflets(lines, pairs, leaf, rng))
    return join_meshes(parts)


def _check_plant(height, leaf, sides) -> None:
    check_positive("height", height)
    check_positive("leaf", leaf)
    check_integer("sides", sides)
    if sides < 3:
        raise ValueError(f"Argument `sides` must be at least 3, but is {sides}.")


# --- branches ------------------------------------------------------------------------------------

_RINGS = 5  # of a branch


def _trunk(height: float, rng) -> tuple[np.ndarray, np.ndarray]:
    lean = np.array([*(0.06 * height * rng.normal(size=2)), 0.0])
    t = np.linspace(0.0, 1.0, _RINGS)
    line = height * np.multiply(UP, t[:, None]) + lean * t[:, None] ** 2
    return line[None], (0.045 * height * (1.0 - 0.7 * t))[None]


def _forked(lines: np.ndarray, thick: np.ndarray, count: int, level: int, rng):
    """Branches that leave others: each along a bow that turns towards the light."""
    n = len(lines) * count
    parent = np.repeat(np.arange(len(lines)), count)
    # One in each stretch of the parent, and turned on by the golden angle from the one before.
    share = (np.tile(np.arange(count), len(lines)) + rng.random(n)) / count
    share = 0.3 + 0.7 * share if level == 0 else 0.2 + 0.8 * share
    base, along = _on(lines[parent], share)
    u, w = _across(along)
    turn = 2.399963 * np.arange(n) + 0.6 * rng.normal(size=n)
    side = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * w
    tilt = rng.uniform(0.6, 1.1, n)[:, None]
    way = np.cos(tilt) * along + np.sin(tilt) * side
    span = np.linalg.norm(lines[:, -1] - lines[:, 0], axis=1)[parent]
    length = span * rng.uniform(0.45, 0.75, n) * (1.15 - 0.55 * share)
    t = np.linspace(0.0, 1.0, _RINGS)[:, None]
    bow = np.multiply(UP, 0.25) + 0.15 * rng.normal(size=(n, 1, 3))
    grown = base[:, None] + length[:, None, None] * (way[:, None] * t + bow * t**2)
    at_base = 0.62 * _between(thick[parent][..., None], share)[:, 0]
    return grown, at_base[:, None] * (1.0 - 0.75 * t[:, 0])


def _between(values: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Values of rings, shape (n, k, c), part of the way along; shape (n, c)."""
    x = np.clip(share, 0.0, 1.0) * (values.shape[1] - 1)
    i = np.minimum(x.astype(int), values.shape[1] - 2)
    n, part = np.arange(len(values)), (x - i)[:, None]
    return (1.0 - part) * values[n, i] + part * values[n, i + 1]


def _on(lines: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points part of the way along lines, and the unit vectors along them there."""
    steps = np.diff(lines, axis=1)
    i = np.minimum((share * steps.shape[1]).astype(int), steps.shape[1] - 1)
    return _between(lines, share), _unit(steps[np.arange(len(lines)), i])


def _unit(a: np.ndarray) -> np.ndarray:
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def _across(along: Points) -> tuple[Points, Points]:
    """Two unit vectors across each, right-handed with it."""
    least = np.eye(3)[np.argmin(abs(along), axis=-1)]
    u = _unit(np.cross(along, least))
    return u, np.cross(along, u)


def _tubes(lines: np.ndarray, thick: np.ndarray, sides: int) -> Mesh:
    """Closed tubes along lines, shape (n, k, 3), of radii of shape (n, k)."""
    n, k, _ = lines.shape
    steps = np.diff(lines, axis=1)
    along = _unit(np.concatenate([steps[:, :1], steps[:, 1:] + steps[:, :-1], steps[:, -1:]], 1))
    # One vector across is kept as straight as the line lets it, so that tubes do not twist.
    u = _across(_unit(lines[:, -1] - lines[:, 0]))[0][:, None]
    u = _unit(u - np.sum(u * along, -1, keepdims=True) * along)
    w = np.cross(along, u)
    angle = 2.0 * math.pi * np.arange(sides) / sides
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    rings = lines[:, :, None] + thick[..., None, None] * (u[:, :, None] * c + w[:, :, None] * s)
    v = np.concatenate([rings.reshape(n, -1, 3), lines[:, :1], lines[:, -1:]], 1)
    own = np.arange(n)[:, None, None] * (k * sides + 2)
    at = own + np.arange(k * sides).reshape(k, sides)
    beside = np.roll(at, -1, 2)
    low, high = (np.broadcast_to(own[:, 0] + k * sides + e, (n, sides)) for e in (0, 1))
    faces = (
        quad_triangles(at[:, :-1], beside[:, :-1], beside[:, 1:], at[:, 1:]),
        np.stack([low, beside[:, 0], at[:, 0]], -1).reshape(-1, 3),
        np.stack([high, at[:, -1], beside[:, -1]], -1).reshape(-1, 3),
    )
    return mesh(v.reshape(-1, 3), np.concatenate(faces))


# --- leaves --------------------------------------------------------------------------------------


def _foliage(lines: np.ndarray, count: int, size: float, rng) -> Mesh:
    """Leaves anywhere on twigs, in all directions but most of them facing up."""
    twig = rng.integers(len(lines), size=count)
    base, along = _on(lines[twig], rng.random(count))
    way = _unit(0.8 * along + rng.normal(size=(count, 3)))
    face = np.multiply(UP, 0.8) + rng.normal(size=(count, 3))
    length = size * rng.uniform(0.6, 1.4, count)
    return _leaf_mesh(base, way, face, length, 0.5 * length)


def _leaflets(lines: np.ndarray, pairs: int, size: float, rng) -> Mesh:
    """Pairs of thin leaves along stalks, shorter towards both ends."""
    share = np.tile(np.repeat((np.arange(pairs) + 0.5) / pairs, 2), len(lines))
    stalk = np.repeat(np.arange(len(lines)), 2 * pairs)
    base, along = _on(lines[stalk], 0.15 + 0.85 * share)
    side = _unit(np.cross(along, UP)) * np.where(np.arange(len(share)) % 2, 1.0, -1.0)[:, None]
    way = _unit(side + 0.45 * along + 0.12 * rng.normal(size=side.shape))
    length = size * (0.25 + 2.4 * share * (1.0 - share)) * rng.uniform(0.85, 1.15, len(share))
    face = np.cross(side, along)
    face *= np.where(face[:, 2:] < 0.0, -1.0, 1.0)
    return _leaf_mesh(base, way, face, length, 0.22 * length)


def _leaf_mesh(base: Points, way: Points, face: Points, length, width) -> Mesh:
    """Rhombi folded along their middle rib, from base to tip."""
    out = np.cross(face, way)
    # A leaf that would face along its own rib may face anywhere.
    bad = np.linalg.norm(out, axis=1) < 1e-6
    out = _unit(np.where(bad[:, None], _across(way)[0], out))
    up = np.cross(way, out)
    length, width = np.reshape(length, (-1, 1)), np.reshape(width, (-1, 1))
    wing = base + 0.45 * length * way + 0.2 * width * up
    corners = base, wing - 0.5 * width * out, base + length * way, wing + 0.5 * width * out
    v = np.stack(corners, 1).reshape(-1, 3)
    a = 4 * np.arange(len(base))
    return mesh(v, quad_triangles(a, a + 1, a + 2, a + 3))
