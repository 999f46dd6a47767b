"""E11: the shadow light field of planar blockers, its spectrum, and the sheared filter.

The paper's order is (v, y), the library's (y, v).
"""

from __future__ import annotations

import functools

import sympy as sp

from derivations.derived.compare import (
    Equation,
    Ov,
    Ox,
    Oy,
    at_symbols,
    hat,
    integral,
    oo,
    t,
    unknown,
    v,
    x,
    y,
)
from firstorder.conventions import Frame
from firstorder.shadowfield import (
    ON_LIGHT,
    PLANE,
    PlanarShadowSpectrum,
    blocker_spectrum,
    light_rate_of_endless_wedge,
    planar_blocker,
    receiver_rate,
    shadow_irradiance,
    sheared_filter,
    to_two_planes,
    wedge_corners,
)
from firstorder.symbolic import UnknownField, derive
from firstorder.symbolic._edges import sifted
from firstorder.symbolic._programs.reading import expression, matrix
from firstorder.symbolic._spectra import of_spectrum

d1, d2, near, far = sp.symbols("d_1 d_2 d_min d_max", positive=True)
high, pix, fine = sp.symbols("Omega_y_max Omega_pix Omega_g", positive=True)
g, f, l_ = unknown("g", "y"), unknown("f", "y", "v"), unknown("l", "y")
G, F, LAMP = hat("g", "y"), hat("f", "y", "v"), hat("l", "y")
BLOCKER, FIELD = UnknownField("g", frame=PLANE), UnknownField("f", frame=ON_LIGHT)
LIGHT = UnknownField("l", frame=PLANE)
WINDOW = UnknownField("w", frame=Frame(("v",)))
test = unknown("p", "y")


# --- spectra -------------------------------------------------------------------------------------


@functools.cache
def on_line():
    """The blocker's spectrum under a window that has become endless: its transform is a Dirac."""
    G_, W = BLOCKER.spectrum(), WINDOW.spectrum()
    found = of_spectrum(at_symbols(lambda d: blocker_spectrum(G_, d, W), d2))
    (window,) = (e for e in found.expression.atoms(sp.Function) if "w" in type(e).__name__)
    return found.mapped(lambda e: e.xreplace({window: sp.DiracDelta(*window.args)}))


def on_line_printed():
    return G(Oy) * sp.DiracDelta(Ov - d2 * Oy)


@functools.cache
def two_planes():
    return derive(at_symbols(to_two_planes, d1), ON_LIGHT)


def between_planes(expression):
    """A formula with the blocker's spectrum in place of that of any shadow light field."""
    kind = type(F(Oy, Ov))
    return expression.replace(lambda e: type(e) is kind, lambda e: on_line()(*e.args))


@functools.cache
def occluder():
    """The blocker over (x, y): E11 (6)."""
    of_f = derive(at_symbols(to_two_planes, d1), ON_LIGHT).spectrum.expression
    return between_planes(of_f.replace(_is_light, lambda e: F(*e.args)))


def _is_light(e):
    return getattr(e, "base", "") == "L_hat"


def seen_by(spectrum):
    """What a spectrum with a Dirac says: its integral with any function of Omega_y."""
    return sifted(integral(spectrum.xreplace({Oy: t}) * test(t)))


@functools.cache
def shadow():
    """Irradiance of a light without form factor, as laws: E11 (5)."""
    return derive(at_symbols(lambda *a: shadow_irradiance(FIELD, LIGHT, *a), d1, -oo, oo))


def planar_shadow():
    """E11 (8): from (5) with a planar blocker, and the library's closed form."""
    overlap = sifted(between_planes(shadow().spectrum.expression))
    spectra = BLOCKER.spectrum(), LIGHT.spectrum()
    named = of_spectrum(at_symbols(lambda a, b: PlanarShadowSpectrum(*spectra, a, b), d1, d2))
    return [overlap, named]


