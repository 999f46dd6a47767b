"""What modules print of their numbers; notebooks are in `symbolic/test_display.py`."""

import importlib
import inspect
import pkgutil

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import firstorder
from firstorder import flatland, space
from firstorder._display import FEW, ROWS, in_print
from firstorder.caching import Cache, Candidates, ValidityRegion
from firstorder.fields import gaussian
from firstorder.space.discontinuities import DiscontinuityMesh
from firstorder.transport import Path, Travel


class Leaf(eqx.Module):
    """Anything with one leaf."""

    a: object
    __repr__ = in_print


PRINTED = {
    "a number": (jnp.array(0.125), "0.125"),
    "six digits": (jnp.array([np.pi, 1e9 / 3.0]), "[3.14159, 3.33333e+08]"),
    "no zero below zero": (jnp.array([[-0.0, 1.0]]), "[[0, 1]]"),
    "whole numbers in full": (jnp.array([1234567, -1]), "[1234567, -1]"),
    "an array of NumPy": (np.array([0.5, np.nan, np.inf]), "[0.5, nan, inf]"),
    "complex numbers": (jnp.array([1.0 + 2.0j]), "[1+2j]"),
    "no array": ("text", "'text'"),
}


@pytest.mark.parametrize("name", PRINTED)
def test_numbers_of_small_arrays_are_printed(name):
    value, text = PRINTED[name]
    assert repr(Leaf(value)) == f"Leaf(a={text})"


SHORTENED = {
    "many numbers": lambda: jnp.zeros(FEW + 1),
    "no numbers": lambda: jnp.zeros((0, 2)),
    "truth": lambda: jnp.array([True]),
    "keys": lambda: jax.random.key(0),
    "an outline": lambda: jax.ShapeDtypeStruct((2,), "float32"),
}


@pytest.mark.parametrize("name", SHORTENED)
def test_of_all_else_the_shape_is_printed(name):
    module = Leaf(SHORTENED[name]())
    assert repr(module) == eqx.tree_pformat(module)


def test_what_cannot_be_looked_at_is_printed_as_its_shape():
    gone, traced = jnp.ones(2), []
    gone.delete()
    assert repr(Leaf(gone)).startswith("Leaf(a=f")
    jax.make_jaxpr(lambda x: traced.append(repr(Leaf(x))))(jnp.ones(2))
    assert traced[0].startswith("Leaf(a=")
    assert "1" not in traced[0].replace("f16", "")


def test_light_and_its_way_print_their_numbers():
    field = gaussian((0.5, 0.0), (1.0, 0.5))
    assert repr(field) == "Gaussian(center=[0.5, 0], precision=[[1, 0], [0, 4]], amplitude=1)"
    assert "chain=Chain(events=(Travel(d=2),))" in repr(Path(field) >> Travel(2.0))
    assert repr(field.jet((0.5, 0.0))).startswith("Jet(value=1, gradient=[0, 0], hessian=")


def test_shapes_and_hits_print_their_numbers():
    lamp = flatland.Segments((1.0, 1.0), (-1.0, 1.0))
    assert repr(lamp) == "Segments(start=[[1, 1]], end=[[-1, 1]])"
    hits = flatland.nearest(
        flatland.Scene.of(flatland.primitive(lamp)), np.zeros((1, 2)), np.array([[0.0, 2.0]])
    )
    assert repr(hits) == "Hits(t=[0.5], index=[0], s=[0.5])"
    assert repr(space.sphere((0.0, 0.0, 1.0), 2.0)).startswith("Ellipsoids(center=[[0, 0, 1]], ")
    assert repr(flatland.Circles(jnp.zeros((20, 2)), 1.0)).startswith("Circles(center=f")


def public_classes():
    """All classes that packages export, descriptions of others left out."""
    for info in pkgutil.walk_packages(firstorder.__path__, "firstorder."):
        module = importlib.import_module(info.name) if info.ispkg else None
        for thing in (getattr(module, name) for name in getattr(module, "__all__", ())):
            described = inspect.isabstract(thing) or getattr(thing, "_is_protocol", False)
            if isinstance(thing, type) and not issubclass(thing, Exception) and not described:
                yield thing


def test_no_public_class_prints_by_default():
    """Which of tuples is all their numbers, of modules no number, and of others an address."""
    ours = {"firstorder", "dataclasses", "reprlib"}
    origins = {c: getattr(c.__repr__, "__module__", "builtins") for c in public_classes()}
    assert len(origins) > 150
    assert {c for c, module in origins.items() if module.partition(".")[0] not in ours} == set()


MANY = jnp.ones((1000, 1, 1))


def test_results_with_many_numbers_print_their_names_and_shapes():
    assert repr(ValidityRegion(jnp.array([[[2.0]]]))) == "ValidityRegion(matrix=[[[2]]], clamp=0)"
    assert repr(ValidityRegion(MANY)).startswith("ValidityRegion(matrix=f")
    assert len(repr(ValidityRegion(MANY))) < 50
    line = Candidates.on_line(jnp.linspace(0.0, 1.0, 1000), jnp.ones((1000, 2)))
    cache = Cache(line, ValidityRegion(MANY), 1)
    assert len(repr(cache)) < 500
    assert str(cache).splitlines()[ROWS // 2 + 1] == f"... {1000 - ROWS} more"
    assert len(str(cache).splitlines()) == ROWS + 2
    assert space.GaussianSky().__repr__() == "GaussianSky(center=[0, 0, 1], sigma=0.5, radiance=1)"


def test_a_discontinuity_mesh_counts_its_lines():
    line = np.zeros((65, 3)), np.ones(65)
    kind, order = np.array(["three edges"] * 2 + ["vertex and edge"]), np.full(3, 2)
    mesh = DiscontinuityMesh((line[0],) * 3, (line[1],) * 3, kind, order)
    assert repr(mesh) == (
        "DiscontinuityMesh: 3 pieces of lines, 2 of 'three edges', 1 of 'vertex and edge'"
    )


def test_a_path_begins_with_light():
    with pytest.raises(TypeError, match=r"but is a Travel: write Path\(source\) >>|violates type"):
        Path(Travel(2.0))
