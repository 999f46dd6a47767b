"""Entry points whose first call counts, each as a function with arguments.

`tests/test_first_call.py` bounds the programs that JAX traces of them, and
`benchmarks/bench_first_call.py` times their first calls. A program is counted in equations, those
of the functions that it calls and of its loops included; one that is compiled once and called
twice counts twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from firstorder import caching, flatland, imaging, shadowfield, space
from firstorder.fields import BoxProfile, GaussianProfile, Separable, gaussian
from firstorder.flatland import library
from firstorder.flatland.bounces import Discretization, solve_radiosity
from firstorder.imaging import Lamp, shading
from firstorder.laws import Integrate
from firstorder.space.azimuthal import irradiance_by_azimuth
from firstorder.transport import Cosine, Curvature, Mirror, Reflection

Call = tuple[Callable[..., Any], tuple]


def equations(function: Callable[..., Any], *args: Any) -> int:
    """How many equations JAX traces of a call."""
    return sum(1 for _ in _all(eqx.filter_make_jaxpr(function)(*args)[0].jaxpr))


def numbers_computed(function: Callable[..., Any], *args: Any) -> int:
    """How many numbers those equations compute, each loop once."""
    program = eqx.filter_make_jaxpr(function)(*args)[0].jaxpr
    return sum(math.prod(out.aval.shape) for e in _all(program) for out in e.outvars)


def _all(program) -> Iterator[Any]:
    """Every equation of a program and of the programs inside it."""
    for equation in program.eqns:
        yield equation
        for inner in jax.tree.leaves(list(equation.params.values()), is_leaf=_is_program):
            if _is_program(inner):
                yield from _all(getattr(inner, "jaxpr", inner))


def _is_program(a: Any) -> bool:
    return hasattr(a, "eqns") or hasattr(a, "jaxpr")


# --- worlds --------------------------------------------------------------------------------------


def lit_by_segment(x, radius):
    """Irradiance beside a disc, as the README has it."""
    lamp = flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    disc = flatland.primitive(flatland.Circles((0.1, 0.5), radius))
    return flatland.irradiance(flatland.Scene.of(lamp, disc), flatland.Receiver((x, 0.0), 0.0))


def room(s):
    """Irradiance on the floor of J12's room."""
    scene = library.named_scene("scene_d")
    return flatland.irradiance(scene, flatland.receiver(scene, scene.named("floor")[0], s))


def lamp_ball_box():
    """A lamp above a ball and a box."""
    lamp = space.rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    return space.Scene.of(
        space.primitive(lamp, emission=1.0),
        space.primitive(space.sphere((0.1, 0.05, 1.0), 0.2), albedo=0.5),
        space.primitive(space.box((0.3, 0.3, 0.2), (0.5, 0.5, 0.6)), albedo=0.5),
    )


def light_of_a_line():
    """Irradiance along a floor as a field: the light field of a lamp and a disc, integrated."""
    lamp = flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    disc = flatland.primitive(flatland.Circles((0.1, 0.5), 0.2))
    light = flatland.light_field(flatland.Scene.of(lamp, disc), flatland.Receiver((0.0, 0.0), 0.0))
    return Integrate("theta", -0.5 * math.pi, 0.5 * math.pi, 24)(Cosine()(light))


def lit_in_space(scene, at, step):
    """Irradiance of a receiver after a step."""
    return space.irradiance(scene, at.moved(step))


def light_of_slopes():
    """The light field of a lamp and a ball on a floor, integrated over one slope."""
    lamp = space.rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    ball = space.primitive(space.sphere((0.1, 0.05, 1.0), 0.2), albedo=0.5)
    scene = space.Scene.of(space.primitive(lamp, emission=1.0), ball)
    light = space.light_field(scene, space.Receiver.at((0.1, 0.2, 0.0)), axis="w")
    return Integrate("w", -3.0, 3.0, 16)(light)


