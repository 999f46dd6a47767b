"""Scenes, lights and fields in another precision."""

import equinox as eqx
import jax


def as_dtype(tree, dtype):
    """A copy whose floating numbers are of one precision."""
    return jax.tree.map(lambda a: a.astype(dtype) if eqx.is_inexact_array(a) else a, tree)
