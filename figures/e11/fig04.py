"""E11 Fig. 4: the blockers' spectrum, a line for one depth and a wedge for many, and the overlap.

The paper gives no numbers. Ours: 24 opaque strips 4 to 8 cm wide, their edges blurred by 1.5 cm
so that samples hold them, on one plane 0.35 m below the light (a), and at depths between 0.2 and
0.45 m (b, c). What is transformed is the *dimming* 1 - f, under a Gaussian window of deviation
0.35 m over y and 0.35 over v (stated, because the Dirac of a plane is as narrow as the window is
wide). (c) is (b) as a receiver at d1 = 1 m sees it. (d) puts the band of a Gaussian light
(deviation 0.25 m, its middle at 0) over it and (e) is the shadow's spectrum: the overlap,
integrated along Omega_y, beside the transform of the shadow itself.

The wedge is asymptotic: the strips of (b) dim the light as a product, and the share of energy
outside is what the product leaves there. One minus a sum of strips leaves less. Slopes and shares
are those of 20 draws of the strips, of which the first is shown.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_most, near
from firstorder import plotting
from firstorder.checks.tolerance import normwise
from firstorder.fields import Affine, Grid, SoftSlit, discrete_transform
from firstorder.shadowfield import PLANE, Wedge, energy_outside, planar_blocker

D1, DEPTHS, SINGLE, STRIPS, SEED = 1.0, (0.2, 0.45), 0.35, 24, 5
WINDOW, SIGMA = 0.35, 0.25


def draw(quick: bool) -> Drawing:
    n, m = (192, 61) if quick else (320, 161)
    grid = Grid.spanning((n, n), (1.6, 1.6))
    Omega = np.linspace(-12.0, 12.0, m)
    over = _spectra(grid, Omega, SEED)
    wide = Grid.spanning((n + n // 2, n), (2.8, 1.6))
    seen = np.asarray(_on_receiver(wide))
    receiver = np.asarray(discrete_transform(seen, wide, Omega, Omega))
    wedge = Wedge(*DEPTHS)
    figure, axes = plotting.panels(1, 5, 2.6, 2.5)
    for ax, key, title in ((axes[0, 0], "plane", "a) one plane"), (axes[0, 1], "many", "b) many")):
        plotting.show_spectrum(
            ax, over[key].T, Omega, Omega, decades=3.0, names=("v", "y"), title=title
        )
        ax.set_xlim(-6.0, 6.0)
    for depth in DEPTHS:
        t = np.array([-12.0, 12.0])
        axes[0, 1].plot(depth * t, t, color="white", linestyle="--", linewidth=0.9)
    for ax, title in ((axes[0, 2], "c) on the receiver"), (axes[0, 3], "d) and the light")):
        plotting.show_spectrum(
            ax, receiver, Omega, Omega, decades=3.0, names=("x", "y"), title=title
        )
        e11.draw_wedge(ax, wedge, D1, 12.0)
        ax.set_xlim(-6.0, 6.0)
    for band in (-1.0, 1.0):
        # The light's spectrum is down to a hundredth here.
        axes[0, 3].axhline(band * 3.03 / (2 * np.pi * SIGMA), color=e11.LIGHT_INK, linestyle="-")
    H = _shadow_spectra(seen, wide, Omega)
    for key, style in (("overlap (5)", "-"), ("transform of h", ":")):
        axes[0, 4].plot(Omega, np.abs(H[key]), style, label=key)
    axes[0, 4].set_xlim(-6.0, 6.0)
    axes[0, 4].set_xlabel(plotting.label("Omega_x"))
    axes[0, 4].set_title("e) |H|", loc="left")
    axes[0, 4].legend(loc="upper right")
    arrays = {
        "Omega": Omega,
        "receiver": receiver,
        **over,
        **{f"H_{k[0]}": a for k, a in H.items()},
    }
    draws = [over, *(_spectra(grid, Omega, 100 + k) for k in range(2 if quick else 19))]
    claims = _claims(draws, receiver, H, Omega, wedge)
    return Drawing(figure, arrays, claims, size=f"{n}^2 samples, {m}^2 frequencies", seed=SEED)


def _spectra(grid: Grid, Omega, seed: int) -> dict[str, np.ndarray]:
    """Of the dimmings of a draw."""
    fields = _dimmings(grid, seed)
    return {k: np.asarray(discrete_transform(d, grid, Omega, Omega)) for k, d in fields.items()}


def _strips(seed: int = SEED):
    """Depth, place on its plane and width of each strip."""
    rng = np.random.default_rng(seed)
    return rng.uniform((DEPTHS[0], -1.0, 0.04), (DEPTHS[1], 1.0, 0.08), (STRIPS, 3))


def _strip(middle, width):
    return SoftSlit(Affine([1.0], -middle, PLANE), width, 0.015)


def _covered(y, v, depths, strips):
    """Each strip's own dimming, one axis for the strips."""

    def one(strip):
        depth, middle, width = strip
        return planar_blocker(_strip(middle, width), depth)(y, v)

    return jax.lax.map(one, (depths, strips[:, 1], strips[:, 2]))


def _window(y, v):
    return jnp.exp(-0.5 * ((y / WINDOW) ** 2 + (v / WINDOW) ** 2))


