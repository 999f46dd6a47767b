"""Where light and spectra are drawn when nobody says it: around what there is of them."""

from __future__ import annotations

import itertools

import numpy as np

from firstorder.errors import Refused
from firstorder.fields import Extent, Field, Grid, SampledSpectrum, Spectrum
from firstorder.flatland import LightField
from firstorder.flatland.shapes._bounds import bounds
from firstorder.laws.base import FieldImage

# Half of what is shown of a coordinate along which nothing is known of the light.
HALF = {"theta": 0.5 * np.pi, "phi": np.pi}
DEVIATIONS = 3.5  # of a bell that are shown
DECADES = 3.0  # frequencies that are searched for energy, up and down from a cycle per unit
FAINT = 0.01  # share of the greatest magnitude that is energy
CYCLES = 16.0  # across the light itself, beyond which no energy is looked for


def window_of(field: Field, size: int) -> Grid:
    """A grid over the light of a field: over its extent, or over the scene that sends it."""
    extent, scene = extent_of(field), source_of(field)
    halves, centers = [], []
    for i, name in enumerate(field.frame.coordinates):
        low, high = -HALF.get(name, 1.0), HALF.get(name, 1.0)
        if extent is not None:
            ends = _along(extent, i)
            low, high = ends if 0.0 < ends[1] - ends[0] < np.inf else (low, high)
        elif scene is not None and name == "x":
            low, high = _line_through(scene)
        halves.append(0.5 * (high - low))
        centers.append(0.5 * (high + low))
    return Grid.spanning((size,) * field.frame.dims, tuple(halves), tuple(centers))


def extent_of(field: Field) -> Extent | None:
    """Where the light of a field lies, by its spectrum or by those of what it is made of."""
    if isinstance(field, FieldImage):
        inner = extent_of(field.operand)
        return None if inner is None else field.law.extent(inner, field.operand.frame)
    try:
        return field.spectrum().extent()
    except Refused:
        return None


def source_of(field: Field) -> LightField | None:
    """The light of a scene that laws took to this field, if it was that."""
    while isinstance(field, FieldImage):
        field = field.operand
    return field if isinstance(field, LightField) else None


def _along(extent: Extent, axis: int) -> tuple[float, float]:
    ends = extent.along(np.eye(extent.center.shape[-1])[axis], DEVIATIONS)
    return float(ends[0]), float(ends[1])


def _line_through(light: LightField) -> tuple[float, float]:
    """The part of the line of a light field that lies before, beside and behind its scene."""
    boxes = [bounds(group) for group in light.scene.groups]
    corners = [np.stack([x, y], -1) for box in boxes for x, y in itertools.product(*_sides(box))]
    away = np.concatenate(corners) - np.asarray(light.line.position)
    x = away @ np.asarray(light.line.tangent)
    return float(x.min()), float(x.max())


def _sides(box: tuple[np.ndarray, np.ndarray]) -> list[list[np.ndarray]]:
    """Both ends along x, and both along y."""
    return [[end[:, axis] for end in box] for axis in (0, 1)]


def frequencies_of(F: Spectrum, size: int) -> Grid:
    """A grid over the energy of a spectrum, about the origin."""
    sampled = isinstance(F, SampledSpectrum)  # beyond these frequencies it repeats itself
    halves = [0.5 / step for step in F.grid.step] if sampled else _energy(F)
    return Grid.spanning((size,) * F.frame.dims, tuple(float(h) for h in halves))


def _energy(F: Spectrum) -> list[float]:
    """How far the energy reaches along each axis; looked for on a ladder of frequencies."""
    n = F.frame.dims
    steps = 10.0 ** np.linspace(-DECADES, DECADES, 121 if n == 1 else 31)
    ladder = np.concatenate([-steps[::-1], [0.0], steps])
    extent = F.extent()
    caps = [_cap(extent, i) for i in range(n)]
    # Where the light is so narrow that its energy may lie beyond the ladder, it is stretched.
    stretches = [max(1.0, cap / steps[-1]) if np.isfinite(cap) else 1.0 for cap in caps]
    axes = [np.clip(a * ladder, -cap, cap) for a, cap in zip(stretches, caps, strict=True)]
    mesh = np.meshgrid(*axes, indexing="ij")
    found = np.nan_to_num(np.abs(np.asarray(F(*mesh))), posinf=0.0)
    strong = found >= FAINT * max(float(found.max()), 1e-300)
    halves = []
    for omega, stretch, cap in zip(mesh, stretches, caps, strict=True):
        reach = float(np.abs(omega[strong]).max(initial=0.0))
        if reach <= 0.0:
            reach = stretch * steps[0]
        elif reach >= steps[-1] and np.isinf(cap):  # it does not die out
            reach = 1.0
        halves.append(min(reach * steps[1] / steps[0], cap))  # up to the next rung
    return halves


def _cap(extent: Extent | None, axis: int) -> float:
    """Frequencies beyond which light of a known width is not asked for."""
    if extent is None:
        return np.inf
    low, high = _along(extent, axis)
    return CYCLES / (high - low) if 0.0 < high - low < np.inf else np.inf
