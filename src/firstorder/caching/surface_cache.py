"""Irradiance cache on a plane piece of surface, with circles or ellipses as regions of validity.

What `cache` is along a line: candidates hold all that a record would, a cache is a choice among
them, and a record is a row of a table.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.caching._records import checked_order, kept, printed, weights
from firstorder.caching.cache import Lookup
from firstorder.caching.ellipses import ValidityRegion
from firstorder.caching.radii import CLAMPS
from firstorder.errors import check_finite, check_shape
from firstorder.numerics.batching import in_batches
from firstorder.typing import as_float

BLOCK = 256  # places answered at a time; with a thousand records this stays in the cache
PAD = 128  # records are padded to multiples of it, so that few sizes are compiled


class SurfaceCandidates(eqx.Module):
    """Candidate records at places on a plane.

    Attributes:
        position: in the tangent plane [m].
        value: irradiance [W/m^2].
        gradient: in the tangent plane [W/m^3].
        hessian: in the tangent plane, for extrapolation of order 2 [W/m^4].
        minimum: length of the shortest ray [m]; infinite if it was not asked for.
        harmonic: harmonic mean of the lengths of rays [m]; infinite if it was not asked for.
    """

    position: Float[Array, "m 2"]
    value: Float[Array, " m"]
    gradient: Float[Array, "m 2"]
    hessian: Float[Array, "m 2 2"]
    minimum: Float[Array, " m"]
    harmonic: Float[Array, " m"]

    @staticmethod
    def of(
        position: ArrayLike,
        value: ArrayLike,
        gradient: ArrayLike,
        hessian: ArrayLike | None = None,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> SurfaceCandidates:
        """Candidates from arrays that were gathered; zeros in the place of a Hessian left out.

        Raises:
            ValueError: if shapes do not fit, or a number is not finite.

        Example:
            >>> import numpy as np
            >>> from firstorder.caching import SurfaceCandidates
            >>> SurfaceCandidates.of(np.zeros((3, 2)), np.ones(3), np.zeros((3, 2))).value.shape
            (3,)
        """
        position = as_float(position)
        m = position.shape[0]
        if hessian is None:
            hessian = jnp.zeros((m, 2, 2), position.dtype)
        parts = {
            "position": (position, (m, 2)),
            "value": (value, (m,)),
            "gradient": (gradient, (m, 2)),
            "hessian": (hessian, (m, 2, 2)),
        }
        found = []
        for name, (given, shape) in parts.items():
            given = as_float(given).astype(position.dtype)
            check_shape(name, given, shape)
            check_finite(name, given)
            found.append(given)
        lengths = [
            jnp.broadcast_to(as_float(a).astype(position.dtype), (m,)) for a in (minimum, harmonic)
        ]
        return SurfaceCandidates(*found, *lengths)

    @staticmethod
    def on(
        E: Callable[[Array], Array],
        position: ArrayLike,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> SurfaceCandidates:
        """Candidates for any irradiance that is a function of a place (2,), by autodiff.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import SurfaceCandidates
            >>> some = SurfaceCandidates.on(lambda x: x[0] * x[1], jnp.array([[2.0, 3.0]]))
            >>> some.gradient.tolist(), some.hessian.tolist()
            ([[3.0, 2.0]], [[[0.0, 1.0], [1.0, 0.0]]])
        """
        position = as_float(position)

        def slopes(x):
            value, gradient = jax.value_and_grad(E)(x)
            return gradient, (value, gradient)

        def one(x):
            hessian, (value, gradient) = jax.jacfwd(slopes, has_aux=True)(x)
            return value, gradient, hessian

        step = 4096
        each = eqx.filter_jit(jax.vmap(one))
        parts = [each(position[i : i + step]) for i in range(0, position.shape[0], step)]
        value, gradient, hessian = (jnp.concatenate(p) for p in zip(*parts, strict=True))
        return SurfaceCandidates.of(position, value, gradient, hessian, minimum, harmonic)


def surface_taylor(
    value: Float[Array, "..."],
    gradient: Float[Array, "... 2"],
    hessian: Float[Array, "... 2 2"],
    dx: Float[Array, "... 2"],
    order: int = 1,
) -> Float[Array, "..."]:
    """Expansion of the given order about a record: `E + g . dx + dx^T H dx / 2`.

    Args:
        value: E at the record [W/m^2].
        gradient: there; not used at order 0 [W/m^3].
        hessian: there; used at order 2 only [W/m^4].
        dx: step from the record, in the tangent plane [m].
        order: 0, 1 or 2.

    Raises:
        ValueError: for another order.

    Reference: J12 §8.1; its eq. 52 is the one on a line.
    """
    checked_order(order)
    x, y = dx[..., 0], dx[..., 1]
    if order == 0:
        return jnp.broadcast_to(value, jnp.broadcast_shapes(value.shape, x.shape))
    linear = value + gradient[..., 0] * x + gradient[..., 1] * y
    if order == 1:
        return linear
    cross = hessian[..., 0, 1] + hessian[..., 1, 0]
    return linear + 0.5 * (hessian[..., 0, 0] * x * x + cross * x * y + hessian[..., 1, 1] * y * y)


class SurfaceCache(eqx.Module):
    """Records on a plane; called with places, it answers with irradiance.

    `E(x) = sum_i w_i T_i(x - x_i) / sum_i w_i` over the records that reach x, those with
    `e_i = |M_i (x - x_i)| < 1`, where T_i is the expansion of the given order and M_i the matrix of
    the record's ellipse (identity over R for a circle). As along a line, `w_i = 1 / e_i`, which
    ends at 1 where the reach does; with `fade`, `1 / e_i - 1`, which ends at zero.

    Where no record reaches, the one with the smallest e_i answers, beyond its radius, and
    `Lookup.covered` is false: a number, never NaN.

    Attributes:
        position, value, gradient, hessian: of each record, as `SurfaceCandidates` has them.
        matrix: of its ellipse [1/m].
        clamp: what acted on it: 0 nothing, -1 raised, 1 cut.
        order: of the expansions, 0, 1 or 2.
        fade: whether the weights end at zero.

    Raises:
        ValueError: if there is no record, shapes do not fit, or a matrix is not finite.

    Reference: J12 §8.1 (after eqs. 33, 34 and 52).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import SurfaceCache, SurfaceCandidates, circular_regions
        >>> places = jnp.array([[0.0, 0.0], [1.0, 0.0]])
        >>> some = SurfaceCandidates.on(lambda x: jnp.cos(x[0]) + x[1], places)
        >>> cache = SurfaceCache.of(some, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0))
        >>> answer = cache(jnp.array([[0.0, 0.1], [5.0, 0.0]]))
        >>> round(answer.value[0].item(), 6), answer.covered.tolist()
        (1.1, [True, False])
    """

    position: Float[Array, "r 2"]
    value: Float[Array, " r"]
    gradient: Float[Array, "r 2"]
    hessian: Float[Array, "r 2 2"]
    matrix: Float[Array, "r 2 2"]
    clamp: Int[Array, " r"]
    order: int = eqx.field(static=True, default=1)
    fade: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a cache that could not answer."""
        if self.position.shape[0] == 0:
            raise ValueError("Argument `position` must hold at least one record, but is empty.")
        check_shape("matrix", self.matrix, (*self.value.shape, 2, 2))
        check_finite("matrix", self.matrix)
        checked_order(self.order)

    @staticmethod
    def of(
        candidates: SurfaceCandidates,
        reach: ValidityRegion,
        chosen: ArrayLike | None = None,
        *,
        order: int = 1,
        fade: bool = False,
    ) -> SurfaceCache:
        """The chosen candidates as records; all if none are named.

        Args:
            candidates: to choose from.
            reach: one for each candidate, as `circular_regions` and `elliptic_regions` give them.
            chosen: which candidates are records, as `fill_surface` gives it.
            order: of the expansions.
            fade: whether the weights end at zero.
        """
        rows = kept(chosen, len(candidates.value))
        return SurfaceCache(
            candidates.position[rows],
            candidates.value[rows],
            candidates.gradient[rows],
            candidates.hessian[rows],
            jnp.asarray(reach.matrix)[rows],
            jnp.asarray(reach.clamp)[rows],
            order,
            fade,
        )

    @property
    def count(self) -> int:
        """Number of records."""
        return self.value.shape[0]

    def __call__(self, x: ArrayLike) -> Lookup:
        """Irradiance at places (..., 2) of the plane."""
        x = as_float(x).astype(self.value.dtype)
        value, covered = _answers(*_padded(self), x.reshape(-1, 2), self.order, self.fade)
        return Lookup(value.reshape(x.shape[:-1]), covered.reshape(x.shape[:-1]))

    def semi_axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Semi-axes of each record's ellipse, the longer first [m], and its angle from x [rad]."""
        _, sizes, turned = np.linalg.svd(np.asarray(self.matrix))
        # The smallest singular value belongs to the longest axis, which is the last row.
        along = turned[:, 1]
        return 1.0 / sizes[:, ::-1], np.arctan2(along[:, 1], along[:, 0]) % np.pi

    def columns(self) -> dict[str, np.ndarray]:
        """The table: one vector for each column, ready for `firstorder.io.write_csv`."""
        x, g, H = (np.asarray(a) for a in (self.position, self.gradient, self.hessian))
        lengths, angle = self.semi_axes()
        return {
            "x": x[:, 0],
            "y": x[:, 1],
            "E": np.asarray(self.value),
            "dE_dx": g[:, 0],
            "dE_dy": g[:, 1],
            "d2E_dx2": H[:, 0, 0],
            "d2E_dxdy": H[:, 0, 1],
            "d2E_dy2": H[:, 1, 1],
            "radius": lengths[:, 0],
            "shorter": lengths[:, 1],
            "angle": angle,
            "clamp": np.array([CLAMPS[int(c)] for c in np.asarray(self.clamp)]),
        }

    @staticmethod
    def from_columns(columns: dict[str, np.ndarray], *, order: int = 1, fade: bool = False):
        """A cache from a table that `columns` gave, read from where it was written.

        Raises:
            ValueError: if a column is missing.
        """
        names = ("x", "y", "E", "dE_dx", "dE_dy", "d2E_dx2", "d2E_dxdy", "d2E_dy2")
        missing = [k for k in (*names, "radius", "shorter", "angle") if k not in columns]
        if missing:
            raise ValueError(f"Argument `columns` must hold `{missing[0]}`, but does not.")
        x, y, E, gx, gy, xx, xy, yy = (np.asarray(columns[k], float) for k in names)
        a, b, angle = (np.asarray(columns[k], float) for k in ("radius", "shorter", "angle"))
        u = np.stack([np.cos(angle), np.sin(angle)], -1)
        outer = u[:, :, None] * u[:, None, :]
        matrix = outer / a[:, None, None] + (np.eye(2) - outer) / b[:, None, None]
        codes = {word: code for code, word in CLAMPS.items()}
        clamp = [codes[str(word)] for word in columns.get("clamp", [""] * len(x))]
        hessian = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
        return SurfaceCache(
            jnp.asarray(np.stack([x, y], -1)),
            jnp.asarray(E),
            jnp.asarray(np.stack([gx, gy], -1)),
            jnp.asarray(hessian),
            jnp.asarray(matrix),
            jnp.asarray(clamp, dtype=jnp.int32),
            order,
            fade,
        )

    def __str__(self) -> str:
        """The table, in print."""
        return printed(self.columns())


