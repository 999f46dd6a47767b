"""R07 Fig. 12: the gradient of net visibility on a floor below a ball, four ways.

The paper gives no numbers. The ball has a radius of 0.5 m and its centre 1 m above a floor of 4 m
by 4 m; B_x is that of the solid angle that is seen (R07 eq. 48). Analytic: the ball is a cap of the
sphere of directions, `B = 2 pi sqrt(1 - R^2 / d^2)`, differentiated by hand. Per azimuth: (48) with
(45) and (46), at 400 azimuths that are placed adaptively, as footnote 4 has it (Simpson's rule on
16 even cells, and the cell is halved in which it differs most from trapezoids); at 400 even ones;
and at a few with the substitution that takes the inverse square root of footnote 4 away. Numeric:
differences over neighbouring pixels of a render with 900 rays per pixel, 30 polar angles by 30
azimuths, on one grid or in random places in its cells.

"Nearly exact for 24-bit RGB" is taken for: at 8 bits over the gradient's range, no pixel is off by
more than one level. Even azimuths miss that beside the ball, where the range of azimuths that meet
it ends between two of them: their error falls as a root of their number, and the largest one has no
bound, since an azimuth may graze the ball as closely as it likes. "Noticeable" is taken for an rms
error above one level; white is the solid angle of the whole sky.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.spread import rms
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._quadrature import inverse_sqrt_panels
from firstorder.visibility import contour_elevation

RADIUS, HEIGHT, HALF = 0.5, 1.0, 2.0
AZIMUTHS, GRID = 400, 30
FEW = (4, 8, 16, 32)
SHOWN = 16
SEED, SEEDS = 12, 20
SOURCE = "R07 §7.2, Fig. 12"
EVERY = np.array([4, 8, 16, 32, 64, 128, 256, 512])  # azimuths
ADAPTIVE, EVEN = f"{AZIMUTHS} adaptive azimuths", f"{AZIMUTHS} even azimuths"


def draw(quick: bool) -> Drawing:
    n = 48 if quick else 160
    axis = (np.arange(n) + 0.5) / n * 2.0 * HALF - HALF
    x, y = np.reshape(np.meshgrid(axis, axis), (2, -1))
    exact = analytic(x, y)
    found = {ADAPTIVE: adaptive(x, y, AZIMUTHS), EVEN: even(x, y, AZIMUTHS)}
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
        f"b) {ADAPTIVE}": found[ADAPTIVE],
        f"c) {EVEN}": found[EVEN],
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
    seeds = 3 if quick else SEEDS
    claims = [*_azimuths(levels, x, y), *_rays(axis, span, seeds)]
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


def adaptive(x, y, count: int, batch: int = 1600, cells: int = 16) -> np.ndarray:
    """(48) by Simpson's rule; the cell is halved in which it differs most from trapezoids.

    Args:
        x: places.
        y: of them.
        count: azimuths; half as many half great circles.
        batch: places at a time.
        cells: to begin with, even ones of two steps each.
    """

    def along(rows):
        x, y = (np.asarray(a)[:, None] for a in rows)
        phi = np.broadcast_to(np.linspace(0.0, np.pi, 2 * cells + 1), (batch, 2 * cells + 1))
        f = integrand(x, y, phi)
        # Azimuths and values at the cells' ends and middles; new cells are appended.
        ends = [np.stack([a[:, :-2:2], a[:, 1:-1:2], a[:, 2::2]], -1) for a in (phi, f)]
        every = np.arange(batch)
        for _ in range((count // 2 - 2 * cells) // 2):
            phi, f = ends
            wide = phi[..., 2] - phi[..., 0]
            worst = np.argmax(wide * np.abs(f @ np.array([1.0, -2.0, 1.0])), 1)
            old, known = phi[every, worst], f[every, worst]
            new = 0.5 * (old[:, :2] + old[:, 1:])
            found = integrand(x, y, new)
            for k, (parent, between) in enumerate(((old, new), (known, found))):
                low, high = (
                    np.stack([parent[:, j], between[:, j], parent[:, j + 1]], -1) for j in (0, 1)
                )
                ends[k][every, worst] = low
                ends[k] = np.concatenate([ends[k], high[:, None]], 1)
        phi, f = ends
        return np.sum((phi[..., 2] - phi[..., 0]) * (f @ np.array([1.0, 4.0, 1.0])), 1) / 6.0

    return host_blocks(along, (x, y), batch)


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


def seen(x, y) -> np.ndarray:
    """Net visibility, B [sr]."""
    return 2.0 * np.pi * np.sqrt(1.0 - RADIUS**2 / (x**2 + y**2 + HEIGHT**2))


def traced(x, y, random, shift=(0.5, 0.5)) -> np.ndarray:
    """Net visibility from 30 x 30 rays a pixel, in one place of all cells or in random ones."""
    i, j = (a.ravel() for a in np.mgrid[:GRID, :GRID])
    total = np.empty(len(x))
    for k, (a, b) in enumerate(zip(x, y, strict=True)):
        s, t = shift if random is None else random.random((2, GRID * GRID))
        theta, phi = 0.5 * np.pi * (i + s) / GRID, 2.0 * np.pi * (j + t) / GRID
        sine = np.sin(theta)
        along = -sine * (np.cos(phi) * a + np.sin(phi) * b) + np.cos(theta) * HEIGHT
        free = (along < 0.0) | (a * a + b * b + HEIGHT**2 - along**2 > RADIUS**2)
        total[k] = np.sum(sine * free)
    return total * (0.5 * np.pi / GRID) * (2.0 * np.pi / GRID)


# --- panels and claims ---------------------------------------------------------------------------


def _errors(ax, axis, levels, y) -> None:
    names = (EVEN, ADAPTIVE, f"{SHOWN} nodes", "differences, random")
    for name, colour in zip(names, (2, 0, 1, 3), strict=True):
        ax.semilogy(axis, np.abs(levels[name]) + 1e-16, color=plotting.COLOURS[colour],
                    linestyle="-", linewidth=0.9, label=name)  # fmt: skip
    ax.axhline(1.0, color="0.4", linestyle=":", linewidth=0.8)
    ax.set(title=f"e) error along y = {y:.2f} m", xlabel="$x$ (m)", ylabel="8-bit levels")
    ax.set(ylim=(1e-12, 1e9))
    ax.legend(fontsize=7, loc="upper right")


def _orders(ax, x, y, exact, span) -> None:
    some = np.random.default_rng(SEED).integers(len(x), size=400)

    def off(g):
        return rms(g - exact[some]) * 255.0 / span

    ways = ((even, "even over the circle", 2), (few, "substituted", 1), (adaptive, "adaptive", 0))
    for way, label, colour in ways:
        counts = EVERY[4:] if way is adaptive else EVERY  # it begins with some
        errors = [off(way(x[some], y[some], int(c))) for c in counts]
        ax.loglog(counts, errors, color=plotting.COLOURS[colour], marker="o", markersize=2.5,
                  linestyle="-", label=label)  # fmt: skip
    ax.axhline(1.0, color="0.4", linestyle=":", linewidth=0.8)
    ax.set(title="f) error against azimuths", xlabel="azimuths", ylabel="rms, 8-bit levels")
    ax.legend(fontsize=7, loc="center right")


def _azimuths(levels, x, y) -> list[Statement | Measurement]:
    """Of the gradient per azimuth."""
    away = np.hypot(x, y) / RADIUS
    places = [away[np.argmax(np.abs(levels[name]))] for name in (ADAPTIVE, EVEN)]
    told: list[Statement | Measurement] = [
        Statement("With 400 adaptive azimuths (footnote 4) gradients are nearly exact for 24-bit "
                  "RGB: largest error at 8 bits", "nearly exact",
                  np.max(np.abs(levels[ADAPTIVE])),
                  at_most(1.0, "one level of 8 bits"), SOURCE, "levels"),
        Statement("With 8 substituted nodes: largest error at 8 bits", None,
                  np.max(np.abs(levels["8 nodes"])), at_most(1.0, "one level of 8 bits"), OURS,
                  "levels"),
        Measurement("Largest errors with adaptive and with even azimuths: distance from the "
                    "ball's foot over its radius", ", ".join(f"{d:.2f}" for d in places),
                    source="R07 footnote 4"),
    ]  # fmt: skip
    for name in (ADAPTIVE, EVEN, *(f"{k} nodes" for k in FEW)):
        both = f"{np.max(np.abs(levels[name])):.2g}, {rms(levels[name]):.2g}"
        told.append(Measurement(f"Error at 8 bits with {name}: largest and rms", both, "levels"))
    return told


def _rays(axis, span: float, seeds: int) -> list[Statement | Measurement]:
    """Of images from 900 rays a pixel, and of their differences: some rows, over seeds."""
    some = axis[:: len(axis) // 8]
    x, y = np.meshgrid(axis, some)
    true, slope = seen(x, y), analytic(x, y)
    off = {"in random places": [], "on one grid": []}
    for k in range(seeds):
        random = np.random.default_rng([SEED, k])
        for name, where in zip(off, ((random,), (None, random.random(2))), strict=True):
            image = traced(x.ravel(), y.ravel(), *where).reshape(x.shape)
            steep = np.gradient(image, axis, axis=1)
            off[name].append((rms(image - true) * 255.0 / (2.0 * np.pi),
                              rms(steep - slope) * 255.0 / span))  # fmt: skip
    means = {name: np.mean(each, 0) for name, each in off.items()}
    errors = {name: np.std(each, axis=0, ddof=1) / seeds**0.5 for name, each in off.items()}
    worse = max(means, key=lambda name: means[name][0])
    told: list[Statement | Measurement] = [
        Statement("Even with 900 samples the image shows noticeable variance or bias: the larger "
                  "rms error at 8 bits, rays in random places or on one grid", "noticeable",
                  means[worse][0], at_least(1.0, "'noticeable': more than one level"), SOURCE,
                  "levels", errors[worse][0], f"{seeds} seeds, {seeds} places of the grid",
                  "Only the cells that the ball's rim crosses err, and they cancel in part.")
    ]  # fmt: skip
    for name, mean in means.items():
        told += [
            Measurement(f"Image from 900 rays {name}: rms error at 8 bits", mean[0], "levels",
                        errors[name][0]),
            Statement("These errors become pronounced when gradients are computed by numerical "
                      f"differentiation: 900 rays {name}, rms error at 8 bits", "very noisy",
                      mean[1], at_least(1.0, "'very noisy': more than one level"), SOURCE,
                      "levels", errors[name][1], f"{seeds} seeds"),
        ]  # fmt: skip
    return told
