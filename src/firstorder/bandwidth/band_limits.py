"""Band limits: where in frequency space the energy of a light field can be, at every step.

A band limit is a convex set about zero. A point of energy moves by `M^T` (`laws.move`), a product
adds the band of the factor, an integral keeps the slice `Omega_axis = 0`, and a convolution is a
product integrated: so a zonotope cut by slabs is closed under every linear law, in flatland and in
space alike, and its reach along any direction is a small linear program.

From these sets follow the sampling rates of D05 §6.2 for a curved glossy mirror (`curved_mirror`).
"""

from __future__ import annotations

import functools
import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_kind,
    check_not_negative,
    check_shape,
    nan_unless,
)
from firstorder._display import Module
from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields.environment import Environment, Harmonics
from firstorder.fields.field import Constant, Field, Sum
from firstorder.fields.gaussians import Gaussian
from firstorder.fields.kernel import GaussianProfile
from firstorder.fields.mask import HalfPlane
from firstorder.fields.sources import BoxProfile, DiracProfile, Separable, UniformProfile
from firstorder.laws.base import FieldImage, Law
from firstorder.laws.convolve import Circle, Convolve, Line
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.laws.warp import Warp
from firstorder.numerics._compiled import compiled
from firstorder.numerics._scale import power_of_two
from firstorder.transport.event import Path
from firstorder.transport.events.cosine import ClampedCosine
from firstorder.transport.events.texture import Wave
from firstorder.typing import RealLike, Scalar, Vector, as_float

LEVEL = 1e-3

# --- the set -----------------------------------------------------------------------------------


