"""D05 Fig. 12: spectrum of the clamped cosine, and of the cosine times Fresnel's term.

The paper says "typical materials" and plots no formula. Ours are smooth dielectrics: water (index
1.33), glass (1.5) and diamond (2.4); the product is scaled to its own peak. Dots are midpoint
samples of the hump, transformed; the dashed curve is D05's printed (13), which has a pole.
"""

from __future__ import annotations

import numpy as np

from figures.style import Claim, Drawing
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
    products = {
        name: np.asarray(ClampedCosine()(0.0, angle) * Fresnel(eta)(0.0, angle))
        for name, eta in MATERIALS.items()
    }
    spectra = {k: _transform(v, angle, weight, W).real for k, v in products.items()}
    energies = {k: _share(v, angle, weight) for k, v in products.items()}
    bare = _share(np.cos(angle), angle, weight)

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
    grid_error = h**2 / 6.0
    off = float(np.max(np.abs(sampled - np.asarray(clamped_cosine_transform(dots)))))
    wrong = float(np.abs(printed - cosine)[np.argmin(np.abs(W - 0.5))])
    order = _falloff()
    claims = [
        Claim(
            "Printed (13) at half a cycle is the transform there", 0.0, wrong, "off", wrong < 1e-9
        ),
        Claim(
            "Corrected (13) meets the samples within their grid error h^2/6",
            grid_error,
            off,
            "off",
            off <= grid_error,
        ),
        Claim(
            "The envelope falls as this power of frequency",
            -2.0,
            order,
            "",
            abs(order + 2.0) < 0.05,
        ),
        Claim("Most of the cosine's energy is below 1/pi cycles/rad", "most", bare, "", bare > 0.5),
    ]
    claims += [
        Claim(f"cos+ times Fresnel, {k}: low frequencies (below 1/pi)", "mostly", e, "", e > 0.5)
        for k, e in energies.items()
    ]
    return Drawing(figure, arrays, claims, curves, size=f"{n} frequencies, 600 angles")


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
