"""Round outlines, on the host: limbs of ellipsoids, rims of discs, rims and walls of cylinders.

Seen from a place, a body with the middle c and the half-axes A is the cone of the directions u with
`F(u) <= 0`,

    F(u) = (w x u) S (w x u) - u adj(S) u,      w = c - place,  S = A A^T.

A plane with the normal n touches it if `n S n = (n . w)^2`. For an eye that moves, a limb moves as
an edge would that touches it where the line of sight does.

The outline of a cylinder is made of arcs of its two rims, which are those of discs, and of two
straight lines of its wall, a body whose last half-axis is endless: with F over its square,

    S -> a a^T,      adj(S) -> sum over i of (b_i x a) (b_i x a)^T,      A = (b_1 b_2 a)

A rim is part of the outline where the plane that touches it has the cylinder behind it, and a wall
where it is touched between the rims.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.space.discontinuities._edges import dot, unit
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Cylinders, Discs, Ellipsoids, Shape

BALL, FLAT, WALL = range(3)  # kinds of bodies
OFF = 1e-6  # angle to an outline above which a line of sight does not touch it [rad]
ANGLES = 256  # about an axis or an outline, at which places are looked for


class Rounds(NamedTuple):
    """Round bodies of a scene, each by its middle and its quadric.

    Attributes:
        center: c [m].
        axes: of the shape, as columns [m].
        spread: S, of rank two for a disc or a rim, of rank one for a wall [m^2].
        adjugate: adj(S) [m^4].
        end: of a rim from the middle of its cylinder [m]; of other bodies zero.
        kind: `BALL`, `FLAT` (a disc or a rim) or `WALL`.
        shape: number that the rims and the wall of one cylinder share.
    """

    center: Float[np.ndarray, "*b 3"]
    axes: Float[np.ndarray, "*b 3 3"]
    spread: Float[np.ndarray, "*b 3 3"]
    adjugate: Float[np.ndarray, "*b 3 3"]
    end: Float[np.ndarray, "*b 3"]
    kind: Int[np.ndarray, "*b"]
    shape: Int[np.ndarray, "*b"]

    def take(self, which) -> Rounds:
        """Some of them, or some of them again."""
        return Rounds(*(a[which] for a in self))


class Outline(NamedTuple):
    """An outline about a direction in which it is seen.

    Attributes:
        touch: the point of the body that is seen there [m].
        m: unit normal of the plane that touches the body there, outwards.
        curvature: k of the outline `y = k x^2 / 2` on the plane `direction + x tau + y m`, with
            `tau = direction x m` (a great circle has none).
        there: whether it is part of the outline of the shape.
    """

    touch: Float[np.ndarray, "n 3"]
    m: Float[np.ndarray, "n 3"]
    curvature: Float[np.ndarray, " n"]
    there: Bool[np.ndarray, " n"]


def rounds_of(scene: Scene) -> Rounds:
    """Ellipsoids, discs, and rims and walls of cylinders of a scene.

    Example:
        >>> from firstorder.space import Scene, cylinder, primitive, sphere
        >>> from firstorder.space.discontinuities._rounds import rounds_of
        >>> ball = Scene.of(primitive(sphere((0, 0, 1), 0.5)))
        >>> rounds_of(ball).spread[0].diagonal().tolist()
        [0.25, 0.25, 0.25]
        >>> tube = Scene.of(primitive(cylinder((0, 0, 1), (0, 0, 2), 0.5)))
        >>> rounds_of(tube).center[:, 2].tolist()  # both rims and the wall
        [2.0, 1.0, 1.5]
    """
    shapes = [each for group in scene.groups for each in _shapes(group)]
    if not shapes:
        none, matrices, numbers = np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0, int)
        return Rounds(none, matrices, matrices, matrices, none, numbers, numbers)
    rows = [(*row, number) for number, each in enumerate(shapes) for row in each]
    return Rounds(*(np.array(a) for a in zip(*rows, strict=True)))


def _shapes(group: Shape) -> list[list[tuple]]:
    """The bodies of each shape of a kind, as columns of `Rounds` but for the last."""
    if not isinstance(group, Ellipsoids | Discs | Cylinders):
        return []
    centers, axes = (np.asarray(a, float) for a in (group.center, group.axes))
    return [_bodies(group, c, A) for c, A in zip(centers, axes, strict=True)]


def _bodies(group: Shape, c, A) -> list[tuple]:
    a, none = A[:, 2], np.zeros(3)
    if isinstance(group, Ellipsoids):
        return [(c, A, *_quadric(A), none, BALL)]
    flat = _quadric(A * [1.0, 1.0, 0.0])
    if isinstance(group, Discs):
        return [(c, A, *flat, none, FLAT)]
    side = np.cross(A[:, :2].T, a).T
    wall = np.outer(a, a), side @ side.T
    rims = [(c + end, A, *flat, end, FLAT) for end in (a, -a)]
    return [*rims, (c, A, *wall, none, WALL)]


def _quadric(A) -> tuple[np.ndarray, np.ndarray]:
    """S and adj(S)."""
    S = A @ A.T
    return S, np.stack([np.cross(S[i - 2], S[i - 1]) for i in range(3)])


def form(S: np.ndarray, a: np.ndarray, b: np.ndarray | None = None) -> Any:
    """The quadratic form `a S a`, or `a S b`."""
    return np.einsum("...i,...ij,...j->...", a, S, a if b is None else b)


def outside(rounds: Rounds, place, way) -> np.ndarray:
    """F: zero along outlines, negative within [m^6]."""
    side = np.cross(rounds.center - place, way)
    return form(rounds.spread, side) - form(rounds.adjugate, way)


def outline_at(rounds: Rounds, place, u) -> Outline:
    """Outlines in directions in which they are seen.

    Args:
        rounds: one body for each row.
        place: of the eye, shape (n, 3) [m].
        u: unit directions of outlines, likewise.
    """
    w = rounds.center - place
    slope = half_slope(rounds, place, u)
    m = unit(slope - dot(slope, u)[..., None] * u)
    tau = np.cross(u, m)
    bend = form(rounds.spread, np.cross(w, tau)) - form(rounds.adjugate, tau)
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature = -bend / np.linalg.norm(slope, axis=-1)
        r = form(rounds.adjugate, w, u) / form(rounds.adjugate, u)
        touch = place + r[..., None] * u
        return Outline(touch, m, curvature, _part_of_outline(rounds, touch, m))


def _part_of_outline(rounds: Rounds, touch, m) -> np.ndarray:
    """Whether the outline of a body is that of its shape, by points that are touched."""
    along = np.linalg.solve(rounds.axes, (touch - rounds.center)[..., None])[..., 2, 0]
    behind = dot(m, rounds.end) >= OFF * np.linalg.norm(rounds.end, axis=-1)
    return np.where(rounds.kind == WALL, np.abs(along) < 1.0, behind)


def tangent_planes(rounds: Rounds, place, u, across) -> np.ndarray:
    """Normals of the planes that touch bodies where other planes cross their outlines.

    By Newton's method along those planes.

    Args:
        rounds: one body for each row.
        place: of the eye, shape (n, 3) [m].
        u: directions near to the crossings.
        across: normals of the planes that cross the outlines.
    """
    n = unit(across)
    for _ in range(8):
        u = unit(u - dot(u, n)[..., None] * n)
        slope, along = half_slope(rounds, place, u), np.cross(n, u)
        u = u - (0.5 * outside(rounds, place, u) / dot(slope, along))[..., None] * along
    return half_slope(rounds, place, unit(u))


def half_slope(rounds: Rounds, place, way) -> np.ndarray:
    """Half of the gradient of F by the direction [m^6]."""
    w = rounds.center - place
    side = np.einsum("...ij,...j->...i", rounds.spread, np.cross(w, way))
    return np.cross(side, w) - np.einsum("...ij,...j->...i", rounds.adjugate, way)


def plane_form(rounds: Rounds, place, frame: Float[np.ndarray, "2 3"]) -> np.ndarray:
    """F of directions in a plane through an eye, as a quadratic form by a frame of the plane."""
    side = np.cross((rounds.center - place)[:, None], frame)
    G = np.einsum("kai,kij,kbj->kab", side, rounds.spread, side)
    return G - np.einsum("ai,kij,bj->kab", frame, rounds.adjugate, frame)


def slope_by_place(rounds: Rounds, place, way) -> np.ndarray:
    """The gradient of F by the place of the eye [m^5]."""
    side = np.cross(rounds.center - place, way)
    return 2.0 * np.cross(np.einsum("...ij,...j->...i", rounds.spread, side), way)


def touching(rounds: Rounds, w, n) -> np.ndarray:
    """From an eye to where planes through it touch bodies [m].

    Args:
        rounds: one body for each row.
        w: from the eye, or any point of the plane, to the middle [m].
        n: normals of the planes.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return w - np.einsum("...ij,...j->...i", rounds.spread, n) / dot(n, w)[..., None]


