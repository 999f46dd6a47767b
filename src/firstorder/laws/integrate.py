"""Integrate: over one coordinate, splitting where the field breaks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_finite, check_integer
from firstorder.conventions import POSITIONS, SLOPES, TIMES, Frame
from firstorder.errors import Refused
from firstorder.fields._coerce import as_field
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws._edges import surviving_edges
from firstorder.laws._one_sided import inherited_edges
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.numerics._quadrature import composite_gauss_legendre, sorted_breaks
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
        lower: lower end: a number, or a field over all coordinates that ignores `axis`, or a plain
            function of them.
        upper: upper end, likewise. Below `lower` the integral is negative.
        nodes: Gauss-Legendre nodes per smooth piece. The integral's `with_error` (`Field`) says
            what they are worth; ends that cut light off are part of the question.
        breaks: where else to cut, as fields over all coordinates that ignore `axis`: at narrow
            peaks, and where the field bends but does not jump. Those outside the interval do
            nothing.

    Raises:
        ValueError: if `nodes` is not positive.
        TypeError: if an end is neither a number nor a field.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Integrate
        >>> E = Integrate("theta", -9.0, 9.0, 64)(gaussian((0.0, 0.0), (1.0, 1.0)))
        >>> round(E(0.0).item(), 12)  # sqrt(2 pi)
        2.506628274631
    """

    REFINED: ClassVar = ("nodes",)

    axis: str = eqx.field(static=True)
    lower: Array | Field
    upper: Array | Field
    nodes: int = eqx.field(static=True, default=64)
    breaks: tuple[Field, ...] = ()

    def __init__(self, axis: str, lower, upper, nodes: int = 64, breaks: tuple[Field, ...] = ()):
        """Store the interval; see the class."""
        self.axis = axis
        self.lower, self.upper = _end("lower", lower), _end("upper", upper)
        self.nodes, self.breaks = nodes, breaks
        check_integer("nodes", nodes)
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
        crossings = _crossings(f.edges(), origin, a, lower.value, upper.value)
        others = [_within(b.jet(origin), lower.value, upper.value) for b in self.breaks]
        boundaries = [lower, *crossings, *others, upper]
        # In one frame: a pattern may be labelled by the sense that the light had before.
        parts = ((b.value, b.gradient, b.hessian) for b in boundaries)
        return a, along, [Jet(*(p.astype(u.dtype) for p in own), f.frame) for own in parts]

    def value(self, f: Field, u: Ray) -> Scalar:
        """Gauss-Legendre on each piece between edges."""
        _, along, (lower, *inner, upper) = self._line(f, u)
        t, w = composite_gauss_legendre(
            lower.value, upper.value, [b.value for b in inner], self.nodes
        )
        return jnp.sum(w * jax.vmap(lambda s: f.at(along(s)))(t))

    def jet(self, f: Field, u: Ray) -> Jet:
        """Interior terms by quadrature of the jets, boundary terms in closed form."""
        a, along, (lower, *inner, upper) = self._line(f, u)
        t, w = composite_gauss_legendre(
            lower.value, upper.value, [b.value for b in inner], self.nodes
        )
        ends, order = sorted_breaks(lower.value, upper.value, [b.value for b in inner])
        curves = jax.tree.map(lambda *leaves: jnp.stack(leaves)[order], lower, *inner, upper)
        epsilon = _epsilons(ends, curves.gradient, along, f.frame, a)
        inside = jnp.concatenate([ends[:-1] + epsilon[0], ends[1:] - epsilon[1]])
        if not inner and not self._ends_move:  # nothing moves
            inside = inside[:0]
        jets = jax.vmap(lambda s: f.jet(along(s)))(t)
        total = jax.tree.map(lambda leaf: jnp.tensordot(w, leaf, axes=(0, 0)), jets)
        if inside.size:
            # One-sided limits at both ends of each panel, from just inside it (never from the break
            # itself, where rounding would decide on which side it lies), by Taylor's formula.
            # Apart from the nodes', so that who asks for no Hessian pays for none at the nodes.
            near = jax.vmap(lambda s: f.jet(along(s)))(inside)
            to_limit = jnp.concatenate([-epsilon[0], epsilon[1]])
            limits = jax.vmap(partial(_transported, a))(near, to_limit)
            moved = jax.tree.map(lambda leaf: jnp.concatenate([leaf[:-1], leaf[1:]]), curves)
            sign = jnp.repeat(jnp.array([-1.0, 1.0], u.dtype), epsilon[0].size)
            terms = jax.vmap(partial(_boundary, a))(moved, limits)
            total = total + jax.tree.map(lambda leaf: jnp.tensordot(sign, leaf, (0, 0)), terms)
        keep = np.array([i for i in range(f.frame.dims) if i != a], dtype=int)
        hessian = total.hessian[keep][:, keep]
        return Jet(total.value, total.gradient[keep], hessian, self.frame(f.frame))

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges that run along the axis survive, their jump integrated; others are smoothed away.

        So do those of an end that jumps. Where an edge enters or leaves the interval the result has
        a kink, and no jump.
        """
        a = f.frame.axis(self.axis)
        rest = np.delete(np.eye(f.frame.dims), a, axis=1)
        restrict = Move(rest, to=self.frame(f.frame))
        of_light = tuple(
            Edge(restrict.level(e.level), self(e.jump)) for e in surviving_edges(f.edges(), a)
        )
        ends = {"lower": self.lower, "upper": self.upper}

        def cut(name: str, smooth: Field) -> Field:
            others = ends | {name: smooth}
            return Integrate(self.axis, nodes=self.nodes, breaks=self.breaks, **others)(f)

        of_ends = tuple(
            Edge(restrict.level(e.level), e.jump)
            for name, end in ends.items()
            if isinstance(end, Field)
            for e in inherited_edges(end, partial(cut, name))
        )
        return of_light + of_ends

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """The slice through zero frequency of the axis (R07 Fig. 2)."""
        self._refuse_moving_ends()
        a = F.frame.axis(self.axis)
        return F.at(jnp.insert(Omega, a, 0.0))

    def extent(self, extent: Extent, frame: Frame) -> Extent | None:
        """The operand's, without the coordinate that is gone."""
        keep = np.array([i for i in range(frame.dims) if i != frame.axis(self.axis)], dtype=int)
        spread = extent.spread[:, keep][:, :, keep]
        return Extent(extent.center[:, keep], spread, extent.sides[:, :, keep])

    def covariance(self, S: Covariance) -> Covariance:
        """Conditioning a Gaussian on `Omega_axis = 0`: the Schur complement."""
        self._refuse_moving_ends()
        a = S.frame.axis(self.axis)
        keep = np.array([i for i in range(S.frame.dims) if i != a], dtype=int)
        column = S.matrix[keep, a]
        # Light that is the same all along the axis has no energy there to take away.
        own = jnp.where(S.matrix[a, a] == 0, 1.0, S.matrix[a, a])
        matrix = S.matrix[keep][:, keep] - jnp.outer(column, column) / own
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


