"""Public functions take NumPy's arrays, integers and lists as well as JAX's arrays."""

import ast
import os
import pathlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import (
    bandwidth,
    caching,
    fields,
    flatland,
    imaging,
    reconstruction,
    space,
    visibility,
)
from firstorder.bandwidth.pixel_rates import blocker_distance, mean_inverse_distance
from firstorder.conventions import FLATLAND
from firstorder.flatland import library
from firstorder.flatland.bounces import (
    DensityEstimator,
    photon_irradiance,
    photon_map,
    trace_photons,
)
from firstorder.flatland.estimators import gap_quadrature
from firstorder.space.bounces.radiosity import rectangle_irradiance
from firstorder.space.library import sphere_over_plane
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.silhouettes.meshes import mesh_silhouette

ROOM, BALL = library.scene_b(), sphere_over_plane()
GLASS = flatland.Scene.of(
    flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0))),
    flatland.primitive(flatland.Circles((0.0, 2.0), 1.0), ior=1.5),
)
THROUGH = ((1, "through"), (1, "through"))
MAP = photon_map(ROOM, trace_photons(ROOM, jax.random.key(0), 200, 1))
CAMERA = imaging.pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
PLACES, SLOPES = [[1, 1], [3, 1], [1, 3], [3, 3]], [[1, 2], [3, 4], [-1, 2], [0, 1]]
SQUARE = [[-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]]
FLAT, SOLID = flatland.Receiver((0.0, 0.0), 0.0), space.receiver((0, 0, 0), (1, 0, 0))
LENS = mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])

UNCHECKED = os.environ.get("SHAPE_CHECKS") == "off"
OF_INTEGERS = {"photon_irradiance", "blocker_distance"}  # numbers of shapes among them

