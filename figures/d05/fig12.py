"""D05 Fig. 12: spectrum of the clamped cosine, and of the cosine times Fresnel's term.

The paper says "typical materials" and plots no formula. Ours are smooth dielectrics: water (index
1.33), glass (1.5) and diamond (2.4); the product is scaled to its own peak. Dots are midpoint
samples of the hump, transformed; the dashed curve is D05's printed (13), which has a pole.
"""

from __future__ import annotations

import numpy as np

from figures.d05.shared.readings import EQUAL, most
from figures.style import Drawing
from figures.verdicts import Statement, at_most, near
from firstorder import plotting
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import ClampedCosine, Fresnel, clamped_cosine_transform

MATERIALS = {"water, 1.33": 1.33, "glass, 1.5": 1.5, "diamond, 2.4": 2.4}


def draw(quick: bool) -> Drawing:
    n = 201 if quick else 1001
    W = np.linspace(-2.0, 2.0, n)
    cosine = np.asarray(clamped_cosine_transform(W))
    with np.errstate(divide="ignore"):
        printed = 2.0 * np.cos(0.5 * np.pi * W) / (1.0 - (2.0 * np.pi * W) ** 2)
    angle, weight = _hump(600)
    products = {name: _product(index, angle) for name, index in MATERIALS.items()}
    spectra = {k: _transform(v, angle, weight, W).real for k, v in products.items()}

    figure, axes = plotting.panels(1, 3, 3.6, 3.0)
    a, b, c = axes[0]
    a.plot(W, cosine, label=r"$2\cos(\pi^2\Omega)/(1-(2\pi\Omega)^2)$")
    near = np.abs(np.abs(W) - 0.5 / np.pi) < 0.02
    a.plot(W, np.where(near, np.nan, printed), label="as printed", alpha=0.8)
    h = np.pi / 64
    samples = -0.5 * np.pi + h * (np.arange(64) + 0.5)
    dots = np.linspace(-2.0, 2.0, 41)
    sampled = (np.cos(samples) * np.cos(2 * np.pi * dots[:, None] * samples)).sum(axis=1) * h
    a.plot(dots, sampled, "o", markersize=2.5, linestyle="none", label="transformed samples")
    a.set(title="a) clamped cosine", ylim=(-1.2, 3.6))
    a.legend(loc="upper right", fontsize=7)
    b.plot(W, np.abs(cosine) / 2.0, label="cosine")
    for name, F in spectra.items():
        b.plot(W, np.abs(F) / np.max(np.abs(F)), label=name)
    b.set(title="b) times Fresnel, scaled", ylim=(0.0, 1.05))
    b.legend(fontsize=7)
    degrees = np.degrees(angle)
    c.plot(degrees, np.cos(angle), label="cosine")
    for name, values in products.items():
        c.plot(degrees, values / np.max(values), label=name)
    c.set(title="c) the same over the angle, scaled", xlabel=r"$\theta$ (degrees)", ylim=(0, 1.05))
    for ax in (a, b):
        ax.set_xlabel(plotting.label("Omega_theta"))

    curves = {"spectra": {"Omega_theta": W, "cosine": cosine, "printed": printed, **spectra}}
    arrays = {"Omega_theta": W, "cosine": cosine, "printed": printed, "angle": angle, **products}
    off = float(np.max(np.abs(sampled - np.asarray(clamped_cosine_transform(dots)))))
    wrong = float(np.abs(printed - cosine)[np.argmin(np.abs(W - 0.5))])
    claims = [*_transforms(wrong, off, h**2 / 6.0), *_low(angle, weight)]
    return Drawing(figure, arrays, claims, curves, size=f"{n} frequencies, 600 angles")


def _transforms(wrong, off, grid_error) -> list[Statement]:
    return [
        Statement("(13) is the transform of the clamped cosine: as printed, off at half a cycle by",
                  0.0, wrong, at_most(EQUAL, "rounding"), "D05 (13)",
                  reason="A misprint: cos(pi Omega / 2) for cos(pi^2 Omega). It is off at all "
                  "frequencies but a few and has a pole at 1 / (2 pi), where the transform is "
                  "finite."),
        Statement("... corrected, off the samples by at most", 0.0, off,
                  at_most(grid_error, "the grid error h^2 / 6 of midpoints"), "D05 (13)"),
        Statement("The transform falls off as this power of frequency", -2.0, _falloff(),
                  near(-2.0, 0.025, "to the frequencies fitted"), "D05 §4.1"),
    ]  # fmt: skip


def _low(angle, weight) -> list[Statement]:
    """Energy below 1 / pi: over that band the hump makes one period in the half circle and less."""
    bare = _share(np.cos(angle), angle, weight)
    indices = np.linspace(min(MATERIALS.values()), max(MATERIALS.values()), 23)
    shares = [_share(_product(n, angle), angle, weight) for n in indices]
    return [
        Statement("Most of the cosine's energy is centred around zero: below 1/pi cycles/rad",
                  "most", bare, most(), "D05 §4.1 Fig. 12 (a)"),
        Statement("Cosine times Fresnel contains mostly low frequencies, for typical materials: "
                  "least energy below 1/pi cycles/rad", "mostly", float(np.min(shares)),
                  most("mostly"), "D05 §4.3 Fig. 12 (b)",
                  scanned="dielectrics of index 1.33 to 2.4"),
    ]  # fmt: skip


def _product(index: float, angle) -> np.ndarray:
    """Cosine times Fresnel's reflectance."""
    return np.asarray(ClampedCosine()(0.0, angle) * Fresnel(index)(0.0, angle))


def _hump(nodes: int):
    """Gauss-Legendre nodes above the horizon."""
    t, w = gauss_legendre(nodes)
    return 0.5 * np.pi * t, 0.5 * np.pi * w


def _transform(values, angle, weight, W):
    return np.exp(-2j * np.pi * W[:, None] * angle) @ (values * weight)


def _share(values, angle, weight) -> float:
    """Fraction of the energy below 1 / pi cycles per radian, by Parseval."""
    W = np.linspace(-1.0, 1.0, 201) / np.pi
    F = _transform(values, angle, weight, W)
    return float(np.trapezoid(np.abs(F) ** 2, W) / np.sum(values**2 * weight))


def _falloff() -> float:
    """Fitted power of the envelope: the largest value over one period of its cosine."""
    W = np.array([10.0, 20.0, 40.0, 80.0])
    over = W[:, None] + np.linspace(0.0, 2.0 / np.pi, 41)
    return float(
        np.polyfit(np.log(W), np.log(np.max(np.abs(clamped_cosine_transform(over)), axis=1)), 1)[0]
    )
