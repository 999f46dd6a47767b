"""Light fields and spectra on axes: curves over one coordinate, images over two."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path

from firstorder.fields import (
    Edge,
    Field,
    Grid,
    SampledSpectrum,
    Spectrum,
    discrete_transform,
)
from firstorder.flatland import LightField
from firstorder.laws import Integrate, Multiply
from firstorder.laws.base import FieldImage
from firstorder.plotting._axes import check_one_of_numbers, colour_bar
from firstorder.plotting._windows import frequencies_of, source_of, window_of
from firstorder.plotting.flatland import _outlines
from firstorder.plotting.light import log_magnitude, show_light_field, show_spectrum
from firstorder.plotting.style import label

SIZES = {1: 400, 2: 128}  # samples along an axis; even, so that none lies in the middle
HALVINGS = 60


def plot_field(ax: Axes, field: Field, window: Grid | None = None, size: int = 0) -> None:
    """Radiance over one coordinate as a curve, broken where it jumps, or over two as an image."""
    window = _checked("field", field, window) or window_of(field, size or SIZES[field.frame.dims])
    words = quantity(field)
    if field.frame.dims == 1:
        x, values = curve(field, window)
        _check_some("field", values)
        ax.plot(x, values, "-")
        ax.set(xlabel=label(field.frame.coordinates[0]), ylabel=words, xlim=_ends(window, 0))
        show_no_value(ax, values)
        return
    values = np.array(window.sample(field))
    values[blank(field, window.axis(0))] = np.nan
    _check_some("field", values)
    names = field.frame.coordinates[0], field.frame.coordinates[1]
    image = show_light_field(
        ax, values, window.axis(0), window.axis(1), names=names, scale=False,
        equal=names == ("x", "y"),
    )  # fmt: skip
    show_no_value(ax, values)
    colour_bar(ax, image, words)


def plot_spectrum(
    ax: Axes, F: Spectrum, window: Grid | None = None, decades: float = 6.0, size: int = 0
) -> None:
    """Magnitude over one frequency as a curve, or over two as an image, both by powers of ten."""
    window = _checked("spectrum", F, window) or frequencies_of(F, size or SIZES[F.frame.dims])
    values = _transformed(F, window)
    _check_some("spectrum", values)
    names = F.frame.coordinates
    if F.frame.dims == 1:
        magnitude = np.abs(values)
        known = magnitude[np.isfinite(magnitude)]
        top = float(known.max(initial=0.0)) or 1.0
        ax.plot(window.axis(0), top * 10.0 ** log_magnitude(magnitude, top, decades), "-")
        least = max(float(known.min(initial=top)), top * 10.0**-decades)
        ax.set(yscale="log", ylim=(0.5 * least, 2.0 * top), xlim=_ends(window, 0))
        ax.set(xlabel=label(f"Omega_{names[0]}"), ylabel=r"magnitude $|\hat{L}|$")
        show_no_value(ax, magnitude)
        return
    image = show_spectrum(
        ax, values, window.axis(0), window.axis(1), decades=decades, names=(names[0], names[1]),
        scale=False,
    )  # fmt: skip
    show_no_value(ax, np.abs(values))
    known = np.abs(values[np.isfinite(values)])
    colour_bar(ax, image, rf"$\log_{{10}} |\hat{{L}}| / {known.max(initial=0.0):.3g}$")


def _transformed(F: Spectrum, window: Grid) -> np.ndarray:
    """Densities on a grid; of samples by products of matrices, which `at` has to do one by one."""
    if isinstance(F, SampledSpectrum):
        axes = [window.axis(i) for i in range(F.frame.dims)]
        return np.asarray(discrete_transform(F.samples, F.grid, *axes))
    return np.asarray(F(*np.moveaxis(window.points(), -1, 0)))


def quantity(field: Field) -> str:
    """Label of the values of a field, with their unit where that is known."""
    if not field.frame.directions:
        return "light $L$"  # some direction is integrated out, perhaps under a weight
    unit = isinstance(field, LightField) and field.radiance is None
    return "radiance $L$ (W/(m rad))" if unit else "radiance $L$"


def _checked(name: str, portrait: Field | Spectrum, window: Grid | None) -> Grid | None:
    """Refuse what cannot be drawn.

    Raises:
        ValueError: if the portrait has more than two coordinates, holds no numbers or is a batch,
            or if the window has other coordinates than it.
    """
    dims, names = portrait.frame.dims, ", ".join(portrait.frame.coordinates)
    if dims not in SIZES:
        raise ValueError(
            f"Argument `{name}` must be over one or two coordinates to be drawn, but is over "
            f"({names}): draw a section, Function(lambda x, v: L(x, 0.0, v, 0.0), frame) of light."
        )
    check_one_of_numbers(name, portrait, name, _batch_of)
    if window is not None and len(window.size) != dims:
        raise ValueError(
            f"Argument `window` must be over the {dims} coordinates {names}, "
            f"but has {len(window.size)}."
        )
    return window


def _batch_of(portrait: Field | Spectrum) -> int:
    """How many portraits `jax.vmap` put into one, which answers for no ray; 0 for one alone."""
    sizes = {np.shape(leaf)[0] if np.ndim(leaf) else 0 for leaf in jax.tree.leaves(portrait)}
    if len(sizes) != 1 or 0 in sizes or _answers(portrait):
        return 0
    return sizes.pop() if _answers(jax.tree.map(lambda leaf: leaf[0], portrait)) else 0


def _answers(portrait: Field | Spectrum) -> bool:
    """Whether it gives one number for one ray."""
    ray = jax.ShapeDtypeStruct((portrait.frame.dims,), jnp.result_type(float))
    try:
        return jax.eval_shape(portrait.at, ray).shape == ()
    except (ValueError, TypeError, IndexError):  # its parts do not fit one ray
        return False


def _check_some(name: str, values: np.ndarray) -> None:
    """Refuse a picture of nothing: unknown light, or a window inside of a body."""
    if not np.isfinite(values).any():
        raise ValueError(f"Argument `{name}` must have a value in the window, but has none there.")


def _ends(window: Grid, axis: int) -> tuple[float, float]:
    half = 0.5 * window.extent[axis]
    return window.center[axis] - half, window.center[axis] + half


# --- over one coordinate --------------------------------------------------------------------------


def curve(field: Field, window: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Places and values of a field of one coordinate, with NaN between the sides of each jump."""
    x = np.asarray(window.axis(0), float)
    jumps = np.unique(np.concatenate([x[:0], *(_jumps(edge, x) for edge in field.edges())]))
    epsilon = float(jnp.finfo(jnp.result_type(float)).eps) ** 0.5 * window.extent[0]
    x = x[np.all(np.abs(x[:, None] - jumps) > epsilon, axis=-1)]
    places = np.concatenate([x, jumps - epsilon, jumps + epsilon, jumps])
    values = _asked(field, places, window.size[0])
    values[len(places) - len(jumps) :] = np.nan
    values[blank(field, places)] = np.nan
    order = np.argsort(places, kind="stable")
    return places[order], values[order]


