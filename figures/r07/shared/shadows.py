"""What R07 Figs. 9, 10, 16 and 17 share: functions along a line, samplers, and R07 (37).

The paper gives no sizes of its flatland scene, so what is claimed of it is judged over `rooms`: the
box 0.4 to 1.0 m wide and 0.2 to 0.6 m high, 0.15 to 0.5 m over the floor, in its left half; the
circle of radius 0.2 to 0.4 m, 0.5 to 1.0 m over the floor, in its right half; the sky as it is.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from figures.spread import rms
from figures.verdicts import Measurement
from firstorder import plotting, reconstruction
from firstorder.caching import harmonic_mean_distance
from firstorder.conventions import direction
from firstorder.fields import Environment, Function, Gaussian
from firstorder.fields.environment import ANGLE
from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    box,
    irradiance,
    nearest,
    primitive,
)
from firstorder.flatland.intersect import first_shape
from firstorder.flatland.library._scenes import r07_fig09
from firstorder.flatland.library.bumps import Bumps
from firstorder.scene._derivatives import line_derivatives
from firstorder.transport import Camera, Surface, image_jet, lambert

SUN, SPREAD, HEIGHT = -0.5, 0.35, 4.0  # sky of `library.r07_fig16`; the camera above the base

# --- functions along a line ---------------------------------------------------------------------


class Shadow(eqx.Module):
    """Irradiance on the floor y = 0 of a scene, with both derivatives, exact."""

    scene: Scene

    def __call__(self, x):
        def E(x):
            at = Receiver(jnp.stack([x, jnp.zeros_like(x)]), jnp.zeros_like(x), 0)
            return irradiance(self.scene, at)

        d = line_derivatives(E, x)
        return d.value, d.first, d.second


class Image(eqx.Module):
    """A diffuse bumpy surface in distant light, seen from above: value, I_u and I_uu (R07 (26)).

    The eye is so high over the middle, and its focal length so chosen, that px runs along the flat
    base: px = x - middle.
    """

    bumps: Bumps
    middle: float = 0.0

    def __call__(self, px):
        normal = Function(lambda x, theta: self.bumps.normal(x))
        light = Environment(Gaussian([SUN], [[SPREAD**-2]], frame=ANGLE))
        seen = Surface(normal, (lambert(),)).reflect(light, 48)
        view = Camera((self.middle, HEIGHT), HEIGHT).derivatives(px)
        return image_jet(view, seen.jet(jnp.stack([view.x, view.theta])))


@eqx.filter_jit
def along(function, x):
    """A function with its derivatives at many places: value, slope, second derivative."""
    return jnp.stack(jax.vmap(function)(x))


# --- rooms --------------------------------------------------------------------------------------


def rooms(count: int, seed: int = 9) -> Iterator[Scene]:
    """Scenes like that of Fig. 9, at random in the ranges that stand above."""
    random = np.random.default_rng(seed)
    floor = primitive(Segments((-3.0, 0.0), (3.0, 0.0)), name="floor", albedo=1.0)
    sky = r07_fig09().environment
    for _ in range(count):
        left, low, wide, high = random.uniform((-2.2, 0.15, 0.4, 0.2), (-1.2, 0.5, 1.0, 0.6))
        x, y, radius = random.uniform((0.2, 0.5, 0.2), (1.2, 1.0, 0.4))
        yield Scene.of(
            floor,
            primitive(box((left, low), (left + wide, low + high)), name="box"),
            primitive(Circles((x, y), radius), name="circle"),
            environment=sky,
        )


# --- samplers -----------------------------------------------------------------------------------

LINEAR, CUBIC = 1, 2  # numbers of each sample that an interpolant takes
INTERPOLANTS = {"lines": LINEAR, "cubics": CUBIC}


def disagreement(cell: reconstruction.LineCell):
    """How far a cell's line is from its cubic: the error of lines, by values and slopes alone."""
    first = reconstruction.LineCell(cell.length, cell.left[:CUBIC], cell.right[:CUBIC])
    return reconstruction.line_by_disagreement(LINEAR)(first)


DRIVERS = {
    "uniform": reconstruction.line_by_length,
    "numeric": reconstruction.line_by_differences,
    "gradient": reconstruction.line_by_gradient,
    "disagreement": disagreement,
    "second order": reconstruction.line_by_curvature,
    "for cubics": reconstruction.line_by_disagreement(2),
}


class Chosen(eqx.Module):
    """One of several drivers by a vector of zeros and a one: all of them compile as one."""

    which: jax.Array

    def __call__(self, cell):
        return jnp.dot(self.which, jnp.stack([driver(cell) for driver in DRIVERS.values()]))


