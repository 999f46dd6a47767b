"""A bumpy ellipsoid rendered without the library: implicit surface, closed hits, Blinn's tilt.

Written for any module of arrays: NumPy for differences, JAX for automatic differentiation. Bumps
are a function of space, restricted to the surface: no (u, v) here, and no shape operator.
"""

from __future__ import annotations

import functools

import numpy as np

from derivations.imaging import _surfaces as our

RADII = our.RADII
EYE = np.array([1.6, 1.2, 1.4])
GAMMA = 1.5
BUMPS = ((0.010, (9.0, 4.0, -3.0), 0.3), (0.006, (-2.0, 11.0, 7.0), 1.1))
PIXELS = np.array([[0.05, -0.08], [-0.21, 0.1], [0.14, 0.17], [-0.05, 0.02]])
NEAR = np.array([0.0, 1.0])
STEP = 1e-3


def camera():
    """Columns right, up, back of a camera that looks at the origin."""
    back = our.unit(EYE)
    right = our.unit(np.cross([0.0, 0.0, 1.0], back))
    return np.stack([right, np.cross(back, right), back], 1)


def height(x, m=np):
    """Waves through space."""
    return sum(a * m.sin(m.sum(np.array(k) * x, -1) + f) for a, k, f in BUMPS)


def height_slope(x, m=np):
    """The gradient of the waves."""
    return sum(a * m.cos(m.sum(np.array(k) * x, -1) + f) * np.array(k) for a, k, f in BUMPS)


def distant(x, w, m=np):
    """A smooth environment."""
    return m.exp(0.9 * w[..., 0] - 0.7 * w[..., 1] * w[..., 2] + 0.5 * w[..., 2]) + 0.0 * x[0]


def light(x, w, near, m=np):
    """The environment (near = 0), or the light of a lamp in the room (near = 1)."""
    return (1.0 - near) * distant(x, w, m) + near * our.light(x, w, m)


def hit(p, m=np):
    """Where the ray through p meets the ellipsoid, and its normal: a quadratic equation."""
    d = camera() @ m.stack([p[0], p[1], -GAMMA * (1.0 + 0.0 * p[0])])
    d = d / m.sqrt(m.sum(d * d))
    a, b, c = m.sum((d / RADII) ** 2), m.sum(d * EYE / RADII**2), np.sum((EYE / RADII) ** 2) - 1.0
    x = EYE + (-b - m.sqrt(b * b - a * c)) / a * d
    n = x / RADII**2
    return x, n / m.sqrt(m.sum(n * n)), -d


def render(p, near, m=np):
    """The image at p as a mirror, and glossy: Blinn's normal, a sum over the sphere."""
    x, n, v = hit(p, m)
    slope = height_slope(x, m)
    n = n - (slope - m.sum(slope * n) * n)
    n = n / m.sqrt(m.sum(n * n))
    r = 2.0 * m.sum(n * v) * n - v
    w, weights = our.sphere(32)
    glossy = m.sum(weights * light(x, w, near, m) * bell(m.sum(w * r, -1), m))
    return m.stack([light(x, r, near, m), glossy])


def bell(t, m, k=our.SHARPNESS):
    """The glossy lobe."""
    return k / (2.0 * np.pi * (1.0 - np.exp(-2.0 * k))) * m.exp(k * (t - 1.0))


@functools.cache
def by_differences():
    """Gradients of the re-rendered image: central differences of eighth order.

    Shape (light, pixel, mirror or glossy, px or py), as in the others.
    """

    def gradient(p, near):
        steps = [our.slope(lambda s, e=e: render(p + s * e, near), STEP) for e in np.eye(2)]
        return np.stack(steps, -1)

    return np.array([[gradient(p, near) for p in PIXELS] for near in NEAR])


@functools.cache
def by_autodiff():
    """The same by forward differentiation of the renderer."""
    import jax
    import jax.numpy as jnp

    gradient = jax.vmap(jax.jacfwd(lambda p, near: render(p, near, jnp)), (0, None))
    lights = jax.jit(jax.vmap(gradient, (None, 0)))
    return np.asarray(lights(jnp.asarray(PIXELS), jnp.asarray(NEAR)))


def ellipsoid(uv):
    """The ellipsoid by longitude and latitude, for the library's charts."""
    import jax.numpy as jnp

    u, v = uv
    return RADII * jnp.stack([jnp.cos(v) * jnp.cos(u), jnp.cos(v) * jnp.sin(u), jnp.sin(v)])


def longitude_latitude(x):
    """Its inverse."""
    import jax.numpy as jnp

    y = x / RADII
    return jnp.stack([jnp.arctan2(y[1], y[0]), jnp.arctan2(y[2], jnp.hypot(y[0], y[1]))])


def library(p, near):
    """Value and image gradient by the library, as a mirror and glossy; and what they are made of.

    Returns:
        Values (2,), gradients (2, 2), and the view, the point and the light reflected (both).
    """
    import jax.numpy as jnp

    from firstorder.imaging._bumps import bumped, chart
    from firstorder.imaging._reflection import reflected_radiance
    from firstorder.imaging.camera import Pinhole, image_gradient
    from firstorder.laws import VonMisesFisher, Zonal

    pinhole = Pinhole(jnp.asarray(EYE, p.dtype), jnp.asarray(camera(), p.dtype), GAMMA)
    x, n, _ = hit(p, jnp)
    view = pinhole.view(p, jnp.linalg.norm(x - EYE), n)
    uv = longitude_latitude(view.position)
    point = bumped(chart(ellipsoid, uv), lambda uv: height(ellipsoid(uv), jnp), uv)
    lobes = (None, Zonal(VonMisesFisher(our.SHARPNESS), 16, 32))
    B = [
        reflected_radiance(lambda x, w: light(x, w, near, jnp), point, view.to_eye, k)
        for k in lobes
    ]
    values, gradients = [b.value for b in B], [image_gradient(view, point, b) for b in B]
    return jnp.stack(values), jnp.stack(gradients), (view, point, B)


@functools.cache
def ours():
    """The library at `PIXELS` under both lights."""
    import jax
    import jax.numpy as jnp

    lights = jax.jit(jax.vmap(jax.vmap(library, (0, None)), (None, 0)))
    return lights(jnp.asarray(PIXELS), jnp.asarray(NEAR))