def _jumps(edge: Edge, x: np.ndarray) -> np.ndarray:
    """Where an edge lies between the first place and the last, and jumps; by bisection."""
    level, n = _asked(edge.level, x, len(x)), len(x)
    k = np.flatnonzero(np.sign(level[:-1]) * np.sign(level[1:]) < 0.0)
    a, b, sign = x[k], x[k + 1], np.sign(level[k])
    for _ in range(HALVINGS if len(k) else 0):
        middle = 0.5 * (a + b)
        same = np.sign(_asked(edge.level, middle, n)) == sign
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    there = np.concatenate([0.5 * (a + b), x[level == 0.0]])
    return there[np.abs(_asked(edge.jump, there, n)) > 0.0]


def _asked(field: Field, x: np.ndarray, size: int) -> np.ndarray:
    """Values at any number of places, always so many at a time: one program is compiled."""
    blocks = -(-len(x) // size)
    padded = np.concatenate([x, np.zeros(blocks * size - len(x))]).reshape(blocks, size)
    return np.concatenate([x[:0], *(np.asarray(field(row)) for row in padded)])[: len(x)]


# --- no value -------------------------------------------------------------------------------------


def blank(field: Field, x: np.ndarray) -> np.ndarray:
    """Which places x of a scene's light lie inside of a body that lets no light through."""
    kept, source = field, source_of(field)
    while isinstance(kept, FieldImage) and isinstance(kept.law, (Multiply, Integrate)):
        kept = kept.operand  # these leave the places where they are
    if source is None or kept is not source or field.frame.coordinates[0] != "x":
        return np.zeros(len(x), bool)
    scene, line = source.scene, source.line
    eyes = np.asarray(line.position) + np.multiply.outer(x, np.asarray(line.tangent))
    found, k = np.zeros(len(x), bool), 0
    drawn = _outlines(scene, 96)
    for group in scene.groups:
        for points, _ in drawn[k : k + group.count]:
            opaque = float(scene.material.ior[k]) == 0.0 and int(line.on) != k
            if group.closed and opaque:
                found |= Path(points).contains_points(eyes)
            k += 1
    return found


def show_no_value(ax: Axes, values: np.ndarray) -> None:
    """Hatches the ground of an image or a surface where there is no value."""
    if values.ndim == 2 and not np.isfinite(values).all():
        ax.patch.set(hatch="////", edgecolor="0.8", linewidth=0.0)
