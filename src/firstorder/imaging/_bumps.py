"""Bumps and normal maps in space: the shading normal of a surface (u, v), and how fast it turns.

A height h over a surface with normal n and shape operator S tilts the shading normal to
`n' ~ n - grad h` (Blinn 1978, without the heights' own shift). Along a tangent tau

    dn' = -(I - n' n'^T) ((S + Hess h) tau + (S tau . grad h) n) / sqrt(1 + |grad h|^2)

grad and Hess are the surface's own, the Hessian covariant: where the bumps are shallow the shape
operators add up, as the normals' angles do in flatland. `turning` is what
`firstorder.imaging._reflection` needs of a point.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_positive, check_shape
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields.spectrum import Grid
from firstorder.fields.spline import Spline
from firstorder.imaging._reflection import SurfacePoint
from firstorder.numerics._vectors import unit
from firstorder.typing import as_float

Direction = Float[Array, " 3"]
Place = Float[Array, " 2"]
Two = Float[Array, "2 2"]


class Chart(Module):
    """A parametrised surface at one place: position and derivatives in u and v.

    The frame is `t = X_u / |X_u|`, `n ~ X_u x X_v`, `b = n x t`, as normal maps have it.

    Attributes:
        position: X(u, v) [m].
        first: columns X_u, X_v.
        second: X_uu, X_uv, X_vv as `second[:, i, j]`.
    """

    position: Direction
    first: Float[Array, "3 2"]
    second: Float[Array, "3 2 2"]

    @property
    def axes(self) -> Float[Array, "3 3"]:
        """Columns t, b, n; no frame where the parametrisation is singular."""
        n = unit(jnp.cross(self.first[:, 0], self.first[:, 1]))
        t = unit(self.first[:, 0])
        return jnp.stack([t, jnp.cross(n, t), n], 1)

    @property
    def arc_D_uv(self) -> Two:
        """Arc lengths along t and b per u and v; upper triangular."""
        return self.axes[:, :2].T @ self.first

    @property
    def uv_D_arc(self) -> Two:
        """Inverse of `arc_D_uv`."""
        A = self.arc_D_uv
        zero = jnp.zeros_like(A[0, 0])
        rows = [A[1, 1], -A[0, 1]], [zero, A[0, 0]]
        return jnp.stack([jnp.stack(r) for r in rows]) / (A[0, 0] * A[1, 1])

    @property
    def S(self) -> Two:
        """Shape operator in t, b [1/m]: the second fundamental form per arc length."""
        return _per_arc(self.uv_D_arc, jnp.tensordot(self.axes[:, 2], self.second, 1))

    @property
    def twist(self) -> Place:
        """`b . dt` along t and b: how the frame turns about its normal [1/m]."""
        bent = self.axes[:, 1] @ self.second[:, 0, :] / jnp.linalg.norm(self.first[:, 0])
        return bent @ self.uv_D_arc

    def gradient(self, h_uv: Place) -> Place:
        """Surface gradient of a function along t and b from its derivatives in u and v."""
        return h_uv @ self.uv_D_arc

    def hessian(self, h_uv: Place, h_second: Two) -> Two:
        """Covariant Hessian in t, b: `h_ij` less the part that the chart's own bending makes."""
        g = self.axes[:, :2] @ self.gradient(h_uv)
        return _per_arc(self.uv_D_arc, h_second - jnp.tensordot(g, self.second, 1))

    def point(self) -> SurfacePoint:
        """Surface point without bumps."""
        axes = self.axes
        T = axes[:, :2]
        return SurfacePoint(self.position, T, axes[:, 2], -T @ self.S)


def chart(surface: Callable, uv: Place) -> Chart:
    """The chart of a parametrised surface at one place.

    Args:
        surface: jittable and twice differentiable, (u, v) to a position [m].
        uv: where; `X_u x X_v` must not vanish there, and points outward.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import chart
        >>> def ball(uv):
        ...     u, v = uv
        ...     return 2 * jnp.stack([jnp.cos(v) * jnp.cos(u), jnp.cos(v) * jnp.sin(u), jnp.sin(v)])
        >>> jnp.round(chart(ball, jnp.array([0.3, 0.4])).S, 6).tolist()
        [[-0.5, 0.0], [0.0, -0.5]]
    """
    first = jax.jacfwd(surface)
    return Chart(surface(uv), first(uv), jax.jacfwd(first)(uv))


# --- heights --------------------------------------------------------------------------------------


