"""Quadrature of reflections: nodes, and the weight of the light as jet entries in (x, theta).

At fixed offsets `t = turn n + look theta - omega` a homogeneous lobe is the same for all rays, a
lobe that varies does so with x alone, and an exact cosine moves with the ray.
"""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.fields.kernel import Kernel, Profile
from firstorder.numerics._quadrature import composite_gauss_legendre
from firstorder.transport.brdf.general import Brdf
from firstorder.transport.brdf.lobes import NORMAL, Lobe
from firstorder.transport.shading._flat_jets import Entries, Normal
from firstorder.typing import Scalar


def has_cosine(r: Lobe | Brdf) -> bool:
    """Whether a lobe is multiplied by the exact cosine."""
    return isinstance(r, Lobe) and r.cosine


def center_of(r: Lobe | Brdf, n: Normal, theta: Scalar) -> tuple[float, float, Scalar]:
    """Direction of the light, `omega = turn n + look theta - t`: turn, look, and the rest."""
    a = r.argument if isinstance(r, Lobe) else NORMAL
    return a.turn, a.look, a.turn * n.value + a.look * theta


def local_center(r: Lobe, n: Normal, theta: Scalar) -> Entries:
    """`m = look (theta - n)`, the lobe's centre seen from the normal."""
    k, zero = r.argument.look, jnp.zeros_like(theta)
    m = k * (theta - n.value)
    return Entries(m, -k * n.x, k + zero, -k * n.xx, zero, zero)


def weigh(r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar, count: int):
    """Nodes t, their quadrature weights, and the weight of the light as entries in (x, theta)."""
    if isinstance(r, Brdf):
        return _hemisphere_weight(r, n, theta, count)
    h = r.kernel.half_width().astype(x.dtype)
    if not r.cosine:
        return *offsets(r.kernel, -h, h, count), lambda t: _kernel_entries(r.kernel, x, t)
    m = local_center(r, n, theta)
    lower = jnp.clip(m.value - 0.5 * np.pi, -h, h)
    upper = jnp.clip(m.value + 0.5 * np.pi, -h, h)

    def weight(t):
        return _kernel_entries(r.kernel, x, t).times(_cosine_entries(m, t))

    return *offsets(r.kernel, lower, upper, count), weight


def offsets(kernel: Kernel, lower: Scalar, upper: Scalar, count: int):
    """Quadrature over a lobe: one panel, or one per piece of a table with four nodes or more."""
    breaks = kernel.knots()
    return composite_gauss_legendre(lower, upper, list(breaks), max(4, count // (len(breaks) + 1)))


def _kernel_entries(kernel: Kernel, x: Scalar, t: Scalar) -> Entries:
    """A lobe at a fixed offset varies with x alone."""
    zero = jnp.zeros_like(x)
    if isinstance(kernel, Profile):
        return Entries(kernel.derivatives(t)[0], zero, zero, zero, zero, zero)
    jet = kernel.jet(jnp.stack([x, t]))
    return Entries(jet.value, jet.gradient[0], zero, jet.hessian[0, 0], zero, zero)


def _cosine_entries(m: Entries, t: Scalar) -> Entries:
    """`cos(m - t)`, the cosine of the incoming local angle."""
    c, s = jnp.cos(m.value - t), jnp.sin(m.value - t)
    return Entries(
        c,
        -s * m.x,
        -s * m.theta,
        -c * m.x * m.x - s * m.xx,
        -c * m.x * m.theta,
        -c * m.theta * m.theta,
    )


def _hemisphere_weight(r: Brdf, n: Normal, theta: Scalar, count: int):
    """`rho(w, theta - n) cos w` at fixed `w = -t`; its derivatives are those in the outgoing angle.

    The panels follow the BRDF's peaks with the ray. What is integrated is smooth there, so that
    moves nothing but the nodes.
    """
    o = theta - n.value
    quarter = jnp.asarray(0.5 * np.pi, o.dtype)
    # The closed form holds the nodes still, and so does autodiff of the value.
    breaks = [jax.lax.stop_gradient(-p) for p in r.peaks(o)]
    nodes, weights = composite_gauss_legendre(-quarter, quarter, breaks, count)

    def weight(t):
        rho, d, dd = r.derivatives(-t, o)
        entries = Entries(rho, -n.x * d, d, n.x * n.x * dd - n.xx * d, -n.x * dd, dd)
        return entries.scaled(jnp.cos(t))

    return nodes, weights, weight
