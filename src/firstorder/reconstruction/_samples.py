"""Samples scattered over an image, as arrays that fit one another."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_finite, check_real, check_shape


def sample_places(p: Any) -> Float[np.ndarray, "n 2"]:
    """Places of samples.

    Raises:
        ValueError: if there is none, or they are no finite places in an image.

    Example:
        >>> from firstorder.reconstruction._samples import sample_places
        >>> sample_places([(0, 1), (2, 3)]).shape
        (2, 2)
    """
    check_real("p", np.asarray(p))
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
        ValueError: if the shape is another, or numbers are complex.

    Example:
        >>> from firstorder.reconstruction._samples import sampled
        >>> sampled("value", [1, 2], (2,)).tolist()
        [1.0, 2.0]
    """
    check_real(name, np.asarray(x))
    found = np.asarray(x, float)
    check_shape(name, found, shape)
    return found


def gaussian_weights(size: Any, least: Any) -> Any:
    """`exp(-(size^2 - least^2) / 2)`: ratios of Gaussian weights to the largest, however small.

    As a product, so that no square leaves the range of numbers.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction._samples import gaussian_weights
        >>> gaussian_weights(np.array([1e200, 2e200]), 1e200).tolist()
        [1.0, 0.0]
    """
    # Beyond a thousand more the weight is 0, and a longer difference would only overflow.
    return np.exp(-0.5 * np.minimum(size - least, 1e3) * np.minimum(size + least, 1e300))
