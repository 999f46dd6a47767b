"""Irradiance cache on curved and tilted surfaces: records with normals and all five freedoms.

A record knows how its irradiance changes by steps along its tangents and its normal, and by tilts
of the normal (`space.derivatives`). Another place of any surface is one displacement away,

    u = (axes_i^T (x - x_i), a),      a = angle between n_i and n, along the tangent part of n,

which is what `Receiver.displaced` undoes. So the rotational derivative is used in extrapolation,
and the weight has the turn (J12 eq. 34).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import check_positive, check_shape
from firstorder._display import Module
from firstorder.caching._records import (
    checked_order,
    checked_visits,
    kept,
    reached,
    turning,
    weights,
)
from firstorder.caching.cache import BLOCK, Lookup, taylor
from firstorder.caching.filling import Indices
from firstorder.numerics._batching import in_batches
from firstorder.numerics._vectors import norm
from firstorder.space import Derivatives, Receiver
from firstorder.typing import as_float

FREEDOMS = 5


def displacement(start: Receiver, end: Receiver) -> Float[Array, "*r 5"]:
    """Steps and tilt that move one receiver onto the place and the normal of another.

    `start.displaced(displacement(start, end))` has the position and the normal of `end`; its
    tangents are turned about none but the axis across both normals.

    Args:
        start: whose axes are used; shapes broadcast.
        end: where to.

    Returns:
        Steps along x, y and z [m], tilts along x and y [rad].

    Example:
        >>> from firstorder.caching import displacement
        >>> from firstorder.space import Receiver
        >>> up, aside = Receiver.at((0.0, 0.0, 0.0)), Receiver.at((1.0, 0.0, 2.0), (1.0, 0.0, 1.0))
        >>> [round(u, 4) for u in displacement(up, aside).tolist()]  # an eighth of a turn along x
        [1.0, 0.0, 2.0, 0.7854, 0.0]
    """
    step = jnp.sum(start.axes * (end.position - start.position)[..., None], -2)
    n = jnp.sum(start.axes * end.normal[..., None], -2)
    aside, up = n[..., :2], n[..., 2:]
    square = jnp.sum(aside * aside, -1, keepdims=True)
    # The angle over its sine, which has derivatives at no turn too: those of its series.
    small = (square < 1e-8) & (up > 0.0)
    sine = jnp.sqrt(jnp.where(small | (square == 0.0), 1.0, square))
    rate = jnp.where(small, 1.0 + square / 6.0, jnp.arctan2(sine, up) / sine)
    # Half a turn has no axis of its own: any will do.
    half = (square == 0.0) & (up < 0.0)
    tilt = jnp.where(half, jnp.array([np.pi, 0.0], n.dtype), rate * aside)
    return jnp.concatenate([step, tilt], -1)


def hessian_along(derivatives: Derivatives, S: ArrayLike) -> Float[Array, "*r 2 2"]:
    """Second derivative along a surface that first-order extrapolation by all freedoms leaves out.

    A step d along a surface of shape operator S tilts the normal by `-S d` and leaves the tangent
    plane by `d.S d / 2`. The expansion of order 1 has the rise in it, so what is missing is

        d^T (E_dd - E_da S - S E_ad + S E_aa S) d / 2,

    which is `Derivatives.along` without its term `E_z S`. Its `derivative_norm` gives radii.

    Args:
        derivatives: by all freedoms of receivers in space.
        S: their shape operators, zero where the surface is flat [1/m].

    Raises:
        ValueError: if a freedom is missing.

    Reference: derived here; J12 §5 names the rotational part.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import hessian_along
        >>> from firstorder.space import Derivatives, Receiver
        >>> flat = Derivatives(jnp.zeros(()), jnp.zeros(5), jnp.eye(5), Receiver.freedoms)
        >>> hessian_along(flat, jnp.eye(2)).tolist()  # one of the steps, one of the tilts
        [[2.0, 0.0], [0.0, 2.0]]
    """
    _check_freedoms(derivatives)
    H = derivatives.hessian
    S = jnp.broadcast_to(as_float(S), (*H.shape[:-2], 2, 2)).astype(H.dtype)
    mixed = H[..., :2, 3:] @ S
    return H[..., :2, :2] - mixed - jnp.swapaxes(mixed, -1, -2) + S @ H[..., 3:, 3:] @ S


def _check_freedoms(derivatives: Derivatives) -> None:
    """Refuses derivatives by some freedoms only.

    Raises:
        ValueError: if they are.
    """
    if derivatives.freedoms != Receiver.freedoms:
        raise ValueError(
            f"Argument `derivatives` must be by {', '.join(Receiver.freedoms)}, "
            f"but is by {', '.join(derivatives.freedoms)}."
        )


def _check_row(at: Receiver) -> None:
    """Refuses receivers that are not in a row.

    Raises:
        ValueError: if so.
    """
    if at.position.ndim != 2:
        raise ValueError(
            f"Argument `at` must be a row of receivers, but has positions of {at.position.shape}."
        )


def fill_surface(at: Receiver, radius: ArrayLike, visits: Indices) -> Bool[np.ndarray, " m"]:
    """Selection of records from receivers on any surfaces, visited in the given order.

    A receiver is left out if a record made before covers it: if `|dx| / R + sin(turn)` is below 1
    (`e < 1 - 8 eps`). On the host, in m steps over the records so far.

    Args:
        at: a row of receivers.
        radius: R that each would have, finite [m].
        visits: their numbers, in the order of the visits.

    Returns:
        True for records.

    Raises:
        ValueError: if a radius is not positive, there is not one for each receiver, or a visit is
            no receiver's number.

    Reference: J12 eq. 34; Ward et al. 1988.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import fill_surface
        >>> from firstorder.space import Receiver
        >>> edge = Receiver.at(np.zeros((2, 3)), [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
        >>> fill_surface(edge, np.ones(2), [0, 1]).tolist()  # a right angle: one cannot serve both
        [True, True]
    """
    check_positive("radius", radius)
    x, n = np.asarray(at.position), np.asarray(at.normal)
    _check_row(at)
    check_shape("radius", np.asarray(radius), (len(x),))
    # In the precision of the places, as the cache measures: the rim is eight of its roundings in.
    R, records = np.asarray(radius, x.dtype), np.zeros(len(x), bool)
    rows: list[int] = []
    for i in checked_visits(visits, len(x)).tolist():
        away = np.linalg.norm(x[rows] - x[i], axis=1) / R[rows]
        turn = np.linalg.norm(np.cross(n[rows], n[i]), axis=1)  # its sine, 1 from a right angle
        error = away + np.where(n[rows] @ n[i] > 0.0, turn, 1.0)
        if not np.any(reached(error)):
            rows.append(i)
    records[rows] = True
    return records


class SurfaceCache(Module):
    """Records on surfaces of any shape; asked for receivers, it answers with irradiance.

    `E = sum_i w_i T_i(u_i) / sum_i w_i` over the records whose error `|x - x_i| / R_i + sin(turn)`
    is below 1, where T_i is the expansion of order 0, 1 or 2 in the five freedoms, u_i the
    `displacement` from the record, and `w_i = 1 / error`. On flat ground it answers as `Cache` does
    with circles. Where no record reaches, that of the smallest error answers.

    Valid where the record sees the same light: a record around a corner is kept out by the turn,
    one on a parallel surface behind only by its radius.

    Args:
        at: receivers of the records, in a row.
        derivatives: of irradiance by all freedoms, with the same leading axis.
        radius: how far each may be used [m].
        order: of the expansions.

    Raises:
        ValueError: if there is no record, a radius is not positive and finite, or a freedom is
            missing.

    Reference: Ward and Heckbert 1992; J12 eqs. 33 and 34.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.caching import SurfaceCache
        >>> from firstorder.space import Receiver, Scene, derivatives, irradiance, primitive, sphere
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 3.0), 1.0), emission=1.0))
        >>> top = Receiver.at([(0.0, 0.0, 1.0)], [(0.0, 0.0, 1.0)])
        >>> found = jax.vmap(lambda at: derivatives(irradiance, scene, at))(top)
        >>> cache = SurfaceCache(top, found, jnp.array([0.5]), order=2)
        >>> aside = Receiver.at((0.1, 0.0, 0.995), (0.1, 0.0, 0.995))  # on a ball of radius 1
        >>> abs(cache(aside).value - irradiance(scene, aside)).item() < 1e-3
        True
    """

    at: Receiver
    derivatives: Derivatives
    radius: Float[Array, " r"] = eqx.field(converter=as_float)
    order: int = eqx.field(static=True, default=1)

    def __check_init__(self):
        """Refuse a cache that could not answer."""
        checked_order(self.order)
        _check_freedoms(self.derivatives)
        r = self.radius.size
        check_shape("radius", self.radius, (r,))
        if r == 0:
            raise ValueError("Argument `radius` must hold at least one record, but is empty.")
        check_shape("derivatives", self.derivatives.gradient, (r, FREEDOMS))
        check_shape("at", self.at.position, (r, 3))
        check_positive("radius", self.radius)

    @staticmethod
    def of(
        at: Receiver,
        derivatives: Derivatives,
        radius: ArrayLike,
        chosen: ArrayLike | None = None,
        *,
        order: int = 1,
    ) -> SurfaceCache:
        """A cache of the chosen receivers.

        Args:
            at: candidates, a row of receivers.
            derivatives: theirs.
            radius: theirs [m].
            chosen: which become records, a mask such as `fill_surface` gives; all if left out.
            order: of the expansions.
        """
        _check_row(at)
        check_shape("radius", as_float(radius), at.position.shape[:1])
        _check_freedoms(derivatives)
        # Of rows that are not there JAX would take the last one.
        check_shape("derivatives", derivatives.gradient, (len(at.position), FREEDOMS))
        rows = kept(chosen, len(at.position))
        parts = at, derivatives, as_float(radius)
        some = jax.tree.map(lambda a: jnp.asarray(a)[rows], parts)
        return SurfaceCache(*some, order=order)

    @property
    def count(self) -> int:
        """Number of records."""
        return self.radius.shape[0]

    def __call__(self, at: Receiver) -> Lookup:
        """Irradiance at receivers.

        Args:
            at: with any leading axes.
        """
        shape = at.position.shape[:-1]
        row = at.position.reshape(-1, 3), at.axes.reshape(-1, 3, 3)
        value, covered = _answers(self, *row)
        return Lookup(value.reshape(shape), covered.reshape(shape))


@eqx.filter_jit
def _answers(cache: SurfaceCache, position: Float[Array, "p 3"], axes: Float[Array, "p 3 3"]):
    """Weighted means of the expansions, and which places are covered."""
    d = cache.derivatives

    def one(asked):
        here = Receiver(asked[0], asked[1], jnp.zeros((2, 2), position.dtype))
        u = displacement(cache.at, here)
        error = norm(u[:, :3]) / cache.radius + turning(u[:, 3:])
        weight, used, covered = weights(error, jnp.ones(cache.count, bool))
        # What is not used is far away, where its expansion may be of any size.
        u = jnp.where(used[:, None], u, 0.0)
        there = taylor(d.value, d.gradient, d.hessian, u, cache.order)
        return jnp.sum(weight * there) / jnp.sum(weight), covered

    return in_batches(one, (position, axes), BLOCK)
