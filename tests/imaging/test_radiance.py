"""Value and image gradient alone: against the sum of R07's terms, and against autodiff."""

import functools
import pathlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging import _radiance as module
from firstorder.imaging._area_lights import lobe_radiance, shadow_edge_terms
from firstorder.imaging._interaction import SurfaceInteraction, surface_interaction
from firstorder.imaging.camera import pinhole
from firstorder.imaging.shading import SurfaceMaps
from firstorder.imaging.sky_lights import sky_light
from firstorder.space import Scene, primitive, sphere
from firstorder.space.skies import GaussianSky
from tests.precision import as_dtype

SCENE = Scene.of(primitive(sphere((0.0, 0.0, 0.5), 0.5), albedo=0.6, specular=0.3, exponent=12.0))
CAMERA = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.4)
LAMP = Lamp((-1.0, -1.5, 2.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 8.0, 5, True)
DOME = sky_light(GaussianSky((-0.3, -0.5, 0.8), 0.5), "even", 4)
LIGHTS = {"near": LAMP, "distant": DOME}
PLACES = np.array([(0.05, 0.1), (-0.08, 0.2), (0.12, 0.02), (0.0, 0.24)])
# What rounding leaves of sums of some dozen terms and a power of 12.
ROUNDING = {"float64": 1e-12, "float32": 2e-4}


def bumps(index, x):
    return 0.01 * jnp.sin(20.0 * x[0]) * jnp.sin(15.0 * x[1]) * jnp.sin(17.0 * x[2])


def texture(index, x):
    return 0.6 + 0.3 * jnp.sin(9.0 * x[0] - 4.0 * x[2])


FINISH = SurfaceMaps(bumps, albedo=texture)


@functools.cache
def seen_places() -> SurfaceInteraction:
    look = jax.vmap(lambda p: surface_interaction(SCENE, CAMERA, p, jnp.array(0), FINISH))
    return jax.jit(look)(PLACES)


def places(dtype="float64") -> SurfaceInteraction:
    return as_dtype(seen_places(), dtype)


def visibility(light, share=0.6):
    count = light.shape[0] * light.shape[1]
    return np.random.default_rng(3).random((len(PLACES), count)) < share


def fast(at, light, seen):
    def one(at, seen):
        point, factors = module.shading_point(at)
        return module.radiance_gradient(light, seen, point, factors, module.point_motion(at))

    return eqx.filter_jit(jax.vmap(one))(at, seen)


@functools.cache
def by_terms(name):
    """The sum of both lobes' terms, as `shade_point` takes it."""
    at, light = places(), LIGHTS[name]

    def one(at, seen):
        above = light.toward(at.point.position)[0] @ at.point.base_normal > 0.0
        terms = lobe_radiance(light, 1.0 * (seen & above), at.point, at.view.to_eye, at.lobe)
        slopes = (t.image_gradient(at.view, at.point) for t in terms)
        return sum(t.value for t in terms), sum(slopes)

    return eqx.filter_jit(jax.vmap(one))(at, visibility(light))


def off(found, true) -> float:
    """Largest error, over the largest of the true numbers."""
    errors = [np.max(abs(a - b)) / np.max(abs(b)) for a, b in zip(found, true, strict=True)]
    return float(max(errors))


def against_terms(name, dtype="float64") -> float:
    at, light = places(dtype), as_dtype(LIGHTS[name], dtype)
    found = fast(at, light, visibility(light))
    assert all(a.dtype == dtype for a in found)
    return off(found, by_terms(name))


@pytest.mark.smoke
@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("dtype", ROUNDING)
def test_value_and_gradient_are_the_sum_of_the_terms(name, dtype):
    assert against_terms(name, dtype) < ROUNDING[dtype]


def against_autodiff(name) -> float:
    """The value of `radiance`, differentiated through camera, surface, bumps and texture."""
    light = LIGHTS[name]
    seen = jnp.asarray(visibility(light))

    def value(p, seen):
        at = surface_interaction(SCENE, CAMERA, p, jnp.array(0), FINISH)
        return module.radiance(light, seen, *module.shading_point(at))

    true = eqx.filter_jit(jax.vmap(jax.value_and_grad(value)))(jnp.asarray(PLACES), seen)
    return off(fast(places(), light, seen), true)


@pytest.mark.parametrize("name", LIGHTS)
def test_the_gradient_is_autodiffs(name):
    assert against_autodiff(name) < 1e-11


FAULTS = {
    "the mirror turns once": ("dr = 2.0 * (", "dr = 1.0 * ("),
    "the eye stands still": ("dot(n, v) * dn) - dv", "dot(n, v) * dn)"),
    "the lobe has no way to grow short": ("(4.0 + point.exponent)", "4.0"),
    "the normal's own step is left out": ("- from_n[3] * n ", ""),
    "the lamp's cosine is left out": ("still + (each / at.facing) @ at.area", "still"),
    "moments are about the origin": ("a[:3] - a[3] * x", "a[:3]"),
    "the texture does not vary": ("+ (plain @ ones) * motion.diffuse", ""),
}


@pytest.fixture
def faulty(monkeypatch):
    """The module with one line of its source replaced."""
    source = pathlib.Path(module.__file__).read_text("utf-8")

    def put(right, wrong):
        assert source.count(right) == 1
        names = dict(vars(module))
        exec(compile(source.replace(right, wrong), "fault", "exec"), names)
        for name in ("point_motion", "radiance_gradient", "edge_radiance", "_slid"):
            monkeypatch.setattr(module, name, names[name])

    return put


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(fault, faulty):
    faulty(*FAULTS[fault])
    assert against_terms("near") > 1e-3
    assert against_autodiff("near") > 1e-3


# --- edges of shadows ----------------------------------------------------------------------------


def edges_off(name, dtype="float64") -> float:
    """All pairs of neighbours, one by one, against the dense sum of `shadow_edge_terms`.

    A blocker half-way has `(1 - tau) / tau = 1`, at its limb too, if all nodes are as deep.
    """
    at, light = places(dtype), as_dtype(LIGHTS[name], dtype)
    seen = visibility(light).reshape(-1, *light.shape)
    both = eqx.filter_jit(jax.vmap(lambda at: (module.shading_point(at), module.point_motion(at))))
    (point, _), motion = both(at)
    moved = motion.position
    one = eqx.filter_jit(functools.partial(module.edge_radiance, light))
    found = np.zeros((len(PLACES), 2, 2))
    rows, columns = light.shape
    for k, V in enumerate(seen.astype(float)):
        here = jax.tree.map(lambda a, k=k: a[k], (point, moved))
        for i, j in np.ndindex(rows, columns):
            for axis, (m, n) in enumerate(((i + 1, j), (i, j + 1))):
                if axis == 1 and light.wraps:
                    n %= columns
                if m < rows and n < columns and V[m, n] != V[i, j]:
                    nodes = jnp.array(i * columns + j), jnp.array(m * columns + n)
                    found[k] += (V[m, n] - V[i, j]) * one(nodes, jnp.array(axis), *here)
    return off([found.sum(1)], [dense(name, seen)])


def dense(name, seen):
    light = LIGHTS[name]

    def one(at, seen):
        lobe = eqx.tree_at(
            lambda a: (a.albedo, a.specular),
            at.lobe,
            (jnp.pi + 0.0 * at.lobe.albedo, 2.0 * jnp.pi / (at.lobe.exponent + 2.0)),
        )
        above = light.toward(at.point.position)[0] @ at.point.base_normal > 0.0
        half = jnp.full(len(seen), 0.5)
        terms = shadow_edge_terms(light, seen, half, at.point, at.view.to_eye, lobe)
        return sum(terms) @ at.view.surface_D_p(at.point), above

    seen = np.asarray(seen.reshape(len(seen), -1), float)
    edges, above = eqx.filter_jit(jax.vmap(one))(places(), seen)
    assert np.all(above) or name == "distant"
    return np.asarray(edges)


@pytest.mark.parametrize("dtype", ROUNDING)
def test_edges_one_by_one_are_the_dense_sum(dtype):
    assert edges_off("near", dtype) < ROUNDING[dtype]


@pytest.mark.parametrize(
    "wrong", [("at.weight * at.height)[0]", "at.weight)[0]"), ("[0, axis]", "[0, 1 - axis]")]
)
def test_wrong_edges_are_noticed(wrong, faulty):
    faulty(*wrong)
    assert edges_off("near") > 1e-3


@pytest.mark.parametrize("x", [(0.5, 0.2, 2.0), (0.0, 0.0, -30.0), (-1.0, -1.5, 2.5)])
def test_no_nan_in_degenerate_places(x):
    """Behind the lamp, far below it, on one of its nodes."""
    at = jax.tree.map(lambda a: a[0], places())
    at = eqx.tree_at(lambda a: a.point.position, at, jnp.asarray(x))
    point, factors = module.shading_point(at)
    found = module.radiance_gradient(LAMP, jnp.ones(25), point, factors, module.point_motion(at))
    assert all(np.all(np.isfinite(a)) for a in found)
