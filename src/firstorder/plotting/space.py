"""Scenes of space as a camera sees them, silhouettes drawn over anything, and a receiver's sky."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from firstorder.imaging.camera import Pinhole
from firstorder.space import Planes, Receiver, Scene, silhouette
from firstorder.space.receiver import in_receiver_frame

_INK, _LAMP, _FLOOR = "0.15", "#e0a526", "0.75"
_SAMPLES = 64


def project(camera: Pinhole, points: Any) -> np.ndarray:
    """Image coordinates of points, shape (..., 2); NaN for what is not in front of the camera.

    Example:
        >>> from firstorder.plotting import project
        >>> from firstorder.imaging import pinhole
        >>> project(pinhole((0.0, -2.0, 0.0), (0.0, 0.0, 0.0)), [[0.5, 0.0, 0.5]]).tolist()
        [[0.25, 0.25]]
    """
    way = (np.asarray(points) - np.asarray(camera.eye)) @ np.asarray(camera.axes)
    ahead = -way[..., 2:]
    near = ahead > 1e-6 * np.max(np.abs(way), -1, keepdims=True, initial=1e-300)
    return np.where(near, way[..., :2] / np.where(near, ahead, 1.0), np.nan) * float(camera.gamma)


def silhouette_curves(scene: Scene, eye: Any, on: int = -1) -> list[tuple[int, np.ndarray]]:
    """The silhouettes that an eye sees, covered parts included: a shape's number and its points.

    Each curve is a piece: an edge of two points, or an arc of many. Horizons of planes are left
    out.

    Args:
        scene: the shapes.
        eye: where they are seen from [m].
        on: number of the shape on which the eye lies, or -1.

    Example:
        >>> from firstorder.plotting import silhouette_curves
        >>> from firstorder.space.library import sphere_over_plane
        >>> len(silhouette_curves(sphere_over_plane(), (3.0, 0.0, 0.5)))
        1
    """
    lines, edges, arcs, rims = _pieces(scene, jnp.asarray(eye, float), jnp.asarray(on))
    skipped = _planes(scene)
    found = []
    for (owner, live), points in ((lines, edges), (arcs, rims)):
        for k, there, p in zip(*map(np.asarray, (owner, live, points)), strict=True):
            if there and int(k) not in skipped:
                found.append((int(k), p))
    return found


@eqx.filter_jit
def _pieces(scene: Scene, eye, on):
    found = silhouette(scene, eye, on)
    straight, curved = found.straight, found.curved
    edges = jnp.stack([straight.start, straight.end], 1)
    t = jnp.linspace(0.0, 1.0, _SAMPLES + 1)
    angles = curved.first[:, None] + (curved.last - curved.first)[:, None] * t
    rims = jax.vmap(lambda arc, t: arc.point(t))(curved, angles)
    return (straight.owner, straight.live), edges, (curved.owner, curved.live), rims


def _planes(scene: Scene) -> set[int]:
    kinds = [type(group) for group in scene.groups for _ in range(group.count)]
    return {i for i, kind in enumerate(kinds) if kind is Planes}


def draw_view(
    ax: Axes, scene: Scene, camera: Pinhole, *, half_width: float = 1.0, names: bool = False
) -> None:
    """Draws a scene as a camera sees it: filled silhouettes, the farthest first.

    What emits is yellow; the brighter, the higher the albedo. A plane is a grid of lines a metre
    apart, a quarter of a metre near its middle, which of z = const is at x = y = 0.

    Valid for shapes that do not cover each other in a circle (painter's order by the middles).

    Args:
        ax: where to draw; its axes become equal.
        scene: what is seen.
        camera: the eye.
        half_width: image coordinate of the right edge.
        names: whether names are written.
    """
    ax.set_aspect("equal")
    ax.set(xlim=(-half_width, half_width), ylim=(-0.75 * half_width, 0.75 * half_width))
    ax.set(xticks=[], yticks=[])
    ax.grid(False)
    planes = _planes(scene)
    centers = np.concatenate([np.asarray(group.center) for group in scene.groups])
    axes = np.concatenate([np.asarray(group.axes) for group in scene.groups])
    for k in planes:
        _draw_plane(ax, camera, centers[k], axes[k], half_width)
    curves = silhouette_curves(scene, camera.eye)
    far = np.linalg.norm(centers - np.asarray(camera.eye), axis=-1)
    for k in np.argsort(-far):
        mine = [p for owner, p in curves if owner == k]
        if k in planes or not mine:
            continue
        _fill(ax, scene, int(k), _joined([project(camera, p) for p in mine]))
        if names and scene.names[k]:
            at = project(camera, centers[k])
            ax.annotate(scene.names[k], tuple(at), fontsize=6, ha="center", va="center")


def _fill(ax: Axes, scene: Scene, k: int, polygon: np.ndarray) -> None:
    bright = float(np.max(np.asarray(scene.material.emission)[k])) > 0.0
    albedo = float(np.max(np.asarray(scene.material.albedo)[k]))
    color = _LAMP if bright else str(0.35 + 0.55 * min(albedo, 1.0))
    ax.fill(*polygon.T, facecolor=color, edgecolor=_INK, linewidth=0.8)


def _joined(pieces: list[np.ndarray]) -> np.ndarray:
    """Pieces of one silhouette as one closed polygon: each is followed by the one that is nearest.

    A convex shape's pieces meet end to end, though in any order and direction.
    """
    left = [p[np.all(np.isfinite(p), -1)] for p in pieces]
    left = [p for p in left if len(p)]
    if not left:
        return np.zeros((0, 2))
    out = left.pop(0)
    while left:
        gaps = [(np.sum((p[e] - out[-1]) ** 2), i, e) for i, p in enumerate(left) for e in (0, -1)]
        _, i, e = min(gaps)
        following = left.pop(i)
        out = np.concatenate([out, following if e == 0 else following[::-1]])
    return out


def _draw_plane(ax: Axes, camera: Pinhole, center, axes, half_width: float) -> None:
    u, v, normal = axes.T / np.linalg.norm(axes, axis=0)[:, None]
    if not np.any(normal[:2]):
        center, u, v = np.array([0.0, 0.0, center[2]]), np.eye(3)[0], np.eye(3)[1]
    t = np.linspace(-8.0, 8.0, 400)[:, None]
    for a in np.concatenate([np.arange(-8.0, 8.01, 1.0), np.arange(-2.0, 2.01, 0.25)]):
        for line in (center + t * u + a * v, center + a * u + t * v):
            p = project(camera, line)
            p[np.max(np.abs(p), -1, initial=0.0, where=np.isfinite(p)) > 3.0 * half_width] = np.nan
            ax.plot(*p.T, color=_FLOOR, linewidth=0.4, linestyle="-", zorder=0)


def draw_silhouettes(
    ax: Axes, scene: Scene, eye: Any, camera: Pinhole, *, color: str = "#b91c1c"
) -> None:
    """Draws, into a camera's view, the silhouettes that another eye sees, and that eye as a dot.

    These are the curves whose points move the shadow: on a smooth shape they are where lines of
    sight from the eye are tangent to it.

    Args:
        ax: with the view of the camera.
        scene: the shapes.
        eye: whose silhouettes are drawn [m].
        camera: of the view.
        color: of the lines.
    """
    eye = np.asarray(eye, float)
    ax.plot(*project(camera, eye[None]).T, "o", color=color, markersize=3)
    for _, points in silhouette_curves(scene, eye):
        ax.plot(*project(camera, points).T, color=color, linestyle="-", linewidth=1.3)


def _sky_curves(scene: Scene, at: Receiver) -> list[np.ndarray]:
    """Silhouettes on a receiver's hemisphere, seen from above: (w_x, w_y) of their directions.

    In this projection (Nusselt) areas are shares of the irradiance of a uniform sky, times pi.
    Pieces below the horizon are cut off.
    """
    out = []
    for _, points in silhouette_curves(scene, at.position, int(at.on)):
        fine = points
        if len(points) == 2:
            fine = points[0] + np.linspace(0.0, 1.0, _SAMPLES + 1)[:, None] * (
                points[1] - points[0]
            )
        w = np.asarray(in_receiver_frame(at, jnp.asarray(fine) - at.position))
        w = w / np.linalg.norm(w, axis=-1, keepdims=True)
        out.append(np.where(w[:, 2:] >= 0.0, w[:, :2], np.nan))
    return out


def draw_sky(ax: Axes, scene: Scene, at: Receiver, title: str = "") -> None:
    """Draws a receiver's sky: the unit disc of directions and the silhouettes in it.

    Args:
        ax: where to draw; its axes become equal.
        scene: the shapes.
        at: the receiver.
        title: of the panel.

    Example:
        >>> from firstorder.plotting import draw_sky, panels
        >>> from firstorder.space import receiver
        >>> from firstorder.space.library import sphere_over_plane
        >>> figure, axes = panels()
        >>> draw_sky(axes[0, 0], sphere_over_plane(), receiver((1.0, 0.0, 0.0)))
        >>> len(axes[0, 0].lines)
        2
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    ax.plot(np.cos(turn), np.sin(turn), color="0.6", linestyle="-", linewidth=0.8)
    for curve in _sky_curves(scene, at):
        ax.plot(*curve.T, color=_INK, linestyle="-", linewidth=1.2)
    ax.set_aspect("equal")
    ax.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), xticks=[], yticks=[])
    ax.grid(False)
    ax.set_title(title, loc="left")
