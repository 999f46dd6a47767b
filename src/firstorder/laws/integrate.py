"""Integrate: over one coordinate, splitting where the field breaks."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.quadrature import panels
from firstorder.typing import Array, ComplexScalar, Frequency, Ray, Scalar, as_float


class Integrate(Law):
    """`h(u') = int_lower^upper f(u) du_axis`, where u' are the coordinates that are left.

    Jet: interior and boundary terms, both from this one place. With the boundaries `b(u')` (the
    edges of f, and the ends) and `J` = f just below minus f just above b along the axis,
    `h_i = int f_i + sum J b_i`,
    `h_ij = int f_ij + sum (J b_ij + J_i b_j + J_j b_i + J_axis b_i b_j)` (R07 eq. 3 where there
    is no boundary).
    Spectrum: the slice `Omega_axis = 0`. Covariance: the Schur complement, exact for Gaussians.
    Wavelet: the coefficients with the constant along the axis, `H_i = sqrt(length) F_i0`.

    Valid when the field is negligible outside the interval, for spectrum and covariance; wrong, and
    refused, where an end moves. Edges may coincide two at a time (see `Multiply.edges`); a curved
    edge may meet the interval once.

    Args:
        axis: name of the coordinate.
        lower: lower end: a number, or a field over all coordinates that ignores `axis`.
        upper: upper end, likewise. Below `lower` the integral is negative.
        nodes: Gauss-Legendre nodes per smooth piece.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Integrate
        >>> E = Integrate("theta", -9.0, 9.0, 64)(gaussian((0.0, 0.0), (1.0, 1.0)))
        >>> round(E(0.0).item(), 12)  # sqrt(2 pi)
        2.506628274631
    """

    axis: str = eqx.field(static=True)
    lower: Array | Field
    upper: Array | Field
    nodes: int = eqx.field(static=True, default=64)

    def __init__(self, axis: str, lower, upper, nodes: int = 64):
        """Store the interval; see the class."""
        self.axis = axis
        self.lower = lower if isinstance(lower, Field) else as_float(lower)
        self.upper = upper if isinstance(upper, Field) else as_float(upper)
        self.nodes = nodes
        if nodes < 1:
            raise ValueError(f"Argument `nodes` must be positive, but is {nodes}.")

    def frame(self, frame: Frame) -> Frame:
        """One coordinate fewer."""
        return frame.without(self.axis)

    def _refuse_moving_ends(self) -> None:
        if isinstance(self.lower, Field) or isinstance(self.upper, Field):
            raise Refused("ends that move cut the light: multiply by their mask, then integrate")

    def _line(self, f: Field, u: Ray) -> tuple[int, Callable, Array, Array, list]:
        """The line of integration through `u`: axis, parametrisation, ends, edge crossings."""
        a = f.frame.axis(self.axis)
        rest = [i for i in range(f.frame.dims) if i != a]

        def along(t):
            return jnp.zeros(f.frame.dims, u.dtype).at[jnp.array(rest)].set(u).at[a].set(t)

        if not rest:
            along = lambda t: t[None]  # noqa: E731  a field of one coordinate has nothing else
        origin = along(jnp.zeros((), u.dtype))
        lower, upper = (
            end.at(origin) if isinstance(end, Field) else end.astype(u.dtype)
            for end in (self.lower, self.upper)
        )
        crossings = [(e, *e.crossing(origin, a, lower, upper)) for e in f.edges()]
        return a, along, lower, upper, crossings

    def value(self, f: Field, u: Ray) -> Scalar:
        """Gauss-Legendre on each piece between edges."""
        _, along, lower, upper, crossings = self._line(f, u)
        t, w = panels(lower, upper, [b.value for _, _, b in crossings], self.nodes)
        return jnp.sum(w * jax.vmap(lambda s: f.at(along(s)))(t))

    def jet(self, f: Field, u: Ray) -> Jet:
        """Interior terms by quadrature of the jets, boundary terms in closed form."""
        a, along, lower, upper, crossings = self._line(f, u)
        t, w = panels(lower, upper, [b.value for _, _, b in crossings], self.nodes)
        jets = jax.vmap(lambda s: f.jet(along(s)))(t)
        total = jax.tree.map(lambda leaf: jnp.tensordot(w, leaf, axes=(0, 0)), jets)
        forward = jnp.where(upper < lower, -1.0, 1.0)
        for edge, sign, b in crossings:
            jump = edge.jump.jet(along(b.value)).scaled(-forward * sign)
            total = total + _boundary(a, b, jump)
        for end, sign, at in ((self.lower, -1.0, lower), (self.upper, 1.0, upper)):
            if isinstance(end, Field):
                total = total + _boundary(a, end.jet(along(at)), f.jet(along(at)).scaled(sign))
        keep = np.array([i for i in range(f.frame.dims) if i != a], dtype=int)
        hessian = total.hessian[keep][:, keep]
        return Jet(total.value, total.gradient[keep], hessian, self.frame(f.frame))

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges that run along the axis survive, their jump integrated; others are smoothed away.

        Where an edge enters or leaves the interval the result has a kink, and no jump.
        """
        a = f.frame.axis(self.axis)
        rest = np.delete(np.eye(f.frame.dims), a, axis=1)
        restrict = Move(rest, to=self.frame(f.frame))
        return tuple(Edge(restrict.level(e.level), self(e.jump)) for e in surviving(f.edges(), a))

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """The slice through zero frequency of the axis (R07 Fig. 2)."""
        self._refuse_moving_ends()
        a = F.frame.axis(self.axis)
        return F.at(jnp.insert(Omega, a, 0.0))

    def covariance(self, S: Covariance) -> Covariance:
        """Conditioning a Gaussian on `Omega_axis = 0`: the Schur complement."""
        self._refuse_moving_ends()
        a = S.frame.axis(self.axis)
        keep = np.array([i for i in range(S.frame.dims) if i != a], dtype=int)
        column = S.matrix[keep, a]
        matrix = S.matrix[keep][:, keep] - jnp.outer(column, column) / S.matrix[a, a]
        return Covariance(matrix, self.frame(S.frame))

    def wavelet(self, W: Wavelet) -> Wavelet:
        """The coefficients constant along the axis; the printed factor 1 is for length 1."""
        self._refuse_moving_ends()
        a = W.frame.axis(self.axis)
        grid = W.grid
        keep = [i for i in range(len(grid.size)) if i != a]
        rest = type(grid)(*(tuple(p[i] for i in keep) for p in (grid.size, grid.step, grid.center)))
        H = jnp.take(W.coefficients, 0, axis=a) * jnp.sqrt(grid.extent[a])
        return Wavelet(H, rest, self.frame(W.frame))


