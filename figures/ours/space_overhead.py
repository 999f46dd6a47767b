"""What gradients cost beside values, for three spheres over a plane: rays, shading, and both.

No figure of the papers: R07 §8.1 ("minimal overhead") and §9.2 ("less than 2%": 1.2 minutes of
75.9), J12 §8 ("roughly 50% more computation time" for the Hessian, with fast rays).

Values are R07's: 100 x 100 rays a receiver, traced through the analytic shapes, and through meshes
of the balls (5,120 triangles each) by Embree, whose hits are met again in double precision. Object
space gradients are `boundary_gradient`: silhouettes of all shapes, cut and integrated, no ray.
Image-space gradients start from the rays that were traced: an edge is where neighbours in an
azimuth differ. As R07 has it that needs no further ray; bisected, 16 rays for each edge and 3 for
its tangent's length.

"Gradient shading at most twice value shading" is asked of the exact irradiance and its automatic
derivatives, the receiver's motion in its plane; times are processor times, least of several.
Silhouettes, cuts and what is seen between them are found once. The derivative of a sum over closed
edges is one integral along them at fixed cuts (`space.silhouettes._edge_integrals`), so that a
gradient differentiates no cut and a Hessian each cut once.
R07's ratio of rays to shading is taken from its own numbers: 75.9 minutes over 512 x 512 pixels of
10,000 rays are 1.7 microseconds a ray, on the machine of 2007.
"""

from __future__ import annotations

import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.io import Embree
from firstorder.numerics._batching import in_batches
from firstorder.space import first_shape, receiver
from firstorder.space.direct_lighting import boundary_gradient, irradiance
from firstorder.space.library._scenes import three_spheres
from firstorder.space.meshes.triangle_mesh import mesh

SIDE = 100  # rays in theta and in phi
TRACED = 64  # receivers that trace them
RAY_2007 = 75.9 * 60.0 / (512**2 * SIDE**2)  # seconds
BISECTED, TANGENT = 16, 3  # rays for an edge's angle, and for the length of its tangent


def draw(quick: bool) -> Drawing:
    count = 64 if quick else 1024
    rng = np.random.default_rng(0)
    x = jnp.asarray(np.append(rng.uniform(-1.5, 1.5, (count, 2)), np.zeros((count, 1)), 1))
    scene = three_spheres()
    (floor,) = scene.named("floor")
    at = receiver(x, on=floor)
    few = receiver(x[:TRACED], on=floor)
    w, weight = _rays()

    seconds = {
        "rays": _cost(_traced, scene, few, w) / TRACED,
        "embree": _cost(_by_embree, Embree(_balls(scene)), np.asarray(few.position), w) / TRACED,
        "summed": _cost(_summed, jnp.ones((TRACED, SIDE * SIDE), bool), weight) / TRACED,
        "edges": _cost(_edges, scene, at) / count,
        "value": _cost(_value, scene, at) / count,
        "gradient": _cost(_gradient, scene, at) / count,
        "hessian": _cost(_hessian, scene, at) / count,
    }
    hit = np.asarray(_traced(scene, few, w)).reshape(TRACED, SIDE, SIDE)
    changes = np.sum(hit[:, :, 1:] != hit[:, :, :-1], (1, 2))  # theta is the last axis
    extra = changes * (BISECTED + TANGENT) / SIDE**2

    figure, axes = plotting.panels(1, 2, 3.8, 2.8)
    names = ("rays", "embree", "summed", "edges", "value", "gradient", "hessian")
    words = (
        "10,000 rays",
        "by Embree",
        "their sum",
        "boundary",
        "exact E",
        "E, gradient",
        "E, g., Hessian",
    )
    axes[0, 0].bar(words, [1e6 * seconds[n] for n in names], color=plotting.COLOURS[0])
    axes[0, 0].set_yscale("log")
    axes[0, 0].tick_params(axis="x", rotation=35)
    axes[0, 0].set_title("time for a receiver", loc="left")
    axes[0, 0].set_ylabel("microseconds")
    axes[0, 1].bar(["object space", "as traced", "bisected"], [0.0, 0.0, 100 * extra.mean()])
    axes[0, 1].axhline(30.0, color="0.6", linewidth=0.8, linestyle="--")
    axes[0, 1].set_title("further rays for a gradient", loc="left")
    axes[0, 1].set_ylabel("% of the value's")

    arrays = {"extra": extra, **{f"seconds_{k}": np.array(v) for k, v in seconds.items()}}
    size = f"{count} receivers, {SIDE} x {SIDE} rays for {TRACED}"
    claims = _claims(seconds, float(extra.mean()), float(extra.max()))
    return Drawing(figure, arrays, claims, {}, size, 0)


# --- what is timed -------------------------------------------------------------------------------


