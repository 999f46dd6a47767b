"""Curves and layers, which are plain arrays by name, with their units: for pandas and xarray.

What is an object of its own has these as methods, `to_pandas` and `to_xarray`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from firstorder._labelled import DataFrame, Dataset, data_frame, data_set
from firstorder.imaging.images import RADIANCE, pixel_grid

# Columns of what `plotting.curve_of` and the command line make of a receiver in flatland.
CURVE = {
    **dict.fromkeys(("arc", "x", "y"), "m"),
    "s": "1",
    "E": "W/m",
    "dE": "W/m^2",
    "d2E": "W/m^3",
}
# Layers of images as `firstorder render` writes them; gradients by the unit of the image.
_SLOPE = f"{RADIANCE} / unit of the image"
LAYERS = {
    "value": RADIANCE,
    "distance": "m",
    "curvature": "1/m",
    "cosine": "1",
    **dict.fromkeys(("grad.u", "grad.v", "shadow.u", "shadow.v"), _SLOPE),
}


def curve_to_pandas(curve: Mapping[str, Any], units: Mapping[str, str] = CURVE) -> DataFrame:
    """A curve along a receiver as a table, with units in `attrs["units"]`.

    Args:
        curve: columns of one length, such as `plotting.curve_of` gives.
        units: of the columns that have one.

    Raises:
        ModuleNotFoundError: without the extra `tables`.

    Example:
        >>> from firstorder.io import curve_to_pandas
        >>> curve_to_pandas({"arc": [0.0, 0.1], "E": [1.0, 0.5]}).attrs["units"]
        {'arc': 'm', 'E': 'W/m'}
    """
    return data_frame(curve, units)


def layers_to_xarray(layers: Mapping[str, Any], half_width: float = 1.0) -> Dataset:
    """Layers of an image as a data set over u and v, image coordinates of the pixels' centres.

    Args:
        layers: by name, of one shape (w, h), first axis across, the second upwards: from
            `read_layers` or `rendering.render_to_files`.
        half_width: image coordinate of the image's right edge.

    Raises:
        ValueError: if the layers are not of one shape (w, h).
        ModuleNotFoundError: without the extra `tables`.

    Example:
        >>> import numpy as np
        >>> from firstorder.io import layers_to_xarray
        >>> image = layers_to_xarray({"value": np.array([[1.0], [2.0]])})
        >>> image.value.sel(u=0.5).values.tolist(), image.value.attrs["units"]
        ([2.0], 'W/(m^2 sr)')
    """
    shapes = {np.shape(a) for a in layers.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 2:
        raise ValueError(
            f"Argument `layers` must hold arrays of one shape (w, h), but has {sorted(shapes)}."
        )
    u, v = pixel_grid(*next(iter(shapes)), half_width)
    return data_set(
        {name: (("u", "v"), a, LAYERS.get(name, "")) for name, a in layers.items()},
        {"u": (("u",), u, "unit of the image"), "v": (("v",), v, "unit of the image")},
    )
