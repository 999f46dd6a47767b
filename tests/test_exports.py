"""Every exported name under jit, vmap and grad, in float32 and in float64.

A new export is one line of `PROBES` in `tests/probes`: a function of one number s that builds the
thing from s and returns what it computes. The walk differentiates it through that number. A probe
of several names, which is compiled once, returns a dictionary by them. Abstract classes are walked
through what extends them. What works on the host by design is in `HOST`, and whole chapters and
modules of that kind in `ON_THE_HOST`. Names of private modules that several chapters share are
walked with the exports.
"""

import ast
import importlib
import inspect
import pathlib
import pkgutil
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import firstorder
from tests.probes import (
    caching,
    conventions,
    fields,
    flatland,
    flatland_parts,
    imaging,
    methods,
    numerics,
    shadowfield,
    space,
    space_parts,
    transport,
    visibility,
)

# Chapters, and modules below them, that work on the host by design, and what they are.
ON_THE_HOST = {
    "caching.candidate_tables": "tables in NumPy, ray by ray",
    "caching.filling": "which candidates become records: one after the other, in NumPy",
    "caching.occlusion": "tables in NumPy",
    "checks": "judges what has been computed",
    "cli": "the command line",
    "flatland.discontinuities._event_table": "tables of visual events",
    "io": "files",
    "jobs": "jobs for this program or for workers, which compile what they are given",
    "ledger": "gathers and judges rows",
    "plotting": "pictures by matplotlib",
    "rendering": "images, tile by tile into files",
    "session": "flags of JAX",
    "shadowfield.rendering": "tables of shadow rays in NumPy, as many as there are",
    "space.discontinuities._event_table": "tables of visual events",
    "symbolic": "formulas by SymPy",
}


def on_the_host(name):
    """Whether a dotted name lies in what works on the host."""
    parts = name.split(".")
    return any(".".join(parts[: i + 1]) in ON_THE_HOST for i in range(len(parts)))


def packages():
    """Names of all public packages whose numbers are JAX's, those above before those below."""
    found = [
        info.name.removeprefix("firstorder.")
        for info in pkgutil.walk_packages(firstorder.__path__, "firstorder.")
        if info.ispkg
    ]
    public = [name for name in found if not on_the_host(name) and "._" not in f".{name}"]
    return sorted(public, key=lambda name: (name.count("."), name))


PROBES = (
    caching.PROBES
    | conventions.PROBES
    | fields.PROBES
    | flatland.PROBES
    | flatland_parts.PROBES
    | imaging.PROBES
    | methods.PROBES
    | numerics.PROBES
    | shadowfield.PROBES
    | space.PROBES
    | space_parts.PROBES
    | transport.PROBES
    | visibility.PROBES
)

# What NumPy or Python computes by design: it cannot be traced, so its own tests have to do.
HOST = {
    # Words: which coordinates, which sense.
    "conventions.Frame",
    "conventions.frame_with",
    "conventions.travel_sign",
    "flatland.light_fields.facing",
    # What makes or measures tables and images, in NumPy.
    "caching.fill_surface",
    "caching.floats_per_record",
    "caching.gradient_discontinuities",
    "caching.ideal_region",
    "caching.largest_set",
    "caching.neighbour_clamping",
    "caching.rms",
    "caching.ssim",
    "imaging.PrimaryHits",
    "imaging.RenderedImage",
    "imaging.ShadedPixels",
    "imaging.facet_gbuffer",
    "imaging.gbuffer",
    "imaging.pixel_grid",
    "imaging.pixel_positions",
    "imaging.primary_hits",
    "imaging.render",
    "imaging.shade_pixels",
    # Panels, events and numbers of photons follow from the scene, and are found before the rest.
    "flatland.bounces.Discretization",
    "flatland.bounces.RadiositySolution",
    "flatland.bounces.PhotonMap",
    "flatland.bounces.corner_exponent",
    "flatland.bounces.photon_map",
    "flatland.bounces.solve_radiosity",
    "flatland.bounces.split_photons",
    "flatland.discontinuities.jumps_on",
    "flatland.discontinuities.visual_events",
    "shadowfield.depth_range",
    "shadowfield.replicas_overlap",
    "shadowfield.visible_lengths",
    "space.bounces.face_layout",
    "space.discontinuities.DiscontinuityMesh",
    "space.discontinuities.discontinuity_mesh",
    "space.discontinuities.visual_events_along",
    "space.bounces.solve_radiosity",
    # Photons in space are asked for by trees of SciPy.
    "space.bounces.PhotonMap",
    "space.bounces.final_gather",
    "space.bounces.photon_irradiance",
    "space.bounces.photon_map",
    "space.bounces.photon_radiance_maps",
    "space.bounces.photon_radiances",
    # Which edges of a mesh are seen: numbers of edges and faces, by a tracer on the host.
    "space.silhouettes.BruteForceTracer",
    "space.silhouettes.MeshSilhouettes",
    "space.silhouettes.visible_mesh_silhouettes",
    # Scenes by their names.
    "flatland.library.describe_scene",
    "flatland.library.named_scene",
    "flatland.library.scene_names",
    "space.library.describe_scene",
    "space.library.named_scene",
    "space.library.scene_names",
    "numerics.host_blocks",  # a loop of the host over a compiled function
    "numerics._batching.host_rows",  # the same for one block
    "numerics._order.morton",  # an order of points for tables of NumPy
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
    "reconstruction.by_tangent_planes",
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
    "reconstruction.quadtree_image",
    # Oracles for estimators, by SciPy's incomplete beta function and bisection.
    "sampling.ExpectedDensity",
    "sampling.expected_fixed_radius",
    "sampling.expected_k_nearest",
    # Refuses a frame; it computes nothing.
    "transport.require_frame",
}