class BandLimit(Module):
    """All frequencies `sum_i g_i s_i` with `|s_i| <= bound_i` and `|rows s| <= limits`.

    A zonotope cut by slabs, symmetric about zero as the spectrum of real light is. It is closed
    under linear maps, sums and slices, in any dimension.

    Args:
        generators: one column g_i for each source of frequencies, in cycles per unit.
        bounds: how far each reaches; infinite for an edge, which has all frequencies.
        rows: one row for each slab, over the generators.
        limits: half-width of each slab, in cycles per unit.
        frame: names of the coordinates.

    Reference: D05 Figs. 6, 15 (there drawn as segments and parallelograms).

    Example:
        >>> from firstorder.bandwidth import BandLimit
        >>> environment = BandLimit.box((0.0, 3.0))  # no content in x
        >>> sheared = environment.moved([[1.0, 0.0], [0.5, 1.0]])  # L(x, theta + x / 2)
        >>> sheared.extent("x").item()
        1.5
    """

    generators: Float[Array, "n m"]
    bounds: Float[Array, " m"]
    rows: Float[Array, "q m"]
    limits: Float[Array, " q"]
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    @classmethod
    def box(cls, half_widths, frame: Frame = FLATLAND) -> BandLimit:
        """The box `|Omega_i| <= half_widths_i`; zero is allowed, and so is infinity.

        Raises:
            ValueError: if a half-width is negative, or there is not one for each coordinate.
        """
        widths = as_float(half_widths)
        check_shape("half_widths", widths, (frame.dims,))
        _check_half_widths("half_widths", widths)
        return cls.spanned(jnp.eye(frame.dims, dtype=widths.dtype), widths, frame)

    @classmethod
    def spanned(cls, generators, bounds, frame: Frame = FLATLAND) -> BandLimit:
        """The zonotope of the given columns: one column is a segment, two a parallelogram.

        Args:
            generators: columns, shape (n, k) [cycles per unit].
            bounds: how far each reaches to both sides, shape (k,).
            frame: names of the n coordinates.

        Raises:
            ValueError: if there is not one row for each coordinate and one bound for each column,
                or a bound is negative.

        Example:
            >>> from firstorder.bandwidth import BandLimit
            >>> segment = BandLimit.spanned([[1.0], [2.0]], [3.0])
            >>> segment.extent("x").item(), segment.extent("theta").item()
            (3.0, 6.0)
        """
        G, bounds = as_float(generators), as_float(bounds)
        check_shape("generators", G, (frame.dims, G.shape[-1] if G.ndim else 0))
        check_shape("bounds", bounds, G.shape[1:])
        _check_half_widths("bounds", bounds)
        return cls(G, bounds, jnp.zeros((0, G.shape[1]), G.dtype), jnp.zeros(0, G.dtype), frame)

    def moved(self, M, to: Frame | None = None) -> BandLimit:
        """Points of energy move by `M^T` under `f(M u + c)`; M may be a projection or a lift."""
        M = as_float(M)
        check_shape("M", M, (self.frame.dims, (to or self.frame).dims))
        generators = jnp.sum(M[:, :, None] * self.generators[:, None, :], axis=0)
        return BandLimit(generators, self.bounds, self.rows, self.limits, to or self.frame)

    def __add__(self, other: BandLimit) -> BandLimit:
        """All sums of frequencies: the band of a product.

        Raises:
            ValueError: if the other one has other coordinates.
        """
        if other.frame.coordinates != self.frame.coordinates:
            raise ValueError(
                f"Bands that are added must have the same coordinates, but have "
                f"{', '.join(self.frame.coordinates)} and {', '.join(other.frame.coordinates)}."
            )
        return BandLimit(
            jnp.concatenate([self.generators, other.generators], axis=1),
            jnp.concatenate([self.bounds, other.bounds]),
            _block(self.rows, other.rows),
            jnp.concatenate([self.limits, other.limits]),
            self.frame,
        )

    def cut(self, axis: str, limit: RealLike) -> BandLimit:
        """Remainder of the set where `|Omega_axis| <= limit`: an ideal filter."""
        check_not_negative("limit", limit)
        row = self.generators[self.frame.axis(axis)]
        rows = jnp.concatenate([self.rows, row[None]])
        limits = jnp.concatenate([self.limits, as_float(limit)[None].astype(self.limits.dtype)])
        return BandLimit(self.generators, self.bounds, rows, limits, self.frame)

    def sliced(self, axis: str) -> BandLimit:
        """The slice `Omega_axis = 0`, that axis gone: the band of an integral."""
        keep = np.arange(self.frame.dims) != self.frame.axis(axis)
        cut = self.cut(axis, 0.0)
        return BandLimit(
            cut.generators[keep], cut.bounds, cut.rows, cut.limits, self.frame.without(axis)
        )

    @compiled
    def reach(self, direction: RealLike) -> Scalar:
        """Largest `direction . Omega` in the set (its support function), in cycles per unit.

        The dual linear program, `min over y of sum_i bound_i |g_i . w - (rows^T y)_i| +
        limits . |y|`, is a weighted median: it is solved exactly by looking at every vertex, at
        which as many terms vanish as there are slabs. Any y is a bound, so a slab left out can
        only make the answer larger.
        """
        direction = as_float(direction)
        check_shape("direction", direction, (self.frame.dims,))
        q, m = self.rows.shape
        products = self.generators * direction[:, None]
        target, size = (
            jnp.pad(jnp.sum(terms, axis=0), (0, q)) for terms in (products, jnp.abs(products))
        )
        # Slabs across coordinates of other units would look parallel to a determinant.
        unit = power_of_two(self.rows) if m else jnp.ones_like(self.limits)
        weights = jnp.concatenate([self.bounds, self.limits / unit])
        A = jnp.concatenate([(self.rows / unit[:, None]).T, jnp.eye(q, dtype=target.dtype)])
        vertices = np.array(list(itertools.combinations(range(m + q), q)), dtype=int)
        return jnp.min(jax.vmap(lambda chosen: _dual(A, target, size, weights, chosen))(vertices))

    @compiled
    def farthest(self, direction: RealLike) -> Vector:
        """A corner of the set that reaches farthest along `direction`.

        The gradient of `reach`. Where a whole face is farthest, one of its corners: the direction
        is turned by the square root of the rounding error to choose it. NaN where the set does not
        end that way.
        """
        w = as_float(direction)
        turn = jnp.sqrt(jnp.finfo(w.dtype).eps) * jnp.sqrt(jnp.sum(w**2))
        w = w + turn * jnp.cos(1.0 + jnp.arange(w.size, dtype=w.dtype))
        reach, corner = jax.value_and_grad(self.reach)(w)
        return nan_unless(jnp.isfinite(reach), corner)

    def extent(self, axis: str) -> Scalar:
        """Largest `|Omega_axis|` in the set: sample that coordinate at twice this rate."""
        return self.reach(jnp.eye(self.frame.dims)[self.frame.axis(axis)])