def _padded(cache: SurfaceCache) -> tuple[Array, ...]:
    """The records as columns of one size for many caches, and which are real."""
    more = -cache.count % PAD
    fields = (cache.position, cache.value, cache.gradient, cache.hessian, cache.matrix)
    columns = [jnp.concatenate([a, jnp.broadcast_to(a[-1:], (more, *a.shape[1:]))]) for a in fields]
    return (*columns, jnp.arange(cache.count + more) < cache.count)


@eqx.filter_jit
def _answers(
    position: Float[Array, "r 2"],
    value: Float[Array, " r"],
    gradient: Float[Array, "r 2"],
    hessian: Float[Array, "r 2 2"],
    matrix: Float[Array, "r 2 2"],
    valid: Bool[Array, " r"],
    x: Float[Array, "p 2"],
    order: int,
    fade: bool,
) -> tuple[Float[Array, " p"], Bool[Array, " p"]]:
    def one(place):
        dx = place - position
        u = matrix[:, 0, 0] * dx[:, 0] + matrix[:, 0, 1] * dx[:, 1]
        v = matrix[:, 1, 0] * dx[:, 0] + matrix[:, 1, 1] * dx[:, 1]
        square = u * u + v * v
        error = jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)
        weight, _, covered = weights(error, valid, fade)
        there = surface_taylor(value, gradient, hessian, dx, order)
        return jnp.sum(weight * there) / jnp.sum(weight), covered

    return in_batches(one, x, BLOCK)
