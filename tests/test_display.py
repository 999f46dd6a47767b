"""What modules print of their numbers; notebooks are in `symbolic/test_display.py`."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder._display import FEW, in_print
from firstorder.fields import gaussian
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


def test_a_path_begins_with_light():
    with pytest.raises(TypeError, match=r"but is a Travel: write Path\(source\) >>|violates type"):
        Path(Travel(2.0))
