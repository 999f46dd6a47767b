"""Film: radiance of any range as a picture, exposed by its log-average and bent as film bends it.

One look for all scenes in space: `develop` of whatever a renderer gives, in grey or in colour.
`plotting.pictures.tone_map` is linear instead, for radiance that should be compared by eye.
"""

from __future__ import annotations

import os

import numpy as np
from jaxtyping import Float, UInt8

from firstorder._argument_checks import check_positive, check_real, check_shape
from firstorder.io.images import LUMINANCE
from firstorder.plotting.pictures import _write_levels, tone_map

MIDDLE = 0.18  # reflectance of a grey card: what the log-average is exposed to
DARKEST = 1e-3  # of the log-average's own scale: pixels below count as this dark


def exposure_of(values: Float[np.ndarray, "w h *bands"], middle: float = MIDDLE) -> float:
    r"""Factor that brings the log-average of an image's luminance to middle grey.

    `middle / exp(mean(log(max(Y, d))))` over the pixels that are finite and not black; `d` is a
    thousandth of their mean, so that a few dark ones do not decide. Twice the light is half the
    exposure.

    Args:
        values: radiance, perhaps with red, green and blue in a last axis.
        middle: to which the log-average goes, positive.

    Returns:
        The factor; 1 if all is black.

    Reference: Reinhard et al., "Photographic tone reproduction for digital images", TOG 21(3),
    2002, eqs. 1-2.

    Raises:
        ValueError: if `middle` is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import exposure_of
        >>> round(exposure_of(np.array([[1.0, 4.0]])), 12)  # the log-average is 2
        0.09
    """
    check_positive("middle", middle)
    values = _in_three(values)
    Y = values @ LUMINANCE if values.ndim == 3 else values
    lit = Y[np.isfinite(Y) & (Y > 0.0)]
    if not lit.size:
        return 1.0
    return float(middle / np.exp(np.mean(np.log(np.maximum(lit, DARKEST * np.mean(lit))))))


def filmic(x: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    r"""The curve of film: a toe, a nearly straight part, and a shoulder that reaches white late.

    `x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)`, at most 1: linear light of a screen from
    exposed radiance. Middle grey, 0.18, becomes 0.27; white is reached at 7.24, forty times as
    bright. Bands are bent apart, so that bright colours lose their colour as they do on film.

    Args:
        x: exposed radiance; what is negative is 0, infinity is 1.

    Reference: K. Narkowicz, "ACES filmic tone mapping curve", 2016: a fit to the Academy's curve.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import filmic
        >>> filmic(np.array([0.0, 0.18, 10.0, np.inf])).round(3).tolist()
        [0.0, 0.267, 1.0, 1.0]
    """
    x = np.clip(np.asarray(x, float), 0.0, 1e6)
    return np.minimum(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1.0)


def develop(
    values: Float[np.ndarray, "w h *bands"], exposure: float | None = None
) -> UInt8[np.ndarray, "h w *bands"]:
    """Radiance as levels of a screen by exposure, the curve of film and that of sRGB.

    Args:
        values: radiance, first axis across, second upwards; perhaps red, green and blue in a last
            one. NaN is shown black, infinity white.
        exposure: the factor; that of `exposure_of` if left out. Pictures that are compared want
            the same.

    Returns:
        Levels of grey, or of red, green and blue, rows from the top.

    Raises:
        ValueError: if there are bands, but not three, or the exposure is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import develop
        >>> develop(np.array([[0.0], [0.18], [50.0]]), 1.0).tolist()
        [[0, 141, 255]]
    """
    values = _in_three(values)
    if exposure is None:
        exposure = exposure_of(values)
    check_positive("exposure", exposure)
    with np.errstate(over="ignore"):
        return tone_map(filmic(np.nan_to_num(values, nan=0.0) * exposure), 1.0)


def write_still(
    path: str | os.PathLike[str],
    values: Float[np.ndarray, "w h *bands"],
    exposure: float | None = None,
) -> None:
    """Writes radiance as a picture of film (`develop`), whole or not at all.

    Args:
        path: ends in .png.
        values: as in `develop`.
        exposure: as in `develop`.

    Raises:
        ValueError: as `develop`, or if the file is of another kind.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.plotting import write_still
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.png")
        >>> write_still(file, np.ones((4, 3, 3)))
        >>> file.read_bytes()[1:4]
        b'PNG'
    """
    _write_levels(path, develop(values, exposure))


def tinted(
    values: Float[np.ndarray, "w h"],
    labels: np.ndarray,
    tints: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "w h 3"]:
    """A grey image in colour: each thing has a tint, and the luminance is that of the grey one.

    `values * tint / luminance(tint)`: numbers measured on the grey image are those of the
    luminance (Rec. 709) of this one.

    Args:
        values: radiance.
        labels: what each pixel shows, from 0; -1 for nothing, which stays grey.
        tints: red, green and blue of each label, linear; some of it positive.

    Raises:
        ValueError: if a label has no tint, is below -1 or no integer, there is not one for each
            pixel, or a tint is black.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import tinted
        >>> red = np.array([[1.0, 0.0, 0.0]])
        >>> tinted(np.array([[2.0]]), np.array([[0]]), red).round(3).tolist()
        [[[9.407, 0.0, 0.0]]]
    """
    tints, labels = np.asarray(tints, float), np.asarray(labels)
    if labels.dtype.kind not in "iu":
        raise ValueError(f"Argument `labels` must be integers, but is {labels.dtype}.")
    if labels.size and labels.max() >= len(tints):
        raise ValueError(
            f"Argument `tints` must have a row for label {labels.max()}, but has {len(tints)}."
        )
    if labels.size and labels.min() < -1:
        raise ValueError(f"Argument `labels` must be -1 or more, but one is {labels.min()}.")
    luminance = tints @ LUMINANCE
    if np.any(dark := ~(luminance > 0.0)):
        raise ValueError(
            f"Argument `tints` must have a luminance, but row {np.argmax(dark)} has none."
        )
    rows = np.concatenate([tints / luminance[:, None], np.ones((1, 3))])
    values = np.asarray(values, float)
    check_shape("labels", labels, values.shape)
    return values[..., None] * rows[labels]


def _in_three(values) -> np.ndarray:
    check_real("values", np.asarray(values))
    values = np.asarray(values, float)
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[-1] != 3):
        raise ValueError(
            "Argument `values` must be an image, with three bands if it has any, but has shape "
            f"{values.shape}."
        )
    return values