def _rays():
    """Directions (phi, theta) in the middles of equal steps, and their weights."""
    step = 0.5 * np.pi / SIDE
    theta, phi = step * (np.arange(SIDE) + 0.5), 2.0 * np.pi * (np.arange(SIDE) + 0.5) / SIDE
    phi, theta = (a.ravel() for a in np.meshgrid(phi, theta, indexing="ij"))
    s, c = np.sin(theta), np.cos(theta)
    w = np.stack([s * np.cos(phi), s * np.sin(phi), c], -1)
    return jnp.asarray(w), jnp.asarray(s * c * step * 2.0 * np.pi / SIDE)


@eqx.filter_jit
def _traced(scene, at, w):
    def one(a):
        return first_shape(scene, jnp.broadcast_to(a.position, w.shape), w, a.on) >= 0

    return jax.lax.map(one, at)


def _balls(scene):
    """The spheres as one mesh."""
    import trimesh

    balls = scene.groups[0]
    sphere = trimesh.creation.icosphere(4)
    points = np.asarray(balls.center)[:, None] + sphere.vertices @ np.asarray(balls.axes).mT
    faces = sphere.faces + len(sphere.vertices) * np.arange(balls.count)[:, None, None]
    return mesh(points.reshape(-1, 3), faces.reshape(-1, 3))


def _by_embree(tracer, positions, w):
    return [tracer.nearest(np.broadcast_to(x, w.shape), w).face >= 0 for x in positions]


@eqx.filter_jit
def _summed(hit, weight):
    return jnp.where(hit, 0.0, weight).sum(-1)


def _each(function, at):
    """For all receivers, some at a time so that they stay in the cache."""
    return in_batches(function, at, 32)


@eqx.filter_jit
def _edges(scene, at):
    return _each(lambda a: boundary_gradient(scene, a), at)


def _moved(scene, a):
    return lambda x: irradiance(scene, a.moved(x))


@eqx.filter_jit
def _value(scene, at):
    return _each(lambda a: irradiance(scene, a), at)


@eqx.filter_jit
def _gradient(scene, at):
    return _each(lambda a: jax.value_and_grad(_moved(scene, a))(jnp.zeros(2)), at)


@eqx.filter_jit
def _hessian(scene, at):
    def one(a):
        both = jax.value_and_grad(_moved(scene, a))

        def slopes(x):
            found = both(x)
            return found[1], found

        H, (E, g) = jax.jacfwd(slopes, has_aux=True)(jnp.zeros(2))
        return E, g, H

    return _each(one, at)


def _cost(function, *arguments) -> float:
    jax.block_until_ready(function(*arguments))
    best = np.inf
    for _ in range(5):
        begin = time.process_time()
        jax.block_until_ready(function(*arguments))
        best = min(best, time.process_time() - begin)
    return best


# --- claims --------------------------------------------------------------------------------------


def _claims(s, extra: float, worst: float) -> list[Claim]:
    value, meshes = s["rays"] + s["summed"], s["embree"] + s["summed"]
    old = SIDE**2 * RAY_2007 + s["summed"]
    gradient, hessian = s["gradient"] / s["value"], s["hessian"] / s["value"]
    return [
        Claim("Further rays for gradients in object space", "none", 0.0, "of the value's", True),
        Claim(
            "Further rays in image space, edges bisected and tangents measured: mean",
            "none, edges as they were traced",
            extra,
            "of the value's",
            extra <= 0.3,
        ),
        Claim("The same, most of all receivers", None, worst, "of the value's"),
        Claim("Exact E with its gradient over E alone", None, gradient, "times", gradient <= 2.0),
        Claim("E with gradient and Hessian over E alone", None, hessian, "times", hessian <= 4.0),
        Claim(
            "Total of a gradient in object space beside 10,000 rays through analytic shapes",
            None,
            s["edges"] / value,
            "of the value's time",
        ),
        Claim(
            "Total of a gradient in object space beside 10,000 rays by Embree",
            None,
            s["edges"] / meshes,
            "of the value's time",
        ),
        Claim(
            "Total of a gradient in object space at R07's cost of a ray, 1.7 microseconds",
            "less than 0.02",
            s["edges"] / old,
            "of the value's time",
            s["edges"] / old < 0.02,
        ),
        Claim(
            "Hessian beside 10,000 rays through analytic shapes",
            "roughly 0.5 (J12, for its own scenes)",
            (s["hessian"] - s["value"]) / value,
            "of the value's time",
        ),
        Claim(
            "Hessian beside 10,000 rays by Embree",
            "roughly 0.5 (J12, for its own scenes)",
            (s["hessian"] - s["value"]) / meshes,
            "of the value's time",
        ),
        Claim("Cost of a ray through analytic shapes", None, 1e9 * s["rays"] / SIDE**2, "ns"),
        Claim("Cost of a ray by Embree", None, 1e9 * s["embree"] / SIDE**2, "ns"),
    ]
