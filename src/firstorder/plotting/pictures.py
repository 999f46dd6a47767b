"""Pictures of radiance to look at: tone-mapped PNG files, without axes."""

from __future__ import annotations

import os
import pathlib

import matplotlib.image
import numpy as np
from jaxtyping import Float, UInt8

from firstorder._argument_checks import check_positive, check_real
from firstorder.io.files import atomic_write

WHITE = 0.995  # the share of pixels that are not burnt out


def tone_map(
    values: Float[np.ndarray, "w h *bands"], white: float | None = None
) -> UInt8[np.ndarray, "h w *bands"]:
    """Radiance as levels of a screen: linear up to white, and then the sRGB curve.

    Args:
        values: radiance, first axis across, second upwards; and perhaps red, green and blue in a
            last one. NaN is shown black, infinity white.
        white: radiance that becomes white; if left out, what half a percent of the finite pixels
            exceed.

    Returns:
        Levels of grey, or of red, green and blue, rows from the top.

    Raises:
        ValueError: if there are bands, but not three, or white is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import tone_map
        >>> tone_map(np.array([[0.0], [0.21], [1.0]]), 1.0).tolist()
        [[0, 126, 255]]
    """
    check_real("values", np.asarray(values))
    values = np.asarray(values, float)
    if values.ndim not in (2, 3):
        raise ValueError(f"Argument `values` must be an image, but has shape {values.shape}.")
    if values.ndim == 3 and values.shape[-1] != 3:
        raise ValueError(
            "Argument `values` must have three bands to be a picture in colour, but has "
            f"{values.shape[-1]}."
        )
    if white is None:
        known = values[np.isfinite(values)]
        white = float(np.quantile(known, WHITE)) if known.size else 1.0
        white = white if white > 0.0 else 1.0
    check_positive("white", white)
    with np.errstate(over="ignore"):
        x = np.clip(np.nan_to_num(values / white), 0.0, 1.0)
    curve = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.rint(255.0 * curve).astype(np.uint8).swapaxes(0, 1)[::-1]


def write_png(
    path: str | os.PathLike[str],
    values: Float[np.ndarray, "w h *bands"],
    white: float | None = None,
) -> None:
    """Writes radiance as a tone-mapped picture, whole or not at all.

    Args:
        path: ends in .png.
        values: as in `tone_map`.
        white: as in `tone_map`.

    Raises:
        ValueError: as `tone_map`, or if the file is of another kind.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.plotting import write_png
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.png")
        >>> write_png(file, np.ones((4, 3)))
        >>> file.read_bytes()[1:4]
        b'PNG'
    """
    _write_levels(path, tone_map(values, white))


def _write_levels(path: str | os.PathLike[str], levels: UInt8[np.ndarray, "h w *bands"]) -> None:
    """Writes levels of a screen, rows from the top in any style, whole or not at all."""
    path = pathlib.Path(path)
    if path.suffix.lower() != ".png":
        raise ValueError(f"{path.name}: a picture is written to a .png file.")
    with atomic_write(path) as part:
        matplotlib.image.imsave(part, levels, origin="upper", cmap="gray", vmin=0, vmax=255)
