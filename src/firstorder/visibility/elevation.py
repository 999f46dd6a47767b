"""Polar angles of shadow edges in vertical slices, and their derivatives when the receiver moves.

Everything stands in the receiver's frame: it is at the origin, its normal is +z. A slice at azimuth
phi is the plane of z and `e_rho = (cos phi, sin phi, 0)`; in it a ray at polar angle theta points
along `w = sin(theta) e_rho + cos(theta) z`. Where a ray just touches a blocker, theta is the edge
angle alpha. R07 section 7 writes u for e_rho, v for `e_phi = (-sin phi, cos phi, 0)` and c for
`e_theta = cos(alpha) e_rho - sin(alpha) z`; so do we.

Angles may be negative: then the ray lies at azimuth phi + pi, and the slice is half of a great
circle, over the pole. Unlike flatland's, the angle grows *towards* e_rho, so that moving along it
lowers alpha.

The first derivative asks for the tangent plane at the touched point, and for nothing else of the
blocker; the second one for its curvature there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_coordinates, check_finite, nan_unless
from firstorder._display import Module
from firstorder.conventions import azimuth_axes, cylindrical
from firstorder.typing import as_float

# A vector as an array (vectors on the last axis, any axes before it) or as a tuple.
Points: TypeAlias = ArrayLike | Sequence


class Elevation(Module):
    """Edge angles in vertical slices, with their derivatives when the receiver moves.

    Attributes:
        value: alpha, polar angle from the normal; negative beyond the pole [rad].
        alpha_u: derivative for a step along e_rho [rad/m].
        alpha_v: derivative for a step along e_phi [rad/m].
        distance: D, to the touched point [m].
        phi: azimuth of the slice [rad].

    Reference: R07 §7, eqs. 39-41.
    """

    value: Float[Array, "*b"]
    alpha_u: Float[Array, "*b"]
    alpha_v: Float[Array, "*b"]
    distance: Float[Array, "*b"]
    phi: Float[Array, "*b"]

    @property
    def alpha_x(self) -> Float[Array, "*b"]:
        """Derivative for a step along x: `alpha_u cos(phi) - alpha_v sin(phi)` (R07 eq. 41)."""
        return self.alpha_u * jnp.cos(self.phi) - self.alpha_v * jnp.sin(self.phi)

    @property
    def alpha_y(self) -> Float[Array, "*b"]:
        """Derivative for a step along y: `alpha_u sin(phi) + alpha_v cos(phi)`."""
        return self.alpha_u * jnp.sin(self.phi) + self.alpha_v * jnp.cos(self.phi)

    @property
    def gradient(self) -> Float[Array, "*b 2"]:
        """(alpha_x, alpha_y)."""
        return jnp.stack([self.alpha_x, self.alpha_y], -1)


def contour_elevation(
    point: Points, normal: Points, phi: ArrayLike | None = None, S: Points | None = None
) -> Elevation:
    """The edge angle of a smooth blocker, from the point that the ray touches and its normal there.

        alpha_u = -cos(alpha) / D,    alpha_v = -(v . n) / (D c . n)

    On a receiver with shape operator S its frame turns with it, and a step m moves the blocker by
    `-(m + omega x p)`, `omega = z x (-S m)`, in place of -m.

    Valid when: the ray is tangent there, `w . n = 0` (not checked), and crosses the silhouette:
    `c . n != 0`. Where the slice only grazes the blocker alpha_v goes as the inverse square root
    of the azimuth that is left (R07 footnote 4), and is infinite there: NaN.

    Args:
        point: p, the touched point in the receiver's frame [m].
        normal: n, the blocker's normal there, of either sign and any length.
        phi: azimuth of the slice, which must hold the point; left out, that of the point, so that
            alpha is not negative [rad].
        S: shape operator of the receiver (2, 2); left out, it is flat [1/m].

    Raises:
        ValueError: if a number is not finite.

    Reference: R07 §7.1, eqs. 42-46.

    Example:
        >>> from firstorder.visibility import contour_elevation
        >>> found = contour_elevation((1.0, 0.0, 1.0), (0.6, 0.5291502622129182, -0.6))
        >>> print(round(float(found.value), 4), round(float(found.alpha_u), 4))
        0.7854 -0.5
        >>> round(float(found.alpha_v), 4)
        -0.4410
    """
    check_finite("normal", normal)
    slice_ = _slice(point, phi)
    p, (u, v, _, c), D = slice_.p, slice_.axes, slice_.D
    n = as_float(normal)
    steep = _dot(c, n)
    ok = slice_.there & (steep != 0.0)
    steep = jnp.where(ok, steep, 1.0)
    rates = [-_dot(_moved(m, p, S), n) / (D * steep) for m in (u, v)]
    return _elevation(slice_, ok, rates)


def crease_elevation(
    point: Points, tangent: Points, phi: ArrayLike | None = None, S: Points | None = None
) -> Elevation:
    """The edge angle of an edge in space, straight or bent, from where the slice meets it.

        alpha_u = -cos(alpha) / D,    alpha_v = (k . c) / (D k . v)

    With k any tangent of the silhouette on a smooth blocker this is the same number as
    `contour_elevation`: k and w span its tangent plane.

    Valid when: the edge crosses the slice, `k . v != 0`; otherwise NaN.

    Args:
        point: p, where the slice meets the edge, in the receiver's frame [m].
        tangent: k, along the edge, of either sign and any length.
        phi: azimuth of the slice, a number or an array; left out, that of the point [rad].
        S: shape operator of the receiver (2, 2); left out, it is flat [1/m].

    Raises:
        ValueError: if a number is not finite.

    Reference: R07 App. D, eq. 72.

    Example:
        >>> from firstorder.visibility import crease_elevation
        >>> found = crease_elevation((1.0, 0.0, 1.0), (0.0, 1.0, 0.0))  # a beam across
        >>> print(round(float(found.alpha_u), 4), round(float(found.alpha_v), 4))
        -0.5 0.0
    """
    check_finite("tangent", tangent)
    slice_ = _slice(point, phi)
    p, (u, v, _, c), D = slice_.p, slice_.axes, slice_.D
    k = as_float(tangent)
    across = _dot(k, v)
    ok = slice_.there & (across != 0.0)
    across = jnp.where(ok, across, 1.0)

    def rate(m):
        step = _moved(m, p, S)
        return (_dot(k, c) * _dot(step, v) / across - _dot(step, c)) / D

    return _elevation(slice_, ok, [rate(u), rate(v)])


def contour_elevation_hessian(
    point: Points, normal: Points, curvature: Points, phi: ArrayLike | None = None
) -> Float[Array, "*b 2 2"]:
    """Second derivatives of the edge angle of a smooth blocker in x and y.

    With H = dn/dp the derivative of the unit normal (3, 3), `q_i = m_i + alpha_i D c` the way of
    the touched point but for its slide along the ray, and `s_i = w . H q_i + (n . c) alpha_i`,

        alpha_ij = -(q_i . H q_j - s_i s_j / (w . H w)) / (D c . n)

    Valid when: the receiver is flat, and the blocker bends along the ray, `w . H w != 0`.

    Args:
        point: the touched point in the receiver's frame [m].
        normal: unit normal there.
        curvature: H; `(I - n n^T) / R` on a sphere of radius R about which n points out [1/m].
        phi: azimuth of the slice, a number or an array; left out, that of the point [rad].

    Returns:
        [[alpha_xx, alpha_xy], [alpha_xy, alpha_yy]] [rad/m^2].

    Raises:
        ValueError: if a number is not finite.

    Reference: ours; R07 §7.1 stops at the first derivative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import contour_elevation_hessian
        >>> n = jnp.array([-1.0, 0.0, 0.0])  # a ball at (1, 0, 2) of radius 1, overhead to one side
        >>> H = jnp.eye(3) - jnp.outer(n, n)
        >>> print(contour_elevation_hessian((0.0, 0.0, 2.0), n, H, phi=0.0).round(4))
        [[-0.125  0.   ]
         [ 0.     0.5  ]]
    """
    check_finite("curvature", curvature)
    n, H = as_float(normal), as_float(curvature)
    first = contour_elevation(point, normal, phi)
    slice_ = _slice(point, phi)
    (_, _, w, c), D = slice_.axes, slice_.D
    rates = jnp.nan_to_num(first.gradient)
    steep, along = _dot(c, n), _dot(w, _apply(H, w))
    ok = slice_.there & (steep != 0.0) & (along != 0.0)
    steep, along = jnp.where(ok, steep, 1.0), jnp.where(ok, along, 1.0)
    q = [m + (D * rates[..., i])[..., None] * c for i, m in enumerate(_steps(w))]
    s = [_dot(w, _apply(H, q[i])) + steep * rates[..., i] for i in (0, 1)]
    entries = [
        [-(_dot(q[i], _apply(H, q[j])) - s[i] * s[j] / along) / (D * steep) for j in (0, 1)]
        for i in (0, 1)
    ]
    return nan_unless(ok[..., None, None], _matrix(entries))


def crease_elevation_hessian(
    point: Points,
    tangent: Points,
    curvature: Points = (0.0, 0.0, 0.0),
    phi: ArrayLike | None = None,
) -> Float[Array, "*b 2 2"]:
    """Second derivatives of the edge angle of an edge in space in x and y.

    With K the edge's curvature vector, `t_i = (v . m_i) / (k . v)` the way of the touched point
    along it and `r_i = k t_i - m_i` its way as the receiver sees it,

        alpha_ij = c . (K - k (v . K) / (k . v)) t_i t_j / D - ((w . r_i)(c . r_j)
                   + (w . r_j)(c . r_i)) / D^2

    Valid when: the receiver is flat and `k . v != 0`. The silhouette of a smooth blocker is not
    such an edge: it moves with the receiver, and `contour_elevation_hessian` knows how.

    Args:
        point: where the slice meets the edge, in the receiver's frame [m].
        tangent: k, its unit tangent.
        curvature: K, zero for a straight edge [1/m].
        phi: azimuth of the slice, a number or an array; left out, that of the point [rad].

    Returns:
        [[alpha_xx, alpha_xy], [alpha_xy, alpha_yy]] [rad/m^2].

    Raises:
        ValueError: if a number is not finite.

    Reference: ours; R07 App. D stops at the first derivative.

    Example:
        >>> from firstorder.visibility import crease_elevation_hessian
        >>> print(crease_elevation_hessian((1.0, 0.0, 1.0), (0.0, 1.0, 0.0)).round(4))
        [[-0.5  0. ]
         [ 0.   0. ]]
    """
    check_finite("curvature", curvature)
    slice_ = _slice(point, phi)
    (_, v, w, c), D = slice_.axes, slice_.D
    k, K = as_float(tangent), as_float(curvature)
    across = _dot(k, v)
    ok = slice_.there & (across != 0.0)
    across = jnp.where(ok, across, 1.0)
    steps = _steps(w)
    t = [_dot(v, m) / across for m in steps]
    r = [k * t[i][..., None] - steps[i] for i in (0, 1)]
    bend = _dot(c, K - k * (_dot(v, K) / across)[..., None])
    entries = [
        [
            bend * t[i] * t[j] / D
            - (_dot(w, r[i]) * _dot(c, r[j]) + _dot(w, r[j]) * _dot(c, r[i])) / D**2
            for j in (0, 1)
        ]
        for i in (0, 1)
    ]
    return nan_unless(ok[..., None, None], _matrix(entries))


# --- small change --------------------------------------------------------------------------------


class _Slice(Module):
    """A point of a vertical slice, the slice's axes u, v, w, c at it, and whether D > 0."""

    p: Array
    value: Array
    phi: Array
    axes: tuple[Array, Array, Array, Array]
    D: Array
    there: Array


