"""Discs in space, by quadrature: numbers for the rows of `radiometry` about three dimensions."""

from __future__ import annotations

import numpy as np


def coaxial_discs() -> float:
    """(13): flux from one disc to another, four-fold quadrature against the known form factor."""
    R1, R2, h, n = 0.7, 1.1, 0.9, 40
    t, weight = np.polynomial.legendre.leggauss(n)
    q1, q2 = (0.5 * R * (1 + t) for R in (R1, R2))
    a = 2 * np.pi * np.arange(64) / 64
    r2 = (
        q1[:, None, None] ** 2
        + q2[None, :, None] ** 2
        - 2 * q1[:, None, None] * q2[None, :, None] * np.cos(a)
        + h**2
    )
    inner = np.sum(h**2 / r2**2, -1) * 2 * np.pi / 64
    flux = 2 * np.pi * np.einsum("i,j,ij->", 0.5 * R1 * weight * q1, 0.5 * R2 * weight * q2, inner)
    X = 1 + (1 + (R2 / h) ** 2) / (R1 / h) ** 2
    factor = 0.5 * (X - np.sqrt(X**2 - 4 * (R2 / R1) ** 2))
    return abs(flux / (np.pi * np.pi * R1**2 * factor) - 1.0)


def under_disc(power: int) -> float:
    """(15) and (23): light of a disc on a point beside its axis, times `(r(w) . o)^power`.

    By directions, of which the disc is a cone's section, against an integral over the disc.
    """
    R, h, off, n = 0.6, 0.8, 0.25, 400
    o = np.array([0.3, -0.2, np.sqrt(1 - 0.13)])
    a = 2 * np.pi * (np.arange(n) + 0.5) / n
    t, weight = np.polynomial.legendre.leggauss(60)

    def lobe(w):
        mirrored = np.stack([-w[..., 0], -w[..., 1], w[..., 2]], -1)
        return (mirrored @ o) ** power

    # By directions: at the azimuth a the disc reaches to the distance q from the point's foot.
    q = off * np.cos(a) + np.sqrt(R**2 - (off * np.sin(a)) ** 2)
    polar = 0.5 * np.arctan(q / h)[:, None] * (1 + t)
    w = np.stack(
        [np.cos(a)[:, None] * np.sin(polar), np.sin(a)[:, None] * np.sin(polar), np.cos(polar)], -1
    )
    f = lobe(w) * np.cos(polar) * np.sin(polar) * 0.5 * np.arctan(q / h)[:, None]
    by_angle = np.sum(f * weight) * 2 * np.pi / n
    # Over the disc: d omega = cos dA / r^2.
    ring = 0.5 * R * (1 + t)
    y = np.stack(
        [off + ring * np.cos(a)[:, None], ring * np.sin(a)[:, None], h + 0 * ring * a[:, None]], -1
    )
    r = np.linalg.norm(y, axis=-1)
    f = lobe(y / r[..., None]) * h**2 / r**4 * ring
    by_area = np.sum(f * weight) * 0.5 * R * 2 * np.pi / n
    return abs(by_angle / by_area - 1.0)
