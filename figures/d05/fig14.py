"""D05 Fig. 14: diffuse shading under an environment map, a convolution and a product at once.

The paper gives no numbers. Ours: a sky of two Gaussian suns (0.35 rad at 0.5, 0.15 rad at -0.6,
half as bright), a hill of curvature -0.7 rad/m, seen through a Gaussian window 5 m wide, because an
endless plane has a Dirac for a spectrum. (a)-(d) are the panels of the paper; (e) compares the
irradiance of the fourth step with the sky blurred by the cosine.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.d05.shared.readings import equal
from figures.style import Drawing
from figures.verdicts import Statement
from firstorder import plotting
from firstorder.checks.tolerance import normwise
from firstorder.fields import Function, Grid, gaussian
from firstorder.laws import Integrate
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import Cosine, Curvature, clamped_cosine_transform

KAPPA, WINDOW = -0.7, 5.0
SUNS = ((0.5, 0.35, 1.0), (-0.6, 0.15, 0.5))  # angle, width, brightness


def draw(quick: bool) -> Drawing:
    n = 81 if quick else 241
    Ox, Ot = np.linspace(-1.5, 1.5, n), np.linspace(-2.0, 2.0, n)
    suns = [gaussian((0.0, a), (WINDOW, s), amplitude=b) for a, s, b in SUNS]
    sky = suns[0] + suns[1]
    path = sky >> Curvature(KAPPA) >> Cosine(window=Grid.spanning((2, 288), (1.0, 15.0)))
    spectra = [eqx.filter_jit(lambda F: F(Ox[:, None], Ot))(F) for F in path.spectra]
    spectra = [np.asarray(F) for F in spectra]
    line = np.asarray(
        eqx.filter_jit(lambda F: F(Ox))(Integrate("theta", -9.0, 9.0)(path.spectra[-1]))
    )

    x = np.linspace(-2.0, 2.0, n)
    E = np.asarray(_endless(x))
    blurred = _blurred_sky(KAPPA * x)
    product = (
        _sky_transform(Ox / KAPPA) * np.asarray(clamped_cosine_transform(Ox / KAPPA)) / abs(KAPPA)
    )

    figure, axes = plotting.panels(1, 5, 2.75, 2.7)
    titles = ("a) environment", "b) after rotation", "c) after the cosine")
    for c, (F, title) in enumerate(zip(spectra, titles, strict=True)):
        plotting.show_spectrum(axes[0, c], F, Ox, Ot, decades=4.0, title=title)
    # A window w(x) blurs the line's product with its own transform, along Omega_x.
    axes[0, 3].plot(Ox, np.abs(product), label="product of 1D spectra")
    peak = np.max(np.abs(product)) / np.max(np.abs(line))
    axes[0, 3].plot(Ox, np.abs(line) * peak, label="c) at $\\Omega_\\theta=0$, scaled")
    axes[0, 3].set(title="d) on the horizontal line", xlabel=plotting.label("Omega_x"))
    axes[0, 3].set_ylim(0.0, 1.45 * np.max(np.abs(product)))
    axes[0, 3].legend(fontsize=7, loc="upper right")
    axes[0, 4].plot(x, E, label="shaded, step by step")
    axes[0, 4].plot(x, blurred, label="sky $\\otimes\\cos_+$ at $kx$")
    axes[0, 4].set(title="e) irradiance", xlabel=plotting.label("x"))
    axes[0, 4].set_ylim(0.0, 1.3 * np.max(E))
    axes[0, 4].legend(fontsize=7, loc="upper right")
    curves = {"irradiance": {"x": x, "shaded": E, "blurred": blurred}}
    arrays = {"Omega_x": Ox, "Omega_theta": Ot, "line": line, "product": product, "x": x, "E": E}
    arrays |= {f"spectrum_{i}": F for i, F in enumerate(spectra)}
    return Drawing(figure, arrays, _claims(E, blurred), curves, size=f"{n} x {n} frequencies")


def _claims(E, blurred) -> list[Statement]:
    same = normwise(E, blurred)
    # The 2D transform of dE' = e(theta + k x) cos+(theta) at one frequency, by plain sums.
    Ox, Ot = 0.2, 0.3
    t, w = gauss_legendre(64)
    angle, weight = 0.5 * np.pi * t, 0.5 * np.pi * w
    place = np.arange(-9.0, 9.0, 0.01)
    dE = _sky(angle[:, None] + KAPPA * place) * (np.cos(angle) * weight)[:, None]
    phase = np.exp(-2j * np.pi * (Ox * place + Ot * angle[:, None]))
    truth = np.sum(dE * phase) * 0.01
    printed = _sky_transform(Ox / KAPPA) * float(clamped_cosine_transform(Ox / KAPPA - Ot))
    without, corrected = abs(printed / truth - 1), abs(printed / abs(KAPPA) / truth - 1)
    words = "The spectrum of dE' is the pairwise product of two 1D spectra"
    return [
        Statement("Irradiance is the sky convolved with the cosine, read at k x", 0.0, same,
                  equal(), "D05 §6.1", "normwise"),
        Statement(f"{words}, as printed: off by", 0.0, without, equal(), "D05 §6.1", "relative",
                  reason="A sky that is read at k x has its spectrum at Omega_x / k, over |k|: the "
                  "printed product lacks that factor and is off by |k| - 1 at all curvatures but "
                  "1 and -1."),
        Statement(f"{words} over |k|, as corrected: off by", 0.0, corrected, equal(), "D05 §6.1",
                  "relative"),
    ]  # fmt: skip


def _sky(theta):
    return sum(b * np.exp(-0.5 * ((theta - a) / s) ** 2) for a, s, b in SUNS)


def _sky_transform(Omega):
    """Closed-form transform of the two suns."""
    return sum(
        b * s * np.sqrt(2 * np.pi) * np.exp(-2 * (np.pi * s * Omega) ** 2 - 2j * np.pi * Omega * a)
        for a, s, b in SUNS
    )


def _endless(x):
    """Irradiance by events, of a sky that does not depend on place at all."""
    distant = Function(
        lambda place, angle: (
            sum(b * jnp.exp(-0.5 * ((angle - a) / s) ** 2) for a, s, b in SUNS) + 0.0 * place
        )
    )
    lit = (Curvature(KAPPA) >> Cosine())(distant)
    E = Integrate("theta", -0.5 * jnp.pi, 0.5 * jnp.pi, 96)(lit)
    return eqx.filter_jit(lambda f: f(x))(E)


def _blurred_sky(normal):
    """`int sky(a) cos+(a - n) da` by quadrature about each normal."""
    t, w = gauss_legendre(96)
    angle = normal[:, None] + 0.5 * np.pi * t
    return (_sky(angle) * np.cos(angle - normal[:, None])) @ (0.5 * np.pi * w)