@eqx.filter_jit
def samplings(function, low, high, budget: int, initial: int, breaks=()):
    """The samples of every driver, stacked; those of a smaller budget are those taken first."""
    return jax.vmap(
        lambda which: reconstruction.sample_line(
            function, low, high, budget, Chosen(which), initial=initial, breaks=breaks
        )
    )(jnp.eye(len(DRIVERS)))


def cut(line: reconstruction.LineSamples, budget: int) -> reconstruction.LineSamples:
    """The samples of a smaller budget: the sampler is greedy, so it would have taken the same."""
    keep = np.asarray(line.order) < budget
    return reconstruction.LineSamples(line.x[keep], line.data[keep], line.order[keep])


def one_of(lines, driver: str) -> reconstruction.LineSamples:
    """The samples of one driver."""
    return jax.tree.map(lambda a: a[list(DRIVERS).index(driver)], lines)


def curve(line, x, data: int = 1) -> np.ndarray:
    """The interpolant of a set of samples at places x."""
    return np.asarray(value(line.interpolant(data), jnp.asarray(x)))


value = eqx.filter_jit(lambda f, x: f(x))


@eqx.filter_jit
def swept(make, phases, x, budget: int, initial: int):
    """Samplings of many images on [x_0, x_n], and the images themselves at x, stacked.

    Args:
        make: makes the bumps of one phase.
        phases: one for each image.
        x: places at which the images are wanted.
        budget: of each driver.
        initial: samples at the beginning.
    """

    def one(phase):
        image = Image(make(phase))
        lines = samplings(image, x[0], x[-1], budget, initial)
        return lines, jnp.stack(jax.vmap(image)(x))

    return jax.vmap(one)(phases)


def errors_over(lines, images, x, budgets, data: int = LINEAR) -> dict[str, np.ndarray]:
    """Rms errors of the lines or cubics through the samples: by driver, an array (phases, budgets).

    "uniform" is a truly even grid of as many samples.
    """
    lines, images = jax.tree.map(np.asarray, lines), np.asarray(images)

    def error(name, i, budget):
        if name == "uniform":
            at = np.linspace(x[0], x[-1], budget)
            known = np.stack([np.interp(at, x, row) for row in images[i, :CUBIC]], 1)
        else:
            line = one_of(phase_of(lines, i), name)
            kept = line.order < budget
            at, known = line.x[kept], line.data[kept]
        return rms(_through(at, known, data, x) - images[i, 0])

    every = range(len(images))
    return {k: np.array([[error(k, i, b) for b in budgets] for i in every]) for k in DRIVERS}


def _through(at, known, data: int, x) -> np.ndarray:
    if data == LINEAR:
        return np.interp(x, at, known[:, 0])
    return CubicHermiteSpline(at, known[:, 0], known[:, 1])(x)


def over_grids(make, phases, x, grids, budgets, enough: float):
    """Images sampled from several initial grids.

    Args:
        make: makes the bumps of one phase.
        phases: one for each image.
        x: places at which errors are taken.
        grids: initial samples.
        budgets: of which errors are wanted, in rising order.
        enough: the error that is aimed at, of the images' contrast.

    Returns:
        Errors by grid and interpolant, and then by driver, arrays (phases, budgets); the samples
        that are needed for `enough`, by driver and interpolant, one for each grid; the images.
    """
    errors, needed, images = {}, {}, np.zeros(0)
    for initial in grids:
        run = swept(make, jnp.asarray(phases), jnp.asarray(x), int(budgets[-1]), initial)
        images = np.asarray(run[1])
        contrast = np.std(images[:, 0], axis=1)[:, None]
        for kind, data in INTERPOLANTS.items():
            found = errors_over(*run, x, budgets, data)
            errors[initial, kind] = found
            for name, error in found.items():
                short = (budgets < initial) & (name != "uniform")
                fair = np.where(short, np.inf, error / contrast)
                needed.setdefault((name, kind), []).append(samples_needed(fair, budgets, enough))
    return errors, needed, images


def samples_needed(errors, budgets, enough: float) -> float:
    """How many samples the median image needs for an error; twice the most if none is enough."""
    few = np.append(budgets, 2 * budgets[-1])
    met = np.concatenate([errors <= enough, np.ones((len(errors), 1), bool)], 1)
    return float(np.median(few[np.argmax(met, 1)]))


