"""R07 Fig. 12: the gradient of net visibility on a floor below a ball, four ways.

The paper gives no numbers. The ball has a radius of 0.5 m and its centre 1 m above a floor of 4 m
by 4 m; B_x is that of the solid angle that is seen (R07 eq. 48). Analytic: the ball is a cap of the
sphere of directions, `B = 2 pi sqrt(1 - R^2 / d^2)`, differentiated by hand. Per azimuth: (48) with
(45) and (46), at 400 azimuths evenly spaced over the circle, as the paper has it, and at a few with
the substitution that takes the inverse square root of footnote 4 away. Numeric: differences over
neighbouring pixels of a render with 900 rays per pixel, 30 polar angles by 30 azimuths, on one grid
or in random places in its cells.

"Nearly exact for 24-bit RGB" is taken for: at 8 bits over the gradient's range, no pixel is off by
more than one level. Even azimuths miss that only beside the ball, where the range of azimuths that
meet it ends between two of them: their error falls as a root of their number, and the largest one
has no bound, since an azimuth may graze the ball as closely as it likes. "Noticeable" is taken
for an rms error above one level.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._quadrature import inverse_sqrt_panels
from firstorder.visibility import contour_elevation

RADIUS, HEIGHT, HALF = 0.5, 1.0, 2.0
AZIMUTHS, GRID = 400, 30
FEW = (4, 8, 16, 32)
SHOWN = 16
SEED = 12


def draw(quick: bool) -> Drawing:
    n = 48 if quick else 160
    axis = (np.arange(n) + 0.5) / n * 2.0 * HALF - HALF
    x, y = np.reshape(np.meshgrid(axis, axis), (2, -1))
    exact = analytic(x, y)
    found = {f"{AZIMUTHS} even azimuths": even(x, y, AZIMUTHS)}
    found |= {f"{k} nodes": few(x, y, k) for k in FEW}
    random = np.random.default_rng(SEED)
    for name, shift in (("one grid", None), ("random", random)):
        render = traced(x, y, shift).reshape(n, n)
        found[f"differences, {name}"] = np.ravel(np.gradient(render, axis, axis=1))
    span = 2.0 * np.max(np.abs(exact))
    levels = {name: 255.0 * (g - exact) / span for name, g in found.items()}

    figure, axes = plotting.panels(2, 3, 3.2, 2.9)
    images = {
        "a) analytic": exact,
        f"b) {AZIMUTHS} even azimuths": found[f"{AZIMUTHS} even azimuths"],
        f"c) {SHOWN} nodes": found[f"{SHOWN} nodes"],
        "d) differences, 900 rays": found["differences, random"],
    }
    for ax, (title, image) in zip(axes.ravel(), images.items(), strict=False):
        shown = ax.imshow(
            image.reshape(n, n), cmap=plotting.SIGNED, vmin=-0.5 * span, vmax=0.5 * span,
            origin="lower", extent=(-HALF, HALF, -HALF, HALF),
        )  # fmt: skip
        ax.set(title=title, xlabel="$x$ (m)", ylabel="$y$ (m)")
        figure.colorbar(shown, ax=ax, shrink=0.8, label=r"$\partial B/\partial x$ (sr/m)")
    row = np.argmin(np.abs(axis - 0.3))
    _errors(axes[1, 1], axis, {k: v.reshape(n, n)[row] for k, v in levels.items()}, axis[row])
    _orders(axes[1, 2], x, y, exact, span)
    claims = _claims(levels, x, y)
    columns = {"row": {"x": axis, **{k: v.reshape(n, n)[row] for k, v in levels.items()}}}
    arrays = {"x": axis, "exact": exact.reshape(n, n)}
    arrays |= {k: v.reshape(n, n) for k, v in found.items()}
    return Drawing(figure, arrays, claims, columns, f"{n} x {n} pixels", SEED)


# --- four ways -----------------------------------------------------------------------------------


def analytic(x, y) -> np.ndarray:
    """B = 2 pi sqrt(1 - R^2 / d^2), differentiated by hand."""
    square = x**2 + y**2 + HEIGHT**2
    return 2.0 * np.pi * RADIUS**2 * x / (square**2 * np.sqrt(1.0 - RADIUS**2 / square))


def integrand(x, y, phi) -> np.ndarray:
    """The sum over edges of sgn alpha_x |sin(alpha)| in half great circles at azimuths phi."""
    gap = np.stack(np.broadcast_arrays(-x, -y, HEIGHT), -1)
    u, v = -x * np.cos(phi) - y * np.sin(phi), x * np.sin(phi) - y * np.cos(phi)
    meets = np.abs(v) < RADIUS
    cut = np.sqrt(np.where(meets, RADIUS**2 - v**2, 0.25 * RADIUS**2))
    far = np.hypot(u, HEIGHT)
    D = np.sqrt(far**2 - cut**2)
    total = np.zeros(np.broadcast_shapes(u.shape, phi.shape))
    for sign in (1.0, -1.0):  # the lower end of what is hidden, and the upper
        alpha = np.arctan2(u, HEIGHT) - sign * np.arcsin(cut / far)
        s, c = np.sin(alpha), np.cos(alpha)
        p = D[..., None] * np.stack([s * np.cos(phi), s * np.sin(phi), c], -1)
        rate = np.asarray(RATE(p, (p - gap) / RADIUS, phi))
        total += np.where(meets, sign * rate * np.abs(s), 0.0)
    return total


@jax.jit
def RATE(p, normal, phi):
    """R07 (41) with (45) and (46)."""
    return contour_elevation(p, normal, phi).alpha_x


def even(x, y, count: int, batch: int = 1600) -> np.ndarray:
    """(48) at evenly spaced azimuths; those half a turn apart are one half great circle."""
    phi = np.pi * (np.arange(count // 2) + 0.5) / (count // 2)

    def along(rows):
        x, y = (np.asarray(a)[:, None] for a in rows)
        return integrand(x, y, np.broadcast_to(phi, (batch, phi.size))).sum(1)

    return host_blocks(along, (x, y), batch) * np.pi / phi.size


def few(x, y, count: int) -> np.ndarray:
    """(48) at a few azimuths, between the slices that are tangent to the ball."""
    base, lag, weight = (
        np.asarray(a)[0] for a in inverse_sqrt_panels(jnp.array([0.0, 1.0]), count)
    )
    flat = np.hypot(x, y)
    beside = flat > RADIUS
    half = np.where(beside, np.arcsin(RADIUS / np.where(beside, flat, 1.0)), 0.5 * np.pi)
    middle = np.arctan2(-y, -x)
    phi = middle[:, None] + half[:, None] * (2.0 * (base + lag) - 1.0)
    return 2.0 * half * (integrand(x[:, None], y[:, None], phi) @ weight)


def traced(x, y, random) -> np.ndarray:
    """Net visibility from 30 x 30 rays a pixel, at the cells' centres or in random places."""
    i, j = (a.ravel() for a in np.mgrid[:GRID, :GRID])
    total = np.empty(len(x))
    for k, (a, b) in enumerate(zip(x, y, strict=True)):
        s, t = (0.5, 0.5) if random is None else random.random((2, GRID * GRID))
        theta, phi = 0.5 * np.pi * (i + s) / GRID, 2.0 * np.pi * (j + t) / GRID
        sine = np.sin(theta)
        along = -sine * (np.cos(phi) * a + np.sin(phi) * b) + np.cos(theta) * HEIGHT
        free = (along < 0.0) | (a * a + b * b + HEIGHT**2 - along**2 > RADIUS**2)
        total[k] = np.sum(sine * free)
    return total * (0.5 * np.pi / GRID) * (2.0 * np.pi / GRID)