def _dimmings(grid: Grid, seed: int = SEED):
    """1 - f over (y, v): one plane, many planes, and many as if strips simply added."""
    return _by_slope(*np.moveaxis(np.asarray(grid.points()), -1, 0), jnp.asarray(_strips(seed)))


@jax.jit
def _by_slope(y, v, strips):
    window = _window(y, v)
    plane = _covered(y, v, jnp.full(STRIPS, SINGLE), strips)
    many = _covered(y, v, strips[:, 0], strips)
    return {
        "plane": (1.0 - jnp.prod(1.0 - plane, 0)) * window,
        "many": (1.0 - jnp.prod(1.0 - many, 0)) * window,
        "added": jnp.sum(many, 0) * window,
    }


def _on_receiver(grid: Grid):
    """The same rays, named by (x, y)."""
    x, y = np.moveaxis(np.asarray(grid.points()), -1, 0)
    return _by_slope(y, (x - y) / D1, jnp.asarray(_strips()))["many"]


def _shadow_spectra(seen, grid: Grid, Omega) -> dict[str, np.ndarray]:
    """H by (5), and from h itself."""
    y = grid.axis(1)
    light = np.exp(-0.5 * (y / SIGMA) ** 2) / (SIGMA * np.sqrt(2 * np.pi))
    h = seen @ light * grid.step[1]
    line = Grid((grid.size[0],), (grid.step[0],))
    fine = np.linspace(-12.0, 12.0, 481)
    F = np.asarray(discrete_transform(seen, grid, Omega, fine))
    L = np.exp(-2.0 * (np.pi * SIGMA * fine) ** 2)
    return {
        "overlap (5)": F @ L * (fine[1] - fine[0]),
        "transform of h": np.asarray(discrete_transform(h, line, Omega)),
    }


def _claims(draws, receiver, H, Omega, wedge) -> list[Statement | Measurement]:
    slope, slope_error = spread([_slope(over["plane"], Omega) / SINGLE for over in draws])
    outside = {k: spread([_outside(over[k], Omega, wedge) for over in draws])
               for k in ("many", "added")}  # fmt: skip
    scanned = f"{len(draws)} draws of {STRIPS} strips"
    return [
        Statement(
            "The spectrum of occluders at one depth is a line: its Omega_v / Omega_y over d2",
            1.0,
            slope,
            near(1.0, 0.01, "the window smears frequencies by 0.3 cycles/m, of some 6"),
            "E11 (3)",
            error=slope_error,
            scanned=scanned,
        ),
        Statement(
            "That of occluders in a range of depths is a wedge: energy outside, and outside two "
            "deviations of the window's own spectrum",
            "0.005 lies outside (Fig. 7)",
            outside["many"][0],
            at_most(0.005, "the paper's 0.5 %"),
            "E11 §3.1",
            "share",
            outside["many"][1],
            scanned,
        ),
        Measurement(
            "The same if strips added instead of multiplying", outside["added"][0], "share",
            outside["added"][1],
        ),
        Statement(
            "The spectrum on the receiver is d1 F(d1 Omega_x, Omega_y + Omega_x), sampled "
            "both ways",
            0.0,
            _resampled(Omega, receiver),
            at_most(1e-4, "strips are sampled, not exact"),
            "E11 (4)",
            "normwise",
        ),
        Statement(
            "The shadow's spectrum is the overlap of the light's and the occluders'",
            0.0,
            normwise(H["overlap (5)"], H["transform of h"]),
            at_most(1e-9, "double precision"),
            "E11 (5)",
            "normwise",
        ),
    ]  # fmt: skip


def _slope(spectrum, Omega) -> float:
    """Omega_v over Omega_y by least squares, away from the window's own width."""
    Oy, Ov = np.meshgrid(Omega, Omega, indexing="ij")
    energy = np.abs(spectrum) ** 2 * (np.abs(Oy) > 3.0)
    return float(np.sum(energy * Oy * Ov) / np.sum(energy * Oy**2))


def _outside(spectrum, Omega, wedge) -> float:
    """Share of the energy outside the wedge and two deviations of the window's spectrum."""
    Oy, Ov = np.meshgrid(Omega, Omega, indexing="ij")
    inside = wedge.contains(Oy, Ov, None, 2.0 / (2.0 * np.pi * WINDOW))
    return float(energy_outside(jnp.abs(spectrum) ** 2, inside))


def _resampled(Omega, receiver) -> float:
    """(4) from samples over (y, v), against samples over (x, y)."""
    grid = Grid.spanning((320, 320), (1.6, 1.6))
    dimming = np.asarray(_dimmings(grid)["many"])
    pick = np.linspace(0.3, 0.7, 9) * (Omega.size - 1)
    worst, top = 0.0, np.max(np.abs(receiver))
    for i in np.round(pick).astype(int):
        for j in np.round(pick).astype(int):
            Ox, Oy = Omega[i], Omega[j]
            F = discrete_transform(dimming, grid, np.array([Oy + Ox]), np.array([D1 * Ox]))
            worst = max(worst, abs(D1 * complex(F[0, 0]) - receiver[i, j]) / top)
    return worst
