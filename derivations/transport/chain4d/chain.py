"""A curved mirror in space, to first order: straight rays off a paraboloid (Coddington).

The outgoing ray is followed back: where it meets `z = x.S x / 2`, its mirror image about the normal
there, and where that crosses the plane across the incoming ray.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.transport.chain4d import _space_tracer as tracer
from firstorder.conventions import SPACE_SLOPE
from firstorder.laws import Move, Warp
from firstorder.ledger import Check, Row, na
from firstorder.transport import GlossyPatch


def coddington():
    """The Jacobian of the traced ray at the central one, for a general shape operator."""
    x, y, v, w, a, b, d, tilt = sp.symbols("x y v w S_11 S_12 S_22 theta_0", real=True)
    u = sp.Matrix([x, y, v, w])
    zero = {x: 0, y: 0, v: 0, w: 0}
    S = sp.Matrix([[a, b], [b, d]])

    def frame(angle):
        c, s = sp.cos(angle), sp.sin(angle)
        return sp.Matrix([[c, 0, -s], [0, 1, 0], [s, 0, c]])

    p, along = frame(-tilt) * sp.Matrix([x, y, 0]), frame(-tilt) * sp.Matrix([-v, -w, 1])
    # p + t d on the surface: t vanishes at zero, so its first order is that of -height / slope
    flat = p[:2, :]
    height = p[2] - (flat.T * S * flat)[0] / 2
    q = p - along * (height / along[2])
    n = sp.Matrix([*(-S * q[:2, :]), 1])
    image = 2 * (n.dot(along) / n.dot(n)) * n - along
    there, back = frame(tilt).T * q, frame(tilt).T * image
    at = there - back * (there[2] / back[2])
    met = sp.Matrix([at[0], at[1], -back[0] / back[2], -back[1] / back[2]])
    J = met.jacobian(u).subs(zero)
    c = sp.cos(tilt)
    zeros = sp.zeros(2)
    P = sp.Matrix([[a / c, b], [b, d * c]])
    expected = sp.Matrix.vstack(
        sp.Matrix.hstack(sp.eye(2), zeros), sp.Matrix.hstack(2 * P, -sp.eye(2))
    )
    return list((J - expected).applyfunc(sp.simplify))


S = np.array([[-0.5, 0.13], [0.13, 0.3]])


def by_tracing() -> float:
    """The matrix against differences of traced rays, axes rolled and not."""
    worst = 0.0
    for there, roll in ((0.7, 0.0), (-0.9, 0.3)):
        traced = tracer.jacobian(
            lambda u, t=there, r=roll: tracer.reflected_ray(S, t, -t, 0.0, r, u)
        )
        ours = GlossyPatch(jnp.asarray(S), there, roll=roll).mirror_matrix()
        worst = max(worst, float(np.max(np.abs(traced - np.asarray(ours)))))
    return worst


def exact_map(patch: GlossyPatch):
    """All exact warps of a patch without lobe, as one function of the ray."""
    laws, frame = [], SPACE_SLOPE
    for event in patch.chain(exact=True).events:
        law = event.law(frame)
        assert isinstance(law, Move | Warp)
        laws.append(law)
        frame = law.frame(frame)

    def back(u):
        for law in reversed(laws):
            u = law.map(u) if isinstance(law, Warp) else law.preimage(u)
        return u

    return back


def by_autodiff() -> float:
    """The matrix against the Jacobian of the exact steps together."""
    patch = GlossyPatch(jnp.asarray(S), 0.7, azimuth=0.0, roll=0.4)
    J = jax.jacfwd(exact_map(patch))(jnp.zeros(4))
    return float(np.max(np.abs(np.asarray(J) - np.asarray(patch.mirror_matrix()))))


ROWS = [
    Row(
        "C.space.chain",
        "identity",
        "firstorder.transport.chain4d.chain.GlossyPatch.mirror_matrix",
        coddington,
        autodiff=Check(by_autodiff, 1e-13),
        fourier=na("two routes"),
        brute_force=Check(by_tracing, 1e-10),
        note="What D05 §5.2 leaves out. The tangential power is 2 S_11 / cos, the sagittal 2 S_22 "
        "cos; D05's shear by k_2 alone makes the latter 2 S_22.",
    ),
]
