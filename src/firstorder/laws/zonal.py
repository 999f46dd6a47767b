"""Convolve on the sphere of directions with a kernel that depends on the angle alone.

`h(w) = int f(w') rho(w . w') dw'`. Directions are unit vectors here and not coordinates: tangent
vectors at different directions live in different planes, and are never added by component.
"""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_count, check_positive, check_unit, nan_unless
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields.jet import Jet
from firstorder.numerics._quadrature import composite_gauss_legendre, periodic_trapezoid
from firstorder.numerics._refinement import with_errors_of_self
from firstorder.typing import Scalar, as_float

Direction = Float[Array, " 3"]
Cosines = Float[Array, "*b"]
SPHERE = Frame(("w_x", "w_y", "w_z"))


class ZonalKernel(Module):
    """A continuous function `rho(t)` of the cosine `t = w . w'`."""

    @abc.abstractmethod
    def derivatives(self, t: Cosines) -> tuple[Cosines, Cosines, Cosines]:
        """`rho, rho', rho''` in closed form, between breaks."""

    def breaks(self) -> tuple[tuple[Scalar, Scalar], ...]:
        """Cosines at which the quadrature splits, each with the jump of `rho'` there."""
        return ()


class VonMisesFisher(ZonalKernel):
    """`k exp(k (t - 1)) / (2 pi (1 - exp(-2 k)))`: the bell on the sphere, with integral 1.

    Args:
        sharpness: k; a width of about `1 / sqrt(k)` radians.

    Raises:
        ValueError: if `sharpness` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.laws import VonMisesFisher
        >>> value, slope, _ = VonMisesFisher(5.0).derivatives(jnp.array(1.0))
        >>> round((slope / value).item(), 6)  # the sharpness
        5.0
    """

    sharpness: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a sharpness that is none."""
        check_positive("sharpness", self.sharpness)

    def derivatives(self, t: Cosines) -> tuple[Cosines, Cosines, Cosines]:
        """Each derivative multiplies by k."""
        k = nan_unless(self.sharpness > 0, self.sharpness)
        rho = k / (-2.0 * np.pi * jnp.expm1(-2.0 * k)) * jnp.exp(k * (t - 1.0))
        return rho, k * rho, k**2 * rho

    def breaks(self) -> tuple[tuple[Scalar, Scalar], ...]:
        """No kink, but a panel of its own for the peak and one for its foot."""
        k = self.sharpness
        return (1.0 - 8.0 / k, jnp.zeros(())), (1.0 - 40.0 / k, jnp.zeros(()))


class ZonalCosine(ZonalKernel):
    """`max(t, 0) / pi`: diffuse shading, with a kink at the horizon.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.laws import Zonal, ZonalCosine
        >>> w = jnp.array([0.0, 0.0, 1.0])
        >>> round(Zonal(ZonalCosine())(lambda w: 1.0 + 0.0 * w[2])(w).item(), 9)
        1.0
    """

    def derivatives(self, t: Cosines) -> tuple[Cosines, Cosines, Cosines]:
        """Value, a step for its slope, and zero; the kink on the horizon is left to `breaks`."""
        up = 0.5 * (1.0 + jnp.sign(t)) / np.pi
        return up * t, up, jnp.zeros_like(t)

    def breaks(self) -> tuple[tuple[Scalar, Scalar], ...]:
        """The horizon."""
        return ((jnp.zeros(()), jnp.full((), 1.0 / np.pi)),)


class Zonal(Module):
    """`h(w) = int f(w') rho(w . w') dw'` over the whole sphere.

    With `P w' = w' - (w . w') w`, the part of w' in the tangent plane at w,
    `grad h = int f rho' P w' dw'` (R07 eq. 67), and the covariant Hessian is
    `Hess h = int f (rho'' (P w')(P w')^T - rho' (w . w') P) dw'`, plus the kernel's kinks.
    The derivative may also be put on f, not by component but as a rotation:
    `w x grad h = int (w' x grad f) rho dw'`.
    Spectrum: `h_lm = multipliers[l] f_lm` on spherical harmonics (Funk and Hecke).

    Quadrature in polar coordinates about w: Gauss-Legendre in the cosine, split at the kernel's
    breaks, times the trapezoid rule in azimuth; spectrally accurate for a smooth f.

    Args:
        kernel: rho.
        nodes: Gauss-Legendre nodes per smooth piece of the kernel.
        turns: nodes of the azimuth.

    Raises:
        ValueError: if `nodes` or `turns` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.laws import VonMisesFisher, Zonal
        >>> w = jnp.array([0.6, 0.0, 0.8])
        >>> round(Zonal(VonMisesFisher(5.0))(lambda w: 1.0 + 0.0 * w[2])(w).item(), 12)
        1.0
    """

    REFINED: ClassVar = ("nodes", "turns")

    kernel: ZonalKernel
    nodes: int = eqx.field(static=True, default=24)
    turns: int = eqx.field(static=True, default=48)

    def __check_init__(self):
        """Refuse an empty rule."""
        check_count("nodes", self.nodes)
        check_count("turns", self.turns)

    def __call__(self, f: Callable) -> Callable:
        """The convolved function, a callable of a direction."""
        return lambda w: self.value(f, w)

    def _cosines(self) -> tuple[Array, Array]:
        """Nodes and weights in the cosine."""
        one = jnp.ones(())
        return composite_gauss_legendre(-one, one, [t for t, _ in self.kernel.breaks()], self.nodes)

    def _around(self, w: Direction, t: Float[Array, " k"]) -> tuple[Array, float]:
        """Directions at cosines t from w, shape (k, turns, 3), and the weight of an azimuth."""
        phi, weight = periodic_trapezoid(2.0 * np.pi, self.turns)
        e1, e2 = _tangents(w)
        ring = jnp.cos(phi)[:, None] * e1 + jnp.sin(phi)[:, None] * e2
        # A panel that is clipped to a pole has its nodes there: the sine is 0, its slope infinite.
        square = 1.0 - t**2
        sine = jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)
        return t[:, None, None] * w + sine[:, None, None] * ring, weight

    @with_errors_of_self
    def value(self, f: Callable, w: Direction, *, with_error: bool = False) -> Scalar:
        """`int f(w') rho(w . w') dw'`.

        Args:
            f: jittable function of a unit vector.
            w: unit vector.
            with_error: whether to give an `Approximation`: the answer, and a bound of its error.
        """
        check_unit("w", w)
        t, weights = self._cosines()
        away, weight = self._around(w, t)
        light = weight * jnp.sum(jax.vmap(jax.vmap(f))(away), axis=1)
        return jnp.sum(weights * self.kernel.derivatives(t)[0] * light)

    @with_errors_of_self
    def jet(self, f: Callable, w: Direction, *, with_error: bool = False) -> Jet:
        """Value, gradient (a vector tangent at w) and covariant Hessian (3 x 3, tangent).

        Along the great circle `w cos s + e sin s` the value is
        `h + s e . gradient + s^2 e . hessian . e / 2 + O(s^3)`.

        Args:
            f: jittable function of a unit vector; its derivatives are not needed.
            w: unit vector.
            with_error: whether to give an `Approximation`: the answer, and a bound of its error.
        """
        check_unit("w", w)
        t, weights = self._cosines()
        kinks = self.kernel.breaks()
        # A broad kernel has breaks beyond the poles, where there is no direction.
        edge = jnp.clip(jnp.stack([k for k, _ in kinks]), -1.0, 1.0) if kinks else jnp.zeros(0)
        away, weight = self._around(w, jnp.concatenate([t, edge]))
        light = weight * jax.vmap(jax.vmap(f))(away)
        rho, slope, bend = self.kernel.derivatives(t)
        # A kink is a Dirac in rho'': one more ring of nodes.
        jumps = jnp.stack([j for _, j in kinks]) if kinks else jnp.zeros(0)
        bend = jnp.concatenate([weights * bend, jumps])
        P = jnp.eye(3) - w[:, None] * w
        across = away @ P
        mean = jnp.sum(light[: t.size], axis=1)
        gradient = jnp.einsum("k,ka,kai->i", weights * slope, light[: t.size], across[: t.size])
        outer = jnp.einsum("k,ka,kai,kaj->ij", bend, light, across, across)
        hessian = outer - jnp.sum(weights * slope * t * mean) * P
        return Jet(jnp.sum(weights * rho * mean), gradient, hessian, SPHERE)

    @with_errors_of_self
    def multipliers(self, order: int, *, with_error: bool = False) -> Float[Array, " l"]:
        """`2 pi int rho(t) P_l(t) dt` for l = 0 ... order: the kernel's spectrum.

        Args:
            order: the last l.
            with_error: whether to give an `Approximation`: the answer, and a bound of its error.

        Reference: Funk and Hecke; Ramamoorthi and Hanrahan 2001.
        """
        t, weights = self._cosines()
        rho = weights * self.kernel.derivatives(t)[0]

        def step(pair, n):
            before, now = pair
            after = ((2.0 * n + 1.0) * t * now - n * before) / (n + 1.0)
            return (now, after), now

        _, legendre = jax.lax.scan(
            step, (jnp.zeros_like(t), jnp.ones_like(t)), jnp.arange(order + 1.0)
        )
        return 2.0 * np.pi * legendre @ rho


def _tangents(w: Direction) -> tuple[Direction, Direction]:
    """Two unit vectors that complete w to a right-handed frame (Duff et al. 2017)."""
    x, y, z = w
    sign = jnp.where(z < 0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    e1 = jnp.stack([1.0 + sign * x * x * a, sign * b, -sign * x])
    return e1, jnp.stack([b, sign + y * y * a, -y])
