"""Samples scattered over an image, as arrays that fit one another."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_finite, check_shape


def sample_places(p: Any) -> Float[np.ndarray, "n 2"]:
    """Places of samples.

    Raises:
        ValueError: if there is none, or they are no finite places in an image.

    Example:
        >>> from firstorder.reconstruction._samples import sample_places
        >>> sample_places([(0, 1), (2, 3)]).shape
        (2, 2)
    """
    places = np.asarray(p, float)
    if not len(places):
        raise ValueError("Argument `p` must have at least one sample, but has none.")
    if places.ndim != 2 or places.shape[1] != 2:
        raise ValueError(f"Argument `p` must have shape (n, 2), but has {places.shape}.")
    check_finite("p", places)
    return places


def sampled(name: str, x: Any, shape: tuple[int, ...]) -> Float[np.ndarray, "*n"]:
    """Values at samples or pixels, as an array of the shape that is asked for.

    Raises:
        ValueError: if the shape is another.

    Example:
        >>> from firstorder.reconstruction._samples import sampled
        >>> sampled("value", [1, 2], (2,)).tolist()
        [1.0, 2.0]
    """
    found = np.asarray(x, float)
    check_shape(name, found, shape)
    return found
