"""Integrate: over one coordinate, splitting where the field breaks."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws.base import Law
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

    Valid when the field is negligible outside the interval, for spectrum and covariance.

    Args:
        axis: name of the coordinate.
        lower: lower end: a number, or a field over all coordinates that ignores `axis`.
        upper: upper end, likewise.
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
        for edge, sign, b in crossings:
            total = total + _boundary(a, b, edge.jump.jet(along(b.value)).scaled(-sign))
        for end, sign, at in ((self.lower, -1.0, lower), (self.upper, 1.0, upper)):
            if isinstance(end, Field):
                total = total + _boundary(a, end.jet(along(at)), f.jet(along(at)).scaled(sign))
        keep = jnp.array([i for i in range(f.frame.dims) if i != a], dtype=int)
        hessian = total.hessian[keep][:, keep]
        return Jet(total.value, total.gradient[keep], hessian, self.frame(f.frame))

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges that cross the axis are smoothed away; one parallel to it would be lost: refuse.

        A parallel edge shows as a level that does not change along the axis.
        """
        a = f.frame.axis(self.axis)
        for e in f.edges():
            if runs_along(e, a):
                raise Refused("an edge parallel to the integral survives it: integrate each side")
        return ()

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """The slice through zero frequency of the axis (R07 Fig. 2)."""
        a = F.frame.axis(self.axis)
        return F.at(jnp.insert(Omega, a, 0.0))

    def covariance(self, S: Covariance) -> Covariance:
        """Conditioning a Gaussian on `Omega_axis = 0`: the Schur complement."""
        a = S.frame.axis(self.axis)
        keep = jnp.array([i for i in range(S.frame.dims) if i != a], dtype=int)
        column = S.matrix[keep, a]
        matrix = S.matrix[keep][:, keep] - jnp.outer(column, column) / S.matrix[a, a]
        return Covariance(matrix, self.frame(S.frame))

    def wavelet(self, W: Wavelet) -> Wavelet:
        """The coefficients constant along the axis; the printed factor 1 is for length 1."""
        a = W.frame.axis(self.axis)
        grid = W.grid
        keep = [i for i in range(len(grid.size)) if i != a]
        rest = type(grid)(*(tuple(p[i] for i in keep) for p in (grid.size, grid.step, grid.center)))
        H = jnp.take(W.coefficients, 0, axis=a) * jnp.sqrt(grid.extent[a])
        return Wavelet(H, rest, self.frame(W.frame))


def runs_along(edge: Edge, a: int) -> bool:
    """Whether a straight edge does not change along axis a (a concrete fact, or assumed not)."""
    level = edge.level
    if not isinstance(level, Affine) or isinstance(level.normal, Tracer):
        return False
    return bool(level.normal[a] == 0)


def _boundary(a: int, b: Jet, J: Jet) -> Jet:
    """`(0, J b_i, J b_ij + J_i b_j + J_j b_i + J_a b_i b_j)`, for all i, j but a."""
    cross = J.gradient[:, None] * b.gradient
    hessian = J.value * b.hessian + cross + cross.T
    hessian = hessian + J.gradient[a] * b.gradient[:, None] * b.gradient
    return Jet(jnp.zeros_like(J.value), J.value * b.gradient, hessian, J.frame)