def planar_shadow_printed():
    ratio = d1 / d2
    return 2 * [ratio * G(ratio * Ox) * LAMP((1 - ratio) * Ox)]


# --- filters and rates ---------------------------------------------------------------------------


def beyond(depth):
    """`d_1 / d_2 - 1`."""
    return d1 / depth - 1


def filtered(name):
    """A number of the sheared filter."""
    return expression(
        at_symbols(lambda *a: getattr(sheared_filter(*a), name), d1, near, far, high, pix)
    )


def along_receiver():
    """E11 (17), for a receiver beyond all blockers: the largest of some numbers is one of them."""

    def rate(d1, near, far, high, pix, fine):
        filter_ = sheared_filter(d1, near, far, high, pix)
        return receiver_rate(filter_, wedge_corners(d1, near, far, fine))

    found = expression(at_symbols(rate, d1, near, far, high, pix, fine))
    return found.replace(sp.Max, _largest)


def _largest(*numbers):
    """The number that exceeds all others, if `d_min < d_max < d_1`."""
    more = sp.symbols("a b", positive=True)
    apart = {far: near + more[0], d1: near + more[0] + more[1]}
    for one in numbers:
        gaps = (sp.factor(sp.cancel((one - other).xreplace(apart))) for other in numbers)
        if all(gap.is_nonnegative for gap in gaps):
            return one
    raise ValueError(f"None of {numbers} is the largest everywhere.")


def along_light():
    return expression(at_symbols(light_rate_of_endless_wedge, d1, near, far, high))


DERIVED = {
    "E11.1": Equation(
        lambda: derive(at_symbols(lambda d: planar_blocker(BLOCKER, d), d2)).value,
        lambda: g(d2 * v + y),
    ),
    "E11.3": Equation(on_line, on_line_printed),
    "E11.4": Equation(
        lambda: two_planes().spectrum.expression.replace(_is_light, lambda e: F(*e.args)),
        lambda: d1 * F(Oy + Ox, d1 * Ox),
    ),
    "E11.5": Equation(
        lambda: [shadow().value, shadow().spectrum],
        # Omega_y = -t
        lambda: [
            integral(f(t, (x - t) / d1) * l_(t)),
            d1 * integral(F(-t + Ox, d1 * Ox) * LAMP(t)),
        ],
    ),
    "E11.6": Equation(
        occluder, lambda: d1 * G(Oy + Ox) * sp.DiracDelta(d1 * Ox - d2 * (Oy + Ox))
    ),
    "E11.7": Equation(
        lambda: seen_by(occluder()),
        lambda: seen_by(d1 / d2 * G(d1 / d2 * Ox) * sp.DiracDelta((d1 / d2 - 1) * Ox - Oy)),
    ),
    "E11.8": Equation(planar_shadow, planar_shadow_printed),
    "E11.9": Equation(
        lambda: filtered("primal_scale"),
        lambda: 2 * pix / high / (1 / beyond(far) - 1 / beyond(near)),
    ),
    "E11.10": Equation(
        lambda: filtered("primal_shear"),
        lambda: -(1 / beyond(far) + 1 / beyond(near)) / 2,
    ),
    "E11.11": Equation(
        # its row for v, times the scale that follows, is the shear
        lambda: matrix(two_planes().laws[0].M)[1, :] * d1,
        lambda: [1, -1],
    ),
    "E11.12": Equation(
        lambda: matrix(two_planes().laws[0].M).extract([1, 0], [0, 1]),
        lambda: sp.diag(1 / d1, 1) * sp.Matrix([[1, -1], [0, 1]]),
    ),
    "E11.14": Equation(on_line, on_line_printed),
    "E11.17": Equation(along_receiver, lambda: fine * far / d1 + high / beyond(far)),
    "E11.18": Equation(
        along_light, lambda: high * beyond(near) * (1 / beyond(far) - 1 / beyond(near))
    ),
}  # fmt: skip
DERIVED["E11.16"] = DERIVED["E11.4"]
