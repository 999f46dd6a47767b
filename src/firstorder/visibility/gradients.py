"""Shading behind blockers, with its gradient and Hessian split into interior and boundary.

    B(p) = int T(p, omega) V(p, omega) domega                                      (R07 eq. 32)

p are any parameters: the place x of the receiver, the angle theta towards the eye, a light's size,
a blocker's position. T is smooth; V is one or zero and jumps at the edges alpha_j(p), with R07's
signs, +1 from visible to blocked as angles grow. Then

    B_p  = int T_p V  +  sum_j sgn_j T alpha_p
    B_pq = int T_pq V +  sum_j sgn_j (T_p alpha_q + T_q alpha_p + T_omega alpha_p alpha_q
                                      + T alpha_pq)

with T and its derivatives taken at alpha_j. The first part is the *interior*, which an integrator
that ignores visibility's motion gets right; the second, the *boundary*, is what it misses.

V does not depend on theta, so B_theta has no boundary part for a general T: R07 (35) holds only for
`T = L(x, omega) rho(theta - omega)`, where integration by parts moves the derivative to L V; see
`angular_derivative_by_parts`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_finite, nan_unless
from firstorder._display import Module
from firstorder.numerics._quadrature import composite_gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.typing import Scalar, Vector, as_float
from firstorder.visibility._intervals import HORIZON, clip_intervals, signed_edges, whole_turns
from firstorder.visibility.edge_angles import EdgeAngle

# Transport: (parameters, angle) -> what the light from that angle adds per radian.
Transport = Callable[[Vector, Scalar], Scalar]


class SplitDerivative(Module):
    """A derivative of shading in two parts.

    Attributes:
        interior: from transport that changes where it is visible.
        boundary: from edges that move.

    Reference: R07 §6, eq. 31.
    """

    interior: Float[Array, "*s"]
    boundary: Float[Array, "*s"]

    @property
    def total(self) -> Float[Array, "*s"]:
        """The derivative."""
        return self.interior + self.boundary


class Shading(Module):
    """Shading at one point with its gradient and Hessian in the parameters.

    Attributes:
        value: B.
        gradient: B_p, in two parts of shape (k,).
        hessian: B_pq, in two parts of shape (k, k).
    """

    value: Float[Array, ""]
    gradient: SplitDerivative
    hessian: SplitDerivative


class VisibilityEdges(Module):
    """Visibility as its edges, which are functions of the parameters.

    Attributes:
        edges: a row, with derivatives by the parameters. Their jumps are R07's signs, +1 from
            visible to blocked as angles grow, -1 back, 0 for one that is hidden (whose other
            entries are then of no account, NaN included).
        start: visibility just above the lower end of the horizon, 0 or 1.

    Reference: R07 §6, eqs. 33 and 34.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import VisibilityEdges, edge_at
        >>> step = VisibilityEdges(edge_at(jnp.array([0.0]), 0.5, 1.0), jnp.array(1.0))
        >>> step.visibility(jnp.array([-0.5, 0.5])).tolist()
        [1.0, 0.0]
    """

    edges: EdgeAngle
    start: Float[Array, ""]

    def visibility(self, omega: Float[Array, "*w"]) -> Float[Array, "*w"]:
        """V at angles that are no edges: a sum of R07's steps, without derivative."""
        angle, sign = jax.lax.stop_gradient((self.edges.value, self.edges.jump))
        passed = jnp.where(sign != 0, jnp.nan_to_num(angle) < omega[..., None], False)
        return self.start - jnp.sum(jnp.where(passed, sign, 0.0), -1)

    def known(self) -> VisibilityEdges:
        """Edges with harmless numbers where one is hidden."""
        e, shown = self.edges, self.edges.jump != 0
        harmless = EdgeAngle(
            jnp.where(shown, e.value, 0.0),
            jnp.where(shown[:, None], e.gradient, 0.0),
            jnp.where(shown[:, None, None], e.hessian, 0.0),
            e.jump,
        )
        return VisibilityEdges(harmless, self.start)