# --- panels and claims ---------------------------------------------------------------------------


def _errors(ax, axis, levels, y) -> None:
    names = (f"{AZIMUTHS} even azimuths", f"{SHOWN} nodes", "differences, random")
    for name, colour in zip(names, (2, 1, 3), strict=True):
        ax.semilogy(axis, np.abs(levels[name]) + 1e-16, color=plotting.COLOURS[colour],
                    linestyle="-", linewidth=0.9, label=name)  # fmt: skip
    ax.axhline(1.0, color="0.4", linestyle=":", linewidth=0.8)
    ax.set(title=f"e) error along y = {y:.2f} m", xlabel="$x$ (m)", ylabel="8-bit levels")
    ax.set(ylim=(1e-12, 1e9))
    ax.legend(fontsize=7, loc="upper right")


def _orders(ax, x, y, exact, span) -> None:
    some = np.random.default_rng(SEED).integers(len(x), size=400)
    counts = np.array([4, 8, 16, 32, 64, 128, 256, 512])

    def rms(g):
        return float(np.sqrt(np.mean((g - exact[some]) ** 2)) * 255.0 / span)

    ways = ((even, "even over the circle", 2), (few, "substituted", 1))
    for way, label, colour in ways:
        errors = [rms(way(x[some], y[some], int(c))) for c in counts]
        ax.loglog(counts, errors, color=plotting.COLOURS[colour], marker="o", markersize=2.5,
                  linestyle="-", label=label)  # fmt: skip
    ax.axhline(1.0, color="0.4", linestyle=":", linewidth=0.8)
    ax.set(title="f) error against azimuths", xlabel="azimuths", ylabel="rms, 8-bit levels")
    ax.legend(fontsize=7, loc="center right")


def _claims(levels, x, y) -> list[Claim]:
    def rms(e):
        return float(np.sqrt(np.mean(e**2)))

    uniform = levels[f"{AZIMUTHS} even azimuths"]
    worst = float(np.max(np.abs(uniform)))
    at = int(np.argmax(np.abs(uniform)))
    told = [
        Claim(
            "Per azimuth, 400 even azimuths: largest error at 8 bits",
            "nearly exact",
            worst,
            "levels",
            worst <= 1.0,
        ),
        Claim("The same, rms", "nearly exact", rms(uniform), "levels", rms(uniform) <= 1.0),
        Claim(
            "The same: share of pixels that are off by more than half a level",
            None,
            float(np.mean(np.abs(uniform) > 0.5)),
        ),
        Claim(
            "Where its largest error is: distance from the ball's foot over its radius",
            "near the projection of the sphere",
            float(np.hypot(x[at], y[at]) / RADIUS),
            "",
        ),
    ]
    for k in FEW:
        error = levels[f"{k} nodes"]
        told.append(
            Claim(
                f"{k} substituted nodes: largest error at 8 bits, and rms",
                None,
                f"{np.max(np.abs(error)):.2g}, {rms(error):.2g}",
                "levels",
            )
        )
    for name, words in (("one grid", "on one grid"), ("random", "in random places")):
        error = rms(levels[f"differences, {name}"])
        told.append(
            Claim(
                f"Differences over pixels of 900 rays {words}: rms error at 8 bits",
                "very noisy",
                error,
                "levels",
                error > 1.0,
            )
        )
    return told
