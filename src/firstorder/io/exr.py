"""OpenEXR files: images with named layers, such as `value`, `grad.u` and `SV`.

A layer of three bands is three channels, `grad.u.R`, `grad.u.G` and `grad.u.B`; those of `value`
are R, G and B alone, which every program shows in colour.

The package OpenEXR comes with `pip install "firstorder[images]"`. Layers are single precision, rows
from the top, as other programs expect them; here their first axis is across, their second upwards.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_real
from firstorder.io._channels import openexr, read_channels
from firstorder.io.files import atomic_write
from firstorder.scene._bands import band_names


def write_layers(path: str | os.PathLike[str], layers: Mapping[str, np.ndarray]) -> None:
    """Writes an .exr file, whole or not at all.

    Args:
        path: ends in .exr.
        layers: by name, all of one shape (w, h), or (w, h, bands).

    Raises:
        ValueError: without layers, for layers that are complex, of different shapes or without
            pixels, for a channel without a name or two of one name, or for another kind of file.
        ModuleNotFoundError: without the extra `images`.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.io import read_layers, write_layers
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.exr")
        >>> write_layers(file, {"value": np.ones((3, 2)), "grad.u": np.zeros((3, 2))})
        >>> sorted(read_layers(file)), read_layers(file)["value"].shape
        (['grad.u', 'value'], (3, 2))
    """
    path, OpenEXR = pathlib.Path(path), _writer(path)
    for layer in layers.values():
        check_real("layers", np.asarray(layer))
    shapes = {np.shape(a) for a in layers.values()}
    if len({s[:2] for s in shapes}) != 1 or not {len(s) for s in shapes} <= {2, 3}:
        raise ValueError(
            "Argument `layers` must hold arrays of one shape (w, h) or (w, h, bands), but has "
            f"{sorted(shapes)}."
        )
    if any(0 in shape for shape in shapes):
        raise ValueError(f"Argument `layers` must have pixels, but has {sorted(shapes)}.")
    channels = [channel for layer in layers.items() for channel in _channels(*layer)]
    names = [name for name, _ in channels]
    if "" in names:
        raise ValueError("Argument `layers` must name each layer, but one has no name.")
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(
            f"Argument `layers` must give each channel once, but two are called {twice[0]}."
        )
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    rows = {name: np.ascontiguousarray(np.asarray(a, np.float32).T[::-1]) for name, a in channels}
    with atomic_write(path) as part:
        OpenEXR.File(header, rows).write(os.fspath(part))


def _writer(path: str | os.PathLike[str]) -> Any:
    """The package that writes a file, whose name is judged."""
    path = pathlib.Path(path)
    if path.suffix.lower() != ".exr":
        raise ValueError(f"{path.name}: layers are written to .exr files.")
    return openexr(path.name)


def _channels(name: str, layer: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """A layer as channels: itself, or one for each band."""
    if np.ndim(layer) == 2:
        yield name, layer
        return
    bands = band_names(layer.shape[-1])
    for k, band in enumerate(bands):
        yield (band if name == "value" and len(bands) == 3 else f"{name}.{band}"), layer[..., k]


def read_layers(path: str | os.PathLike[str]) -> dict[str, Float[np.ndarray, "w h"]]:
    """Reads all layers of an .exr file, each band by itself.

    Args:
        path: of the file.

    Returns:
        Layers by name, first axis across.

    Raises:
        ValueError: one sentence that names the file, if it is damaged or too large. Layers may
            hold what is not finite, such as the distance of nothing.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: without the extra `images`.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.io import read_layers, write_layers
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.exr")
        >>> write_layers(file, {"value": np.ones((3, 2))})
        >>> read_layers(file)["value"].shape
        (3, 2)
    """
    return {name: a[::-1].T for name, a in read_channels(pathlib.Path(path)).items()}