def visible_edges(
    low: EdgeAngle, high: EdgeAngle, horizon: tuple[float, float] = HORIZON, others: int = 1
) -> VisibilityEdges:
    """The edges of blockers given by both of their ends; covered ends are hidden.

    A segment seen from its other side has its ends in the other order: they are exchanged. Each
    blocker takes less than half a turn. NaN if a blocker has no ends, as one around the receiver.
    Ends by all motions of the receiver count as on a straight one; `EdgeAngle.along` follows a
    curved one.

    Args:
        low: lower ends of n blockers (side +1), or of one, as the receiver moves along x.
        high: their upper ends (side -1).
        horizon: between which light arrives.
        others: how many parameters follow x, on which no edge depends (theta: one).

    Reference: R07 §6.2, and eq. 37 for its signs.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import visible_edges, point_edge_angle
        >>> low = point_edge_angle(jnp.array([[1.0, 2.0]]))
        >>> high = point_edge_angle(jnp.array([[-1.0, 2.0]]), side=-1.0)
        >>> visible_edges(low, high).edges.jump.tolist()
        [1.0, -1.0]
    """
    low, high = _ordered(_along_x(low), _along_x(high))
    angle, sign = signed_edges(low.value, high.value, horizon)
    # A blocker around the receiver has no ends: NaN, where an empty interval would mean full light.
    known = jnp.all(jnp.isfinite(low.value) & jnp.isfinite(high.value))
    angle = nan_unless(known, angle)
    first = jnp.concatenate([low.first, high.first])
    second = jnp.concatenate([low.second, high.second])
    k = 1 + others
    gradient = jnp.zeros((*angle.shape, k), angle.dtype).at[:, 0].set(first)
    hessian = jnp.zeros((*angle.shape, k, k), angle.dtype).at[:, 0, 0].set(second)
    start = nan_unless(known, _start(low.value, high.value, horizon))
    return VisibilityEdges(EdgeAngle(angle, gradient, hessian, sign), start)


def autodiff_edges(
    ends: Callable[[Vector], tuple[Array, Array]],
    p: Vector,
    horizon: tuple[float, float] = HORIZON,
) -> VisibilityEdges:
    """The edges of blockers whose ends are differentiable functions of any parameters.

    Args:
        ends: maps p to the lower and the upper ends of n blockers [rad], as from
            `interval_between`.
        p: where to differentiate.
        horizon: between which light arrives.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import autodiff_edges
        >>> ends = lambda p: (jnp.array([-0.25]) - p[0], jnp.array([0.25]) - p[0])
        >>> autodiff_edges(ends, jnp.zeros(1)).edges.gradient.tolist()
        [[-1.0], [-1.0]]
    """
    low, high = ends(p)
    angle, sign = signed_edges(low, high, horizon)
    both = lambda p: jnp.concatenate(ends(p))  # noqa: E731
    gradient, hessian = jax.jacfwd(both)(p), jax.jacfwd(jax.jacfwd(both))(p)
    return VisibilityEdges(EdgeAngle(angle, gradient, hessian, sign), _start(low, high, horizon))


