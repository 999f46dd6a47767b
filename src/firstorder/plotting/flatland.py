"""Scenes of flatland as maps, and curves of light along a receiver."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from firstorder._argument_checks import check_count
from firstorder.conventions import direction
from firstorder.flatland import Scene, Segments, derivatives_on_shape, irradiance
from firstorder.numerics._batching import in_batches
from firstorder.plotting.scenes import map_axes as as_map
from firstorder.plotting.style import COLOURS, RADIANCE

_INK, _LAMP, _MIRROR, _GLASS = "0.15", "#e0a526", "#2563eb", "#7dc4d8"
# J12's colours: irradiance red, its derivatives green and blue.
_CURVES = (("E", "$E$ (W/m)", "#b91c1c"), ("dE", "$E'$ (W/m$^2$)", "#15803d"),
           ("d2E", "$E''$ (W/m$^3$)", "#1d4ed8"))  # fmt: skip
_BANDS = tuple(color for *_, color in _CURVES)  # red, green and blue

# A scene so many times as wide as high has its map above the curves, else beside them.
WIDE = 2.2


def draw_scene(
    ax: Axes,
    scene: Scene,
    *,
    normals: bool = True,
    receivers: Sequence[str] = (),
    names: bool = False,
    sky: bool = True,
) -> None:
    """Draws a scene as a map with equal axes.

    The colour of a line is its albedo, black to white or that of three bands, within a dark
    outline; yellow, or its light's own colour, is what emits, drawn on the side that does; blue a
    mirror, light blue what refracts. Short ticks are normals, stars lights without size, and the
    ring around it all is the sky.

    Args:
        ax: where to draw.
        scene: what to draw, of concrete numbers.
        normals: whether normals are drawn.
        receivers: names of the shapes that are drawn as receivers, in red.
        names: whether names are written.
        sky: whether the environment is drawn.

    Example:
        >>> from firstorder.flatland.library import named_scene
        >>> from firstorder.plotting import draw_scene, panels
        >>> figure, axes = panels()
        >>> draw_scene(axes[0, 0], named_scene("scene_b"))
        >>> axes[0, 0].get_aspect()
        1.0
    """
    as_map(ax, ax.get_title(loc="left"))
    outlines = _outlines(scene, 96)
    everything = np.concatenate([p for p, _ in outlines] + [np.asarray(scene.points.position)])
    low, high = everything.min(0), everything.max(0)
    size = float(np.max(high - low)) or 1.0
    sparse = 1 if scene.count <= 40 else 4
    for index, (points, left) in enumerate(outlines):
        name = scene.names[index]
        _draw_shape(ax, scene, index, points, left, size, name in receivers)
        if normals and index % sparse == 0:
            k = len(points) // 2
            foot = points[k] if len(points) > 2 else points.mean(0)
            tip = foot + 0.035 * size * left[min(k, len(left) - 1)]
            ax.plot(*np.stack([foot, tip]).T, color="0.45", linewidth=0.7, linestyle="-")
        first = index == 0 or scene.names[index - 1] != name
        if names and name and first:
            _write_name(ax, name, points, left)
    if scene.points.intensity.shape[0]:
        at = np.asarray(scene.points.position).T
        ax.plot(*at, "*", color=_LAMP, markersize=11, markeredgecolor=_INK, markeredgewidth=0.5)
    if sky and scene.environment is not None:
        _draw_sky(ax, scene.environment, 0.5 * (low + high), 0.56 * float(np.hypot(*(high - low))))


def receiver_curve(scene: Scene, name: str, samples: int = 201) -> dict[str, np.ndarray]:
    """Direct irradiance and its two derivatives by arc length along the shapes of one name.

    Shapes are walked in the order of their numbers, each at the middles of equal steps of its
    parameter, so that no sample lies on an end.

    Args:
        scene: what shines, and what blocks.
        name: of the receivers.
        samples: on all of them together.

    Returns:
        Columns by name: `shape` (its number), `s` (parameter), `arc` (length from the first end),
        `x`, `y` [m], `E` [W/m], `dE` [W/m^2], `d2E` [W/m^3], these with a last axis of bands, if
        there are any.

    Raises:
        ValueError: if there is no shape of that name, or `samples` is no positive integer.

    Example:
        >>> from firstorder.flatland.library import named_scene
        >>> from firstorder.plotting import receiver_curve
        >>> curve = receiver_curve(named_scene("scene_a"), "floor", 5)
        >>> print(curve["x"].round(3).tolist(), curve["E"][2].round(6))
        [-0.8, -0.4, 0.0, 0.4, 0.8] 0.894427
    """
    return curve_of(scene, name, lambda at: irradiance(scene, at), samples)


def curve_of(scene: Scene, name: str, light, samples: int = 201) -> dict[str, np.ndarray]:
    """A function of a receiver and its derivatives by arc length, along the shapes of one name.

    Args:
        scene: where the receivers are.
        name: of the receivers.
        light: function of a `Receiver`.
        samples: on all of them together.

    Raises:
        ValueError: if there is no shape of that name, or `samples` is no positive integer.
    """
    check_count("samples", samples)
    numbers = np.array(scene.named(name))
    each = max(1, round(samples / len(numbers)))
    s = np.tile((np.arange(each) + 0.5) / each, len(numbers))
    shape = np.repeat(numbers, each)

    @eqx.filter_jit
    def ask(scene, shape, s):
        def one(i, s):
            frame = scene.frame(i, s)
            d = derivatives_on_shape(light, scene, i, s)
            return frame.position, frame.speed, d.value, d.first, d.second

        return in_batches(lambda p: one(*p), (shape, s), 64)

    found = ask(scene, jnp.asarray(shape), jnp.asarray(s))
    place, speed, value, first, second = (np.asarray(a) for a in found)
    steps = speed / each  # exact for what is travelled at one speed
    columns = {"shape": shape, "s": s, "arc": np.cumsum(steps) - 0.5 * steps}
    return columns | {"x": place[:, 0], "y": place[:, 1], "E": value, "dE": first, "d2E": second}


def draw_curves(axes: Iterable[Axes], curve: dict[str, Any], across: str = "arc") -> None:
    """Draws E, E' and E'' along a receiver into three axes, broken where the shape changes.

    Three bands are red, green and blue.

    Args:
        axes: three of them.
        curve: as `receiver_curve` returns it.
        across: the column to draw over: `arc`, `x` or `y`.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import draw_curves, panels
        >>> x = np.linspace(0.0, 1.0, 5)
        >>> curve = {"shape": 0 * x, "arc": x, "E": x**2, "dE": 2 * x, "d2E": 0 * x + 2}
        >>> figure, axes = panels(1, 3)
        >>> draw_curves(axes[0], curve)
        >>> axes[0, 0].get_xlabel()
        'arc length (m)'
    """
    gap = np.flatnonzero(np.diff(curve["shape"]) != 0) + 1
    for ax, (key, words, color) in zip(axes, _CURVES, strict=True):
        x, y = np.insert(curve[across], gap, np.nan), np.insert(curve[key], gap, np.nan, axis=0)
        if len(gap) > 8:  # a polyline: one surface
            x, y = curve[across], curve[key]
        bands = y[None] if y.ndim == 1 else y.T
        colours = [color] if y.ndim == 1 else _BANDS if len(bands) == 3 else COLOURS
        for band, shade in zip(bands, itertools.cycle(colours)):
            ax.plot(x, band, color=shade, linestyle="-", linewidth=1.2)
        ax.axhline(0.0, color="0.8", linewidth=0.6, linestyle="-", zorder=0)
        ax.set_ylabel(words)
        ax.set_xlabel("arc length (m)" if across == "arc" else f"${across}$ (m)")


def scene_report(
    scene: Scene, curves: dict[str, dict[str, Any]], title: str = "", words: str = "direct light"
) -> Figure:
    """A page about a scene: its map in metres, and E, E', E'' along each receiver, one row each.

    The map of a wide scene lies above the curves, that of another beside them.

    Args:
        scene: what to draw.
        curves: as `receiver_curve` returns them, by the receivers' names.
        title: of the page.
        words: what light the curves are of.

    Example:
        >>> from firstorder.flatland.library import named_scene
        >>> from firstorder.plotting import receiver_curve, scene_report
        >>> scene = named_scene("scene_a")
        >>> page = scene_report(scene, {"floor": receiver_curve(scene, "floor", 9)})
        >>> len(page.axes)
        4
    """
    rows, wide = max(1, len(curves)), scene.environment is None and _aspect(scene) > WIDE
    map_height = 0.4 + 8.0 / _aspect(scene) if wide else 0.0
    figure = Figure((9.0 if wide else 12.2, 2.5 * rows + map_height), layout="constrained")
    if wide:  # the map lies above the curves
        grid = figure.add_gridspec(rows + 1, 3, height_ratios=[map_height, *[2.5] * rows])
        above, cells = grid[0, :], [[grid[r + 1, c] for c in range(3)] for r in range(rows)]
    else:
        grid = figure.add_gridspec(rows, 4, width_ratios=[1.25, 1.0, 1.0, 1.0])
        above, cells = grid[:, 0], [[grid[r, c + 1] for c in range(3)] for r in range(rows)]
    ax = figure.add_subplot(above)
    draw_scene(ax, scene, receivers=tuple(curves), names=True)
    ax.set_axis_on()
    ax.set(xlabel="x (m)", ylabel="y (m)")
    ax.spines[:].set_visible(False)  # a frame would look like walls
    if scene.environment is None:
        ax.margins(0.08, 0.15)
    ax.set_title(title, loc="left")
    for row, (name, curve) in zip(cells, curves.items(), strict=False):
        axes = [figure.add_subplot(cell) for cell in row]
        draw_curves(axes, curve)
        axes[0].set_title(f"{name}: {words}", loc="left")
    return figure


# --- parts of a map ------------------------------------------------------------------------------


def _aspect(scene: Scene) -> float:
    """Width of a scene over its height."""
    width, height = np.ptp(np.concatenate([p for p, _ in _outlines(scene, 24)]), axis=0)
    return float(width / max(height, 1e-300))


def _outlines(scene: Scene, samples: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points of every shape and the unit normals at them."""
    found, first = [], 0
    for group in scene.groups:
        s = np.linspace(0.0, 1.0, 2 if isinstance(group, Segments) else samples + 1)
        motion = jax.vmap(lambda one, s=s: jax.vmap(lambda t: one.motion(t)[:2])(jnp.asarray(s)))
        place, speed = (np.asarray(a) for a in motion(group))
        length = np.linalg.norm(speed, axis=-1, keepdims=True)
        left = np.stack([-speed[..., 1], speed[..., 0]], -1) / np.maximum(length, 1e-300)
        found.extend(zip(place, left, strict=True))
        first += group.count
    return found


