"""Irradiance cache along a line or on a plane: records, and interpolation between them.

A cache is a choice among candidates. A record is a row of a table, which can be printed, exported,
read back and drawn.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import check_broadcast, check_positive, check_real
from firstorder._display import Axes, Module, as_picture, drawn, in_print
from firstorder._labelled import DataFrame, data_frame
from firstorder.caching._columns import columns_of, printed, records_of, units_of
from firstorder.caching._records import checked_order, distance, kept, turning, weights
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import ValidityRegion, _check_regions
from firstorder.numerics._batching import in_batches
from firstorder.typing import as_float

BLOCK = 256  # places answered at a time; with a thousand records this stays in the cache
PAD = 128  # records are padded to multiples of it (few: of an eighth), to compile few sizes


def taylor(
    value: ArrayLike,
    gradient: ArrayLike,
    hessian: ArrayLike | None,
    dx: ArrayLike,
    order: int = 1,
) -> Float[Array, "..."]:
    """Expansion of the given order about a record: `E + g . dx + dx^T H dx / 2`.

    Args:
        value: E at the record, shape (...).
        gradient: there, shape (..., d); not used at order 0.
        hessian: there, shape (..., d, d); used at order 2 only.
        dx: steps from the record (..., d), along a line of length 1 in the last axis [m].
        order: 0, 1 or 2.

    Raises:
        ValueError: for another order, or a Hessian that is missing at order 2.

    Reference: the brackets of J12 eqs. 33 and 52; §8.1 on a plane.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import taylor
        >>> line = jnp.array(1.0), jnp.array([2.0]), jnp.array([[4.0]])
        >>> taylor(*line, jnp.array([0.5]), order=2).item()
        2.5
    """
    checked_order(order)
    value, gradient, dx = as_float(value), as_float(gradient), as_float(dx)
    steps = [dx[..., i] for i in range(gradient.shape[-1])]
    total = jnp.broadcast_to(value, jnp.broadcast_shapes(value.shape, steps[0].shape))
    if order == 0:
        return total
    for i, x in enumerate(steps):
        total = total + gradient[..., i] * x
    if order == 1:
        return total
    if hessian is None:
        raise ValueError("Argument `hessian` must be given for order 2, but is missing.")
    square, hessian = 0.0, as_float(hessian)
    for i, j in itertools.combinations_with_replacement(range(len(steps)), 2):
        both = hessian[..., i, j] + (hessian[..., j, i] if i < j else 0.0)
        square = square + both * steps[i] * steps[j]
    return total + 0.5 * square


class Lookup(NamedTuple):
    """An interpolated value, and whether any record was in reach of the place."""

    value: Float[Array, "..."]
    covered: Bool[Array, "..."]

    __repr__ = in_print


class Cache(Module):
    """Records along a line or on a plane; called with places, it answers with irradiance.

    `E(x) = sum_i w_i T_i(x - x_i) / sum_i w_i` over the records that reach x, those whose error
    `e_i = |M_i (x - x_i)| + sin |n - n_i|` is below 1, where T_i is the expansion of the given
    order, M_i the matrix of the record's region (one over R along a line) and the turn of the
    normal counts where the records hold a tilt; `w_i = 1 / e_i`. On a record it is the record's
    value. The printed weights end at 1 rather than 0 where a record's reach ends, and leave a small
    step there; with `fade` they are `1 / e_i - 1` and do not.

    Places exactly on the rim of a region are outside, to rounding: `e_i < 1 - 8 eps`, here and in
    `fill`. Where no record reaches, the one with the smallest error answers, beyond its radius, and
    `Lookup.covered` is false: a number, never NaN.

    Args:
        records: places, values, derivatives and tilts, as rows of candidates.
        region: how far each may be used.
        order: of the expansions, 0, 1 or 2.
        fade: whether the weights end at zero.

    Raises:
        ValueError: if there is no record, a region's radius is not positive and finite, or order 2
            is asked of records without a Hessian.

    Reference: J12 eqs. 33 (order 1), 52 (order 2) and 34 (weights); §8.1 on a plane.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> line = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
        >>> cache = Cache.of(line, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0))
        >>> answer = cache(jnp.array([[0.0], [3.0]]))
        >>> round(answer.value[0].item(), 12), answer.covered.tolist()
        (1.0, [True, False])
        >>> places = jnp.array([[0.0, 0.0], [1.0, 0.0]])
        >>> plane = Candidates.from_function(lambda x: jnp.cos(x[0]) + x[1], places)
        >>> cache = Cache.of(plane, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0, dims=2))
        >>> round(cache(jnp.array([0.0, 0.1])).value.item(), 6)
        1.1
    """

    records: Candidates
    region: ValidityRegion
    order: int = eqx.field(static=True, default=1)
    fade: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a cache that could not answer."""
        r, d = self.records.position.shape
        if r == 0:
            raise ValueError("Argument `position` must hold at least one record, but is empty.")
        _check_regions(self.region, r, d)
        check_positive("radius", self.region.radius)
        self.records.derivative(checked_order(self.order))

    @staticmethod
    def of(
        candidates: Candidates,
        region: ValidityRegion,
        chosen: ArrayLike | None = None,
        *,
        order: int = 1,
        fade: bool = False,
    ) -> Cache:
        """The chosen candidates as records, along a line from left to right; all if none are named.

        Args:
            candidates: to choose from.
            region: one for each candidate, as `circular_regions` and `elliptic_regions` give them.
            chosen: which candidates are records, as `fill` gives it: an array of m truth values.
            order: of the expansions.
            fade: whether the weights end at zero.

        Raises:
            TypeError: if `region` is a number or an array of radii.
            ValueError: for another order than 0, 1 or 2, a Hessian that is missing, or regions or
                truth values that are not as many as candidates.
        """
        rows = kept(chosen, candidates.count)
        _check_regions(region, candidates.count, candidates.dims)
        if candidates.dims == 1:
            rows = rows[np.argsort(np.asarray(candidates.position)[rows, 0], kind="stable")]
        return Cache(candidates.at(rows), region.at(rows), order, fade)

    _repr_html_ = as_picture

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the interpolated irradiance and the records, blank where no record reaches.

        Along a line it is a curve with the records on it, broken wherever a record's reach ends and
        the weights step; triangles are records whose radius was raised to the least one, squares
        those that were cut at the largest. On a plane it is an image with the outlines of what the
        records reach.

        Args:
            ax: matplotlib axes to draw on; new ones if left out, and no window opens.

        Returns:
            The axes.

        Raises:
            ValueError: if the cache is traced, or a batch of caches.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Cache, Candidates, circular_regions
            >>> line = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
            >>> cache = Cache.of(line, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0))
            >>> cache.plot().get_ylabel()
            'irradiance $E$ (W/m)'
        """
        return drawn(self, ax)

    @property
    def count(self) -> int:
        """Number of records."""
        return self.records.count

    def __call__(self, x: ArrayLike, tilt: ArrayLike | None = None) -> Lookup:
        """Irradiance at places, where the normals have a tilt.

        Args:
            x: (..., d); along a line (..., 1), or one number [m].
            tilt: of the normals at these places, zero if left out [rad].

        Raises:
            ValueError: for places of another shape, a tilt that does not broadcast to theirs, or a
                tilt if the records hold none.
        """
        records = self.records
        x = _asked(x, records.dims).astype(records.value.dtype)
        if records.tilt is None:
            if tilt is not None:
                raise ValueError("Argument `tilt` must be left out: the records hold none.")
        else:
            given = as_float(0.0 if tilt is None else tilt).astype(x.dtype)
            check_broadcast("tilt", given, x.shape)
            tilt = jnp.broadcast_to(given, x.shape).reshape(-1, records.dims)
        flat = x.reshape(-1, records.dims)
        value, covered = _answers(self._table(), flat, tilt, self.order, self.fade)
        return Lookup(value.reshape(x.shape[:-1]), covered.reshape(x.shape[:-1]))

    def _table(self) -> _Table:
        """The records, with copies of the last one up to a size that many caches have."""
        step = PAD if self.count > PAD else PAD // 8
        rows = np.minimum(np.arange(-(-self.count // step) * step), self.count - 1)
        valid = jnp.arange(len(rows)) < self.count
        matrix = jnp.asarray(self.region.matrix)[rows]
        return _tabled(self.records, rows, matrix, valid, self.order)

    def columns(self) -> dict[str, np.ndarray]:
        """The table: one vector for each column, ready for `firstorder.io.write_csv`."""
        return columns_of(self.records, self.region)

    def to_pandas(self) -> DataFrame:
        """The table as `columns` gives it, with units in `attrs["units"]`.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Cache, Candidates, circular_regions
            >>> line = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
            >>> cache = Cache.of(line, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0))
            >>> list(cache.to_pandas()), cache.to_pandas().attrs["units"]["dE_dx"]
            (['x', 'E', 'dE_dx', 'd2E_dx2', 'radius', 'clamp'], 'W/m^2')
        """
        return data_frame(self.columns(), units_of(self.records.dims))

    @staticmethod
    def from_columns(
        columns: dict[str, np.ndarray], *, order: int = 1, fade: bool = False
    ) -> Cache:
        """A cache from a table that `columns` gave, read from where it was written.

        Args:
            columns: one array for each name that `columns` gives, of one length.
            order: of the expansions.
            fade: whether the weights end at zero.

        Raises:
            ValueError: if a column is missing or of another length, a radius is not positive, or a
                clamp is another word.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Cache, Candidates, circular_regions
            >>> line = Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 3))
            >>> cache = Cache.of(line, circular_regions(jnp.full(3, 0.5), 0.1, 1.0))
            >>> Cache.from_columns(cache.columns()).records.count
            3
        """
        return Cache(*records_of(columns), order, fade)

    def __str__(self) -> str:
        """The table, in print."""
        return printed(self.columns())


def _asked(x: ArrayLike, dims: int) -> Float[Array, "... d"]:
    """Places (..., d); along a line also one number."""
    x = as_float(x)
    check_real("x", x)
    if x.ndim == 0 and dims == 1:
        return x[None]
    if x.ndim == 0 or x.shape[-1] != dims:
        words = ": arc lengths x are x[..., None]" if dims == 1 else ""
        raise ValueError(f"Argument `x` must have shape (..., {dims}), but has {x.shape}{words}.")
    return x


# --- answers --------------------------------------------------------------------------------------


class _Table(NamedTuple):
    """Columns that an answer needs, of caches of one size; `valid` says which rows are records."""

    position: Float[Array, "... r d"]
    value: Float[Array, "... r"]
    gradient: Float[Array, "... r d"]
    hessian: Float[Array, "... r d d"] | None
    tilt: Float[Array, "... r d"] | None
    matrix: Float[Array, "... r d d"]
    valid: Bool[Array, "... r"]


def _tabled(candidates: Candidates, rows: np.ndarray, matrix: Array, valid: Array, order: int):
    """Rows of candidates, with the matrices of their regions, as a `_Table`."""
    c = candidates
    hessian = c.derivative(2)[rows] if order == 2 else None
    tilt = None if c.tilt is None else c.tilt[rows]
    return _Table(c.position[rows], c.value[rows], c.gradient[rows], hessian, tilt, matrix, valid)


def _answered(table: _Table, x: Array, tilt: Array | None, order: int, fade: bool):
    """Weighted means of the expansions at places (p, d), and which are covered."""

    def one(asked):
        place, turned = asked
        dx = place - table.position
        error = distance(table.matrix, dx)
        if table.tilt is not None:
            error = error + turning(turned - table.tilt)
        weight, used, covered = weights(error, table.valid, fade)
        # What is not used is far away, where its expansion may be of any size.
        there = taylor(
            table.value, table.gradient, table.hessian, jnp.where(used[:, None], dx, 0.0), order
        )
        return jnp.sum(weight * there) / jnp.sum(weight), covered

    return in_batches(one, (x, tilt), BLOCK)


_answers = eqx.filter_jit(_answered)


@eqx.filter_jit
def _answers_of_many(tables: _Table, x: Array, tilt: Array | None, order: int, fade: bool):
    """Answers of several caches of one size, one after the other."""
    return jax.lax.map(lambda table: _answered(table, x, tilt, order, fade), tables)
