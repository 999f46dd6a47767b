"""The sheared filter on gridded rays, in four passes along one coordinate each.

Visibility f stands on a grid over (x1, x2, y1, y2). The filter is a product of one for each axis,
`g(d) l(y - shear d)`, `d = X - x`, and each of these is done in two passes: first along the lamp,

    F(x, u) = sum_y l(y - u) f(x, y),    u = shear d for all d in reach,

then along the receiver on a slanted line, `h(X) = sum_d g(d) F(X - d, shear d)`. With 2 n + 1
places in reach and m on the lamp that costs some (2 n + 1) (m + 1) for each (X, y2) and then each
X, where the sum over all four takes ((2 n + 1) m)^2.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_positive
from firstorder.typing import as_float

Profile = Callable[[Array], Array]


class Axis(NamedTuple):
    """The filter along one axis, on the grid.

    Attributes:
        across: g at the steps from -n to n, shape (2 n + 1,).
        along: l at `y - shear d`, a row for each step.
    """

    across: Float[Array, " k"]
    along: Float[Array, "k m"]


def gridded_axis(
    step: float, places: Float[Array, " m"], sigma: float, shear: float, light: Profile, reach=3.0
) -> Axis:
    """A Gaussian across and the light along, sheared.

    Args:
        step: of the grid on the receiver [m].
        places: y of the grid on the lamp [m].
        sigma: of the Gaussian [m].
        shear: metres on the lamp for each metre across.
        light: intensity at places on the lamp; 0 beyond its ends.
        reach: standard deviations that count.

    Example:
        >>> import jax.numpy as jnp
        >>> from figures.e11.competitors.factored import gridded_axis
        >>> box = lambda y: jnp.where(abs(y) <= 0.5, 1.0, 0.0)
        >>> gridded_axis(0.1, jnp.array([-0.4, 0.0, 0.4]), 0.1, 1.0, box).along[0].tolist()
        [1.0, 1.0, 0.0]
    """
    for name, value in (("step", step), ("sigma", sigma), ("reach", reach)):
        check_positive(name, value)
    n = int(np.floor(reach * sigma / step))
    d = step * jnp.arange(-n, n + 1)
    return Axis(jnp.exp(-0.5 * (d / sigma) ** 2), light(as_float(places) - shear * d[:, None]))


@jax.jit
def factored(f: Float[Array, "a b m n"], first: Axis, second: Axis) -> Float[Array, "a b"]:
    """Share of the lamp that is seen, weighed by the filter: by four passes.

    Args:
        f: visibility over (x1, x2, y1, y2).
        first: filter along (x1, y1).
        second: filter along (x2, y2).

    Valid when: the filter is the same for all receivers, as for blockers and receivers whose depths
    range alike. Places beyond the grid count for nothing, in the norm either.

    Reference: after Yan et al. 2015, Fast 4D sheared filtering; E11 §8 asks for such a thing.
    """
    by_first = _pass(jnp.moveaxis(f, 2, -1), first)  # (X1, x2, y2)
    seen = _pass(jnp.moveaxis(by_first, 1, 0), second)  # (X2, X1)
    ones = [_pass(jnp.ones((f.shape[i], f.shape[2 + i])), k) for i, k in enumerate((first, second))]
    return seen.T / (ones[0][:, None] * ones[1])


def _pass(f: Float[Array, "x *r y"], axis: Axis) -> Float[Array, "x *r"]:
    """Along the lamp, then along the receiver on a slanted line."""
    n = len(axis.across) // 2
    F = jnp.tensordot(f, axis.along, ((-1,), (1,)))  # (x, ..., u)
    wide = jnp.pad(F, ((n, n), *((0, 0),) * (F.ndim - 1)))
    size = f.shape[0]
    # The ray at X - d is `n - d` places into the padded row: the last step comes first.
    parts = [axis.across[k] * wide[2 * n - k : 2 * n - k + size, ..., k] for k in range(2 * n + 1)]
    return functools.reduce(jnp.add, parts)


def direct(f: Float[Array, "a b m n"], first: Axis, second: Axis) -> Float[Array, "a b"]:
    """The same by one sum over all four coordinates at each receiver, with no pass in between."""
    n, m = len(first.across) // 2, len(second.across) // 2
    kernel = jnp.einsum("i,iy,j,jz->ijyz", first.across, first.along, second.across, second.along)
    kernel = kernel[::-1, ::-1]  # by x rather than by X - x
    edges = ((n, n), (m, m), (0, 0), (0, 0))
    wide, ones = jnp.pad(f, edges), jnp.pad(jnp.ones_like(f), edges)
    places = jnp.stack(jnp.meshgrid(*map(jnp.arange, f.shape[:2]), indexing="ij"), -1)

    def one(at):
        start, size = (at[0], at[1], 0, 0), kernel.shape
        here, there = (jax.lax.dynamic_slice(a, start, size) for a in (wide, ones))
        return jnp.sum(kernel * here) / jnp.sum(kernel * there)

    return jax.lax.map(one, places.reshape(-1, 2)).reshape(f.shape[:2])


__all__ = ["Axis", "direct", "factored", "gridded_axis"]