def _check_half_widths(name: str, widths: Array) -> None:
    """Refuse negative ones; a band may reach as far as one likes."""
    check_not_negative(name, jnp.where(jnp.isposinf(widths), 0.0, widths))


def _block(A: Array, B: Array) -> Array:
    """Block-diagonal matrix; unlike scipy's it makes no row of a matrix that has none."""
    upper = jnp.concatenate([A, jnp.zeros((A.shape[0], B.shape[1]), A.dtype)], axis=1)
    lower = jnp.concatenate([jnp.zeros((B.shape[0], A.shape[1]), B.dtype), B], axis=1)
    return jnp.concatenate([upper, lower])


def _dual(A: Array, target: Array, size: Array, weights: Array, chosen: Array) -> Scalar:
    """The dual objective at the vertex where the `chosen` terms vanish; infinite if there is none.

    `weights . |target - A y|` with 0 times infinity read as 0: an unlimited generator costs nothing
    if nothing of it is left but rounding, that of the products of which `target` is the sum (`size`
    that of their absolute values) too.
    """
    eps = 64.0 * jnp.finfo(target.dtype).eps
    y = jnp.zeros(A.shape[1], target.dtype)
    regular = jnp.array(True)
    if A.shape[1]:
        square = A[chosen]
        volume = jnp.prod(jnp.sqrt(jnp.sum(square**2, axis=1)))
        regular = jnp.abs(jnp.linalg.det(square)) > eps * volume
        # (On a GPU jaxlib 0.11.2 solved many small systems rightly, but not the transposed ones of
        # their derivatives, which an inverse needs not.)
        inverse = jnp.linalg.inv(jnp.where(regular, square, jnp.eye(len(square), dtype=A.dtype)))
        y = jnp.sum(inverse * target[chosen], axis=1)
    terms = A * y
    rest = target - jnp.sum(terms, axis=1)
    scale = size + jnp.sum(jnp.abs(terms), axis=1)
    gone = jnp.abs(rest) <= eps * scale
    # What costs without end is no product: its derivative would make that of other vertices NaN.
    endless = jnp.isposinf(weights) & ~gone
    finite = ~(gone | endless)
    cost = jnp.where(finite, jnp.where(finite, weights, 1.0) * jnp.abs(rest), 0.0)
    return jnp.where(regular & ~jnp.any(endless), jnp.sum(cost), jnp.inf)


# --- what the laws do to it --------------------------------------------------------------------


@functools.singledispatch
def band_limit_after(law: Law, band: BandLimit, level: float = LEVEL) -> BandLimit:
    """Band limit of light after a law, from the band limit before it.

    Move: every point by `M^T`. Multiply: plus the factor's band. Integrate: the slice
    `Omega_axis = 0`, refused where an end moves. Convolve: a product, integrated, which for a lobe
    of the difference alone cuts the set at the lobe's cutoff. A warp refuses: linearise it.

    Args:
        law: what happens to the light.
        band: its band limit before.
        level: where the spectrum of a factor or lobe that has no sharp band is cut, as a
            fraction of its peak.

    Raises:
        Refused: if the law, its factor or its kernel has no band limit.
        ValueError: if its factor or its kernel is over other coordinates than the band.

    Reference: D05 §6.2, whose bounds follow from these rules.

    Example:
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.laws import Convolve
        >>> from firstorder.bandwidth import BandLimit, band_limit_after
        >>> blurred = band_limit_after(Convolve(GaussianProfile(0.1)), BandLimit.box((0.0, 100.0)))
        >>> round(blurred.extent("theta").item(), 3)  # where its transform is 1 / 1000
        5.916
    """
    raise Refused(f"{type(law).__name__.lower()} has no rule for band limits")