def walkable(thing):
    """Whether there is something to run: neither a constant nor a description of other classes."""
    described = inspect.isabstract(thing) or getattr(thing, "_is_protocol", False)
    return callable(thing) and not described


def exported():
    """Dotted names of all that is exported and can be made or called.

    What a package below exports is asked for once, by the name of the package above it.
    """
    module = importlib.import_module("firstorder.conventions")
    for name, thing in vars(module).items():
        here = (inspect.isfunction(thing) or inspect.isclass(thing)) and not name.startswith("_")
        if here and thing.__module__ == module.__name__:
            yield f"conventions.{name}"
    seen = set()
    for package in packages():
        module = importlib.import_module(f"firstorder.{package}")
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            again = "." in package and id(thing) in seen
            seen.add(id(thing))
            made = (getattr(thing, "__module__", None) or "").removeprefix("firstorder.")
            if walkable(thing) and not again and not on_the_host(made):
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


def results(name):
    """The classes of what an exported function returns: its own test is theirs."""
    folder, _, last = name.rpartition(".")
    thing = getattr(importlib.import_module(f"firstorder.{folder}"), last)
    returned = getattr(inspect.unwrap(thing), "__annotations__", {}).get("return", "")
    return set(re.findall(r"\w+", str(returned)))


def test_what_works_on_the_host_is_exported_and_has_its_own_test():
    here = pathlib.Path(__file__)
    tests = (test for test in here.parent.rglob("test_*.py") if test != here)
    tested = set().union(*map(used_by, tests))
    assert sorted({name for name in HOST if not shared(name)} - set(exported())) == []
    assert sorted(HOST & set(PROBES)) == []
    tested |= set().union(*(results(name) for name in HOST if name.split(".")[-1] in tested))
    assert [name for name in sorted(HOST) if name.split(".")[-1] not in tested] == []


def numbers(tree):
    """All floating arrays of a result."""
    leaves = [leaf for leaf in jax.tree.leaves(tree) if eqx.is_inexact_array(leaf)]
    assert leaves
    return leaves


def total(leaves):
    return sum(jnp.sum(jnp.real(leaf)) + jnp.sum(jnp.imag(leaf)) for leaf in leaves)


def walk(probe, bits, names=()):
    """Evaluates a probe and its gradient at three numbers, compiled; the faults that it finds.

    Args:
        probe: of one number.
        bits: of the precision.
        names: if it stands for several, the keys of what it returns.
    """
    keys = set()

    def summed(s):
        found = probe(s)
        keys.update(found if len(names) > 1 else ())
        leaves = numbers(found)
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
    if len(names) > 1 and keys != set(names):
        faults.append(f"no result of {sorted(keys ^ set(names))}")
    if not all(np.all(np.isfinite(leaf)) for leaf in leaves):
        faults.append("a value that is not finite")
    if not np.all(np.isfinite(gradient)):
        faults.append("a gradient that is not finite")
    return faults


def names_by_probe():
    """Lists of the names for which one probe stands."""
    found = {}
    for name, probe in sorted(PROBES.items()):
        found.setdefault(probe, []).append(name)
    return list(found.values())


# Double precision first: an array of NumPy that one program has captured in double, JAX hands to
# the next one in double, in single precision too.
@pytest.mark.parametrize("names", names_by_probe(), ids=lambda names: names[0])
@pytest.mark.parametrize("bits", [64, 32])
def test_jit_vmap_and_grad_are_finite_and_keep_the_precision(names, bits):
    assert walk(PROBES[names[0]], bits, names) == []


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


def test_a_name_that_its_probe_does_not_answer_for_is_seen():
    assert walk(lambda s: {"one": s}, 32, ["one", "two"]) == ["no result of ['two']"]


def test_what_is_on_the_host_is_there():
    for name in ON_THE_HOST:
        assert importlib.import_module(f"firstorder.{name}")