def _draw_shape(ax, scene: Scene, index: int, points, left, size: float, received: bool) -> None:
    material = jax.tree.map(lambda a: np.asarray(a)[index], scene.material)
    color, outline = _albedo_colour(material.albedo), _INK
    if material.mirror > 0.0:
        color = _MIRROR
    if material.ior > 0.0:
        color = outline = _GLASS
        ax.fill(*points.T, color=_GLASS, alpha=0.25, linewidth=0)
    if received:
        outline = "#b91c1c"
    wide = 1.6 if scene.count <= 40 else 0.6
    edge = [patheffects.withStroke(linewidth=wide + (2.6 if received else 1.2), foreground=outline)]
    (line,) = ax.plot(*points.T, color=color, linestyle="-", linewidth=wide, path_effects=edge)
    line.set_solid_capstyle("butt")
    for side, away in ((0, 1.0), (1, -1.0)):
        if np.any(material.emission[side] > 0.0):
            shifted = points + away * 0.012 * size * left
            ax.plot(
                *shifted.T,
                color=_lamp_colour(np.asarray(material.emission[side])),
                linestyle="-",
                linewidth=3.0,
                solid_capstyle="butt",
            )


def _albedo_colour(albedo: np.ndarray) -> Any:
    """Grey of the brighter side; of three bands red, green and blue."""
    most = np.clip(np.max(albedo, 0), 0.0, 1.0)
    return tuple(most.tolist()) if most.shape == (3,) else str(float(np.max(most)))