# A function of arrays, and integers for it in lists.
CALLS = {
    "flatland.first_shape": (lambda o, d: flatland.first_shape(ROOM, o, d), [[0, 0]], [[0, 1]]),
    "flatland.nearest": (lambda o, d: flatland.nearest(ROOM, o, d), [[0, 0]], [[0, 1]]),
    "flatland.occluded": (lambda a, b: flatland.occluded(ROOM, a, b), [[0, 0]], [[0, 2]]),
    "flatland.view": (lambda c: flatland.view(ROOM, FLAT, cuts=c), [[1, 2]]),
    "flatland.irradiance": (lambda c: flatland.irradiance(ROOM, FLAT, cuts=c), [[1, 2]]),
    "flatland.local_angle": (lambda p: flatland.local_angle(FLAT, p), [-1, 1]),
    "flatland.trace_path": (
        lambda o, d: flatland.trace_path(GLASS, THROUGH, o, d, 0),
        [0, 4],
        [0, -1],
    ),
    "gap_quadrature": (lambda a: gap_quadrature(a, 4), [-1, 0, 1]),
    "photon_irradiance": (
        lambda k, f, s: photon_irradiance(MAP, DensityEstimator(k=20), k, f, s),
        [0],
        [True],
        [1],
    ),
    "space.first_shape": (lambda o, d: space.first_shape(BALL, o, d), [[0, 0, 9]], [[0, 0, -1]]),
    "space.nearest": (lambda o, d: space.nearest(BALL, o, d), [[0, 0, 9]], [[0, 0, -1]]),
    "space.occluded": (lambda a, b: space.occluded(BALL, a, b), [[0, 0, 9]], [[0, 0, 0]]),
    "in_receiver_frame": (lambda w: space.in_receiver_frame(SOLID, w), [2, 0, 0]),
    "rectangle_irradiance": (rectangle_irradiance, [0, 0, 0], [0, 0, 1], SQUARE),
    "mesh_silhouette": (lambda eye: mesh_silhouette(LENS, eye), [0, 0, 0]),
    "blocker_distance": (
        lambda x, d, on: blocker_distance(BALL, x, d, on),
        [[0, 0, 9]],
        [[[0, 0, -1]]],
        [-1],
    ),
    "mean_inverse_distance": (mean_inverse_distance, [1, 2], [1, 3]),
    "glossy_bandwidth_in_space": (
        lambda S: bandwidth.glossy_bandwidth_in_space(1.0, 3.0, S, 1.0),
        [[-1, 0], [0, -1]],
    ),
    "minimum_distance": (caching.minimum_distance, [1, 2]),
    "derivative_norm": (lambda H: caching.derivative_norm(H, 2), [[2, 0], [0, 1]]),
    "elliptic_regions": (
        lambda H: caching.elliptic_regions(H, 0.1, 0.1, 1.0).matrix,
        [[2, 0], [0, 1]],
    ),
    "gradient_regions": (
        lambda g: caching.gradient_regions(g, 0.5, 0.1, 1.0).matrix,
        [0, 3],
    ),
    "geometric_bound": (caching.geometric_bound, [[[1, 0], [0, 1]], [[-1, 0], [0, -1]]]),
    "taylor": (
        lambda v, g, H, x: caching.taylor(v, g, H, x, order=2),
        1,
        [2, 0],
        [[4, 0], [0, 1]],
        [1, 1],
    ),
    "pixel_labels": (lambda p: imaging.pixel_labels(BALL, CAMERA, p), [[0, 0], [9, 9]]),
    "delaunay_image": (
        lambda p, v, g: reconstruction.delaunay_image(p, v, 4, 4, gradient=g, scheme="gradient"),
        PLACES,
        [1, 2, 3, 5],
        SLOPES,
    ),
    "coherent_image": (
        lambda p, v, g: reconstruction.coherent_image(p, v, g, (4, 4)),
        PLACES,
        [1, 2, 3, 5],
        SLOPES,
    ),
    "directional_coherence": (reconstruction.directional_coherence, PLACES, SLOPES, [[2, 2]]),
    "cross_bilateral": (
        reconstruction.cross_bilateral,
        PLACES,
        [1, 2, 3, 5],
        [[2] * 4] * 4,
        [[1, 2, 1, 2]] * 4,
        [[[0, 0, 1]] * 4] * 4,
    ),
    "autodiff_jet": (lambda u: fields.autodiff_jet(lambda u: u[0] * u[1], u, FLATLAND), [1, 3]),
    "bracket_edges": (
        lambda a: visibility.bracket_edges(lambda a: jnp.abs(a) < 0.5, a, size=2),
        [-1, 0, 1],
    ),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", CALLS)
def test_integers_are_numbers(name):
    """NumPy's integers, and lists where annotations are not checked, which know no lists."""
    call, *given = CALLS[name]
    floats = [np.asarray(a) if name in OF_INTEGERS else jnp.asarray(a, float) for a in given]
    expected = jax.tree.leaves(call(*floats))
    for kind in (np.asarray, list) if UNCHECKED else (np.asarray,):
        found = jax.tree.leaves(call(*(kind(a) if isinstance(a, list) else a for a in given)))
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("world", "scene", "dims"), [(flatland, ROOM, 2), (space, BALL, 3)])
def test_a_single_ray_is_refused_by_the_name_of_its_argument(world, scene, dims):
    one, row = np.ones(dims), np.ones((1, dims))
    with pytest.raises(ValueError, match="`origins` must have shape"):
        world.first_shape(scene, one, row)
    with pytest.raises(ValueError, match="`b` must have shape"):
        world.occluded(scene, row, one)


SRC = pathlib.Path(__file__).parents[1] / "src" / "firstorder"
BARE = "[Array"  # in an annotation: JAX's arrays alone
# The conventions' formulas stand in the middle of others, which have arrays.
EXCEPT = {"conventions.py"}


def bare_arguments(text):
    """Arguments of the public functions of a module that only JAX's arrays fit."""
    for function in ast.parse(text).body:
        if isinstance(function, ast.FunctionDef) and not function.name.startswith("_"):
            for argument in (*function.args.args, *function.args.kwonlyargs):
                words = ast.unparse(argument.annotation) if argument.annotation else ""
                if BARE in words.replace("[ArrayLike", "") and "Callable" not in words:
                    yield f"{function.name}({argument.arg})"


def test_public_functions_ask_for_what_an_array_is_made_of():
    found = [
        f"{path.relative_to(SRC)}: {argument}"
        for path in sorted(SRC.rglob("*.py"))
        if not any(part.startswith("_") for part in path.relative_to(SRC).parts)
        if str(path.relative_to(SRC)) not in EXCEPT
        for argument in bare_arguments(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_an_argument_of_jaxs_arrays_alone_is_noticed():
    text = 'def f(x: Float[Array, "n 2"], y: Float[ArrayLike, "n"], z: ArrayLike): ...'
    assert list(bare_arguments(text)) == ["f(x)"]
