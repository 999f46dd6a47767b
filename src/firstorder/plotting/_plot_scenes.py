"""Scenes on axes with units: flatland as it lies, space seen from above, the front or the side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D

from firstorder import flatland, space
from firstorder._argument_checks import check_known
from firstorder.plotting._axes import check_one_of_numbers, colour_bar, label_axes
from firstorder.plotting.flatland import _GLASS, _LAMP, _MIRROR, draw_scene
from firstorder.scene._words import batch_of
from firstorder.space import Boxes, Discs, Ellipsoids, Planes, Rectangles, Triangles

_INK, _GROUND = "0.15", "0.55"
NAME = 13.0  # points that a name takes, with its distance from the shape
# Columns across and up, the column of depth, and which way along it the eye is.
VIEWS = {"top": (0, 1, 2, 1.0), "front": (0, 2, 1, -1.0), "side": (1, 2, 0, 1.0)}
TITLES = {
    "top": "from above",
    "front": "from the front, along y",
    "side": "from the side, along -x",
}
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
CUBE = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), -1).reshape(-1, 3)


def check_scene(scene: Any) -> None:
    """Refuse what is not one scene of numbers.

    Raises:
        ValueError: if it is traced, or a batch of scenes.
    """
    check_one_of_numbers("scene", scene, "scene", batch_of)


def plot_flatland(
    ax: Axes, scene: flatland.Scene, *, names: bool = True, normals: bool = True, sky: bool = True
) -> None:
    """A map of flatland with its coordinates along the edges."""
    check_scene(scene)
    draw_scene(ax, scene, names=names, normals=normals, sky=sky)
    ax.set_axis_on()
    rings = [c for c in ax.collections if c.get_array() is not None]
    if not rings:
        _make_room(ax)
    for ring in rings:
        if np.ptp(np.asarray(ring.get_array())) > 0.0:
            colour_bar(ax, ring, "sky (W/(m rad))", 0.6)
    label_axes(ax, ("x", "y"))
    material = scene.material
    _key(ax, [
        ("shines", _LAMP, "-", np.any(material.emission)),
        ("mirror", _MIRROR, "-", np.any(material.mirror)),
        ("glass", _GLASS, "-", np.any(material.ior)),
        ("point light", _LAMP, "*", np.size(scene.points.intensity) > 0),
    ])  # fmt: skip


def _ink(albedo: Any) -> Any:
    """Grey, lighter where more is reflected; a colour if there are three bands."""
    light = 0.35 + 0.55 * np.asarray(albedo)
    return tuple(light.tolist()) if light.shape == (3,) else str(float(np.max(light)))


def _make_room(ax: Axes) -> None:
    """Room for names on all sides, also around what is long and low, and on small axes."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    # Labels and the key, which are laid out later, leave about as much of the axes.
    points = 0.6 * 72.0 / ax.figure.dpi * np.array(ax.get_window_extent().size)
    # Lengths have one scale along both axes, on which the names have room at both ends.
    metres = np.array([right - left, top - bottom]) / np.maximum(points - 2.0 * NAME, NAME)
    room = max(0.06 * max(right - left, top - bottom), NAME * metres.max())
    ax.set(xlim=(left - room, right + room), ylim=(bottom - room, top + room))


def plot_space(ax: Axes, scene: space.Scene, *, view: str = "front", names: bool = True) -> None:
    """Outlines of all shapes, seen from far away along an axis; the nearer lie over the others."""
    check_scene(scene)
    check_known("view", view, VIEWS)
    across, up, deep, sign = VIEWS[view]
    found: list[np.ndarray] = []
    for group in scene.groups:
        if not isinstance(group, Planes):
            found += outlines(group, (across, up))
    centers, normals = _middles(scene)
    shown = [k for k, kind in enumerate(_kinds(scene)) if kind is not Planes]
    order = np.argsort(sign * centers[shown, deep], kind="stable")
    bright = np.asarray(scene.material.emission).reshape(len(scene.names), -1).max(-1) > 0.0
    albedo = np.clip(np.max(np.asarray(scene.material.albedo), 1), 0.0, 1.0)
    inks = [_LAMP if bright[k] else _ink(albedo[k]) for k in shown]
    away = sign * normals[shown, deep] < 0.0  # the wall of a room on our side: we look through it
    thin = 0.8 if len(order) < 500 else 0.2
    shapes = PolyCollection(
        [found[i] for i in order],
        facecolors=["none" if away[i] else inks[i] for i in order],
        edgecolors=[_LAMP if bright[shown[i]] else _INK for i in order],
        linewidths=[2.0 if bright[shown[i]] else thin for i in order],
    )
    ax.add_collection(shapes)
    for group in scene.groups:
        if isinstance(group, Planes):
            _draw_planes(ax, group, (across, up))
    ax.autoscale_view()
    _make_room(ax)
    ax.set_aspect("equal")
    ax.set_title(TITLES[view], loc="left")
    label_axes(ax, ("xyz"[across], "xyz"[up]))
    if names:
        _write_names(ax, scene, [shown[i] for i in order], [found[i] for i in order])
    _key(ax, [("shines", _LAMP, "s", bright.any())])