def _lamp_colour(emission: Any) -> Any:
    """Yellow; of three bands the light's own colour, as bright as can be."""
    return tuple((emission / emission.max()).tolist()) if emission.shape == (3,) else _LAMP


def _write_name(ax, name: str, points: np.ndarray, left: np.ndarray) -> None:
    """Writes a shape's name behind it, where its light and its normal do not go."""
    middle = 0.5 * (points[(len(points) - 1) // 2] + points[len(points) // 2])
    behind = -left[(len(left) - 1) // 2]
    across = "center" if abs(behind[0]) < 0.5 else "left" if behind[0] > 0.0 else "right"
    up = "center" if abs(behind[1]) < 0.5 else "bottom" if behind[1] > 0.0 else "top"
    style = {"fontsize": 6, "ha": across, "va": up, "annotation_clip": False}
    ax.annotate(name, tuple(middle), tuple(5.0 * behind), textcoords="offset points", **style)


def _draw_sky(ax: Axes, sky, center: np.ndarray, radius: float) -> None:
    """A ring in the directions from which light comes."""
    angle = np.linspace(-np.pi, np.pi, 181)
    ring = center + radius * np.asarray(direction(jnp.asarray(angle)))
    middle = jnp.asarray(0.5 * (angle[1:] + angle[:-1]))
    radiance = np.asarray(jax.vmap(sky)(middle))
    pieces = LineCollection(list(np.stack([ring[:-1], ring[1:]], 1)), cmap=RADIANCE, linewidth=3.5)
    most = max(float(radiance.max()), 1e-300)
    if radiance.shape[1:] == (3,):
        pieces.set_color(list(radiance / most))
    else:
        pieces.set_array(radiance.reshape(len(radiance), -1).max(-1))
        pieces.set_clim(0.0, most)
    ax.add_collection(pieces)
    ax.set_xlim(center[0] - 1.06 * radius, center[0] + 1.06 * radius)
    ax.set_ylim(center[1] - 1.06 * radius, center[1] + 1.06 * radius)
