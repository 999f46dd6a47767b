"""Integrate: over one coordinate, splitting where the field breaks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.numerics.quadrature import cuts, panels
from firstorder.typing import Array, ComplexScalar, Frequency, Ray, Scalar, as_float


class Integrate(Law):
    """`h(u') = int_lower^upper f(u) du_axis`, where u' are the coordinates that are left.

    Jet: interior and boundary terms, both from this one place. The edges of f cut the interval into
    panels. With the boundaries `b(u')` (edges and ends) and `J` = f just below minus f just above
    b along the axis (nothing below the lower end, nothing above the upper one),
    `h_i = int f_i + sum J b_i`,
    `h_ij = int f_ij + sum (J b_ij + J_i b_j + J_j b_i + J_axis b_i b_j)` (R07 eq. 3 where there
    is no boundary).
    Spectrum: the slice `Omega_axis = 0`. Covariance: the Schur complement, exact for Gaussians.
    Wavelet: the coefficients with the constant along the axis, `H_i = sqrt(length) F_i0`.

    Valid when the field is negligible outside the interval, for spectrum and covariance; wrong, and
    refused, where an end moves. Any number of edges may cross or coincide; a curved one may meet
    the interval once.

    Args:
        axis: name of the coordinate.
        lower: lower end: a number, or a field over all coordinates that ignores `axis`.
        upper: upper end, likewise. Below `lower` the integral is negative.
        nodes: Gauss-Legendre nodes per smooth piece.
        breaks: where else to cut, as fields over all coordinates that ignore `axis`: at narrow
            peaks, and where the field bends but does not jump. Those outside the interval do
            nothing.

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
    breaks: tuple[Field, ...] = ()

    def __init__(self, axis: str, lower, upper, nodes: int = 64, breaks: tuple[Field, ...] = ()):
        """Store the interval; see the class."""
        self.axis = axis
        self.lower = lower if isinstance(lower, Field) else as_float(lower)
        self.upper = upper if isinstance(upper, Field) else as_float(upper)
        self.nodes, self.breaks = nodes, breaks
        if nodes < 1:
            raise ValueError(f"Argument `nodes` must be positive, but is {nodes}.")

    def frame(self, frame: Frame) -> Frame:
        """One coordinate fewer."""
        return frame.without(self.axis)

    @property
    def _ends_move(self) -> bool:
        return isinstance(self.lower, Field) or isinstance(self.upper, Field)

    def _refuse_moving_ends(self) -> None:
        if self._ends_move:
            raise Refused("ends that move cut the light: multiply by their mask, then integrate")

    def _line(self, f: Field, u: Ray) -> tuple[int, Callable, list[Jet]]:
        """The line of integration through `u`: axis, parametrisation, boundaries as jets.

        First the lower end, then the edges in the order of `f.edges()` and the breaks, last the
        upper end.
        """
        a = f.frame.axis(self.axis)
        rest = np.array([i for i in range(f.frame.dims) if i != a], dtype=int)

        def along(t):
            return jnp.zeros(f.frame.dims, u.dtype).at[rest].set(u).at[a].set(t)

        origin = along(jnp.zeros((), u.dtype))
        fixed = Constant(0.0, f.frame)
        lower, upper = (
            end.jet(origin)
            if isinstance(end, Field)
            else eqx.tree_at(lambda j: j.value, fixed.jet(origin), end.astype(u.dtype))
            for end in (self.lower, self.upper)
        )
        crossings = [e.crossing(origin, a, lower.value, upper.value) for e in f.edges()]
        others = [_within(b.jet(origin), lower.value, upper.value) for b in self.breaks]
        boundaries = [lower, *crossings, *others, upper]
        return a, along, jax.tree.map(lambda leaf: leaf.astype(u.dtype), boundaries)

    def value(self, f: Field, u: Ray) -> Scalar:
        """Gauss-Legendre on each piece between edges."""
        _, along, (lower, *inner, upper) = self._line(f, u)
        t, w = panels(lower.value, upper.value, [b.value for b in inner], self.nodes)
        return jnp.sum(w * jax.vmap(lambda s: f.at(along(s)))(t))

    def jet(self, f: Field, u: Ray) -> Jet:
        """Interior terms by quadrature of the jets, boundary terms in closed form."""
        a, along, (lower, *inner, upper) = self._line(f, u)
        t, w = panels(lower.value, upper.value, [b.value for b in inner], self.nodes)
        ends, order = cuts(lower.value, upper.value, [b.value for b in inner])
        hair = jnp.sqrt(jnp.finfo(u.dtype).eps) * (ends[1:] - ends[:-1])
        inside = jnp.concatenate([ends[:-1] + hair, ends[1:] - hair])
        if not inner and not self._ends_move:  # nothing moves
            inside, hair = inside[:0], hair[:0]
        jets = jax.vmap(lambda s: f.jet(along(s)))(t)
        total = jax.tree.map(lambda leaf: jnp.tensordot(w, leaf, axes=(0, 0)), jets)
        if inside.size:
            # One-sided limits at both ends of each panel, from just inside it (never from the break
            # itself, where rounding would decide on which side it lies), by Taylor's formula.
            # Apart from the nodes', so that who asks for no Hessian pays for none at the nodes.
            near = jax.vmap(lambda s: f.jet(along(s)))(inside)
            limits = jax.vmap(partial(_transported, a))(near, jnp.concatenate([-hair, hair]))
            curves = jax.tree.map(lambda *leaves: jnp.stack(leaves)[order], lower, *inner, upper)
            moved = jax.tree.map(lambda leaf: jnp.concatenate([leaf[:-1], leaf[1:]]), curves)
            sign = jnp.repeat(jnp.array([-1.0, 1.0], u.dtype), hair.size)
            terms = jax.vmap(partial(_boundary, a))(moved, limits)
            total = total + jax.tree.map(lambda leaf: jnp.tensordot(sign, leaf, (0, 0)), terms)
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
        level = e.level
        if not isinstance(level, Affine) or isinstance(level.normal, Tracer):
            found.append(Edge(level, _Along(e.jump, level, a)))
        elif level.normal[a] == 0:
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


def _within(b: Jet, lower: Array, upper: Array) -> Jet:
    """A break as a boundary; one outside the interval stands still at its upper end."""
    inside = (b.value > jnp.minimum(lower, upper)) & (b.value < jnp.maximum(lower, upper))
    still = jax.tree.map(jnp.zeros_like, b)
    still = eqx.tree_at(lambda j: j.value, still, jnp.asarray(upper, b.value.dtype))
    return jax.tree.map(lambda x, y: jnp.where(inside, x, y), b, still)


def _transported(a: int, jet: Jet, d: Array) -> Jet:
    """The jet a small step d further along axis a, by Taylor's formula."""
    slope, bend = jet.gradient[a], jet.hessian[a, a]
    value = jet.value + d * slope + 0.5 * d**2 * bend
    return Jet(value, jet.gradient + d * jet.hessian[a], jet.hessian, jet.frame)


def _boundary(a: int, b: Jet, f: Jet) -> Jet:
    """What `int^b f` owes to its moving end, for all i, j but a.

    `(0, f b_i, f b_ij + f_i b_j + f_j b_i + f_a b_i b_j)`.
    """
    cross = f.gradient[:, None] * b.gradient
    hessian = f.value * b.hessian + cross + cross.T
    hessian = hessian + f.gradient[a] * b.gradient[:, None] * b.gradient
    return Jet(jnp.zeros_like(f.value), f.value * b.gradient, hessian, f.frame)
