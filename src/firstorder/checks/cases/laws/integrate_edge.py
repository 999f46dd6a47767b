"""Integrate across an edge that moves with x: boundary terms of gradient and Hessian."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.cases.laws.integrate import FREQUENCIES, RAYS, scaled
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import Frame
from firstorder.fields import Affine, Constant, Edge, Field, Grid, HalfPlane, Jet
from firstorder.laws import Integrate, Multiply
from firstorder.numerics._quadrature import composite_gauss_legendre

LEVEL, DARK = Affine([0.8, -1.0], 0.1), 0.2
MASK = Multiply(HalfPlane(LEVEL, DARK, 1.0), Grid.spanning((200, 200), (6.0, 6.0)))


def brute(u):
    """Adaptive quadrature, told where the edge is."""
    edge = 0.8 * u[0] + 0.1
    low, high = (
        quad(lambda t: bell(u[0], t), *ends, epsabs=1e-13, epsrel=1e-13)[0]
        for ends in ((-6.0, edge), (edge, 6.0))
    )
    return low + DARK * high


CASES = (
    Case(
        "integrate, an edge",
        Integrate("theta", -6.0, 6.0),
        MASK(light()),
        Grid.spanning((97,), (6.0,)),
        FREQUENCIES,
        RAYS,
        brute,
        Grid.spanning((32, 32), (4.5, 4.5)),
        # The samples of a jump misplace it by at most half a step.
        bounds={"wavelet": 0.5 * 9.0 / 32},
        expected={"covariance": "refused", "wavelet": "approximate"},
    ),
)


class Unbroken(Field):
    """A field that does not tell where it breaks, or tells it wrong."""

    field: Field
    shift: float | None = eqx.field(static=True, default=None)

    @property
    def frame(self) -> Frame:
        """Frame of the light, unchanged."""
        return self.field.frame

    def at(self, u):
        """Radiance of the light, unchanged."""
        return self.field.at(u)

    def jet(self, u):
        """Jet of the light, unchanged."""
        return self.field.jet(u)

    def edges(self):
        """None, or shifted ones."""
        if self.shift is None:
            return ()
        beside = Constant(self.shift, self.frame)
        return tuple(Edge(e.level + beside, e.jump) for e in self.field.edges())


def through(change):
    """The law applied to a field that has been tampered with."""
    return lambda s: twin(
        s,
        value=lambda m, f, u: Integrate.value(m, change(f), u),
        jet=lambda m, f, u: Integrate.jet(m, change(f), u),
    )


def interior(m, f, u):
    """Panels that split at the edges, and no boundary term: what forgets the jump."""
    _, along, (lower, *inner, upper) = m._line(f, u)
    t, w = composite_gauss_legendre(lower.value, upper.value, [b.value for b in inner], m.nodes)
    jets = jax.vmap(lambda s: f.jet(along(s)))(t)
    total = jax.tree.map(lambda leaf: jnp.tensordot(w, leaf, axes=(0, 0)), jets)
    return Jet(total.value, total.gradient[:1], total.hessian[:1, :1], m.frame(f.frame))


def reversed_jump(m, f, u):
    """The boundary terms with the wrong sign."""
    right, inside = Integrate.jet(m, f, u), interior(m, f, u)
    return jax.tree.map(lambda a, b: 2.0 * a - b, inside, right)


JETS = ("gradient", "hessian")
FAULTS = (
    Fault("do not split at the edge", through(Unbroken), ("value", *JETS)),
    Fault("split beside the edge", through(lambda f: Unbroken(f, 0.1)), ("value", *JETS)),
    Fault("forget the jump", lambda s: twin(s, jet=interior), JETS),
    Fault("flip the jump", lambda s: twin(s, jet=reversed_jump), JETS),
    Fault("take the mean", scaled(1.0 / 12.0), ("value", *JETS, "spectrum", "wavelet")),
    Fault("divide by 2 pi", scaled(0.5 / np.pi), ("spectrum", "wavelet")),
    Fault(
        "integrate over the position",
        lambda s: Integrate("x", s.lower, s.upper),
        ("value", *JETS, "spectrum", "wavelet"),
    ),
)
