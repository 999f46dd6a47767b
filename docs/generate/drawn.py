"""The conventions as a picture, whose directions and normals are those that the code returns."""

from __future__ import annotations

import io

import jax
import jax.numpy as jnp
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from firstorder import plotting
from firstorder.conventions import direction, travel_sign
from firstorder.flatland import Arcs, Circles, Scene, Segments, primitive
from firstorder.io.svg.reader import _scene_from_svg

INK, RED, BLUE, GOLD = plotting.COLOURS[:4]
DRAWING = '<svg viewBox="0 0 4 3"><line id="lamp" x1="3" y1="1" x2="1" y2="1" class="light"/></svg>'


def pages() -> dict[str, str]:
    """The picture, as SVG."""
    return {"sides.svg": _svg(figure())}


def figure() -> Figure:
    """Six panels: where angle 0 is, both senses, fronts, normals of a valley, a drawing."""
    panels = (angles, senses, fronts, closed_fronts, valley, drawing)
    with plotting.house_style():
        found, axes = plotting.panels(2, 3, 3.2, 2.5)
        for panel, axis in zip(panels, np.ravel(axes), strict=True):
            panel(axis)
            axis.set_aspect("equal", adjustable="datalim")
            axis.axis("off")
    return found


def angles(axis: Axes) -> None:
    """A receiver, its normal, and a direction at an angle."""
    axis.set_title("angle 0: the normal; left is positive")
    axis.plot([-1, 1], [0, 0], color=INK, lw=2)
    theta = 0.6
    _arrow(axis, (0, 0), direction(jnp.array(0.0)), INK, "normal, theta = 0")
    _arrow(axis, (0, 0), direction(jnp.array(theta)), RED, "theta = 0.6")
    _arrow(axis, (0, 0), direction(jnp.array(-np.pi / 2)), BLUE)
    axis.text(0.9, -0.2, "+x, theta = -pi/2", color=BLUE, ha="right", fontsize=8)
    arc = 0.5 * np.asarray(direction(jnp.linspace(0.0, theta, 20)))
    axis.plot(arc[:, 0], arc[:, 1], color=RED, lw=1)


def senses(axis: Axes) -> None:
    """Two rays of one slope: each points to where light comes from, or to where it goes."""
    axis.set_title("travel by d: incoming and outgoing light")
    v, d = 0.6, 1.0
    way = np.array([-v * d, d])  # as `direction` has it: slopes too grow to the left
    for y in (0.0, d):
        axis.plot([-1.5, 1.5], [y, y], color=INK, lw=1, ls="-")
    for sense, x, colour in (("incoming", -0.3, RED), ("outgoing", 0.5, BLUE)):
        before = travel_sign(sense) * v * d  # l'(x, v) = l(x + before, v)
        foot = x if before < 0.0 else x + before
        _arrow(axis, (foot, 0.0), way, colour)
        sign = "-" if before < 0.0 else "+"
        places = (
            (("x", 0.0), (f"x {sign} v d", d))
            if before < 0.0
            else ((f"x {sign} v d", 0.0), ("x", d))
        )
        for words, y in places:
            at = foot + way[0] * y / d
            axis.text(at, y + (0.05 if y else -0.18), words, color=colour, ha="center", fontsize=8)
        formula = f"{sense}: l'(x, v) = l(x {sign} v d, v)"
        low = -0.45 if before < 0.0 else -0.65
        axis.text(0.0, low, formula, color=colour, ha="center", fontsize=8)


def fronts(axis: Axes) -> None:
    """A segment and an arc of flatland: the front is the left of the way."""
    axis.set_title("open shapes: the left of the way shines")
    scene = Scene.of(
        primitive(Segments((-0.9, 0.0), (-0.1, 0.3))),
        primitive(Arcs((0.6, 0.2), 0.4, -np.pi / 2, np.pi)),
    )
    for index in range(scene.count):
        _shape(axis, scene, index)


def closed_fronts(axis: Axes) -> None:
    """A circle: the front is the outside."""
    axis.set_title("closed shapes: the outside shines")
    scene = Scene.of(primitive(Circles((0.0, 0.0), 0.5)))
    _shape(axis, scene, 0)


def valley(axis: Axes) -> None:
    """The normals of a surface whose angle grows with x."""
    axis.set_title("kappa = dn/dx > 0 is a valley")
    x = np.linspace(-1.0, 1.0, 81)
    kappa = 0.7
    n = kappa * x
    tangent = np.asarray(direction(jnp.asarray(n - np.pi / 2)))
    y = np.concatenate([[0.0], np.cumsum(np.diff(x) * (tangent[:-1, 1] / tangent[:-1, 0]))])
    axis.plot(x, y - y[40], color=INK, lw=2)
    for k in range(8, 81, 16):
        _arrow(axis, (x[k], y[k] - y[40]), 0.35 * np.asarray(direction(jnp.asarray(n[k]))), RED)
    axis.text(0.0, -0.25, "normals lean together: n(x) = kappa x", ha="center", fontsize=8)


def drawing(axis: Axes) -> None:
    """A drawing, 4 by 3 user units, and the scene that is read from it."""
    axis.set_title("an SVG: 1 unit = 1 m, y turned over")
    scene = _scene_from_svg(DRAWING)
    axis.plot([0, 4, 4, 0, 0], [0, 0, 3, 3, 0], color="0.7", lw=0.8)
    axis.text(0.0, 3.1, "SVG: (0, 0), y down", fontsize=8, color="0.4")
    axis.text(0.0, -0.35, "here: (0, 0), y up", fontsize=8)
    _shape(axis, scene, 0, 0.5)
    axis.text(2.0, 2.2, 'x1="3" y1="1" x2="1" y2="1"', fontsize=7, ha="center", color="0.4")


def _shape(axis: Axes, scene: Scene, index: int, length: float = 0.25) -> None:
    """A shape, the way along it, and the normals of its front."""
    s = np.linspace(0.0, 1.0, 65)
    frames = jax.vmap(lambda t: scene.frame(index, t))(s)
    place, normal = np.asarray(frames.position), np.asarray(frames.normal)
    axis.plot(place[:, 0], place[:, 1], color=INK, lw=2, ls="-")
    for k in (8, 24, 40, 56):
        _arrow(axis, place[k], length * normal[k], GOLD)
    way = place[33] - place[31]
    _arrow(axis, place[31], way / np.hypot(*way) * 0.6 * length, BLUE)


def _arrow(axis: Axes, foot, way, colour: str, words: str = "") -> None:
    """An arrow from a place, with words at its tip."""
    foot, tip = np.asarray(foot), np.asarray(foot) + np.asarray(way)
    axis.annotate(
        "", tip, foot, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0}
    )
    axis.plot(*np.transpose([foot, tip]), alpha=0.0)  # arrows do not widen the axes
    if words:
        axis.annotate(words, tip, color=colour, fontsize=8, ha="center", va="bottom")


def _svg(found: Figure) -> str:
    """A figure as text that is the same in every run."""
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "firstorder", "svg.fonttype": "none"}):
        found.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