def bumped(at: Chart, height: Callable, uv: Place) -> SurfacePoint:
    """The shading point of a bump map: Blinn's normal `n - grad h`, in closed form.

    Positions stay on the base surface. Against the surface that is really displaced the normal is
    wrong by `h S grad h`, of first order in height times curvature (`displaced` has all of it).

    Args:
        at: chart of the base surface.
        height: h of (u, v) [m], jittable; or a field with a `jet`, which is then used.
        uv: the same place.

    Reference: Blinn 1978; R07 §4.2, in space.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import bumped, chart
        >>> place = jnp.array([0.25, 0.0])
        >>> floor = chart(lambda uv: jnp.append(uv, 0.0), place)
        >>> waves = bumped(floor, lambda uv: 0.1 * jnp.sin(2 * jnp.pi * uv[0]), place)
        >>> round(-waves.turning[0, 0].item(), 3)  # a crest, as in flatland
        -3.948
    """
    own = getattr(height, "jet", None)
    if own is not None:
        jet = own(uv)
        first, second = jet.gradient, jet.hessian
    else:
        first, second = jax.grad(height)(uv), jax.hessian(height)(uv)
    axes, S = at.axes, at.S
    T, n = axes[:, :2], axes[:, 2]
    g, H = at.gradient(first), at.hessian(first, second)
    return _tilted(at.position, T, n - T @ g, -T @ (S + H) - n[:, None] * (S @ g))


def solid_tilted(point: SurfacePoint, slopes: Callable) -> SurfacePoint:
    r"""The shading point of slopes a(x) given in space: the normal m leans to `m - P a`.

    `P = I - m m^T` takes the part of a that is tangent to the shading normal, and

        d(m - P a) = dm - P da + (m . a) dm + (dm . a) m

    With a the gradient of heights h(x) these are bumps whose heights are given in space, as a solid
    texture is: no chart is needed, and none can be singular. Any other a is a normal map in space.
    The point may be bumpy already, or have a mesh's interpolated normal.

    Args:
        point: with its shading normal and how that turns.
        slopes: a of a position, per metre of travel; jittable, differentiable.

    Reference: as `bumped`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import solid_tilted
        >>> from firstorder.imaging import surface_point
        >>> floor = surface_point(jnp.zeros(3), jnp.eye(3), jnp.zeros((2, 2)))
        >>> solid_tilted(floor, lambda x: jnp.array([-0.75, 0.0, 9.0])).normal.tolist()
        [0.6, 0.0, 0.8]
    """
    a, a_D = jax.jvp(slopes, (point.position,), (point.tangents[:, 0],))
    a_D = jnp.stack([a_D, jax.jvp(slopes, (point.position,), (point.tangents[:, 1],))[1]], 1)
    m, dm = point.normal, point.turning
    flat = m @ a
    turning = dm - a_D + m[:, None] * (m @ a_D) + flat * dm + m[:, None] * (a @ dm)
    return _tilted(point.position, point.tangents, m - a + m * flat, turning)


def displaced(surface: Callable, height: Callable, uv: Place) -> Chart:
    """The chart of the surface that is really displaced along its normals, `X + h n`.

    Its third derivatives of X are taken by automatic differentiation: a reference for `bumped`, and
    what to render where the heights are not small.

    Args:
        surface: (u, v) to a position [m].
        height: (u, v) to a height [m].
        uv: where.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import displaced
        >>> def floor(uv):
        ...     return jnp.append(uv, 0.0)
        >>> displaced(floor, lambda uv: 0.5 + 0.0 * uv[0], jnp.zeros(2)).position.tolist()
        [0.0, 0.0, 0.5]
    """

    def lifted(uv):
        first = jax.jacfwd(surface)(uv)
        normal = unit(jnp.cross(first[:, 0], first[:, 1]))
        return surface(uv) + height(uv) * normal

    return chart(lifted, uv)


# --- normal maps ----------------------------------------------------------------------------------