def error_by_middles(image, x, cells: int, budget: int) -> float:
    """The sampler of R07 §9.1 in 1D: the gradient in the middle of a cell times its length.

    A cell that is split keeps its sample and gets two more, in the middles of its halves.
    """
    h = (x[-1] - x[0]) / cells
    middles = x[0] + h * (np.arange(cells) + 0.5)

    def entry(c, h):
        return -abs(float(np.interp(c, x, image[1]))) * h, c, h

    heap, taken = [entry(c, h) for c in middles], list(middles)
    heapq.heapify(heap)
    while len(taken) + 2 <= budget:
        _, c, h = heapq.heappop(heap)
        for half in (c - 0.25 * h, c + 0.25 * h):
            taken.append(half)
            heapq.heappush(heap, entry(half, 0.5 * h))
    at = np.sort(taken)
    return rms(np.interp(x, at, np.interp(at, x, image[0])) - image[0])


def phase_of(lines, i: int):
    """The samplings of one of the images."""
    return jax.tree.map(lambda a: a[i], lines)


def geometric_mean(a, axis=None):
    """Of errors, which differ by factors."""
    return np.exp(np.mean(np.log(a), axis))


def need_claims(needed, most: int) -> list[Measurement]:
    """Samples for a tenth of the contrast, on the best grid to the worst, by driver.

    Args:
        needed: by driver and interpolant, for each initial grid.
        most: that were tried.
    """

    def words(counts) -> str:
        ends = sorted({min(counts), max(counts)})
        return " to ".join(f"> {most}" if c > most else f"{c:.0f}" for c in ends)

    return [
        Measurement(f"Samples for a tenth of the contrast, {kind}: median image, on the best and "
                    "the worst of the initial grids",
                    ", ".join(f"{k} {words(needed[k, kind])}" for k in DRIVERS))
        for kind in INTERPOLANTS
    ]  # fmt: skip


def shown_needs(ax, needed, grids, most: int, title: str) -> None:
    """Samples that are needed, by driver and interpolant, over the initial grids."""
    for k, name in enumerate(DRIVERS):
        for kind, style in zip(INTERPOLANTS, ("-", "--"), strict=True):
            label = name if kind == "lines" else None
            ax.semilogy(grids, needed[name, kind], style, color=plotting.COLOURS[k], marker="o",
                        markersize=3, label=label)  # fmt: skip
    ax.axhline(most, color="0.6", linewidth=0.8, linestyle=":")
    ax.set(title=title, xlabel="initial samples", ylabel="samples needed")
    ax.set_yticks([9, 17, 33, 65, most], ["9", "17", "33", "65", str(most)])
    ax.minorticks_off()
    ax.legend(fontsize=6, title="lines; dashed: cubics", title_fontsize=6, loc="upper left",
              bbox_to_anchor=(1.0, 1.0))  # fmt: skip


# --- the gradient by R07 (37) -------------------------------------------------------------------

# The box and the sky of `library.r07_fig09`.
CORNERS, SKY = tuple((x, y) for x in (-1.4, -0.5) for y in (0.25, 0.7)), 0.5
MOST = 512  # rays: fewer are padded to as many, so that all counts compile as one
EDGES = 4  # two blockers have no more


def traced(scene: Scene, x, rays: int, shift: float = 0.5):
    """Irradiance and its gradient at (x, 0) from rays in even directions (image space).

    Args:
        scene: of one box and one circle.
        x: receivers.
        rays: of each.
        shift: of all rays, in steps between them.

    Returns:
        E as the sum over the rays; R07 (37) with edges half-way between neighbouring rays and the
        first hit's distance; (37) with each edge bisected and the distance taken to the tangent
        point.
    """
    omega = np.pi * ((np.arange(rays) + shift) / rays - 0.5)
    omega = np.concatenate([omega, np.full(MOST - rays, omega[-1])])
    weight = np.where(np.arange(MOST) < rays, np.pi / rays, 0.0)
    return tuple(np.asarray(a) for a in _traced(scene, jnp.asarray(x), omega, weight))


def sky(scene: Scene):
    """The light, times the cosine at the floor."""
    environment = scene.environment
    assert environment is not None
    return lambda angle: environment(angle) * jnp.cos(angle)