def five_derivatives(scene, at):
    """Value, gradient and Hessian by all freedoms."""
    return space.derivatives(space.irradiance, scene, at)


def path():
    """The README's path of light."""
    shine = Curvature(0.4) >> Mirror() >> Reflection(GaussianProfile(0.2))
    shine = shine >> Curvature(0.4, back=True)
    return (gaussian(center=(0.2, 0.1), sigma=(0.5, 0.3)) >> shine).light


def planar_shadow():
    """The spectrum of a slit's shadow under a lamp."""
    slit, light = (
        Separable([0.0], (BoxProfile(width, "y", shadowfield.PLANE),)).spectrum()
        for width in (0.1, 0.5)
    )
    return shadowfield.PlanarShadowSpectrum(slit, light, 1.0, 0.5)


def small_cache():
    """Two records."""
    some = caching.Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
    return caching.Cache.of(some, caching.circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0))


def radiosity():
    """Light in a small room."""
    walls = flatland.box((0, 0), (1, 1), inward=True)
    scene = flatland.Scene.of(flatland.primitive(walls, emission=0.5, albedo=0.5))
    return solve_radiosity(scene, fineness=Discretization(nodes=4))


def pixel(scene, camera, lamps, p, index):
    """One tile of shaded pixels."""
    return shading._block(scene, camera, lamps, p, index, None, True)


def calls() -> dict[str, Call]:
    """The entry points by name."""
    in_space = lamp_ball_box(), space.Receiver.at((0.1, 0.2, 0.0)), jnp.array([0.1, 0.02])
    in_flatland = jnp.asarray(0.3), jnp.asarray(0.1)
    scene, at, _ = in_space
    light, on_line, in_slopes = path(), light_of_a_line(), light_of_slopes()
    field = space.light_field(scene, space.Receiver.at((0.1, 0.2, 0.0)))
    camera = imaging.pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.4)
    lamp = Lamp((-1.0, -1.5, 2.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 8.0, 5, True)
    pixels = jnp.zeros((shading.BLOCK, 2)), jnp.zeros(shading.BLOCK, int)
    solved = radiosity()
    on_floor = flatland.Receiver((0.3, 0.0), 0.0)
    return {
        "flatland E": (lit_by_segment, in_flatland),
        "flatland gradient": (jax.grad(lit_by_segment, (0, 1)), in_flatland),
        "flatland Hessian": (jax.hessian(lit_by_segment, (0, 1)), in_flatland),
        "scene_d E": (room, in_flatland[:1]),
        "scene_d E''": (jax.grad(jax.grad(room)), in_flatland[:1]),
        "flatland light field, integrated, jet": (type(on_line).jet, (on_line, jnp.array([0.3]))),
        "flatland radiosity": (type(solved).irradiance, (solved, on_floor)),
        "space E": (lit_in_space, in_space),
        "space gradient": (jax.grad(lit_in_space, 2), in_space),
        "space Hessian": (jax.hessian(lit_in_space, 2), in_space),
        "space derivatives": (five_derivatives, (scene, at)),
        "space light field, jet": (type(field).jet, (field, jnp.array([0.0, 0.0, 0.1, 0.1]))),
        "space light field, integrated, jet": (type(in_slopes).jet, (in_slopes, jnp.zeros(3))),
        "azimuth integral": (irradiance_by_azimuth, (scene, at)),
        "path, jet": (type(light).jet, (light, jnp.array([0.3, -0.1]))),
        "path, spectrum": (lambda light, Omega: light.spectrum().at(Omega), (light, jnp.ones(2))),
        "shadow field, spectrum": (lambda H, Omega: H.at(Omega), (planar_shadow(), jnp.ones(1))),
        "cache": (lambda cache, x: cache(x), (small_cache(), jnp.array([0.3]))),
        "tile of pixels": (pixel, (scene, camera, (lamp,), *pixels)),
    }
