"""Irradiance cache along a line: records with derivatives, and interpolation between them.

Candidates are places at which a record could be made, with all that one would hold, computed once;
filling the cache is then a choice among them. A record is a row of a table, which can be printed,
exported and drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.caching._records import checked_order, kept, printed, weights
from firstorder.caching.radii import CLAMPS, Clamped
from firstorder.caching.split_circle import split_circle_error
from firstorder.errors import check_finite, check_positive, check_shape
from firstorder.typing import as_float


class Candidates(eqx.Module):
    """Candidate records at places along a surface.

    Attributes:
        x: arc length along the surface [m].
        n: angle of the normal, counter-clockwise from +y [rad].
        derivatives: E, E', E'', ... in arc length, one column each [W/m^(1+k)].
        minimum: length of the shortest ray [m]; infinite if it was not asked for.
        harmonic: harmonic mean of the lengths of rays [m]; infinite if it was not asked for.
    """

    x: Float[Array, " m"]
    n: Float[Array, " m"]
    derivatives: Float[Array, "m k"]
    minimum: Float[Array, " m"]
    harmonic: Float[Array, " m"]

    @staticmethod
    def along(
        E: Callable[[Array], Array],
        x: ArrayLike,
        *,
        count: int = 4,
        n: ArrayLike = 0.0,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> Candidates:
        """Candidates for any irradiance that is a function of arc length, by nested autodiff.

        Args:
            E: jittable function of one arc length.
            x: arc lengths of the candidates [m].
            count: columns: 4 for E to E'''.
            n: angles of the normals [rad].
            minimum: lengths of the shortest rays [m].
            harmonic: harmonic means of the lengths of rays [m].

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Candidates
            >>> Candidates.along(lambda x: x**3, jnp.array([2.0])).derivatives.tolist()
            [[8.0, 12.0, 12.0, 6.0]]
        """
        x = as_float(x)
        check_finite("x", x)
        columns = eqx.filter_jit(lambda x: jax.vmap(lambda x: _derivatives_of(E, x, count))(x))(x)
        fill = [
            jnp.broadcast_to(as_float(a).astype(x.dtype), x.shape) for a in (n, minimum, harmonic)
        ]
        return Candidates(x, fill[0], columns, fill[1], fill[2])


def _derivatives_of(E: Callable[[Array], Array], x: ArrayLike, count: int) -> Float[Array, " k"]:
    """E and its first `count - 1` derivatives at x."""

    def columns(x):
        return (E(x),)

    for _ in range(count - 1):
        columns = _deeper(columns)
    return jnp.stack(columns(as_float(x)))


def _deeper(f: Callable[[Array], tuple[Array, ...]]):
    """A function's values with one more: the slope of the last of them."""

    def slopes(x):
        found, tangents = jax.jvp(f, (x,), (jnp.ones_like(x),))
        return (*found, tangents[-1])

    return slopes


def taylor(
    derivatives: Float[Array, "... k"], dx: ArrayLike, order: int = 1
) -> Float[Array, "..."]:
    """Taylor expansion of the given order about a record: `sum_k E^(k) dx^k / k!`.

    Args:
        derivatives: E, E', ... along the last axis; those beyond the order are not used.
        dx: distance from the record, in arc length [m].
        order: 0, 1 or 2.

    Raises:
        ValueError: for another order, or too few derivatives.

    Reference: the brackets of J12 eqs. 33 and 52.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import taylor
        >>> taylor(jnp.array([1.0, 2.0, 4.0]), 0.5, order=2).item()
        2.5
    """
    if derivatives.shape[-1] <= checked_order(order):
        raise ValueError(
            f"Argument `derivatives` must hold {order + 1} columns, "
            f"but holds {derivatives.shape[-1]}."
        )
    dx = as_float(dx)
    # Horner's scheme, from the highest term down.
    value = derivatives[..., order]
    for k in range(order, 0, -1):
        value = derivatives[..., k - 1] + value * dx / k
    return jnp.broadcast_to(value, jnp.broadcast_shapes(value.shape, dx.shape))


class Lookup(NamedTuple):
    """An interpolated value, and whether any record was in reach of the place."""

    value: Float[Array, "..."]
    covered: Bool[Array, "..."]


def _blend(
    x: Float[Array, ""],
    n: Float[Array, ""],
    records: tuple[Float[Array, " r"], Float[Array, " r"], Float[Array, "r k"], Float[Array, " r"]],
    valid: Bool[Array, " r"],
    order: int = 1,
    fade: bool = False,
) -> Lookup:
    """The weighted mean of the records' expansions at one place; see `Cache`."""
    at, normal, derivatives, radius = records
    error = split_circle_error(x - at, jnp.where(valid, radius, 1.0), n - normal)
    weight, used, covered = weights(error, valid, fade)
    dx = jnp.where(used, x - at, 0.0)
    return Lookup(jnp.sum(weight * taylor(derivatives, dx, order)) / jnp.sum(weight), covered)


class Cache(eqx.Module):
    """Records along one surface; called with places, it answers with irradiance.

    `E(x) = sum_i w_i T_i(x - x_i) / sum_i w_i` over the records that reach x, those whose error
    `e_i = |x - x_i| / R_i + sin |n - n_i|` is below 1; T_i is the Taylor expansion of the given
    order and `w_i = 1 / e_i`. On a record it is the record's value. The printed weights end at 1
    rather than 0 where a record's reach ends, and leave a small step there; with `fade` they are
    `1 / e_i - 1` and do not.

    Where no record reaches, the one with the smallest error answers, beyond its radius, and
    `Lookup.covered` is false: a number, never NaN.

    Distances are arc lengths. For the straight surfaces of J12 they are distances.

    Args:
        x, n: arc length [m] and normal's angle [rad] of each record.
        derivatives: E, E', E'', ... of each record.
        radius: how far each may be used [m].
        clamp: what acted on the radius: 0 nothing, -1 raised, 1 cut.
        order: of the expansions, 0, 1 or 2.
        fade: whether the weights end at zero.

    Raises:
        ValueError: if there is no record, or a radius is not positive and finite.

    Reference: J12 eqs. 33 (order 1), 52 (order 2) and 34 (weights).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Cache, Candidates, clamped
        >>> some = Candidates.along(jnp.cos, jnp.array([0.0, 1.0]))
        >>> cache = Cache.of(some, clamped(jnp.array([0.8, 0.8]), 0.1, 1.0))
        >>> round(cache(0.0).value.item(), 12), cache(3.0).covered.item()
        (1.0, False)
    """

    x: Float[Array, " r"]
    n: Float[Array, " r"]
    derivatives: Float[Array, "r k"]
    radius: Float[Array, " r"]
    clamp: Int[Array, " r"]
    order: int = eqx.field(static=True, default=1)
    fade: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a cache that could not answer."""
        if self.x.shape[0] == 0:
            raise ValueError("Argument `x` must hold at least one record, but is empty.")
        check_positive("radius", self.radius)
        check_shape("radius", self.radius, self.x.shape)
        if self.derivatives.shape[-1] <= checked_order(self.order):
            raise ValueError(
                f"Argument `derivatives` must hold {self.order + 1} columns, "
                f"but holds {self.derivatives.shape[-1]}."
            )

    @staticmethod
    def of(
        candidates: Candidates,
        radii: Clamped,
        chosen: ArrayLike | None = None,
        *,
        order: int = 1,
        fade: bool = False,
    ) -> Cache:
        """The chosen candidates as records, from left to right; all if none are named.

        Args:
            candidates: to choose from.
            radii: one for each candidate, as `clamped` gives them.
            chosen: which candidates are records, as `fill` gives it.
            order: of the expansions.
            fade: whether the weights end at zero.
        """
        rows = kept(chosen, candidates.x.shape[0])
        rows = rows[np.argsort(np.asarray(candidates.x)[rows], kind="stable")]
        return Cache(
            candidates.x[rows],
            candidates.n[rows],
            candidates.derivatives[rows],
            radii.radius[rows],
            radii.clamp[rows],
            order,
            fade,
        )

    @property
    def count(self) -> int:
        """Number of records."""
        return self.x.shape[0]

    def __call__(self, x: ArrayLike, n: ArrayLike = 0.0) -> Lookup:
        """Irradiance at the arc lengths x, where the normals have the angles n."""
        x = as_float(x)
        n = jnp.broadcast_to(as_float(n).astype(x.dtype), x.shape)
        value, covered = _answers(self, x.ravel(), n.ravel())
        return Lookup(value.reshape(x.shape), covered.reshape(x.shape))

    def columns(self) -> dict[str, np.ndarray]:
        """The table: one vector for each column, ready for `firstorder.io.write_csv`."""
        names = ("E", "dE_dx", "d2E_dx2", "d3E_dx3")
        data = np.asarray(self.derivatives).T
        named = {
            names[k] if k < len(names) else f"d{k}E_dx{k}": column for k, column in enumerate(data)
        }
        words = np.array([CLAMPS[int(c)] for c in self.clamp])
        start = {"x": np.asarray(self.x), "n": np.asarray(self.n)}
        return start | named | {"radius": np.asarray(self.radius), "clamp": words}

    def __str__(self) -> str:
        """The table, in print."""
        return printed(self.columns())


@eqx.filter_jit
def _answers(cache: Cache, x: Float[Array, " p"], n: Float[Array, " p"]) -> Lookup:
    valid = jnp.ones(cache.x.shape, bool)
    records = (cache.x, cache.n, cache.derivatives, cache.radius)
    return jax.vmap(lambda x, n: _blend(x, n, records, valid, cache.order, cache.fade))(x, n)
