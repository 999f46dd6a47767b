"""Spectra of shadow light fields: lines for planar blockers, a wedge for many, energy outside.

A plane of blockers never ends, so that its spectrum is a Dirac on a line. Every number here is
taken under a stated window over the ray's offset v, which widens the line to the window's own
transform; the wedge of a traced scene is measured under a Hann window over (x, y).
"""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import (
    check_one,
    check_positive,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.laws.move import Move
from firstorder.shadowfield.plane.light_field import ON_LIGHT, ON_RECEIVER, to_two_planes
from firstorder.typing import ComplexScalar, Frequency, Scalar, as_float


class _Outer(Spectrum):
    """`first(Omega_0) second(Omega_1)`: a function of one coordinate times one of the other."""

    first: Spectrum
    second: Spectrum
    frame: Frame = eqx.field(static=True, default=ON_LIGHT)

    def at(self, Omega: Frequency) -> ComplexScalar:
        """The product."""
        return self.first.at(Omega[:1]) * self.second.at(Omega[1:])


def blocker_spectrum(G: Spectrum, d2, window: Spectrum) -> Spectrum:
    """Spectrum of a planar blocker under a window: `G(Omega_y) W(Omega_v - d2 Omega_y)`.

    Of `g(y + d2 v) w(v)` over (y, v), exact. For an ever wider window of unit height W tends to the
    Dirac of the paper, and the spectrum to `G(Omega_y) delta(Omega_v - d2 Omega_y)`. It follows
    from the move `(y, v) -> (y + d2 v, v)` and is not written down again.

    Args:
        G: spectrum of the transparency on the blocker's own plane.
        d2: distance of that plane from the light [m].
        window: spectrum W of the window over v.

    Raises:
        ValueError: if `d2` is not positive.

    Reference: E11 eqs. 3, 13, 14.

    Example:
        >>> from firstorder.fields import GaussianProfile, Separable
        >>> from firstorder.conventions import Frame
        >>> from firstorder.shadowfield import PLANE, blocker_spectrum
        >>> g = Separable([0.1], (GaussianProfile(0.05, "y", PLANE),)).spectrum()
        >>> V = Frame(("v",))
        >>> w = Separable([0.0], (GaussianProfile(3.0, "v", V),)).spectrum()
        >>> F = blocker_spectrum(g, 0.5, w)
        >>> on, off = abs(F(2.0, 1.0)), abs(F(2.0, 1.5))  # on the line Omega_v = 0.5 Omega_y
        >>> bool(on > 0.8), bool(off < 1e-9)
        (True, True)
    """
    check_positive("d2", d2)
    d2 = as_float(d2)
    d2 = nan_unless(d2 > 0, d2)
    one, zero = jnp.ones_like(d2), jnp.zeros_like(d2)
    move = Move(jnp.stack([jnp.stack([one, d2]), jnp.stack([zero, one])]), to=ON_LIGHT)
    return move(_Outer(G, window))


def two_plane_spectrum(F: Spectrum, d1) -> Spectrum:
    """Spectrum over (x, y): `d1 F(Omega_y + Omega_x, d1 Omega_x)`, F in the order (y, v).

    Args:
        F: spectrum of the shadow light field over (y, v).
        d1: distance of the receiver from the light [m].

    Raises:
        ValueError: if `d1` is not positive.

    Reference: E11 eqs. 4, 15, 16 (there F stands in the order (v, y)).

    Example:
        >>> from firstorder.conventions import Frame
        >>> from firstorder.fields import gaussian
        >>> from firstorder.shadowfield import two_plane_spectrum
        >>> F = gaussian((0.0, 0.0), (1.0, 1.0), frame=Frame(("y", "v"))).spectrum()
        >>> H = two_plane_spectrum(F, 2.0)
        >>> bool(abs(H(0.1, 0.2) - 2.0 * F(0.3, 0.2)) < 1e-6)
        True
    """
    return to_two_planes(d1)(F)


class ShadowSpectrum(Spectrum):
    """`H(Omega_x) = int F(Omega_x, Omega_y) L(-Omega_y) dOmega_y`: of the irradiance.

    By the trapezoid rule, which converges exponentially if F or L dies out inside the interval.

    Args:
        F: spectrum over (x, y), as `two_plane_spectrum` returns it.
        light: spectrum L of the light's intensity.
        reach: the integral runs over `|Omega_y| < reach` [cycles/m].
        nodes: of the rule.

    Reference: E11 eq. 5.

    Example:
        >>> from firstorder.fields import GaussianProfile, Separable, gaussian
        >>> from firstorder.shadowfield import PLANE, TWO_PLANES, ShadowSpectrum
        >>> F = gaussian((0.0, 0.0), (0.5, 0.5), frame=TWO_PLANES).spectrum()
        >>> light = Separable([0.0], (GaussianProfile(0.5, "y", PLANE),)).spectrum()
        >>> bool(abs(ShadowSpectrum(F, light, 4.0)(0.0)) > 0.5)
        True
    """

    REFINED: ClassVar = ("nodes",)

    F: Spectrum
    light: Spectrum
    reach: Scalar = eqx.field(converter=as_float)
    nodes: int = eqx.field(static=True, default=512)
    frame: Frame = eqx.field(static=True, default=ON_RECEIVER)

    def at(self, Omega: Frequency) -> ComplexScalar:
        """The overlap of light and blockers at this frequency of the receiver."""
        w = jnp.linspace(-1.0, 1.0, self.nodes) * self.reach
        both = jax.vmap(lambda w: self.F.at(jnp.stack([Omega[0], w])) * self.light.at(-w[None]))(w)
        return jnp.sum(both) * (2.0 * self.reach / (self.nodes - 1))


class PlanarShadowSpectrum(Spectrum):
    """Shadow of one plane of blockers: `H = (d1/d2) G((d1/d2) Omega_x) L((1 - d1/d2) Omega_x)`.

    A product, hence in space the blocker, magnified by d1 / d2 from the light's origin, convolved
    with the light, mirrored and scaled by d1 / d2 - 1.

    Args:
        G: spectrum of the transparency.
        light: spectrum L of the light's intensity.
        d1: distance of the receiver from the light [m].
        d2: distance of the blockers from the light, positive [m].

    Valid when: blockers and receiver are parallel to the light, the form factor is left out.

    Raises:
        ValueError: if a distance is not positive.

    Reference: E11 eqs. 6-8 (after Soler and Sillion 1998).

    Example:
        >>> from firstorder.fields import BoxProfile, Separable
        >>> from firstorder.shadowfield import PLANE, PlanarShadowSpectrum
        >>> slit = Separable([0.0], (BoxProfile(0.1, "y", PLANE),)).spectrum()
        >>> light = Separable([0.0], (BoxProfile(0.5, "y", PLANE),)).spectrum()
        >>> H = PlanarShadowSpectrum(slit, light, 1.0, 0.5)
        >>> round(H(0.0).real.item(), 12)  # slit 0.2 m, magnified twice, times a light of 1 m
        0.4
    """

    G: Spectrum
    light: Spectrum
    d1: Scalar = eqx.field(converter=as_float)
    d2: Scalar = eqx.field(converter=as_float)
    frame: Frame = eqx.field(static=True, default=ON_RECEIVER)

    def __check_init__(self):
        """Refuse planes in or behind the light."""
        check_positive("d1", self.d1)
        check_positive("d2", self.d2)

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Closed form."""
        ratio = nan_unless((self.d1 > 0) & (self.d2 > 0), self.d1 / self.d2)
        return ratio * self.G.at(ratio * Omega) * self.light.at((1.0 - ratio) * Omega)


# --- the wedge -----------------------------------------------------------------------------------


class Wedge(Module):
    """The wedge of frequencies that holds the energy of blockers at depths from d2_min to d2_max.

    Over (y, v) between the lines `Omega_v = d2 Omega_y`. Over (x, y) between the lines through zero
    of slope `Omega_y / Omega_x` from `d1 / d2_max - 1` to `d1 / d2_min - 1`: a point of energy
    moves by `M^T`, M the Jacobian of (y, v) by (x, y).

    Exact for a sum of planar layers. A product of layers, which is what blockers make of light,
    puts energy at all sums of the points of their lines: the wedge then holds only for the singular
    part along each edge of f, and not where edges cross.

    Args:
        d2_min: distance of the nearest blocker from the light [m].
        d2_max: distance of the farthest one [m].

    Raises:
        ValueError: if the depths are not two positive numbers in order.

    Reference: E11 §3.1-3.2, Fig. 4 (the text lists the slopes in (y, v) upside down).

    Example:
        >>> from firstorder.shadowfield import Wedge
        >>> [a.item() for a in Wedge(0.25, 0.5).slopes(1.0)]
        [1.0, 3.0]
    """

    d2_min: Scalar = eqx.field(converter=as_float)
    d2_max: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse depths that are none."""
        check_one("d2_min", self.d2_min)
        check_one("d2_max", self.d2_max)
        check_positive("d2_min", self.d2_min)
        check_positive("d2_max", self.d2_max)
        if is_concrete((self.d2_min, self.d2_max)) and bool(self.d2_max < self.d2_min):
            raise ValueError(
                f"Argument `d2_max` must not be less than `d2_min` = {self.d2_min}, "
                f"but is {self.d2_max}."
            )

    @property
    def _depths(self) -> tuple[Scalar, Scalar]:
        """The least and the largest depth; NaN for traced ones that are none, or out of order."""
        ok = (self.d2_min > 0) & (self.d2_max >= self.d2_min)
        return nan_unless(ok, self.d2_min), nan_unless(ok, self.d2_max)

    def direction(self, d2, d1=None) -> Float[Array, "2"]:
        """Frequency (Omega_y, Omega_v) of a wave of unit frequency on a plane at depth d2.

        With a receiver at d1, (Omega_x, Omega_y).
        """
        d2 = as_float(d2)
        energy = jnp.stack([jnp.ones_like(d2), d2])
        return energy if d1 is None else to_two_planes(d1).M.T @ energy

    def slopes(self, d1) -> tuple[Scalar, Scalar]:
        """Smallest and largest `Omega_y / Omega_x`."""
        near, far = (self.direction(d2, d1) for d2 in self._depths)
        return far[1] / far[0], near[1] / near[0]

    def contains(self, first, second, d1=None, margin=0.0) -> Bool[Array, "..."]:
        """Whether frequencies lie in the wedge, or in a box about one that does.

        Args:
            first: Omega_y, or with a receiver Omega_x [cycles/m].
            second: Omega_v [cycles], or with a receiver Omega_y [cycles/m].
            d1: distance of the receiver from the light [m].
            margin: half the width of that box: what a window over the samples smears [cycles/m].
        """
        p, q = (self.direction(d2, d1) for d2 in self._depths)
        beyond_p = p[0] * second - p[1] * first
        before_q = first * q[1] - second * q[0]
        slack = [margin * jnp.sum(jnp.abs(e)) for e in (p, q)]
        right = (beyond_p >= -slack[0]) & (before_q >= -slack[1])
        left = (beyond_p <= slack[0]) & (before_q <= slack[1])
        return right | left


def power_spectrum(
    samples: Array | np.ndarray, grid: Grid, tapered: bool = True, mean: bool = False
) -> Float[Array, "..."]:
    """Spectral energy of samples on the grid's own frequencies: `|F|^2`, whose sum is the energy.

    Args:
        samples: values on `grid`, shape `grid.size`.
        grid: where they lie.
        tapered: under a Hann window, which smears each frequency over two neighbours on each side
            and hides that the samples end; without it the ends of the grid add a bright cross.
        mean: whether the constant part stays in.

    Returns:
        Energies at `grid.frequencies(i)`; their sum is the energy of the (tapered) samples.

    Raises:
        ValueError: if the samples do not fit the grid.

    Example:
        >>> import numpy as np
        >>> from firstorder.fields import Grid
        >>> from firstorder.shadowfield import power_spectrum
        >>> wave = np.cos(2.0 * np.pi * np.arange(8) / 8)
        >>> power_spectrum(wave, Grid((8,), (0.5,)), tapered=False).round(9).tolist()
        [0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]
    """
    check_shape("samples", samples, grid.size)
    f, weight = 1.0 * jnp.asarray(samples), jnp.ones(())  # truth values count as 0 and 1
    if tapered:
        for i, n in enumerate(grid.size):
            hann = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
            weight = weight * hann.reshape([-1 if k == i else 1 for k in range(len(grid.size))])
    weight = jnp.broadcast_to(jnp.asarray(weight, f.dtype), f.shape)
    if not mean:
        f = f - jnp.sum(weight * f) / jnp.sum(weight)
    F = jnp.fft.fftshift(jnp.fft.fftn(weight * f))
    return (F.real**2 + F.imag**2) * (grid.cell / f.size)


def energy_outside(energy: Array, inside: Array) -> Scalar:
    """Share of spectral energy at frequencies that are not `inside`.

    Args:
        energy: as `power_spectrum` gives it, an array.
        inside: truth values, an array of the same shape.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.shadowfield import energy_outside
        >>> energy_outside(jnp.array([1.0, 2.0, 1.0]), jnp.array([False, True, True])).item()
        0.25
    """
    return jnp.sum(jnp.where(inside, 0.0, energy)) / jnp.sum(energy)


def zero_outside(samples: Array | np.ndarray, inside: Array) -> Float[Array, "nx ny"]:
    """The samples with all frequencies set to zero that are not `inside` (E11 Fig. 7 (d), (e)).

    Args:
        samples: values on a grid, shape (nx, ny), taken periodic.
        inside: truth values at `grid.frequencies(i)`, of that shape and symmetric about zero.

    Raises:
        ValueError: if both do not have one shape.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.shadowfield import zero_outside
        >>> mean = jnp.zeros((2, 2), bool).at[1, 1].set(True)  # frequency zero alone
        >>> zero_outside(jnp.array([[1.0, 0.0], [0.0, 1.0]]), mean).tolist()
        [[0.5, 0.5], [0.5, 0.5]]
    """
    check_shape("samples", samples, inside.shape)
    F = jnp.fft.fftshift(jnp.fft.fftn(jnp.asarray(samples)))
    return jnp.fft.ifftn(jnp.fft.ifftshift(jnp.where(inside, F, 0.0))).real