def normal_mapped(at: Chart, normals: Callable, uv: Place) -> SurfacePoint:
    """The shading point of a tangent-space normal map: `n' = m_1 t + m_2 b + m_3 n`.

    How n' turns has three parts: the map's own slope, the base's curvature, and the twist of the
    frame t, b about n, without which a map along bent coordinate lines is wrong.

    Args:
        at: chart of the base surface.
        normals: (u, v) to (m_1, m_2, m_3), of any length but zero; jittable, differentiable.
        uv: the same place.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import chart, normal_mapped
        >>> place = jnp.zeros(2)
        >>> floor = chart(lambda uv: jnp.append(uv, 0.0), place)
        >>> normal_mapped(floor, lambda uv: jnp.array([0.6, 0.0, 0.8]), place).normal.tolist()
        [0.6, 0.0, 0.8]
    """
    m, m_D_arc = normals(uv), jax.jacfwd(normals)(uv) @ at.uv_D_arc
    axes, S, twist = at.axes, at.S, at.twist
    T, n = axes[:, :2], axes[:, 2]
    # dt = twist b + S_t n, db = -twist t + S_b n, dn = -T S
    turned = jnp.stack([-m[1] * twist, m[0] * twist]) - m[2] * S
    turning = axes @ m_D_arc + T @ turned + n[:, None] * (m[:2] @ S)
    return _tilted(at.position, T, axes @ m, turning)


class NormalMap(Module):
    """A tangent-space normal map from pixels, smooth between them and repeating.

    A cubic spline through each channel, so that the normal's derivative is continuous; call it with
    (u, v) for the decoded vector (not of unit length between pixels; `normal_mapped` mends that).

    Args:
        channels: splines of the three components over (u, v).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import NormalMap
        >>> flat = jnp.full((4, 4, 3), 0.5).at[..., 2].set(1.0)
        >>> jnp.abs(NormalMap.of(flat)(jnp.array([0.3, 0.1]))).tolist()
        [0.0, 0.0, 1.0]
    """

    channels: tuple[Spline, Spline, Spline]

    @classmethod
    def of(cls, pixels, extent: tuple[float, float] = (1.0, 1.0)) -> NormalMap:
        """Normal map from an image: pixel `[i, j]` is the normal at the middle of cell (i, j).

        Args:
            pixels: colours in [0, 1], shape (n_u, n_v, 3); decoded as `2 c - 1`.
            extent: lengths of one repetition in u and v.

        Raises:
            ValueError: if the pixels are not such an image, fewer than 4 along an axis, not
                finite, or there are not two extents, both positive.
        """
        pixels = as_float(pixels)
        if pixels.ndim != 3 or pixels.shape[2] != 3:
            raise ValueError(
                f"Argument `pixels` must have shape (n_u, n_v, 3), but has {pixels.shape}."
            )
        check_finite("pixels", pixels)
        check_shape("extent", np.asarray(extent), (2,))
        check_positive("extent", np.asarray(extent))
        half = tuple(0.5 * e for e in extent)
        grid = Grid.spanning(pixels.shape[:2], half, half)
        frame = Frame(("x", "y"))
        red, green, blue = (
            Spline(2.0 * pixels[..., i] - 1.0, grid, frame, "periodic") for i in range(3)
        )
        return cls((red, green, blue))

    def __call__(self, uv: Place) -> Direction:
        """The decoded vector at (u, v)."""
        return jnp.stack([c.at(uv) for c in self.channels])


def shading_shape_operator(point: SurfacePoint) -> Two:
    """The effective shape operator of a point's shading normal, in the base's t, b [1/m].

    `-R^T dn` with R the columns t, b carried from the base's normal to the shading normal by the
    smallest rotation. Not symmetric in general: the shading normal is no normal of the surface on
    which positions lie.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._bumps import shading_shape_operator
        >>> from firstorder.imaging import surface_point
        >>> plain = surface_point(jnp.zeros(3), jnp.eye(3), jnp.array([[1.0, 0.2], [0.2, -0.5]]))
        >>> shading_shape_operator(plain).tolist()
        [[1.0, 0.2], [0.2, -0.5]]
    """
    n, m, T = point.base_normal, point.normal, point.tangents
    carried = T - (n + m)[:, None] * (m @ T) / (1.0 + jnp.dot(n, m))
    return -carried.T @ point.turning


# --- small tools ----------------------------------------------------------------------------------


def _per_arc(uv_D_arc: Two, form: Two) -> Two:
    """A bilinear form in u and v as one in t and b."""
    return uv_D_arc.T @ form @ uv_D_arc


def _tilted(position, tangents, normal, turning) -> SurfacePoint:
    """A shading point from a normal of any length and its derivatives."""
    length = jnp.sqrt(jnp.dot(normal, normal))
    n = normal / length
    turning = turning / length
    return SurfacePoint(position, tangents, n, turning - n[:, None] * (n @ turning))
