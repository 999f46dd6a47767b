"""Closed curves by Fourier series: where lines cross them and where they touch.

Both questions are roots of a smooth periodic function of the parameter, see
`firstorder.numerics._roots`.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import nan_unless
from firstorder._display import Module
from firstorder.numerics._order import order_of
from firstorder.numerics._roots import bracketed_root, brackets, even, newton

MOST_TANGENTS = 8


class CurveRoots(Module):
    """One curve `c(s) = sum_k cosines[k] cos(2 pi k s) + sines[k] sin(2 pi k s)`."""

    cosines: Float[Array, "*n k 2"]
    sines: Float[Array, "*n k 2"]
    samples: int = eqx.field(static=True)

    def motion(self, s: Float[Array, ""]):
        """Position, first and second derivative in s."""
        w = 2.0 * jnp.pi * jnp.arange(self.cosines.shape[-2], dtype=self.cosines.dtype)
        c, q = jnp.cos(w * s)[:, None], jnp.sin(w * s)[:, None]
        w = w[:, None]
        a, b = self.cosines, self.sines
        return (
            jnp.sum(a * c + b * q, -2),
            jnp.sum(w * (b * c - a * q), -2),
            -jnp.sum(w**2 * (a * c + b * q), -2),
        )

    def _size(self) -> Float[Array, ""]:
        """A length of the order of the curve's."""
        return jnp.sqrt(jnp.sum(self.cosines[..., 1:, :] ** 2 + self.sines[..., 1:, :] ** 2))

    def hit(self, origin: Float[Array, "2"], along: Float[Array, "2"], on: Bool[Array, ""]):
        """The nearest crossing with a ray: distance and parameter, infinity if there is none."""
        across = jnp.stack([-along[1], along[0]])

        def f(s):
            return tuple(
                jnp.dot(across, m - (origin if i == 0 else 0.0))
                for i, m in enumerate(self.motion(s))
            )

        curve = jax.lax.stop_gradient(self)
        from_here, to = jax.lax.stop_gradient((origin, along))
        turned = jnp.stack([-to[1], to[0]])

        def fixed(s):
            return tuple(
                jnp.dot(turned, m - (from_here if i == 0 else 0.0))
                for i, m in enumerate(curve.motion(s))
            )

        low, high, crossed = brackets(fixed, even(self.samples, self.cosines.dtype))
        s = jax.vmap(lambda a, b: _found(fixed, a, b))(low, high)
        t = jax.vmap(lambda s: jnp.dot(to, curve.motion(s)[0] - from_here))(s)
        # A point of the curve itself is met again at a distance of rounding.
        least = jnp.where(on, self._nearest_self(), 0.0)
        t = jnp.where(crossed & (t > least), t, jnp.inf)
        best = jnp.argmin(t)
        there = jnp.isfinite(t[best])
        s = jax.lax.stop_gradient(jnp.where(there, s[best], 0.0))
        for _ in range(2):  # now with derivatives
            value, slope, _ = f(s)
            s = s - jnp.where(there, value, 0.0) / jnp.where(there & (slope != 0.0), slope, 1.0)
        distance = jnp.dot(along, self.motion(s)[0] - origin) / jnp.dot(along, along)
        return jnp.where(there, distance, jnp.inf), jnp.mod(s, 1.0)

    def tangents(self, p: Float[Array, "2"]):
        """The points at which lines from p touch the curve, and which of the eight exist."""

        def of(curve, eye):
            def f(s):
                c, v, a = curve.motion(s)
                u = c - eye
                jerk = curve._third(s)
                first = a[0] * u[1] - a[1] * u[0]
                second = jerk[0] * u[1] - jerk[1] * u[0] + a[0] * v[1] - a[1] * v[0]
                return v[0] * u[1] - v[1] * u[0], first, second

            return f

        curve, eye = jax.lax.stop_gradient((self, p))
        fixed, f = of(curve, eye), of(self, p)
        low, high, found = brackets(fixed, even(self.samples, self.cosines.dtype))
        first = order_of(~found)[:MOST_TANGENTS]
        s = jax.vmap(lambda a, b: _found(fixed, a, b))(low[first], high[first])
        apart = jax.vmap(lambda s: jnp.linalg.norm(curve.motion(s)[0] - eye))(s)
        valid = found[first] & (apart > curve._nearest_self())
        s = jax.lax.stop_gradient(s)
        for _ in range(2):
            value, slope, _ = jax.vmap(f)(s)
            s = s - jnp.where(valid, value, 0.0) / jnp.where(valid & (slope != 0), slope, 1.0)
        points = jax.vmap(lambda s: self.motion(s)[0])(s)
        too_many = jnp.sum(found) > MOST_TANGENTS  # better no answer than a wrong one
        return nan_unless(~too_many, points), valid | too_many

    def _nearest_self(self) -> Float[Array, ""]:
        """The distance below which a point of the curve is the eye's own."""
        eps = jnp.finfo(self.cosines.dtype).eps
        return jax.lax.stop_gradient(self._size()) * eps**0.5

    def _third(self, s: Float[Array, ""]):
        """The third derivative of the position."""
        w = 2.0 * jnp.pi * jnp.arange(self.cosines.shape[-2], dtype=self.cosines.dtype)[:, None]
        turned = self.cosines * jnp.sin(w * s) - self.sines * jnp.cos(w * s)
        return jnp.sum(w**3 * turned, -2)


def _found(f, low: Float[Array, ""], high: Float[Array, ""]) -> Float[Array, ""]:
    """The root between two ends of opposite sign, to rounding."""
    s = bracketed_root(f, low, high)
    return newton(f, newton(f, s))