def surviving(edges: tuple[Edge, ...], a: int) -> tuple[Edge, ...]:
    """The edges that do not change along axis a, hence outlive an integral over it.

    For a straight edge whose normal can be looked at that is a fact. For any other, the jump is
    put to zero wherever the level does change: such an edge is carried along in vain, but none is
    lost.
    """
    found = []
    for e in edges:
        known = isinstance(e.level, Affine) and not isinstance(e.level.normal, Tracer)
        if not known:
            found.append(Edge(e.level, _Along(e.jump, e.level, a)))
        elif e.level.normal[a] == 0:
            found.append(e)
    return tuple(found)


class _Along(Field):
    """A jump where the level does not change along axis a, zero elsewhere."""

    jump: Field
    level: Field
    a: int = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the jump."""
        return self.jump.frame

    def _here(self, u: Ray) -> Array:
        return self.level.jet(u).gradient[self.a] == 0

    def at(self, u: Ray) -> Scalar:
        """The jump, or zero."""
        return jnp.where(self._here(u), self.jump.at(u), 0.0)

    def jet(self, u: Ray) -> Jet:
        """Its jet, or zeros."""
        here = self._here(u)
        return jax.tree.map(lambda leaf: jnp.where(here, leaf, 0.0), self.jump.jet(u))

    def edges(self) -> tuple[Edge, ...]:
        """Those of the jump."""
        return self.jump.edges()


def _boundary(a: int, b: Jet, J: Jet) -> Jet:
    """`(0, J b_i, J b_ij + J_i b_j + J_j b_i + J_a b_i b_j)`, for all i, j but a."""
    cross = J.gradient[:, None] * b.gradient
    hessian = J.value * b.hessian + cross + cross.T
    hessian = hessian + J.gradient[a] * b.gradient[:, None] * b.gradient
    return Jet(jnp.zeros_like(J.value), J.value * b.gradient, hessian, J.frame)