@band_limit_after.register
def _(law: Warp, band: BandLimit, level: float = LEVEL) -> BandLimit:
    raise Refused("a warp has no band limit: linearise it at a ray")


@band_limit_after.register
def _(law: Move, band: BandLimit, level: float = LEVEL) -> BandLimit:
    return band.moved(law.M, law.frame(band.frame))


@band_limit_after.register
def _(law: Multiply, band: BandLimit, level: float = LEVEL) -> BandLimit:
    return band + band_limit(law.factor.in_frame(band.frame, "factor"), level)


@band_limit_after.register
def _(law: Integrate, band: BandLimit, level: float = LEVEL) -> BandLimit:
    law._refuse_moving_ends()
    return band.sliced(law.axis)


@band_limit_after.register
def _(law: Convolve, band: BandLimit, level: float = LEVEL) -> BandLimit:
    if not isinstance(law.domain, Line | Circle):
        raise Refused("a horizon has no band limit: multiply by it first, then convolve")
    kernel = law.kernel.in_frame(band.frame, "kernel")
    a, n = band.frame.axis(kernel.axis), band.frame.dims
    wide = band.frame.appended("omega")
    source, difference = np.eye(n, n + 1), np.eye(n, n + 1)
    source[a] = np.eye(n + 1)[n]
    difference[a, n] = -1.0
    lobe = band_limit(kernel, level).moved(difference, wide)
    return (band.moved(source, wide) + lobe).sliced("omega")


@functools.singledispatch
def band_limit(field: Field, level: float = LEVEL) -> BandLimit:
    """A set outside which the spectrum of a field is at most `level` times its peak.

    Exact for light whose spectrum ends; at its level for a Gaussian (whose ellipse is put into the
    parallelogram around it) and the clamped cosine; the whole line across a jump, which has all
    frequencies; and by `band_limit_after` for what a law has made of any of these.
    `band_limit.register` adds a kind of field.

    Raises:
        Refused: if the field has no known band limit.

    Example:
        >>> from firstorder.fields import half_plane
        >>> from firstorder.bandwidth import band_limit
        >>> edge = band_limit(half_plane(0.3))
        >>> edge.extent("x").item(), edge.extent("theta").item()
        (inf, 0.0)
    """
    raise Refused(f"{type(field).__name__} has no known band limit: give one")


@band_limit.register
def _(field: FieldImage, level: float = LEVEL) -> BandLimit:
    return band_limit_after(field.law, band_limit(field.operand, level), level)


@band_limit.register
def _(field: Sum, level: float = LEVEL) -> BandLimit:
    # Each set holds zero, so the sum of all holds each of them.
    return functools.reduce(BandLimit.__add__, (band_limit(f, level) for f in field.fields))


@band_limit.register
def _(field: Constant, level: float = LEVEL) -> BandLimit:
    return BandLimit.spanned(jnp.zeros((field.frame.dims, 0)), jnp.zeros(0), field.frame)


@band_limit.register
def _(field: HalfPlane, level: float = LEVEL) -> BandLimit:
    return BandLimit.spanned(field.level.normal[:, None], jnp.array([jnp.inf]), field.frame)