def is_on(rounds: Rounds, place, u) -> np.ndarray:
    """Whether directions are on outlines of bodies."""
    slope = np.linalg.norm(half_slope(rounds, place, u), axis=-1)
    return np.abs(outside(rounds, place, u)) < 2.0 * OFF * slope


def null_directions(G: Float[np.ndarray, "*n 2 2"]) -> np.ndarray:
    """The two unit directions in which a quadratic form of the plane is zero, shape (..., 2, 2).

    Each changes smoothly with the form, but for its sign. Not finite where there are none.
    """
    mean, half = 0.5 * (G[..., 0, 0] + G[..., 1, 1]), 0.5 * (G[..., 0, 0] - G[..., 1, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = np.arccos(-mean / np.hypot(half, G[..., 0, 1]))
    middle = np.arctan2(G[..., 0, 1], half)
    angle = 0.5 * np.stack([middle + apart, middle - apart], -1)
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def frame_across(way: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 2 3"]:
    """Two unit vectors at right angles to others and to each other."""
    axis = np.eye(3)[np.argmin(np.abs(way), axis=-1)]
    first = unit(np.cross(way, axis))
    return np.stack([first, unit(np.cross(way, first))], -2)


def around(one: Rounds, axis, place, angle) -> Float[np.ndarray, "*n 3"]:
    """Unit directions of the outline of a body, by an angle.

    Planes through the eye touch the body if `n D n = 0`, `D = S - w w`. The plane with the normal
    `adj(S) w` does not meet it, D is negative there, and positive for what is orthogonal by D.

    Args:
        one: the body.
        axis: at right angles to `adj(S) w`, from which the angle is counted.
        place: of the eye [m].
        angle: [rad].
    """
    w = one.center - place
    D = one.spread - w[..., :, None] * w[..., None, :]
    first = between(one, place)
    frame: list[np.ndarray] = []
    for vector in (first, axis, np.cross(first, axis)):
        n = np.broadcast_to(vector, w.shape)
        for other in frame:  # of length one or minus one by D, and orthogonal
            n = n - (np.sign(form(D, other)) * form(D, other, n))[..., None] * other
        with np.errstate(invalid="ignore", divide="ignore"):
            frame.append(n / np.sqrt(np.abs(form(D, n)))[..., None])
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return unit(touching(one, w, frame[0] + cosine * frame[1] + sine * frame[2]))


def on_rim(one: Rounds, angle) -> Float[np.ndarray, "*n 3"]:
    """Points of the edge of a disc by an angle [m]."""
    circle = np.stack([np.cos(angle), np.sin(angle)], -1)
    return one.center + np.einsum("...ij,...j->...i", one.axes[..., :2], circle)


def on_wall(one: Rounds, place, angle) -> Float[np.ndarray, "*n 3"]:
    """Points of the two lines in which the wall of a cylinder is seen, up one and down the other.

    Not finite for an eye within.
    """
    x, y, _ = np.moveaxis(np.linalg.solve(one.axes, (place - one.center)[..., None])[..., 0], -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.arccos(1.0 / np.hypot(x, y))
    about = np.arctan2(y, x) + np.where(np.sin(angle) < 0.0, -half, half)
    up = np.broadcast_to(np.cos(angle), about.shape)
    canonical = np.stack([np.cos(about), np.sin(about), up], -1)
    return one.center + np.einsum("...ij,...j->...i", one.axes, canonical)


def along_outline(one: Rounds, axis, place, angle) -> Float[np.ndarray, "*n 3"]:
    """Unit directions all around the outline of a body, by an angle.

    Args:
        one: the body.
        axis: from which the angle is counted for an ellipsoid, as in `around`.
        place: of the eye [m].
        angle: [rad].
    """
    if one.kind == FLAT:
        return unit(on_rim(one, angle) - place)
    if one.kind == WALL:
        return unit(on_wall(one, place, angle) - place)
    return around(one, axis, place, angle)


def between(one: Rounds, place) -> Float[np.ndarray, "*n 3"]:
    """Normals `adj(S) w` of planes through places that do not meet a body, of some length."""
    return np.einsum("...ij,...j->...i", one.adjugate, one.center - place)


def touching_planes(rounds: Rounds, point, way) -> Float[np.ndarray, "*n 2 3"]:
    """Unit normals of the two planes through a line that touch a body.

    Not finite where the line meets the body.

    Args:
        rounds: one body for each row.
        point: of the line, shape (n, 3) [m].
        way: along the line.
    """
    e, v = frame_across(way), rounds.center - point
    G = np.einsum("...ai,...ij,...bj->...ab", e, rounds.spread, e)
    across = np.einsum("...ai,...i->...a", e, v)
    normals = null_directions(G - across[..., :, None] * across[..., None, :]) @ e
    return unit(normals)
