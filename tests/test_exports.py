"""Every exported name under jit, vmap and grad, in float32 and in float64.

A new export is one line of `PROBES` in `tests/probes`: a function of one number s that builds the
thing from s and returns what it computes. The walk differentiates it through that number. Abstract
classes are walked through what extends them. What works on the host by design is in `HOST`. Names
of private modules that several chapters share are walked with the exports.
"""

import ast
import importlib
import importlib.util
import inspect
import pathlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.probes import fields, flatland, methods, numerics, space, transport, visibility

# Wherever numbers are computed; `checks`, `plotting` and `io` work on the host.
PACKAGES = [
    name
    for name in (
        "numerics", "fields", "laws", "transport", "visibility", "sampling", "scene", "flatland",
        "space", "models", "bandwidth", "reconstruction",
    )
    if importlib.util.find_spec(f"firstorder.{name}")
]  # fmt: skip

PROBES = (
    fields.PROBES
    | flatland.PROBES
    | methods.PROBES
    | numerics.PROBES
    | space.PROBES
    | transport.PROBES
    | visibility.PROBES
)

# What NumPy or Python computes by design: it cannot be traced, so its own tests have to do.
HOST = {
    "numerics.host_blocks",  # a loop of the host over a compiled function
    "numerics._batching.host_rows",  # the same for one block
    # Differences between pixels of finished pictures, and what scales a picture by its own mean.
    "bandwidth.pixel_differences",
    "bandwidth.sampling_density",
    # Steps of a path are shapes' numbers and words; the incidence is asked for as a Python float.
    "flatland.rainbow_incidence",
    "flatland.through_body",
    # Meshes, built once by NumPy.
    "models.bar_lattice",
    "models.bumpy_sphere",
    "models.displaced_ground",
    "models.fern",
    "models.isosurface",
    "models.join_meshes",
    "models.metaballs",
    "models.place_mesh",
    "models.quad_triangles",
    "models.ripples",
    "models.rotation_about",
    "models.torus_knot",
    "models.tree",
    # Rules of quadrature whose numbers are constants.
    "numerics.gauss_legendre",
    "numerics._quadrature.periodic_trapezoid",
    # The quadtree: its samples, its squares, and metrics that tell which square to split next.
    "reconstruction.ImageSamples",
    "reconstruction.QuadtreeCells",
    "reconstruction.ShadedSamples",
    "reconstruction.by_area",
    "reconstruction.by_density",
    "reconstruction.by_differences",
    "reconstruction.by_gradient",
    "reconstruction.by_hessian",
    "reconstruction.by_hessian_differences",
    "reconstruction.by_variance",
    "reconstruction.importance_product",
    "reconstruction.is_far_light",
    "reconstruction.sample_image",
    # Images from scattered samples, with SciPy's trees and triangulations, or void and cluster.
    "reconstruction.bilateral_widths",
    "reconstruction.blue_noise_samples",
    "reconstruction.coherent_image",
    "reconstruction.directional_coherence",
    "reconstruction.DirectionalCoherence",
    "reconstruction.cross_bilateral",
    "reconstruction.delaunay_image",
    # Oracles for estimators, by SciPy's incomplete beta function and bisection.
    "sampling.ExpectedDensity",
    "sampling.expected_fixed_radius",
    "sampling.expected_k_nearest",
    # Refuses a frame; it computes nothing.
    "transport.require_frame",
}


def exported():
    """Dotted names of all that is exported and can be made."""
    for package in PACKAGES:
        module = importlib.import_module(f"firstorder.{package}")
        for name in getattr(module, "__all__", ()):
            if not inspect.isabstract(getattr(module, name)):
                yield f"{package}.{name}"


def shared(name):
    """Whether a name is none of users, but of several chapters: its module is private."""
    return "._" in name


def test_every_export_is_walked():
    walked = set(PROBES) | HOST
    assert sorted(set(exported()) ^ {name for name in walked if not shared(name)}) == []


def used_by(test):
    """The names of the library that a test file imports and reads, or reads from a chapter."""
    nodes = list(ast.walk(ast.parse(test.read_text())))
    froms = [n for n in nodes if isinstance(n, ast.ImportFrom) and n.module]
    ours = {
        alias.asname or alias.name: alias.name
        for n in froms
        if (n.module or "").startswith("firstorder")
        for alias in n.names
    }
    read = {ours[n.id] for n in nodes if isinstance(n, ast.Name) and n.id in ours}
    attributes = [n for n in nodes if isinstance(n, ast.Attribute)]
    return read | {
        n.attr for n in attributes if isinstance(n.value, ast.Name) and n.value.id in ours
    }


def test_what_works_on_the_host_is_exported_and_has_its_own_test():
    here = pathlib.Path(__file__)
    tests = (test for test in here.parent.rglob("test_*.py") if test != here)
    tested = set().union(*map(used_by, tests))
    assert sorted({name for name in HOST if not shared(name)} - set(exported())) == []
    assert sorted(HOST & set(PROBES)) == []
    assert [name for name in sorted(HOST) if name.split(".")[-1] not in tested] == []


def numbers(tree):
    """All floating arrays of a result."""
    leaves = [leaf for leaf in jax.tree.leaves(tree) if eqx.is_inexact_array(leaf)]
    assert leaves
    return leaves


def total(leaves):
    return sum(jnp.sum(jnp.real(leaf)) + jnp.sum(jnp.imag(leaf)) for leaf in leaves)


def walk(probe, bits):
    """Evaluates a probe and its gradient at three numbers, compiled; the faults that it finds."""

    def summed(s):
        leaves = numbers(probe(s))
        return total(leaves), leaves

    with jax.enable_x64(bits == 64):
        s = jnp.array([0.31, 0.47, 0.63])
        assert s.dtype == f"float{bits}"
        compiled = jax.jit(
            jax.vmap(jax.value_and_grad(summed, has_aux=True)),
            compiler_options={"xla_backend_optimization_level": 0},  # it runs once
        )
        (_, leaves), gradient = compiled(s)
    right = (f"float{bits}", f"complex{2 * bits}")
    faults = [f"a result in {leaf.dtype}" for leaf in leaves if leaf.dtype not in right]
    if not all(np.all(np.isfinite(leaf)) for leaf in leaves):
        faults.append("a value that is not finite")
    if not np.all(np.isfinite(gradient)):
        faults.append("a gradient that is not finite")
    return faults


@pytest.mark.parametrize("bits", [32, 64])
@pytest.mark.parametrize("name", sorted(PROBES))
def test_jit_vmap_and_grad_are_finite_and_keep_the_precision(name, bits):
    assert walk(PROBES[name], bits) == []


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (lambda s: jnp.sqrt(0.0 * s), "a gradient that is not finite"),
        (lambda s: 1.0 / jnp.floor(s), "a value that is not finite"),
        (lambda s: s.astype("float16"), "a result in float16"),
    ],
)
def test_the_walk_sees_what_is_wrong(wrong, fault):
    assert fault in walk(wrong, 32)
