"""Sums over the rays that a receiver gathers, and over the walls between their cells.

They are written once for arrays of NumPy and of JAX: `_irradiance_forms` makes forms of them that
are compiled and differentiated, `caching.candidate_tables` adds up half a billion rays on the host.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Array, Float

Either: TypeAlias = np.ndarray | Array


def surface_area_sums(
    near: Float[Either, "*k c r"],
    nearer: Float[Either, "*j r"],
    u: Float[Either, "*k d r"],
    n: Float[Either, "*k d r"],
) -> tuple[Float[Either, "*k c d"], Float[Either, "*j d d"]]:
    """First and second derivatives, by steps, of light that moves with the geometry term alone.

    The kernels are `4 u + n` and `24 u u^T - 4 I + 4 (n u^T + u n^T)`: derivatives of the geometry
    term over the term itself, times r and r^2, as far as they do not turn to the receiver's normal.

    Args:
        near: weights of the rays over their length r, in c rows.
        nearer: weights over r^2.
        u: components of the unit vectors to what is seen.
        n: of the normals there, over their cosine with the way back.

    Reference: J12 §7.1-7.2, eqs. 58, 66.
    """
    xp = u.__array_namespace__()
    first = near @ xp.swapaxes(4.0 * u + n, -1, -2)
    half = (nearer[..., None, :] * (12.0 * u + 4.0 * n)) @ xp.swapaxes(u, -1, -2)
    even = 4.0 * xp.sum(nearer, -1)[..., None, None] * xp.eye(u.shape[-2], dtype=u.dtype)
    return first, half + xp.swapaxes(half, -1, -2) - even


def jumps_across(radiance: Float[Either, "*k m n"], inverse: Float[Either, "*k m n"]):
    """Jumps of radiance across walls, and one over the distance that carries them.

    Args:
        radiance: of the cells, rows from the pole to the horizon.
        inverse: one over the distance of what is seen.

    Returns:
        `(circles (m-1, n), meridians (m, n))`, twice: radiance farther from the pole minus nearer,
        and after the meridian minus before; then `1 / min(r, r')`. Meridian i is where column i
        begins.
    """
    xp = radiance.__array_namespace__()
    L, w = radiance, inverse
    jumps = (L[..., 1:, :] - L[..., :-1, :], L - xp.roll(L, 1, -1))
    carried = (xp.maximum(w[..., :-1, :], w[..., 1:, :]), xp.maximum(w, xp.roll(w, 1, -1)))
    return jumps, carried


class WallSweeps(NamedTuple):
    """What walls sweep along the receiver's plane by a step of it, for distance and jump 1.

    Attributes:
        circle: of circles, by row; times `arc`.
        arc: `int e_rho dphi` over each column.
        rising: of meridians, by row; times `beside`.
        beside: e_phi where each column begins.
    """

    circle: Float[Either, " m_2"]
    arc: Float[Either, "n 2"]
    rising: Float[Either, " m"]
    beside: Float[Either, "n 2"]

    @classmethod
    def of(cls, theta: Float[Either, " m_1"], phi: Float[Either, " n_1"]) -> WallSweeps:
        """From the borders of the cells."""
        xp = theta.__array_namespace__()
        s, c = xp.sin(theta[1:-1]), xp.cos(theta[1:-1])
        sine, cosine = xp.sin(phi), xp.cos(phi)
        return cls(
            s * c * c,
            xp.stack([xp.diff(sine), -xp.diff(cosine)], -1),
            xp.diff(xp.sin(theta)),
            xp.stack([-sine[:-1], cosine[:-1]], -1),
        )

    def gradient(
        self, circles: Float[Either, "*k m_2 n"], meridians: Float[Either, "*k m n"]
    ) -> Float[Either, "*k 2"]:
        """The sum over all walls, from the jumps that they carry over their distances.

        Reference: J12 §7.1, eq. 64 (misprinted).
        """
        return (self.circle @ circles) @ self.arc + (self.rising @ meridians) @ self.beside