@eqx.filter_jit
def _traced(scene: Scene, x, omega, weight):
    light = sky(scene)

    def one(x):
        at = jnp.stack([x, jnp.zeros_like(x)])

        def blocked(a):
            return first_shape(scene, jnp.broadcast_to(at, (a.size, 2)), direction(a), 0) >= 0

        shut = blocked(omega)
        sign = shut[1:] * 1.0 - shut[:-1]  # +1 from visible to blocked
        size, edge = jax.lax.top_k(jnp.abs(sign), EDGES)
        sign = size * sign[edge]
        ends = jnp.where(sign > 0, omega[edge], omega[edge + 1]), omega[edge] + omega[edge + 1]
        free, dark = ends[0], ends[1] - ends[0]
        rough = 0.5 * ends[1], dark

        def halve(_, ends):
            middle = 0.5 * (ends[0] + ends[1])
            met = blocked(middle)
            return jnp.where(met, ends[0], middle), jnp.where(met, middle, ends[1])

        fine = jax.lax.fori_loop(0, 40, halve, (free, dark))[1]
        hits = nearest(scene, jnp.broadcast_to(at, (2 * EDGES, 2)),
                       direction(jnp.concatenate([dark, fine])), 0)  # fmt: skip
        center, _, number = circle(scene)
        tangent = direction(fine) @ (center - at)
        D = hits.t[:EDGES], jnp.where(hits.index[EDGES:] == number, tangent, hits.t[EDGES:])
        sums = [
            jnp.sum(jnp.where(sign != 0, sign * light(a) * jnp.cos(a) / d, 0.0))
            for a, d in ((rough[0], D[0]), (fine, D[1]))
        ]
        return jnp.sum(jnp.where(shut, 0.0, weight * light(omega))), *sums

    return jax.vmap(one)(x)


def formula(scene: Scene, x) -> np.ndarray:
    """R07 (37) with edges known from the shapes (object space), in NumPy, receiver by receiver."""
    center, radius, _ = circle(scene)
    center, radius = np.asarray(center), float(radius)
    corners = np.array(CORNERS)
    total = np.zeros(len(x))
    for i, here in enumerate(np.asarray(x)):
        way = corners - (here, 0.0)
        box = sorted((np.arctan2(-w[0], w[1]), np.hypot(*w)) for w in way)
        to = center - (here, 0.0)
        d, axis = np.hypot(*to), np.arctan2(-to[0], to[1])
        half, D = np.arcsin(radius / d), np.sqrt(d * d - radius * radius)
        pair = [(box[0], box[-1]), ((axis - half, D), (axis + half, D))]
        for k, (low, high) in enumerate(pair):
            (a, _), (b, _) = pair[1 - k]
            for sign, (alpha, D) in ((1.0, low), (-1.0, high)):
                if not a < alpha < b:  # what the other blocker covers is no edge
                    T = np.exp(-0.5 * (alpha / SKY) ** 2) * np.cos(alpha)
                    total[i] += sign * T * np.cos(alpha) / D
    return total


def circle(scene: Scene):
    """Centre, radius and number of the one circle."""
    (group,) = (g for g in scene.groups if isinstance(g, Circles))
    return group.center[0], group.radius[0], scene.named("circle")[0]


def inverse_distance(scene: Scene, x, rays: int = 256) -> np.ndarray:
    """One over the harmonic mean of blockers' distances at (x, 0) [1/m], over even directions."""
    omega = jnp.asarray(np.pi * ((np.arange(rays) + 0.5) / rays - 0.5))
    return np.asarray(_inverse_distance(scene, jnp.asarray(x), omega))


@eqx.filter_jit
def _inverse_distance(scene: Scene, x, omega):
    def one(x):
        at = jnp.broadcast_to(jnp.stack([x, jnp.zeros_like(x)]), (omega.size, 2))
        hits = nearest(scene, at, direction(omega), 0)
        lengths = jnp.where(hits.index >= 0, hits.t, jnp.inf)
        return 1.0 / harmonic_mean_distance(lengths)

    return jax.vmap(one)(x)


# --- where the gradient jumps -------------------------------------------------------------------


def kinks(scene: Scene, function) -> np.ndarray:
    """Where two silhouettes are in line with the floor and E' jumps there, as measured.

    Candidates: below an upright side of the box, and where a line through a corner of it touches
    the circle and meets the floor.
    """
    center, radius, _ = circle(scene)
    found = sorted({c[0] for c in CORNERS})
    for corner in np.array(CORNERS):
        way = np.asarray(center) - corner
        for side in (-1.0, 1.0):
            turn = side * np.arcsin(float(radius) / np.hypot(*way))
            u = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ way
            found.append(float(corner[0] - corner[1] * u[0] / u[1]))
    found = np.array(sorted(found))
    left, right = (np.asarray(along(function, jnp.asarray(found + h)))[1] for h in (-1e-7, 1e-7))
    return found[np.abs(right - left) > 1e-4]
