"""What R07 Figs. 9, 10, 16 and 17 share: functions along a line, samplers, and R07 (37)."""

from __future__ import annotations

import heapq

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder import reconstruction
from firstorder.conventions import direction
from firstorder.fields import Environment, Function, Gaussian
from firstorder.fields.environment import ANGLE
from firstorder.flatland import Circles, Receiver, Scene, irradiance, nearest
from firstorder.flatland.intersect import first_shape
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


# --- samplers -----------------------------------------------------------------------------------

DRIVERS = {
    "uniform": reconstruction.line_by_length,
    "numeric": reconstruction.line_by_differences,
    "gradient": reconstruction.line_by_gradient,
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


def rms(a) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(np.asarray(a)))))


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


def errors_over(lines, images, x, budgets) -> dict[str, np.ndarray]:
    """Rms errors of the lines through the samples: by driver, an array (phases, budgets).

    "uniform" is a truly even grid of as many samples, which x must hold.
    """
    lines, values = jax.tree.map(np.asarray, lines), np.asarray(images)[:, 0]

    def error(name, i, budget):
        if name == "uniform":
            step = (x.size - 1) // (budget - 1)
            assert step * (budget - 1) == x.size - 1
            at, known = x[::step], values[i, ::step]
        else:
            line = one_of(phase_of(lines, i), name)
            kept = line.order < budget
            at, known = line.x[kept], line.data[kept, 0]
        return rms(np.interp(x, at, known) - values[i])

    every = range(len(values))
    return {k: np.array([[error(k, i, b) for b in budgets] for i in every]) for k in DRIVERS}


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


# --- the gradient by R07 (37) -------------------------------------------------------------------

# The box and the sky of `library.r07_fig09`.
CORNERS, SKY = tuple((x, y) for x in (-1.4, -0.5) for y in (0.25, 0.7)), 0.5
MOST = 512  # rays: fewer are padded to as many, so that all counts compile as one
EDGES = 4  # two blockers have no more


def traced(scene: Scene, x, rays: int):
    """Irradiance and its gradient at (x, 0) from rays in even directions (image space).

    Returns:
        E as the sum over the rays; R07 (37) with edges half-way between neighbouring rays and the
        first hit's distance; (37) with each edge bisected and the distance taken to the tangent
        point.
    """
    omega = np.pi * ((np.arange(rays) + 0.5) / rays - 0.5)
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