@band_limit.register
def _(field: Gaussian, level: float = LEVEL) -> BandLimit:
    # |F| / peak = exp(-2 pi^2 W . P^-1 W) and P = C C^T: W = r C s with |s| <= 1 is the ellipse.
    C = jnp.linalg.cholesky(field.precision)
    return BandLimit.spanned(C, jnp.full(C.shape[0], _standard_cutoff(level)), field.frame)


@band_limit.register
def _(field: GaussianProfile, level: float = LEVEL) -> BandLimit:
    return _segment(field, _standard_cutoff(level) / field.sigma)


@band_limit.register(DiracProfile | BoxProfile)
def _(field, level: float = LEVEL) -> BandLimit:
    return _segment(field, jnp.inf)


@band_limit.register
def _(field: UniformProfile, level: float = LEVEL) -> BandLimit:
    return _segment(field, 0.0)


@band_limit.register
def _(field: Separable, level: float = LEVEL) -> BandLimit:
    return functools.reduce(BandLimit.__add__, (band_limit(p, level) for p in field.factors))


@band_limit.register
def _(field: Wave, level: float = LEVEL) -> BandLimit:
    return BandLimit.spanned(field.frequency[:, None], jnp.ones(1), field.frame)


@band_limit.register
def _(field: Harmonics, level: float = LEVEL) -> BandLimit:
    return BandLimit.box([field.orders[-1] / (2.0 * np.pi)], field.frame)


@band_limit.register
def _(field: Environment, level: float = LEVEL) -> BandLimit:
    direction = jnp.eye(field.frame.dims)[field.axis]
    return band_limit(field.light, level).moved(direction[None], field.frame)


@band_limit.register
def _(field: ClampedCosine, level: float = LEVEL) -> BandLimit:
    _check_level(level)
    # |transform| / peak <= 1 / ((2 pi Omega)^2 - 1): the kink at the horizon is all of this tail.
    return _segment(field, float(np.sqrt(1.0 + 1.0 / level)) / (2.0 * np.pi))


def _segment(field, limit) -> BandLimit:
    """Frequencies along the one axis on which a factor depends."""
    here = jnp.eye(field.frame.dims)[:, field.frame.axis(field.axis), None]
    return BandLimit.spanned(here, as_float(limit)[None], field.frame)


def _check_level(level: float) -> None:
    """Refuse a level that no transform falls to."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"Argument `level` must lie in (0, 1), but is {level}.")


def _standard_cutoff(level: float) -> float:
    """Frequency at which `exp(-2 pi^2 Omega^2)` falls to `level`."""
    _check_level(level)
    return float(np.sqrt(-0.5 * np.log(level)) / np.pi)


def path_band_limits(
    path: Path, source: BandLimit | None = None, level: float = LEVEL
) -> tuple[BandLimit | Refused, ...]:
    """Band limit at every step of a path, or the refusal that stopped it.

    Args:
        path: source and events.
        source: band limit of the source, where it has none of its own (an environment map).
        level: see `band_limit`.

    Raises:
        TypeError: if `path` is no path, or `source` no band limit.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.bandwidth import BandLimit, path_band_limits
        >>> from firstorder.transport import Curvature, Mirror
        >>> path = gaussian((0.0, 0.0), (1.0, 1.0)) >> Curvature(2.0) >> Mirror()
        >>> [b.extent("x").item() for b in path_band_limits(path, BandLimit.box((0.0, 3.0)))]
        [0.0, 6.0, 6.0]
    """
    check_kind("path", path, Path, "a path, `light >> event`")
    if source is not None:
        check_kind("source", source, BandLimit, "a `BandLimit`")
    found: list[BandLimit | Refused] = []
    try:
        band = band_limit(path.source, level) if source is None else source
        found.append(band)
        for event in path.events:
            band = band_limit_after(event.law(band.frame), band, level)
            found.append(band)
    except Refused as refusal:  # once refused, it stays refused for the same reason
        found += [refusal] * (len(path.events) + 1 - len(found))
    return tuple(found)
