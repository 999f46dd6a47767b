"""Lambert's edge term for a receiver that moves, and its derivatives.

A point is four numbers `(w, s)`: the unit direction to it and the inverse of its distance, zero
for what is infinitely far. The receiver's normal is +z, and it moves in the plane z = 0.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

# Below this 1 - cos(angle) a series: it converges like 0.1^n there, and a rounding in the closed
# form is not yet magnified.
SHORT = 0.2
TERMS = 18


def _second_coefficients(terms: int) -> list[float]:
    """Coefficients of A'' as a series in t = 1 - k: A(t) = sum n! / (3/2)_n (t/2)^n."""
    a = [1.0]
    for n in range(1, terms + 2):
        a.append(a[-1] * n / (2.0 * n + 1.0))
    return [n * (n - 1) * a[n] for n in range(2, terms + 2)]


def arc_factor(
    k: Float[Array, "*e"], t: Float[Array, "*e"]
) -> tuple[Float[Array, "*e"], Float[Array, "*e"], Float[Array, "*e"]]:
    """`A(k) = arccos(k) / sqrt(1 - k^2)` of a cosine k, with A' and A''.

    Smooth wherever k > -1: an edge of no length is no exception. From
    `(1 - k^2) A' = k A - 1` and its derivative, A and A' follow from A'' without cancellation.

    Args:
        k: cosine of the angle between two directions.
        t: 1 - k, with the digits that a difference of close numbers loses.
    """
    short = t < SHORT
    near = jnp.where(short, t, 0.0)
    series = jnp.zeros_like(near)
    for c in reversed(_second_coefficients(TERMS)):
        series = series * near + c
    u, c = near * (2.0 - near), 1.0 - near
    A = (u**2 * series + 3.0 * c) / (1.0 + 2.0 * c**2)
    A1 = (u * series - A) / (3.0 * c)
    far = jnp.where(short, 0.0, k)
    u = jnp.maximum(1.0 - far**2, 16.0 * jnp.finfo(far.dtype).eps)
    B = jnp.arctan2(jnp.sqrt(u), far) / jnp.sqrt(u)
    B1 = (far * B - 1.0) / u
    B2 = (B + 3.0 * far * B1) / u
    return jnp.where(short, A, B), jnp.where(short, A1, B1), jnp.where(short, series, B2)


def lambert_edge(p: Float[Array, "4 *e"], q: Float[Array, "4 *e"]) -> Float[Array, "6 *e"]:
    """Lambert's term of the edges from p to q, with its gradient and its Hessian.

    `F = angle(p, q) (p x q)_z / (2 |p x q|)`. Summed around an outline that turns from x to y
    about the normal, it is the outline's projected solid angle. With unit directions it is
    `A(p . q) (p x q)_z / 2`, A of `arc_factor`, so no edge is degenerate.

    Valid for edges shorter than half a turn.

    Args:
        p: unit directions and inverse distances [1/m] of where edges start, which stays there.
        q: of where they end, likewise.

    Returns:
        `F, F_x, F_y, F_xx, F_xy, F_yy` as the receiver moves [sr, sr/m, sr/m^2].

    Reference: Lambert's formula as in J12 §9's Arvo 1994; the derivatives are derived in
    `derivations/space/estimators/occlusion_aware.py`.
    """
    w, s, v, r = p[:3], p[3], q[:3], q[3]
    k = jnp.sum(w * v, 0)
    A, A1, A2 = arc_factor(k, 0.5 * jnp.sum((w - v) ** 2, 0))
    Z = w[0] * v[1] - w[1] * v[0]
    # After a step d the ends are w - s d and v - r d. Their product and cross product:
    dot = (-s * v[0] - r * w[0], -s * v[1] - r * w[1])
    cross = (r * w[1] - s * v[1], s * v[0] - r * w[0])
    # ... and the logarithm of 1 / (|p| |q|).
    scale = (s * w[0] + r * v[0], s * w[1] + r * v[1])
    k1 = [dot[i] + k * scale[i] for i in (0, 1)]
    Z1 = [cross[i] + Z * scale[i] for i in (0, 1)]
    parts = [A * Z, *(A1 * k1[i] * Z + A * Z1[i] for i in (0, 1))]
    for i, j in ((0, 0), (0, 1), (1, 1)):
        same = 1.0 if i == j else 0.0
        bend = s**2 * (2.0 * w[i] * w[j] - same) + r**2 * (2.0 * v[i] * v[j] - same)
        bend = bend + scale[i] * scale[j]
        k2 = 2.0 * s * r * same + dot[i] * scale[j] + scale[i] * dot[j] + k * bend
        Z2 = cross[i] * scale[j] + scale[i] * cross[j] + Z * bend
        mixed = k2 * Z + k1[i] * Z1[j] + Z1[i] * k1[j]
        parts.append(A2 * k1[i] * k1[j] * Z + A1 * mixed + A * Z2)
    return 0.5 * jnp.stack(parts)
