"""D05 Fig. 5: projected area of a slope, g, its spectrum, and the spectrum of G in 3D.

No parameter is left open. (a) g(v) = (1 + v^2)^(-3/2), which is the cosine times the Jacobian of
the slope. (b) Its spectrum 4 pi |Omega| K_1(2 pi |Omega|), by the library's jittable integral and
by samples. (c) The spectrum of G(u, v) = (1 + u^2 + v^2)^(-2), of which the paper prints no
formula: 2 pi^2 q K_1(2 pi q) with q = |Omega|, the same curve turned about its axis.

The samples end at |v| = 400, where g is 2e-8: that is the error of the sampled curve, not more.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad
from scipy.special import k1

from figures.d05.shared.readings import equal
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.conventions import SPACE_SLOPE
from firstorder.transport.events.diffuse import SlopeWeight


def draw(quick: bool) -> Drawing:
    n = 201 if quick else 401
    v = np.linspace(-10.0, 10.0, n)
    Omega = np.linspace(-5.0, 5.0, n)
    g = np.asarray(SlopeWeight()(0.0, v))
    transform = jax.vmap(SlopeWeight().transform)
    ghat = np.asarray(transform(jnp.asarray(Omega)[:, None]))
    sampled = _sampled(Omega)
    axis = np.linspace(-1.5, 1.5, 61 if quick else 201)
    U, V = np.meshgrid(axis, axis, indexing="ij")
    space = jax.vmap(SlopeWeight(SPACE_SLOPE).transform)
    G = np.asarray(space(jnp.stack([U.ravel(), V.ravel()], -1))).reshape(U.shape)

    figure, axes = plotting.panels(1, 3, 3.2, 2.7)
    axes[0, 0].plot(v, g)
    axes[0, 0].set(xlabel="$v$", title="(a) $g(v)$")
    axes[0, 1].plot(Omega, ghat, label="closed form")
    axes[0, 1].plot(Omega[:: n // 50], sampled[:: n // 50], "o", ms=2.5, label="samples")
    axes[0, 1].set(xlabel=plotting.label("Omega_v"), title=r"(b) $\hat g(\Omega_v)$")
    axes[0, 1].legend()
    image = axes[0, 2].pcolormesh(axis, axis, G.T, cmap=plotting.MAGNITUDE, rasterized=True)
    axes[0, 2].contour(axis, axis, G.T, levels=[np.pi / 2], colors="white", linewidths=0.8)
    axes[0, 2].set(
        xlabel=r"$\Omega_u$ (cycles)",
        ylabel=plotting.label("Omega_v"),
        title=r"(c) $\hat G(\Omega_u, \Omega_v)$; white: half height",
        aspect="equal",
    )
    figure.colorbar(image, ax=axes[0, 2], shrink=0.85)
    return Drawing(
        figure,
        {"v": v, "g": g, "Omega": Omega, "ghat": ghat, "ghat_sampled": sampled, "Ghat": G},
        _claims(Omega, ghat, sampled, axis, G),
        {"weight": {"v": v, "g": g}, "spectrum": {"Omega_v": Omega, "ghat": ghat}},
        size=f"{n} frequencies, {axis.size}^2 in space, {SAMPLES} samples",
    )


SAMPLES, CUT = 32_000, 400.0


def _sampled(Omega) -> np.ndarray:
    """Transform of samples of g on |v| < CUT."""
    step = 2.0 * CUT / SAMPLES
    v = (np.arange(SAMPLES) + 0.5 - SAMPLES / 2) * step
    g = (1.0 + v**2) ** -1.5
    return np.array([np.sum(g * np.cos(2 * np.pi * w * v)) for w in Omega]) * step


def _claims(Omega, ghat, sampled, axis, G) -> list[Statement | Measurement]:
    z = 2.0 * np.pi * np.abs(Omega[Omega != 0])
    bessel = np.max(np.abs(ghat[Omega != 0] / (2.0 * z * k1(z)) - 1.0))
    power = lambda a: quad(lambda w: (2 * np.pi * w * k1(2 * np.pi * w)) ** 2, 1e-9, a)[0]  # noqa: E731
    share = power(0.5) / power(6.0)
    half = np.interp(-1.0, -ghat[Omega >= 0], Omega[Omega >= 0])
    peak = G[axis.size // 2, axis.size // 2]
    radius = np.hypot(*np.meshgrid(axis, axis, indexing="ij"))
    z = 2.0 * np.pi * np.maximum(radius, 1e-9)
    turned = np.max(np.abs(G - np.pi * z * k1(z)))
    off = float(np.max(np.abs(ghat - sampled)))
    tail = at_most(CUT**-2.0, "the area of g beyond the samples")
    return [
        Statement("The transform of g(v) is 4 pi |O| K_1(2 pi |O|): largest relative error", 0.0,
                  bessel, equal(), "D05 §3.3"),
        Statement("... and that of samples of g: largest difference", 0.0, off, tail, "D05 §3.3"),
        Statement("The transform of g is highly concentrated on low frequencies: energy below half "
                  "a cycle per unit slope", "highly", share,
                  at_least(0.9, "'highly': nine tenths"), "D05 §3.3 Fig. 5 (b)"),
        Measurement("Half height of the transform of g", half, "cycles per unit slope"),
        Statement("The transform of G at zero is the projected hemisphere: error over pi", None,
                  abs(peak / np.pi - 1.0), equal(), OURS),
        Statement("The transform of G is pi / 2 times that of g, turned about its axis: largest "
                  "error", None, turned, equal(), OURS),
    ]  # fmt: skip