def _end(name: str, end) -> Array | Field:
    """An end of the interval: a field that moves it, or a number."""
    if callable(end):  # as a field is
        return as_field(end, name)
    try:
        number = as_float(end)
    except (TypeError, ValueError):
        raise TypeError(f"Argument `{name}` must be a number or a field, but is {end!r}.") from None
    check_finite(name, number)
    return number


def _crossings(
    edges: tuple[Edge, ...], origin: Ray, a: int, lower: Array, upper: Array
) -> list[Jet]:
    """Crossings of the edges in their order; levels of one make are solved side by side.

    A scene has dozens of edges and few kinds of level: the program grows with the kinds.
    """
    kinds: dict[Any, list[int]] = {}
    for i, e in enumerate(edges):
        kinds.setdefault(_make(e.level, i), []).append(i)
    found = {}
    for which in kinds.values():
        levels = [edges[i].level for i in which]
        if len(which) == 1:
            found[which[0]] = edges[which[0]].crossing(origin, a, lower, upper)
            continue
        leaves = [jax.tree.leaves(level) for level in levels]
        rows = zip(*leaves, strict=True)
        # What all share (a law's matrix) is not copied.
        shared = [all(leaf is row[0] for leaf in row) for row in rows]
        axes = [None if s else 0 for s in shared]
        packed = [
            row[0] if s else jnp.stack(row)
            for s, row in zip(shared, zip(*leaves, strict=True), strict=True)
        ]
        form, jump = jax.tree.structure(levels[0]), edges[which[0]].jump

        def solve(*packed, form=form, jump=jump):
            level = jax.tree.unflatten(form, packed)
            return Edge(level, jump).crossing(origin, a, lower, upper)

        jets = jax.vmap(solve, in_axes=axes)(*packed) if not all(shared) else None
        for row, i in enumerate(which):
            found[i] = (
                solve(*packed) if jets is None else jax.tree.map(lambda leaf, r=row: leaf[r], jets)
            )
    return [found[i] for i in range(len(edges))]