@with_errors("nodes")
def shading_derivatives(
    T: Transport,
    p: Float[ArrayLike, " k"],
    edges: VisibilityEdges,
    *,
    horizon: tuple[float, float] = HORIZON,
    nodes: int = 24,
    breaks: Sequence[ArrayLike] = (),
    with_error: bool = False,
) -> Shading:
    """Shading behind blockers with its gradient and Hessian (see the module for the formulas).

    Valid for: any T that is smooth in p, and in omega between the edges and `breaks`; edges that
    are apart. Where two edges pass each other (a visual event) B is continuous and its gradient
    jumps; what comes out there is one of the one-sided ones. Light with edges of its own is a sum
    of shadings, one for each smooth piece, whose ends are edges like a blocker's.

    Args:
        T: transport, `T(p, omega)`.
        p: parameters.
        edges: as jets in p.
        horizon: between which light arrives; it must not move with p.
        nodes: Gauss-Legendre nodes between neighbouring edges.
        breaks: angles at which T is not smooth, numbers or arrays of them.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        B, B_p and B_pq.

    Raises:
        ValueError: if a break is no finite number.

    Reference: R07 §6, eqs. 32-37; the Hessian is ours (R07 §6.2 says that it follows).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import visible_edges, point_edge_angle, shading_derivatives
        >>> low = point_edge_angle(jnp.array([[0.0, 1.0]]))  # a half-plane that begins overhead
        >>> wall = point_edge_angle(jnp.array([[-1e9, 1.0]]), side=-1.0)
        >>> B = shading_derivatives(lambda p, w: jnp.cos(w), jnp.zeros(2), visible_edges(low, wall))
        >>> print(round(float(B.value), 6), B.gradient.total.round(6))
        1.0 [1. 0.]
    """
    p = as_float(p)
    for angle in breaks:
        check_finite("breaks", angle)
    edges = edges.known()
    omega, weight = composite_gauss_legendre(
        *_ends(horizon, p), [*edges.edges.value, *map(as_float, breaks)], nodes
    )
    seen = weight * edges.visibility(omega)
    inside = jax.vmap(lambda w: (T(p, w), jax.grad(T)(p, w), jax.hessian(T)(p, w)))(omega)
    value, first, second = (jnp.tensordot(seen, a, 1) for a in inside)
    boundary = _boundary(T, p, edges.edges)
    return Shading(value, SplitDerivative(first, boundary[0]), SplitDerivative(second, boundary[1]))


def shading(
    T: Callable[[Scalar, Scalar, Scalar], Scalar],
    x: ArrayLike,
    theta: ArrayLike,
    edges: VisibilityEdges,
    **options,
) -> Shading:
    """R07's B(x, theta) = int T(x, theta, omega) V(x, omega) domega; p = (x, theta).

    Args:
        T: transport of place, outgoing angle and incoming angle.
        x: place of the receiver, a number [m].
        theta: outgoing angle, a number [rad].
        edges: as jets in (x, theta), from `visible_edges`.
        options: those of `shading_derivatives`.

    Reference: R07 eqs. 32 and 37; for (35) see `angular_derivative_by_parts`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import autodiff_edges, shading
        >>> ends = lambda p: (jnp.array([-0.5]) - p[0], jnp.array([0.5]) - p[0])
        >>> edges = autodiff_edges(ends, jnp.zeros(2))
        >>> B = shading(lambda x, theta, w: jnp.cos(w), 0.0, 0.0, edges)
        >>> round(B.value.item(), 6)  # 2 (1 - sin 0.5)
        1.041149
    """
    p = jnp.stack([as_float(x), as_float(theta)])
    return shading_derivatives(lambda p, w: T(p[0], p[1], w), p, edges, **options)


