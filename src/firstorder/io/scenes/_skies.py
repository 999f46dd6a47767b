"""Skies of scene files of space, and panoramas from pictures."""

from __future__ import annotations

import os
import pathlib
from typing import Any

import numpy as np

from firstorder.io._channels import check_radiances
from firstorder.io.images import LUMINANCE, read_image
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import nearest_known, refused_at
from firstorder.io.scenes._toml_tables import (
    TomlTable,
    banded,
    number,
    picture,
    row,
    vector,
    whole,
    word,
    yes,
)
from firstorder.space.skies import ConstantSky, GaussianSky, HarmonicSky, PanoramaSky

MOST_DEGREE = 32  # of a panorama's harmonics: their program grows with its square


def sky_of(table: TomlTable, beside: Beside) -> Any:
    """The sky that an [environment] describes: a number, or a function of the direction.

    Args:
        table: of the environment.
        beside: which panoramas it may name.

    Raises:
        ValueError: one sentence that names the line and the key.
    """
    kind = table.take("kind", word)
    match kind:
        case "constant":
            radiance = table.take("radiance", banded)
            refused_at(table.at, lambda: ConstantSky(radiance))
            return radiance
        case "gaussian":
            center = table.take("center", vector, [0.0, 0.0, 1.0])
            rest = [table.take("sigma", number, 0.5), table.take("radiance", banded, 1.0)]
            return refused_at(table.at, lambda: GaussianSky(np.array(center), *rest))
        case "panorama":
            degree = table.take("degree", whole, None)
            if degree is not None and degree > MOST_DEGREE:
                words = f"`degree` must be at most {MOST_DEGREE}, but is {degree}."
                raise table.at("degree").error(words)
            if "file" in table.values:
                path = table.file(beside)
                colour = table.take("colour", yes, False)
                sky = refused_at(lambda key: table.at("file"), lambda: read_panorama(path, colour))
            else:
                values = table.take("values", picture)
                sky = refused_at(table.at, lambda: PanoramaSky(np.array(values)))
            return sky if degree is None else sky.harmonic(degree)
        case "harmonic":
            coefficients = table.take("coefficients", row)
            return refused_at(table.at, lambda: HarmonicSky(np.array(coefficients)))
    known = nearest_known(kind, ("constant", "gaussian", "panorama", "harmonic"))
    raise table.at("kind").error(f'kind "{kind}" is not known: {known}')


def read_panorama(path: str | os.PathLike[str], colour: bool = False) -> PanoramaSky:
    r"""Reads a panorama as the sky of space; `space.skies` says which way it looks.

    Its radiance is the Rec. 709 luminance, in the picture's own unit, or has the bands red, green
    and blue.

    Args:
        path: a picture that `read_image` reads, once around and from pole to pole.
        colour: whether its three bands are kept.

    Raises:
        ValueError: one sentence that names the file, if it cannot be read, or if a radiance is
            negative or not finite.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: if an .exr file is asked for without the extra `images`.

    Example:
        >>> import pathlib, tempfile
        >>> import jax.numpy as jnp
        >>> from firstorder.io import read_panorama
        >>> file = pathlib.Path(tempfile.mkdtemp(), "sky.hdr")
        >>> row = bytes([128, 128, 128, 129]) * 4
        >>> _ = file.write_bytes(b"#?RADIANCE\n\n-Y 2 +X 4\n" + row * 2)
        >>> round(read_panorama(file)(jnp.array([0.0, 0.6, 0.8])).item(), 2)
        1.0
    """
    path = pathlib.Path(path)
    try:
        pixels = read_image(path).astype(float)
        check_radiances(path.name, pixels)
        return PanoramaSky(pixels if colour else pixels @ LUMINANCE)
    except ValueError as error:
        words = str(error).removeprefix(f"{path.name}: ").removeprefix("Argument ")
        raise ValueError(f"{path.name}: {words}") from None
