"""Bands: a last axis of emission, albedo, skies and textures, over which programs are mapped.

A band is one channel of light, such as red: light of one band never becomes light of another. So a
scene of bands is as many scenes of one shape, and every function of it is the function of one band,
mapped: `jax.vmap` over the leaves that have bands, and over nothing else. What depends on shapes
alone is then computed once for all bands, since nothing of it is mapped.

A class says which of its leaves may have bands, and how many axes each has without them, in its
attribute `BANDED`. Functions of one band are made functions of any by `by_band`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from firstorder._argument_checks import check_integer
from firstorder.scene._words import check_one_scene

P = ParamSpec("P")
R = TypeVar("R")
Axes = int | tuple[int | None, ...]
_AXIS = "bands"  # by which programs that are mapped know the others
_GOLDEN = 0.6180339887498949
# Mean and error of an `Estimate` have bands; how many samples there are is the same in all.
OF_AN_ESTIMATE: Axes = (-1, -1, None)


def bands_of(*things: Any) -> int | None:
    """Number of bands of scenes, lights and materials; None if none has a last axis of them.

    Args:
        things: trees of any kind.

    Raises:
        ValueError: if two of them disagree.

    Example:
        >>> from firstorder.flatland import ConstantSky
        >>> from firstorder.scene._bands import bands_of
        >>> bands_of(ConstantSky(1.0)), bands_of(ConstantSky((0.2, 0.4, 0.6)), ConstantSky(1.0))
        (None, 3)
    """
    leaves = jax.tree.leaves(things)
    found = {
        leaf.shape[-1] for leaf, is_banded in zip(leaves, _banded(things), strict=True) if is_banded
    }
    if len(found) > 1:
        *most, last = sorted(found)
        counts = f"{', '.join(map(str, most))} and {last}"
        raise ValueError(
            f"All that has bands must have equally many, but there are things of {counts}."
        )
    return found.pop() if found else None


def band_names(bands: int) -> tuple[str, ...]:
    """Names of bands in files: R, G and B if there are three, else their numbers from 1."""
    return ("R", "G", "B") if bands == 3 else tuple(str(k + 1) for k in range(bands))


def band_columns(columns: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Columns of a table in which one of n rows of bands is a column for each band.

    Raises:
        ValueError: if two of them have one name.

    Example:
        >>> import numpy as np
        >>> from firstorder.scene._bands import band_columns
        >>> list(band_columns({"x": np.zeros(2), "E": np.zeros((2, 3))}))
        ['x', 'E.R', 'E.G', 'E.B']
    """
    found = {}
    for name, column in columns.items():
        column = np.asarray(column)
        each = {name: column}
        if column.ndim == 2 and column.shape[1] > 1:
            bands = band_names(column.shape[1])
            each = {f"{name}.{b}": values for b, values in zip(bands, column.T, strict=True)}
        if twice := sorted(found.keys() & each.keys()):
            raise ValueError(
                f"Argument `columns` must give each column once, but two are called {twice[0]}."
            )
        found |= each
    return found


def one_band(thing: Any, number: int) -> Any:
    """A copy with one of the bands, and without their axis.

    Args:
        thing: of any kind; what has no bands in it stays.
        number: of the band, from 0.

    Raises:
        ValueError: if there is no such band, or its number is traced.
    """
    check_integer("number", number)
    bands = bands_of(thing) or 1
    if number not in range(bands):
        raise ValueError(
            f"Argument `number` must be the number of a band, 0 to {bands - 1}, but is {number}."
        )
    return _filled(thing, lambda leaf: leaf[..., number])


def merged_bands(thing: Any) -> Any:
    """A copy with one band, in which whatever differs in any of its own bands differs.

    A sum with weights that no scene is likely to cancel: to find where light breaks in some band.
    """
    weights = 1.0 + np.modf(np.arange(bands_of(thing) or 0) * _GOLDEN)[0]
    return _filled(thing, lambda leaf: leaf @ jnp.asarray(weights, leaf.dtype))


def check_one_band(name: str, thing: Any) -> None:
    """Refuses a scene of several bands, where they cannot be.

    Raises:
        ValueError: if it has any.
    """
    if (bands := bands_of(thing)) is not None:
        raise ValueError(
            f"Argument `{name}` must have no bands here, but has {bands}: ask for each, "
            f"{name}.band(0) and so on."
        )