@with_errors("nodes")
def angular_derivative_by_parts(
    L: Callable[[Scalar, Scalar], Scalar],
    rho: Callable[[Scalar], Scalar],
    x: ArrayLike,
    theta: ArrayLike,
    edges: VisibilityEdges,
    *,
    horizon: tuple[float, float] = HORIZON,
    nodes: int = 24,
    with_error: bool = False,
) -> SplitDerivative:
    """B_theta of `T = L(x, omega) rho(theta - omega)`, its derivative moved to light and edges.

        B_theta = int L_omega rho V  +  sum_j -sgn_j T(alpha_j)  -  [T V] at the horizon's ends

    The sum is R07 (35); the two other terms are needed with it. The total is that of `shading`,
    where the same derivative is all interior.

    Valid when: rho depends on theta - omega alone.

    Args:
        L: light of place and angle [radiance of any unit].
        rho: the BRDF, times the cosine if it is to count.
        x: place of the receiver, a number [m].
        theta: outgoing angle, a number [rad].
        edges: of visibility.
        horizon: between which light arrives.
        nodes: Gauss-Legendre nodes between neighbouring edges.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Reference: R07 eqs. 32 and 35, which are printed for any T.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import angular_derivative_by_parts, autodiff_edges
        >>> ends = lambda p: (jnp.array([-0.5]) - p[0], jnp.array([0.5]) - p[0])
        >>> edges = autodiff_edges(ends, jnp.zeros(2))
        >>> L, rho = lambda x, w: 1.0 + 0.0 * w, lambda a: jnp.cos(a)
        >>> split = angular_derivative_by_parts(L, rho, 0.0, 0.0, edges)
        >>> abs(split.total.item()) < 1e-9  # the blocker stands in the middle
        True
    """
    x, theta = as_float(x), as_float(theta)
    edges = edges.known()
    low, high = _ends(horizon, x)
    omega, weight = composite_gauss_legendre(low, high, [*edges.edges.value], nodes)
    L_omega = jax.vmap(jax.grad(L, 1), (None, 0))(x, omega)
    interior = jnp.sum(weight * edges.visibility(omega) * L_omega * jax.vmap(rho)(theta - omega))

    def T(w):
        return L(x, w) * rho(theta - w)

    sign = edges.edges.jump
    jumps = jnp.sum(jnp.where(sign != 0, -sign * jax.vmap(T)(edges.edges.value), 0.0))
    stop = edges.start - jnp.sum(sign)
    return SplitDerivative(interior, jumps + edges.start * T(low) - stop * T(high))


# --- small change --------------------------------------------------------------------------------


def _ordered(low: EdgeAngle, high: EdgeAngle) -> tuple[EdgeAngle, EdgeAngle]:
    """Ends of an interval with the lower one first, both on one turn (see `interval_between`)."""
    turned, shift_low, shift_high = whole_turns(low.value, high.value)
    low = eqx.tree_at(lambda a: a.value, low, low.value - shift_low)
    high = eqx.tree_at(lambda a: a.value, high, high.value - shift_high)

    def either(a, b):
        return jnp.where(turned.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(either, high, low), jax.tree.map(either, low, high)


def _along_x(edge: EdgeAngle) -> EdgeAngle:
    """Edges by one step of the receiver; one edge, of a plain point, is a row of one."""
    edge = edge if edge.gradient.shape[-1] == 1 else edge.along()
    return edge if edge.value.ndim else jax.tree.map(lambda a: a[None], edge)


def _boundary(T: Transport, p: Vector, edges: EdgeAngle) -> tuple[Array, Array]:
    """Contribution of the moving edges to gradient and Hessian."""

    def one(a, g, H, sign):
        value, T_w, T_p = T(p, a), jax.grad(T, 1)(p, a), jax.grad(T)(p, a)
        cross = jnp.outer(T_p, g)
        bend = cross + cross.T + T_w * jnp.outer(g, g) + value * H
        shown = sign != 0
        return jnp.where(shown, sign * value * g, 0.0), jnp.where(shown, sign * bend, 0.0)

    parts = jax.vmap(one)(edges.value, edges.gradient, edges.hessian, edges.jump)
    return parts[0].sum(0), parts[1].sum(0)


def _ends(horizon: tuple[float, float], like: Array) -> tuple[Array, Array]:
    return jnp.asarray(horizon[0], like.dtype), jnp.asarray(horizon[1], like.dtype)


def _start(low: Array, high: Array, horizon: tuple[float, float]) -> Array:
    """Whether a ray just above the lower end of the horizon is free."""
    low, high = jax.lax.stop_gradient(clip_intervals(low, high, horizon))
    return 1.0 - jnp.any((low <= horizon[0]) & (high > low), -1).astype(low.dtype)
