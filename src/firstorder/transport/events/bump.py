"""Bump and normal maps: a per-point rotation that is not linear in position."""

from __future__ import annotations

from functools import partial

import equinox as eqx
import jax.numpy as jnp

from firstorder.conventions import Frame, to_global, to_local
from firstorder.fields._coerce import field_or_fields
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet
from firstorder.laws._one_sided import inherited_edges, of_position, still
from firstorder.laws.base import Law
from firstorder.laws.warp import Map, Warp
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Ray


class Bump(Event):
    """Per-point rotation by any normal map n(x): `L_local(x, theta) = L(x, theta + n(x))`.

    Gradient and Hessian contain `n_x` and `n_xx`; the spectrum is refused, and passes through
    `bump.linearised(at)`, a curvature `n_x(at)` and a rotation, with a measured error. A base
    shape and a bump add up: `Bump(base + bumps)`. `back=True` undoes it. Where n jumps, at a
    crease, the light has an edge. Of two creases in one place the sum of the jumps is right to
    second order in their angles.

    Valid for shading normals: the positions are those of the base surface.

    Args:
        normal: n in radians as a field over the light's coordinates, its directions ignored, or a
            function of x, or a number; in space one such field per direction.
        back: from the local frame to the global one instead.

    Called: per-point rotation by a normal map (R07 §4.2).

    Reference: R07 eq. 21.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Bump, wave
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> bumps = wave(0.25, amplitude=0.2)  # n(x) = 0.2 cos(2 pi x / 4)
        >>> Bump(bumps)(L)(0.0, 0.1).item() == L(0.0, 0.1 + 0.2).item()
        True
    """

    normal: Field | tuple[Field, ...] = eqx.field(converter=field_or_fields("normal"))
    back: bool = eqx.field(static=True, default=False)

    def law(self, frame: Frame) -> Law:
        """The warp."""
        normals = self.normal if isinstance(self.normal, tuple) else (self.normal,)
        fits = len(frame.positions) == len(frame.directions) == len(normals)
        require_frame(fits and not frame.uses_slopes, self, frame, "angles, a normal map for each")
        return Warp(_Tilt(normals, frame, self.back))


class _Tilt(Map):
    """`(x, theta + n(x))`, or `(x, theta - n(x))` backwards."""

    normals: tuple[Field, ...]
    frame: Frame = eqx.field(static=True)
    back: bool = eqx.field(static=True)

    def _normals(self, u: Ray) -> list[Jet]:
        """Jets of the normals at the position of `u`, and at direction zero."""
        return [n.jet(u.at[jnp.array(self.frame.directions)].set(0.0)) for n in self.normals]

    def __call__(self, u: Ray) -> Ray:
        """The ray in the other frame."""
        turn = to_local if self.back else to_global
        for i, n in zip(self.frame.directions, self._normals(u), strict=True):
            u = u.at[i].set(turn(u[i], n.value))
        return u

    def derivatives(self, u: Ray):
        """`n_x` in the Jacobian, `n_xx` in the second derivatives: no directions, but time."""
        size, sign = u.size, to_local(0.0, 1.0) if self.back else to_global(0.0, 1.0)
        place = of_position(self.frame)
        J, second = jnp.eye(size, dtype=u.dtype), jnp.zeros((size,) * 3, u.dtype)
        for i, n in zip(self.frame.directions, self._normals(u), strict=True):
            J = J.at[i].add(sign * jnp.where(place, n.gradient, 0.0))
            second = second.at[i].set(sign * jnp.where(place & place[:, None], n.hessian, 0.0))
        return self(u), J, second

    def jumps(self, f: Field) -> tuple[Edge, ...]:
        """Creases: edges of the normals, across which the light is seen in another frame."""

        def turned(i: int, smooth: Field) -> Field:
            normals = (*self.normals[:i], smooth, *self.normals[i + 1 :])
            return Warp(_Tilt(normals, self.frame, self.back))(f)

        return tuple(
            Edge(still(e.level, self.frame), e.jump)
            for i, n in enumerate(self.normals)
            for e in inherited_edges(n, partial(turned, i))
        )
