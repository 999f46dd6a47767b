"""Numbers with their names and units, for other tools: tables of pandas and data sets of xarray.

Both packages come with `pip install "firstorder[tables]"` and are imported when somebody asks. The
numbers are those of the arrays, to the bit; units stand in `attrs`, where both packages keep what
they are told of a thing.
"""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

# pandas.DataFrame and xarray.Dataset, which need not be there.
DataFrame: TypeAlias = Any
Dataset: TypeAlias = Any
# Names of axes, numbers, and their unit.
Variable: TypeAlias = tuple[Sequence[str], Any, str]

# Units of coordinates and freedoms; slopes have none.
UNITS = {
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("theta", "phi", "n", "tilt_x", "tilt_y"), "rad"),
    **dict.fromkeys(("v", "w"), "1"),
    "t": "s",
}


def data_frame(columns: Mapping[str, Any], units: Mapping[str, str]) -> DataFrame:
    """A table of pandas.

    Args:
        columns: vectors of one length, by name.
        units: of the columns that have one; they stand in `attrs["units"]`.

    Raises:
        ModuleNotFoundError: without the extra `tables`.

    Example:
        >>> from firstorder._labelled import data_frame
        >>> data_frame({"E": [1.0, 2.0]}, {"E": "W/m"}).attrs
        {'units': {'E': 'W/m'}}
    """
    made = _package("pandas").DataFrame({name: _numbers(c) for name, c in columns.items()})
    made.attrs["units"] = {name: unit for name, unit in units.items() if name in columns}
    return made


def data_set(
    variables: Mapping[str, Variable], coordinates: Mapping[str, Variable], **about: Any
) -> Dataset:
    """A data set of xarray, each variable with its unit in `attrs["units"]`.

    Args:
        variables: axes, numbers and unit, by name.
        coordinates: the same, of what stands along the axes.
        about: what else is known, for the `attrs` of the whole.

    Raises:
        ModuleNotFoundError: without the extra `tables`.

    Example:
        >>> from firstorder._labelled import data_set
        >>> made = data_set({"E": (["x"], [1.0, 2.0], "W/m")}, {"x": (["x"], [0.0, 1.0], "m")})
        >>> made.E.attrs, made.E.sel(x=1.0).item()
        ({'units': 'W/m'}, 2.0)
    """
    package = _package("xarray")
    found = [
        {name: package.Variable(axes, _numbers(a), {"units": unit} if unit else {})
         for name, (axes, a, unit) in each.items()}
        for each in (variables, coordinates)
    ]  # fmt: skip
    return package.Dataset(*found, attrs=about)


def derivatives_frame(
    value: Any, gradient: Any, hessian: Any, names: Sequence[str], unit: str
) -> DataFrame:
    """A value with its derivatives as one row, or as one for each of many.

    Args:
        value: shape (...).
        gradient: shape (..., m).
        hessian: shape (..., m, m).
        names: of the m coordinates; `x` makes columns `d_x`, `d_x_x`.
        unit: of the value.

    Example:
        >>> from firstorder._labelled import derivatives_frame
        >>> made = derivatives_frame(1.0, [2.0], [[3.0]], ["x"], "W/m")
        >>> list(made), made.attrs["units"]["d_x_x"]
        (['value', 'd_x', 'd_x_x'], 'W/m / (m m)')
    """
    m = len(names)
    g, H = np.reshape(gradient, (-1, m)), np.reshape(hessian, (-1, m, m))
    columns, units = {"value": np.ravel(value)}, {"value": unit}
    for order, a in ((1, g), (2, H)):
        for which in itertools.product(range(m), repeat=order):
            name = "_".join(["d", *(names[i] for i in which)])
            columns[name] = a[(slice(None), *which)]
            units[name] = _unit_per(unit, [UNITS.get(names[i], "1") for i in which])
    return data_frame(columns, units)


def _unit_per(unit: str, others: Sequence[str]) -> str:
    """A unit by others, of which those that are 1 are not written."""
    below = " ".join(other for other in others if other != "1")
    if not below:
        return unit
    return f"{unit} / ({below})" if " " in below else f"{unit} / {below}"


def derivatives_set(
    value: Any, gradient: Any, hessian: Any, names: Sequence[str], unit: str, axis: str, row: str
) -> Dataset:
    """A value with its derivatives, whose last axes are named coordinates.

    Args:
        value: shape (...).
        gradient: shape (..., m).
        hessian: shape (..., m, m).
        names: of the m coordinates.
        unit: of the value.
        axis: what the coordinates are called together: `freedom`; those of columns `freedom_2`.
        row: what the leading axes are called; several are numbered.

    Example:
        >>> from firstorder._labelled import derivatives_set
        >>> made = derivatives_set(1.0, [2.0], [[3.0]], ["x"], "W/m", "freedom", "receiver")
        >>> made.hessian.sel(freedom="x", freedom_2="x").item()
        3.0
    """
    k = np.ndim(value)
    rows = [row] if k == 1 else [f"{row}_{i}" for i in range(k)]
    both, per = [axis, f"{axis}_2"], [UNITS.get(name, "1") for name in names]
    of = f"{unit} per unit of the {axis}"
    return data_set(
        {
            "value": (rows, value, unit),
            "gradient": ([*rows, axis], gradient, of),
            "hessian": ([*rows, *both], hessian, of.replace(f"the {axis}", f"either {axis}")),
        },
        {
            axis: ([axis], list(names), ""),
            both[1]: ([both[1]], list(names), ""),
            f"unit_of_{axis}": ([axis], per, ""),
        },
    )


def _numbers(a: Any) -> np.ndarray:
    """An array of NumPy that is nobody else's."""
    return np.array(a)


def _package(name: str) -> Any:
    """The package, or an error that says where it comes from."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            f"Tables with names and units need the package {name}, which comes with the extra "
            '`tables`: pip install "firstorder[tables]".'
        ) from None