def _slice(point: Points, phi: ArrayLike | None) -> _Slice:
    check_finite("point", point)
    if phi is not None:
        check_finite("phi", phi)
    p = as_float(point)
    check_coordinates("point", p)
    flat2 = p[..., 0] ** 2 + p[..., 1] ** 2
    D2 = flat2 + p[..., 2] ** 2
    there = D2 > 0.0
    D = jnp.sqrt(jnp.where(there, D2, 1.0))
    if phi is None:
        beside = flat2 > 0.0  # over the pole any slice will do
        y, x = jnp.where(beside, p[..., 1], 0.0), jnp.where(beside, p[..., 0], 1.0)
        phi = jnp.arctan2(y, x)
    phi = jnp.broadcast_to(as_float(phi), D.shape).astype(D.dtype)
    u, v = azimuth_axes(phi)
    rho = u[..., 0] * p[..., 0] + u[..., 1] * p[..., 1]
    s, z = jnp.where(there, rho, 0.0) / D, jnp.where(there, p[..., 2], 1.0) / D
    w, c = cylindrical(s, phi, z), cylindrical(z, phi, -s)
    return _Slice(p, jnp.arctan2(s, z), phi, (u, v, w, c), D, there)


def _elevation(slice_: _Slice, ok: Array, rates: list[Array]) -> Elevation:
    value, D = nan_unless(slice_.there, slice_.value), nan_unless(slice_.there, slice_.D)
    return Elevation(value, *(nan_unless(ok, r) for r in rates), D, slice_.phi)


def _moved(m: Array, p: Array, S: Points | None) -> Array:
    """Way of the receiver against the point p, in the receiver's own frame, for a step m."""
    if S is None:
        return m
    tilt = -_apply(as_float(S), m[..., :2])
    # omega = z x (tilt, 0) = (-tilt_y, tilt_x, 0), the frame's turn for this step.
    turn = jnp.stack([-tilt[..., 1], tilt[..., 0], jnp.zeros_like(tilt[..., 0])], -1)
    return m + jnp.cross(turn, p)


def _steps(like: Array) -> list[Array]:
    """Unit steps along x and y."""
    return [jnp.broadcast_to(jnp.eye(3, dtype=like.dtype)[i], like.shape) for i in (0, 1)]


def _dot(a: Array, b: Array) -> Array:
    return jnp.sum(a * b, -1)


def _apply(M: Array, a: Array) -> Array:
    return sum((M[..., k] * a[..., k, None] for k in range(a.shape[-1])), jnp.zeros_like(a))


def _matrix(rows: list[list[Array]]) -> Array:
    return jnp.stack([jnp.stack(row, -1) for row in rows], -2)
