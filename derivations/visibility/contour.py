"""Integrals over regions of the sphere along their edges, by Stokes' theorem.

From the definitions: solid angle is the flux of P / |P|^3 through any surface that a region is the
shadow of, the cosine-weighted one that of (z.P) P / |P|^4. Each contour form is a vector potential;
its curl must be that flux. A receiver that moves sees the same surface from elsewhere, so that the
rate of the flux is minus the derivative of the potential; that this is the law of Biot and Savart
up to a gradient is a curl that vanishes.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

x, y, z = sp.symbols("x y z", real=True)
P = sp.Matrix([x, y, z])
D = sp.sqrt(P.dot(P))
UP = sp.Matrix([0, 0, 1])


def _curl(A):
    return sp.Matrix(
        [A[2].diff(y) - A[1].diff(z), A[0].diff(z) - A[2].diff(x), A[1].diff(x) - A[0].diff(y)]
    )


def _one_form(vector):
    """The A of `vector . (P x dP) = A . dP`."""
    return vector.cross(P)


def values():
    """Curls of the contour forms, less the fluxes that define solid angle and vector irradiance."""
    left = list(_curl(_one_form(UP) / (D * (D + z))) - P / D**3)
    for axis in sp.eye(3).columnspace():
        left += list(_curl(_one_form(axis) / (2 * D**2)) - axis.dot(P) * P / D**4)
    return [sp.simplify(e) for e in left]


def rates():
    """Derivatives of the forms under motion of the eye, less Biot and Savart: closed forms."""
    left = []
    weights = {1: _one_form(UP) / (D * (D + z)), z / D: _one_form(UP) / (2 * D**2)}
    for weight, form in weights.items():
        for i, axis in enumerate(sp.eye(3).columnspace()):
            moved = -form.diff((x, y, z)[i])
            left += list(_curl(moved - weight * _one_form(axis) / D**3))
    return [sp.simplify(e) for e in left]


def segments():
    """Closed forms along a segment: their derivatives in its end are the forms there."""
    t, h = sp.symbols("t h", positive=True)
    # In the plane of the segment: from (h, 0) to (h, t), at the distance h of the eye.
    angle = sp.atan(t / h).diff(t) - h / (h**2 + t**2)
    A, B = h, sp.sqrt(h**2 + t**2)
    wire = h * t * (A + B) / (A * B * (A * B + h * h))
    return [sp.simplify(angle), sp.simplify(wire.diff(t) - h / B**3)]


# --- numeric routes ------------------------------------------------------------------------------

CORNERS = ((0.9, -0.4, 0.8), (0.8, 1.1, 1.4), (-0.7, 0.5, 0.9))


def _solid(corners):
    """Solid angle of a triangle by the triple product, in mpmath."""
    a, b, c = (mp.matrix(v) for v in corners)

    def dot(u, v):
        return sum(i * j for i, j in zip(u, v, strict=True))

    A, B, C = (mp.sqrt(dot(v, v)) for v in (a, b, c))
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    below = A * B * C + dot(a, b) * C + dot(b, c) * A + dot(c, a) * B
    return 2 * mp.atan2(triple, below)


def _quadrature(corners, weight):
    """A weighted solid angle by quadrature over the triangle, in NumPy."""
    u, w = np.polynomial.legendre.leggauss(40)
    u, w = 0.5 + 0.5 * u, 0.5 * w
    a, b, c = (np.array(v) for v in corners)
    s, t = u[:, None], u[None, :]
    p = a + s[..., None] * (b - a) + (s * t)[..., None] * (c - b)
    n = np.cross(b - a, c - a)
    d = np.linalg.norm(p, axis=-1)
    dw = np.abs(p @ n) / d**3 * s
    return np.sum(w[:, None] * w[None, :] * dw * weight(p / d[..., None]))


def _outline(function):
    import jax.numpy as jnp

    corners = [jnp.array(c) for c in CORNERS]
    return sum(function(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))


def by_quadrature() -> float:
    """The closed forms of a triangle against quadrature over its face."""
    from firstorder.visibility import _contour as contour

    solid = _quadrature(CORNERS, lambda w: 1.0)
    vector = np.array([_quadrature(CORNERS, lambda w, i=i: w[..., i]) for i in range(3)])
    found = np.asarray(_outline(contour.segment_vector_irradiance))
    first = abs(abs(float(_outline(contour.segment_solid_angle))) - solid)
    return max(first, float(np.abs(np.abs(found) - np.abs(vector)).max()))


def _moved(i, step):
    return [[mp.mpf(c[k]) - (step if k == i else 0) for k in range(3)] for c in CORNERS]


def by_differences() -> float:
    """Biot and Savart's law of a triangle against differences of its solid angle in 40 digits."""
    from firstorder.visibility import _contour as contour

    with mp.workdps(40):
        h = mp.mpf("1e-12")
        truth = [float((_solid(_moved(i, h)) - _solid(_moved(i, -h))) / (2 * h)) for i in range(3)]
        sign = float(mp.sign(_solid(_moved(0, mp.mpf(0)))))
    found = np.asarray(_outline(contour.segment_translation_rate))
    turned = np.sign(float(_outline(contour.segment_solid_angle)))
    return float(np.abs(found * turned - np.array(truth) * sign).max())


def by_autodiff() -> float:
    """The same law, and the cosine-weighted one, against autodiff of the closed values."""
    import jax
    import jax.numpy as jnp

    from firstorder.numerics._quadrature import gauss_legendre
    from firstorder.visibility import _contour as contour

    t, w = (jnp.asarray(a) for a in gauss_legendre(40))

    def rate(a, b):
        p = a + (0.5 + 0.5 * t)[:, None] * (b - a)
        d = jnp.sqrt(jnp.sum(p * p, -1))
        flow = contour.translation_rate(p, jnp.broadcast_to(b - a, p.shape))
        return jnp.sum((0.5 * w * p[:, 2] / d)[:, None] * flow, 0)

    def solid(eye):
        return _outline(lambda a, b: contour.segment_solid_angle(a - eye, b - eye))

    def cosine(eye):
        return _outline(lambda a, b: contour.segment_vector_irradiance(a - eye, b - eye)[2])

    here = jnp.zeros(3)
    pairs = (
        (jax.grad(solid)(here), _outline(contour.segment_translation_rate)),
        (jax.grad(cosine)(here), _outline(rate)),
    )
    return max(float(jnp.max(jnp.abs(a - b))) for a, b in pairs)


CONTOUR = "firstorder.visibility._contour"

ROWS = [
    Row(
        "C.space.contour",
        "identity",
        f"{CONTOUR}.segment_vector_irradiance",
        symbolic=lambda: [*values(), *segments()],
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(by_quadrature, 1e-12),
    ),
    Row(
        "C.space.biot-savart",
        "identity",
        f"{CONTOUR}.segment_translation_rate",
        symbolic=rates,
        autodiff=Check(by_autodiff, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(by_differences, 1e-13),
    ),
]
