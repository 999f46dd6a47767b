"""The opt-in checked mode: find out which operation made the first NaN inside a jitted function."""

from __future__ import annotations

import functools
from collections.abc import Callable

from jax.experimental import checkify


def checked(function: Callable) -> Callable:
    """Run a function so that a NaN made inside it raises one sentence instead of spreading.

    Library functions turn an invalid *traced* argument (a negative distance, say) into NaN; this
    mode says that it happened. It costs a flag for every operation, so it is for finding mistakes.

    Args:
        function: any traceable function; the result may be jitted.

    Returns:
        A function of the same arguments that raises `ValueError` where a NaN first appears.

    Raises:
        ValueError: by what it returns, where a NaN first appears.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.checks import checked
        >>> checked(jnp.sqrt)(jnp.array(-1.0))
        Traceback (most recent call last):
            ...
        ValueError: A NaN was made by sqrt.
    """
    flagged = checkify.checkify(function, errors=checkify.nan_checks)

    @functools.wraps(function)
    def run(*args, **kwargs):
        error, result = flagged(*args, **kwargs)
        message = error.get()
        if message is None:
            return result
        primitive = message.partition("primitive: ")[2].partition(".")[0].split()
        by = f" by {primitive[0]}" if primitive else ""
        raise ValueError(f"A NaN was made{by}.")

    return run
