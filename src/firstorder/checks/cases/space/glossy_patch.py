"""A curved mirror in space between two rays aslant, axes rolled, out of the plane of incidence."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases.space._light import (
    CENTER,
    FREQUENCIES,
    RAYS,
    SPREAD,
    bell,
    box,
    light,
)
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.laws import Move
from firstorder.transport import Chain, Event, GlossyPatch
from firstorder.transport.chain4d._equator import ComposedMove

SHAPE = np.array([[-0.25, 0.06], [0.06, 0.15]])
THERE, AWAY, ROLL, OUT = 0.6, -0.45, 0.25, 0.15


def _unit(theta, turned=0.0):
    """A direction of the plane that is turned by an angle about the normal."""
    c, s = np.cos(turned), np.sin(turned)
    return np.array([-np.sin(theta) * c, -np.sin(theta) * s, np.cos(theta)])


def _matrix():
    """Every step to first order, written out with vectors: the four coordinates and the shift."""
    c, s = np.cos(ROLL), np.sin(ROLL)
    rolled = np.kron(np.eye(2), np.array([[c, -s], [s, c]]))
    onto = np.diag([np.cos(THERE), 1.0, 1.0, 1.0])
    bend = np.eye(4)
    bend[2:, :2] = np.diag([1.0, np.cos(THERE)]) @ SHAPE
    mirror = np.diag([1.0, 1.0, -1.0, -1.0])
    m, o = _unit(-THERE), _unit(AWAY, OUT)
    pole = np.cross(m, o) / np.linalg.norm(np.cross(m, o))
    pole *= np.sign(pole[1])
    # m seen from its own plane and from the common one; then o from the common one and its own
    along_m, along_o = np.cross(pole, m), np.cross(pole, o)
    across_o = np.array([-np.sin(OUT), np.cos(OUT), 0.0])
    at_m = np.array([[-np.cos(THERE), 0.0, np.sin(THERE)], [0.0, -1.0, 0.0]])
    at_o = np.stack([np.cross(across_o, o), across_o])
    first = at_m @ np.stack([-along_m, -pole]).T
    second = np.stack([along_o, pole]) @ at_o.T
    q = np.array([[np.cos(OUT), -np.sin(OUT)], [np.sin(OUT), np.cos(OUT)]])
    zero = np.zeros((2, 2))
    turn = np.block([[np.eye(2), zero], [zero, first]]) @ np.block([[q, zero], [zero, second]])
    back = np.eye(4)
    back[2:, :2] = -np.diag([1.0, np.cos(AWAY)]) @ (q.T @ SHAPE @ q)
    leave = np.diag([1.0 / np.cos(AWAY), 1.0, 1.0, 1.0])
    # where the outgoing ray is, on the common equator, from the mirror direction
    apart = np.arctan2(-(o @ along_m), o @ m)
    shift = rolled @ onto @ bend @ mirror @ np.concatenate([np.zeros(2), first @ [apart, 0.0]])
    return rolled @ onto @ bend @ mirror @ turn @ back @ leave, shift


M, C = _matrix()
BACK = np.linalg.inv(M)


def brute(u):
    """`f(M u + c)`."""
    return bell(M @ u + C)


def chain(S=SHAPE, there=THERE, away=AWAY, out=OUT, roll=ROLL):
    """The chain of a mirror with these numbers."""
    return GlossyPatch(jnp.asarray(S), there, None, away, out, roll).chain()


CASES = (
    Case(
        "curved mirror in space",
        chain(),
        light(),
        box(28, BACK @ (CENTER - C), BACK @ SPREAD @ BACK.T),  # narrow bells aslant: 28^4
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    ),
)


class _Swapped(Event):
    """An event whose law is changed."""

    chain: Chain
    change: object

    def law(self, frame):
        """All moves as one, changed."""
        return self.change(ComposedMove(self.chain.events).law(frame))


EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("hill for valley", lambda s: chain(-SHAPE), EVERY),
    Fault("exchange the curvatures", lambda s: chain(SHAPE[::-1, ::-1]), EVERY),
    Fault("roll the other way", lambda s: chain(roll=-ROLL), EVERY),
    Fault("leave on the other side", lambda s: chain(out=-OUT), EVERY),
    Fault(
        "no cosine across the plane",
        lambda s: chain(np.diag([1.0, 1.0 / np.cos(THERE)]) @ SHAPE),
        EVERY,
    ),
    Fault(
        "forget 1 / |det M|",
        lambda s: _Swapped(
            s,
            lambda law: twin(
                law,
                spectrum=lambda m, F, w: Move.spectrum(m, F, w) * jnp.abs(jnp.linalg.det(m.M)),
            ),
        ),
        ("spectrum",),
    ),
)
