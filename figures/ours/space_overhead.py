"""What gradients cost beside values, for three spheres over a plane: rays, shading, and both.

No figure of the papers: R07 §8.1 ("no new ray tracing is required in either method to compute
gradients") and J12 §8 ("roughly 50% more computation time" for the Hessian, with fast rays).

Values are R07's: 100 x 100 rays a receiver, traced through the analytic shapes, and through meshes
of the balls (5,120 triangles each) by Embree, whose hits are met again in double precision. Object
space gradients are `boundary_gradient`: silhouettes of all shapes, cut and integrated. What lies
beside a piece of a silhouette is asked by two directions; these count as rays here, and are counted
while the programs of value and gradient are traced. Image-space gradients start from the rays that
were traced: an edge is where neighbours in an azimuth differ. As R07 has it that needs no further
ray; bisected, it would take 16 rays for each edge and 3 for its tangent's length.

Ratios of processor times are taken in turns. The exact irradiance and its automatic derivatives are
those of the receiver's motion in its plane. Silhouettes, cuts and what is seen between them are
found once. The derivative of a sum over closed edges is one integral along them at fixed cuts
(`space.silhouettes._edge_integrals`), so that a gradient differentiates no cut and a Hessian each
cut once. R07's ratio of rays to shading, "less than 2%" (§9.2), is measured on its own image in
`r07_cost_of_a_pixel`; J12's half of the time is of its own scenes: here both are plain numbers.
"""

from __future__ import annotations

from unittest import mock

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures import timing
from figures.style import Drawing
from figures.timing import Ratio
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.io import Embree
from firstorder.numerics._batching import in_batches
from firstorder.scene import _intersect
from firstorder.space import first_shape, receiver
from firstorder.space.direct_lighting import boundary_gradient, irradiance
from firstorder.space.library._scenes import three_spheres
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.silhouettes import visible

SIDE = 100  # rays in theta and in phi
TRACED = 64  # receivers that trace them
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

    rounds = 3 if quick else 9
    seconds = {
        "rays": _cost(rounds, _traced, scene, few, w) / TRACED,
        "embree": _cost(rounds, _by_embree, Embree(_balls(scene)), np.asarray(few.position), w)
        / TRACED,
        "summed": _cost(rounds, _summed, jnp.ones((TRACED, SIDE * SIDE), bool), weight) / TRACED,
        "edges": _cost(rounds, _edges, scene, at) / count,
        "value": _cost(rounds, _value, scene, at) / count,
        "gradient": _cost(rounds, _gradient, scene, at) / count,
        "hessian": _cost(rounds, _hessian, scene, at) / count,
    }
    ratios = {
        name: timing.ratio(lambda f=f: f(scene, at), lambda: _value(scene, at), rounds)
        for name, f in (("gradient", _gradient), ("hessian", _hessian))
    }
    one = jax.tree.map(lambda a: a[0], at)
    asked = {
        "value": _asked(irradiance, scene, one),
        "boundary": _asked(boundary_gradient, scene, one),
        "gradient": _asked(_value_and_gradient, scene, one),
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
    further = [asked["boundary"] - asked["value"], 0.0, SIDE**2 * extra.mean()]
    axes[0, 1].bar(["object space", "as traced", "bisected"], 100.0 * np.array(further) / SIDE**2)
    axes[0, 1].set_title("further rays for a gradient", loc="left")
    axes[0, 1].set_ylabel("% of the value's")

    arrays = {"extra": extra, **{f"seconds_{k}": np.array(v) for k, v in seconds.items()}}
    size = f"{count} receivers, {SIDE} x {SIDE} rays for {TRACED}"
    claims = [*_rays_asked(asked, extra), *_times(ratios, seconds)]
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


def _value_and_gradient(scene, a):
    return jax.value_and_grad(_moved(scene, a))(jnp.zeros(2))


@eqx.filter_jit
def _gradient(scene, at):
    return _each(lambda a: _value_and_gradient(scene, a), at)


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


def _cost(rounds: int, function, *arguments) -> float:
    """Least processor time of several calls, the first one left out."""
    return min([timing.seconds(lambda: function(*arguments)) for _ in range(rounds + 1)][1:])


# --- what is counted -----------------------------------------------------------------------------


def _asked(function, scene, at) -> int:
    """Rays that a program for one receiver asks for, counted while it is traced."""
    counted, beside, first = [], visible._ask, _intersect.first_shape

    def ask(found, eye, turn, w):
        counted.append(w.shape[0])
        return beside(found, eye, turn, w)

    def trace(groups, rays, *more, **named):
        counted.append(rays[0].shape[0])
        return first(groups, rays, *more, **named)

    with (
        mock.patch.object(visible, "_ask", ask),
        mock.patch.object(_intersect, "first_shape", trace),
    ):
        eqx.filter_make_jaxpr(lambda a: function(scene, a))(at)
    return sum(counted)


# --- claims --------------------------------------------------------------------------------------


def _rays_asked(asked: dict[str, int], extra) -> list[Statement | Measurement]:
    none = at_most(0.0, "'no new ray tracing'")
    return [
        Measurement("Directions that the exact value asks for, two a piece of a silhouette",
                    asked["value"], "a receiver"),
        Statement("No new ray tracing is required in object space: directions that the gradient "
                  "asks for beyond the value's", 0.0, asked["boundary"] - asked["value"], none,
                  "R07 §8.1", "a receiver"),
        Statement("... that value and gradient together ask for beyond the value's", 0.0,
                  asked["gradient"] - asked["value"], none, "R07 §8.1", "a receiver"),
        Measurement("Further rays in image space, were edges bisected and tangents measured: mean",
                    float(np.mean(extra)), "of the value's"),
        Measurement("... most of all receivers", float(np.max(extra)), "of the value's"),
    ]  # fmt: skip


def _times(ratios: dict[str, Ratio], s) -> list[Statement | Measurement]:
    (gradient, error), (hessian, error_2) = ratios["gradient"], ratios["hessian"]
    beside = {
        "analytic shapes": s["rays"] + s["summed"],
        "Embree": s["embree"] + s["summed"],
    }
    bent = s["hessian"] - s["value"]
    return [
        Statement("Exact E with its gradient over E alone: time", None, gradient,
                  at_most(2.0, "at most twice"), OURS, "times", error),
        Statement("E with gradient and Hessian over E alone: time", None, hessian,
                  at_most(4.0, "at most four times"), OURS, "times", error_2,
                  reason="A Hessian finds the derivatives of every cut as well; differences "
                  "would take six values of E."),
        *(Measurement(f"A gradient in object space beside 10,000 rays, by {name}",
                      s["edges"] / value, "of the value's time", source="R07 §8.1")
          for name, value in beside.items()),
        *(Measurement(f"A Hessian beside 10,000 rays, by {name}", bent / value,
                      "of the value's time", source="J12 §8")
          for name, value in beside.items()),
        Measurement("Cost of a ray through analytic shapes", 1e9 * s["rays"] / SIDE**2, "ns"),
        Measurement("Cost of a ray by Embree", 1e9 * s["embree"] / SIDE**2, "ns"),
    ]  # fmt: skip
