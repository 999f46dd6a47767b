"""A cache as a table: one column for each number that its records hold, and back.

Names of columns are those of derivatives, `E`, `dE_dx`, `d2E_dxdy`, of tilts `n` or `n_x` and
`n_y`, and of regions `radius`, `shorter`, `angle` and `clamp`.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_finite, check_positive, check_shape
from firstorder._display import table
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import CLAMPS, ValidityRegion


def columns_of(records: Candidates, region: ValidityRegion) -> dict[str, np.ndarray]:
    """One vector for each column."""
    d = records.dims
    named = dict(zip("xy", np.asarray(records.position).T, strict=False))
    if records.tilt is not None:
        named |= dict(zip(_tilts(d), np.asarray(records.tilt).T, strict=True))
    held = (records.value, records.gradient, records.hessian, records.third)
    for order, found in enumerate(held):
        if found is not None:
            for name, which in _derivative_names(order, d).items():
                named[name] = np.asarray(found)[(slice(None), *which)]
    lengths, angle = region.axes()
    named["radius"] = lengths[:, 0]
    if d == 2:
        named |= {"shorter": lengths[:, 1], "angle": angle}
    clamp = np.broadcast_to(np.asarray(region.clamp), lengths.shape[:1])
    return named | {"clamp": np.array([CLAMPS[int(c)] for c in clamp])}


def units_of(dims: int) -> dict[str, str]:
    """Units of all columns that may be."""
    units = dict.fromkeys(("x", "y", "radius", "shorter"), "m")
    units |= dict.fromkeys((*_tilts(dims), "angle"), "rad")
    for order in range(4):
        power = f"^{dims + order}" if dims + order > 1 else ""
        units |= dict.fromkeys(_derivative_names(order, dims), f"W/m{power}")
    return units


def records_of(columns: Mapping[str, np.ndarray]) -> tuple[Candidates, ValidityRegion]:
    """Records and their regions, from what `columns_of` gave.

    Raises:
        ValueError: if a column is missing or of another length, a radius is not positive, or a
            clamp is another word.
    """
    d = 2 if {"y", "shorter", "angle"} & set(columns) else 1
    sizes = ("radius", "shorter", "angle")[: 2 * d - 1]
    for name in (*"xy"[:d], *_derivative_names(0, d), *_derivative_names(1, d), *sizes):
        if name not in columns:
            raise ValueError(f"Argument `columns` must hold `{name}`, but does not.")
    value, gradient, hessian, third = (_derivatives(columns, order, d) for order in range(4))
    assert value is not None
    assert gradient is not None
    tilt = _stacked(columns, _tilts(d)) if set(_tilts(d)) <= set(columns) else None
    records = Candidates.of(
        _stacked(columns, "xy"[:d]), value, gradient, hessian, third=third, tilt=tilt
    )
    clamp = [_code(word) for word in columns.get("clamp", [""] * records.count)]
    regions = {name: np.asarray(columns[name], float) for name in sizes}
    for name, column in {**regions, "clamp": np.asarray(clamp)}.items():
        check_shape(name, column, (records.count,))
        check = check_positive if name in ("radius", "shorter") else check_finite
        check(name, column)
    matrix = _matrices(*regions.values())
    return records, ValidityRegion(jnp.asarray(matrix), jnp.asarray(clamp, dtype=jnp.int32))


def printed(columns: Mapping[str, Any]) -> str:
    """A table as lines: names above their columns, numbers to five digits.

    Example:
        >>> from firstorder.caching._columns import printed
        >>> print(printed({"x": [0.5, 12.0], "clamp": ["", "cut"]}))
          x  clamp
        0.5
         12    cut
    """
    rows = [list(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append([c if isinstance(c, str) else f"{float(c):.5g}" for c in row])
    widths = [max(len(row[i]) for row in rows) for i in range(len(columns))]
    lines = ["  ".join(c.rjust(w) for c, w in zip(row, widths, strict=True)) for row in rows]
    return table([line.rstrip() for line in lines])


def _stacked(columns, names) -> np.ndarray:
    """Columns side by side."""
    found = [np.asarray(columns[name], float) for name in names]
    for name, column in zip(names, found, strict=True):
        check_shape(name, column, found[0].shape)
    return np.stack(found, -1)


def _derivatives(columns, order: int, dims: int) -> np.ndarray | None:
    """All derivatives of one order, of which a table holds the different ones; None without."""
    names = _derivative_names(order, dims)
    if not set(names) <= set(columns):
        return None
    where = {which: name for name, which in names.items()}
    every = itertools.product(range(dims), repeat=order)
    found = _stacked(columns, [where[tuple(sorted(which))] for which in every])
    return found.reshape((-1,) + (dims,) * order)


def _code(word: Any) -> int:
    """The code of a clamp; where none acted, a table that was read may have a gap."""
    codes = {word: code for code, word in CLAMPS.items()}
    word = "" if word != word or word is None else str(word)  # a NaN is not itself
    if word not in codes:
        raise ValueError(f"Argument `columns` must hold known clamps, but has {word!r}.")
    return codes[word]


def _tilts(dims: int) -> tuple[str, ...]:
    return ("n",) if dims == 1 else ("n_x", "n_y")


def _derivative_names(order: int, dims: int) -> dict[str, tuple[int, ...]]:
    """Names of the different derivatives of one order, and where they stand: dE_dx, d2E_dxdy."""
    found = {}
    for which in itertools.combinations_with_replacement(range(dims), order):
        powers = [(a, which.count(i)) for i, a in enumerate("xy") if i in which]
        below = "".join(f"d{a}{k if k > 1 else ''}" for a, k in powers)
        found[f"d{order if order > 1 else ''}E_{below}" if order else "E"] = which
    return found


def _matrices(radius: np.ndarray, *ellipse: np.ndarray) -> np.ndarray:
    """Matrices of regions from their semi-axes: one, or the longer, the shorter and an angle."""
    if not ellipse:
        return 1.0 / radius[:, None, None]
    shorter, angle = ellipse
    u = np.stack([np.cos(angle), np.sin(angle)], -1)
    outer = u[:, :, None] * u[:, None, :]
    return outer / radius[:, None, None] + (np.eye(2) - outer) / shorter[:, None, None]
