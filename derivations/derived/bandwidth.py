"""D05 §6: where energy goes along a path, and how far it reaches.

Spectra read light at `M^-T Omega` after a move `M`, so energy at a frequency goes to `M^T` times
it. The matrices are those of the events. The library's curvature is positive in a valley, D05's on
a bump.
"""

from __future__ import annotations

import sympy as sp

from derivations.derived.compare import (
    LEAVING,
    Equation,
    Ot,
    at_symbols,
    d,
    k,
    x,
)
from firstorder.bandwidth import glossy_bandwidth, occluded_bandwidth
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.symbolic import UnknownField, derive
from firstorder.symbolic._programs.reading import expression, matrix
from firstorder.transport import (
    Curvature,
    Incidence,
    Mirror,
    Occlusion,
    Outgoing,
    Travel,
)

cutoff, depth, facing = sp.symbols("Omega_rho z c", positive=True)
theta_0, theta_1 = sp.symbols("theta_0 theta_1", real=True)
SLOPES_LEAVING = Frame(("x", "v"), "outgoing")


def carried(energy, event, frame):
    """Energy at a frequency, after an event that is a move."""
    (law,) = derive(event, frame).laws
    return matrix(law.M).T * energy


def after_mirror(energy):
    """Into the frame of the normal, and mirrored."""
    energy = carried(energy, Curvature(k), FLATLAND)
    return carried(energy, Mirror(), FLATLAND)


def at_eye(energy):
    """Out of that frame, across the outgoing ray, and to the eye."""
    energy = carried(energy, Curvature(k, back=True), LEAVING)
    energy = carried(energy, Outgoing(theta_1), LEAVING)
    return carried(energy, Travel(d), SLOPES_LEAVING)


def scaled(energy):
    """Energy on its line through zero, where the lobe ends: the angular frequency is the cutoff."""
    return (energy * cutoff / energy[1]).applyfunc(sp.simplify)


def mirrored_sky():
    """Distant light has energy at angular frequencies alone."""
    return scaled(after_mirror(sp.Matrix([0, 1])))


def mirrored_edge():
    """A blocker at a depth, on a tilted receiver."""
    (law,) = derive(Occlusion(UnknownField("V", ("x",)), depth=depth), FLATLAND_SLOPE).laws
    # V(x, 0) = V(x) is read at x - depth v: its energy lies along that form
    form = derive(law.factor).value.expression.args[0]
    line = sp.Matrix([sp.diff(form, x), sp.diff(form, sp.Symbol("v", real=True))])
    return scaled(after_mirror(carried(line, Incidence(theta_0), FLATLAND)))


def bandwidth():
    """Without a blocker, from the path and from the library's closed form."""
    named = at_symbols(glossy_bandwidth, cutoff, d, k, facing)
    return [sp.Abs(at_eye(mirrored_sky())[1]), expression(named)]


def bandwidth_at_edge():
    """With a blocker, likewise."""

    def edge(c, *others):
        return occluded_bandwidth(*others, cos_edge=c)

    named = at_symbols(edge, sp.cos(theta_0), cutoff, d, k, facing, depth)
    return [sp.Abs(at_eye(mirrored_edge())[1]), expression(named)]


def per_bump(rate, cosine):
    """`Omega_rho |1 + rate d / n.v|`."""
    return cutoff * sp.Abs(1 + rate * d / cosine)


DERIVED = {
    "D05.s6.2b": Equation(
        lambda: carried(sp.Matrix([0, Ot]), Curvature(k), FLATLAND),
        lambda: [k * Ot, Ot],
    ),
    "D05.s6.2c": Equation(mirrored_sky, lambda: [-k * cutoff, cutoff]),
    "D05.s6.2d": Equation(
        lambda: carried(
            carried(mirrored_sky(), Curvature(k, back=True), LEAVING),
            Outgoing(theta_1),
            LEAVING,
        ),
        lambda: [-2 * k / sp.cos(theta_1) * cutoff, cutoff],
    ),
    "D05.s6.2e": Equation(
        lambda: at_eye(mirrored_sky()),
        lambda: [
            -2 * k / sp.cos(theta_1) * cutoff,
            cutoff - d * 2 * k / sp.cos(theta_1) * cutoff,
        ],
    ),
    "D05.20": Equation(
        bandwidth, lambda: [per_bump(-2 * k, sp.cos(theta_1)), per_bump(-2 * k, facing)]
    ),
    "D05.s6.2g": Equation(
        lambda: mirrored_edge().subs(k, 0),
        lambda: [sp.cos(theta_0) / depth * cutoff, cutoff],
    ),
    "D05.21": Equation(
        bandwidth_at_edge,
        lambda: [
            per_bump(sp.cos(theta_0) / depth - 2 * k, c) for c in (sp.cos(theta_1), facing)
        ],
    ),
}  # fmt: skip