def by_band(out: Axes = -1) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function of one band as one of any number: mapped over the bands of its arguments.

    Arguments without bands are shared, and so is all that is computed from them alone. Without any
    bands the function is called as it is, and adds nothing to the caller's program.

    Args:
        out: where each leaf of the result has its bands, the last axis if left out; None for
            leaves that do not depend on light.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import ConstantSky
        >>> from firstorder.scene._bands import by_band
        >>> @by_band()
        ... def doubled(sky, x):
        ...     return 2.0 * sky.radiance * x
        >>> doubled(ConstantSky((1.0, 2.0, 3.0)), jnp.ones(2)).shape
        (2, 3)
    """

    def mapped(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def over(*args: P.args, **kwargs: P.kwargs) -> R:
            for thing in (*args, *kwargs.values()):
                if hasattr(thing, "material") and hasattr(thing, "groups"):
                    check_one_scene(thing)
            if bands_of(args, kwargs) is None:
                return function(*args, **kwargs)
            form: list[Any] = []

            def one(parts: list[Any]) -> tuple[Any, ...]:
                rest = iter(parts)
                args_, kwargs_ = _filled((args, kwargs), lambda _: next(rest))
                leaves, tree = jax.tree.flatten(function(*args_, **kwargs_))
                form[:] = [tree]
                return tuple(leaves)

            parts = _parts((args, kwargs))
            leaves = jax.vmap(one, in_axes=-1, out_axes=out, axis_name=_AXIS)(parts)
            return jax.tree.unflatten(form[0], leaves)

        return over

    return mapped


def in_any_band(found: Bool[Array, "*n"]) -> Bool[Array, "*n"]:
    """Whether something is true in any of the bands that `by_band` maps over: the same for all.

    What is seen of shapes asks this, and not of a band alone: it is then computed once for all.
    """
    try:
        return jax.lax.pmax(found.astype(jnp.int32), _AXIS) > 0
    except NameError:  # nothing is mapped over bands
        return found


def band_after_band(out: Axes = -1) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """`by_band` for functions that look at numbers on the host: called once for each band.

    Args:
        out: as for `by_band`; None for leaves that are the same in every band.
    """

    def mapped(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def over(*args: P.args, **kwargs: P.kwargs) -> R:
            bands = bands_of(args, kwargs)
            if bands is None:
                return function(*args, **kwargs)
            found: Sequence[Any] = [
                function(*a, **k) for a, k in (one_band((args, kwargs), i) for i in range(bands))
            ]
            rows = [jax.tree.leaves(one) for one in found]
            axes = out if isinstance(out, tuple) else (out,) * len(rows[0])
            leaves = [
                each[0] if axis is None else jnp.stack(each, axis)
                for axis, *each in zip(axes, *rows, strict=True)
            ]
            return jax.tree.unflatten(jax.tree.structure(found[0]), leaves)

        return over

    return mapped


def _parts(thing: Any) -> list[Any]:
    """Leaves that have bands."""
    return [
        a for a, is_banded in zip(jax.tree.leaves(thing), _banded(thing), strict=True) if is_banded
    ]


def _filled(thing: Any, make: Callable[[Any], Any]) -> Any:
    """A copy of a tree with others in place of the leaves that have bands."""
    leaves, tree = jax.tree.flatten(thing)
    marks = _banded(thing)
    pairs = zip(leaves, marks, strict=True)
    return jax.tree.unflatten(tree, [make(a) if is_banded else a for a, is_banded in pairs])


def _banded(thing: Any) -> list[bool]:
    """Whether each leaf of a tree has a last axis of bands."""
    axes = getattr(type(thing), "BANDED", {})
    found = []
    for path, child in jax.tree_util.tree_flatten_with_path(
        thing, is_leaf=lambda x: x is not thing
    )[0]:
        name = getattr(path[0], "name", None) if path else None
        if child is thing:
            found.append(False)
        elif name in axes and hasattr(child, "ndim"):
            found.append(child.ndim > axes[name])
        else:
            found += _banded(child)
    return found