def _make(level: Field, i: int) -> Any:
    """Key of a level: equal for levels that differ in numbers alone, its own for any other."""
    leaves, form = jax.tree.flatten(level)
    if not all(isinstance(leaf, jax.Array) for leaf in leaves):
        return i
    return form, tuple((leaf.shape, leaf.dtype) for leaf in leaves)


def _within(b: Jet, lower: Array, upper: Array) -> Jet:
    """A break as a boundary; one outside the interval stands still at its upper end."""
    inside = (b.value > jnp.minimum(lower, upper)) & (b.value < jnp.maximum(lower, upper))
    still = jax.tree.map(jnp.zeros_like, b)
    still = eqx.tree_at(lambda j: j.value, still, jnp.asarray(upper, b.value.dtype))
    return jax.tree.map(lambda x, y: jnp.where(inside, x, y), b, still)


def _epsilons(
    ends: Array, gradient: Array, along: Callable[[Array], Ray], frame: Frame, a: int
) -> tuple[Array, Array]:
    """Steps into each panel from its two ends, to where one-sided limits are looked at.

    No nearer to an edge than a field may tell its sides apart (`light_field`: eps^(3/4) in any
    direction). Along the axis an edge that runs nearly so is that much times its slope away. Among
    lengths and times, which have units, that share is of the interval. A slope v turns by
    `1 / (1 + v^2)` of its change.

    Args:
        ends: of the panels, one after another.
        gradient: of each end in the other coordinates.
        along: the ray at a place of the interval.
        frame: of the field.
        a: the axis of integration.
    """
    wide = ends[1:] - ends[:-1]
    eps = jnp.finfo(ends.dtype).eps
    turns = np.array([c not in POSITIONS + TIMES for c in frame.coordinates])
    slopes = np.array([c in SLOPES for c in frame.coordinates])
    rate = jnp.abs(gradient)
    if slopes.any():
        rate = rate * (1.0 + slopes * along(jnp.zeros((), ends.dtype)) ** 2)
    steep = jnp.sum(jnp.where(turns, rate, 0.0), -1)
    own = 1.0 if turns[a] else jnp.abs(ends[-1] - ends[0])
    own = 1.0 + ends**2 if slopes[a] else own
    apart = 16.0 * eps**0.75 * (own + jnp.where(jnp.isfinite(steep), steep, 0.0))
    least = (jnp.minimum(a, 0.25 * jnp.abs(wide)) for a in (apart[:-1], apart[1:]))
    low, high = (jnp.sign(wide) * jnp.maximum(eps**0.5 * jnp.abs(wide), a) for a in least)
    return low, high


def _transported(a: int, jet: Jet, d: Array) -> Jet:
    """The jet a small step d further along axis a, by Taylor's formula."""
    slope, bend = jet.gradient[a], jet.hessian[a, a]
    value = jet.value + d * slope + 0.5 * d**2 * bend
    return Jet(value, jet.gradient + d * jet.hessian[a], jet.hessian, jet.frame)


def _boundary(a: int, b: Jet, f: Jet) -> Jet:
    """Contribution of the moving end to the derivatives of `int^b f`, for all i, j but a.

    `(0, f b_i, f b_ij + f_i b_j + f_j b_i + f_a b_i b_j)`.
    """
    cross = f.gradient[:, None] * b.gradient
    hessian = f.value * b.hessian + cross + cross.T
    hessian = hessian + f.gradient[a] * b.gradient[:, None] * b.gradient
    return Jet(jnp.zeros_like(f.value), f.value * b.gradient, hessian, f.frame)