def outlines(group: space.Shape, columns: tuple[int, int]) -> list[np.ndarray]:
    """Outline of each shape of a kind on a coordinate plane: corners of a convex polygon, (m, 2).

    A ball's is an ellipse, found from the singular values of its flattened axes; 64 corners.
    """
    pick = list(columns)
    center, axes = np.asarray(group.center)[:, pick], np.asarray(group.axes)[:, pick]
    turn = np.linspace(0.0, 2.0 * np.pi, 65)[:-1]
    circle = np.stack([np.cos(turn), np.sin(turn)], -1)
    match group:
        case Ellipsoids():
            u, sizes, _ = np.linalg.svd(axes, full_matrices=False)
            local = np.einsum("nij,nj,kj->nki", u, sizes, circle)
        case Discs():
            local = np.einsum("nij,kj->nki", axes[..., :2], circle)
        case Rectangles():
            local = np.einsum("nij,kj->nki", axes[..., :2], CORNERS)
        case Triangles():
            local = np.stack([0.0 * center, axes[..., 0], axes[..., 1]], 1)
        case _:  # boxes and cylinders
            ends = [np.insert(circle, 2, z, axis=1) for z in (-1.0, 1.0)]
            solid = CUBE if isinstance(group, Boxes) else np.concatenate(ends)
            around = [_hull(points) for points in np.einsum("nij,kj->nki", axes, solid)]
            return [c + points for c, points in zip(center, around, strict=True)]
    return list(center[:, None] + local)


def _hull(points: np.ndarray) -> np.ndarray:
    """The convex hull of points of a plane, counter-clockwise; two points if all are in line."""
    ordered = sorted(map(tuple, points.tolist()))
    slack = 1e-9 * float(np.ptp(points)) ** 2

    def chain(row):
        kept: list = []
        for p in row:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], p) <= slack:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _turn(a, b, c) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _middles(scene: space.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Centres of all shapes, and the normals of the flat ones, zero for the others."""
    centers, normals = [], []
    for group in scene.groups:
        axes = np.asarray(group.axes)
        flat = isinstance(group, (Rectangles, Discs, Triangles))
        centers.append(np.asarray(group.center))
        normals.append(axes[..., 2] if flat else 0.0 * axes[..., 2])
    return np.concatenate(centers), np.concatenate(normals)


def _kinds(scene: space.Scene) -> list[type]:
    return [type(group) for group in scene.groups for _ in range(group.count)]


def _draw_planes(ax: Axes, planes: Planes, columns: tuple[int, int]) -> None:
    """Planes that are seen edge-on, as lines without end; others fill the view and are left out."""
    normals = np.asarray(planes.axes)[..., 2]
    for center, normal in zip(np.asarray(planes.center), normals, strict=True):
        flat = normal[list(columns)]
        if np.linalg.norm(flat) > (1.0 - 1e-9) * np.linalg.norm(normal):
            at = tuple(center[list(columns)])
            beside = (at[0] + flat[1], at[1] - flat[0])
            ax.axline(at, beside, color=_GROUND, linestyle="-", linewidth=1.4, zorder=0)


def _write_names(ax: Axes, scene: space.Scene, numbers: Sequence[int], polygons) -> None:
    """Each name once, in the middle of the nearest shape called so; names at one place in a row."""
    middles = {
        scene.names[k]: 0.5 * (p.min(0) + p.max(0)) for k, p in zip(numbers, polygons, strict=True)
    }
    size = np.ptp(np.concatenate(list(polygons)), axis=0).max() if polygons else 1.0
    places: list[tuple[np.ndarray, list[str]]] = []
    for name, at in middles.items():
        gaps = [(np.abs(there - at) / size, words) for there, words in places]
        near = [words for gap, words in gaps if gap[0] < 0.2 and gap[1] < 0.05]
        if name and near:
            near[0].append(name)
        elif name:
            places.append((at, [name]))
    for at, words in places:
        ax.annotate(
            ", ".join(words), tuple(at), (0, 3), textcoords="offset points", fontsize=6,
            ha="center", va="bottom",
            path_effects=[patheffects.withStroke(linewidth=1.8, foreground="white")],
        )  # fmt: skip


def _key(ax: Axes, entries: Sequence[tuple[str, str, str, Any]]) -> None:
    """Draws a legend beside the picture, of the colours that are in it."""
    lines = [
        Line2D([], [], color=color, label=words, linestyle="-" if mark == "-" else "none",
               marker="" if mark == "-" else mark, linewidth=3.0, markersize=8)
        for words, color, mark, there in entries if there
    ]  # fmt: skip
    if lines:
        ax.legend(
            handles=lines, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0,
            frameon=False, fontsize=7,
        )  # fmt: skip
