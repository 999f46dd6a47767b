"""What scenes of both kinds share, by itself: sides, shares, numbers and names."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.flatland import Segments
from firstorder.scene import _primitives as primitives


def shapes(n, dtype=float):
    return Segments(np.zeros((n, 2), dtype), np.ones((n, 2), dtype))


def test_a_number_takes_the_precision_of_its_shapes():
    for dtype in (np.float32, np.float64):
        assert primitives.sides(0.5, shapes(3, dtype), True).dtype == dtype
        assert primitives.each(0.5, shapes(3, dtype)).dtype == dtype
    assert primitives.each(np.float64(0.5), shapes(3, np.float32)).dtype == np.float64


def test_sides_of_every_form():
    one, both = (primitives.sides(0.5, shapes(3), b) for b in (False, True))
    np.testing.assert_array_equal(one, [[0.5, 0.0]] * 3)
    np.testing.assert_array_equal(both, [[0.5, 0.5]] * 3)
    np.testing.assert_array_equal(primitives.sides((0.1, 0.2), shapes(3), True), [[0.1, 0.2]] * 3)
    fronts = primitives.sides(np.arange(3), shapes(3), False)
    np.testing.assert_array_equal(fronts[:, primitives.FRONT], [0.0, 1.0, 2.0])
    assert not np.any(fronts[:, primitives.BACK])
    np.testing.assert_array_equal(primitives.each(2, shapes(3)), [2.0, 2.0, 2.0])


def test_sides_of_bands():
    red, blue = [0.3, 0.2, 0.1, 0.0], [0.0, 0.1, 0.2, 0.3]
    front = primitives.sides(red, shapes(3), False)
    np.testing.assert_array_equal(front, [[red, [0.0] * 4]] * 3)
    np.testing.assert_array_equal(primitives.sides([red, blue], shapes(3), True), [[red, blue]] * 3)
    three = np.outer([1.0, 2.0, 3.0], red)
    np.testing.assert_array_equal(
        primitives.sides(three, shapes(3), True), np.stack([three, three], 1)
    )


def shares(albedo, mirror, specular=0.0):
    return {
        "albedo": primitives.sides(albedo, shapes(2), True),
        "mirror": primitives.each(np.asarray(mirror), shapes(2)),
        "specular": primitives.each(np.asarray(specular), shapes(2)),
    }


def test_shares_may_add_up_to_one():
    given = shares((0.2, 0.7), 0.3)
    assert primitives.checked(given, tuple(given)) == given
    primitives.checked(shares(0.9, 0.5, 0.5), ("mirror", "specular"))  # albedo is none of these


@pytest.mark.parametrize(
    ("numbers", "names", "words"),
    [
        ((-0.1, 0.0), "albedo mirror", "`albedo` must not be negative"),
        (((0.0, 0.8), 0.3), "albedo mirror", "`albedo` and `mirror` must add .* 1, but .* 1.1"),
        ((0.5, 0.3, 0.3), "albedo mirror specular", "`albedo`, `mirror` and `specular` must add"),
        ((0.0, (0.1, 0.6), (0.6, 0.5)), "mirror specular", "but add up to 1.1"),
    ],
)
def test_more_than_all_is_refused(numbers, names, words):
    with pytest.raises(ValueError, match=words):
        primitives.checked(shares(*numbers), names.split())


def test_traced_numbers_below_zero_are_nan():
    @jax.jit
    def f(albedo):
        return primitives.checked(shares(albedo, 0.0), ("albedo",))

    assert np.all(np.isnan(f(-0.5)["albedo"]))
    np.testing.assert_array_equal(f(0.5)["albedo"], 0.5)
    assert not np.any(f(-0.5)["mirror"])


class Round(SimpleNamespace):
    pass


class Long(SimpleNamespace):
    pass


def thing(kind, name, count):
    return SimpleNamespace(shape=kind(count=count), material=name.upper(), name=name)


def test_numbers_count_through_the_kinds():
    here = [thing(Round, "a", 1), thing(Long, "b", 2), thing(Round, "", 1), thing(Round, "b", 1)]
    groups, materials, names = primitives.grouped(here, (Long, Round), lambda s: len(s))
    assert groups == [1, 3]
    assert materials == ["B", "A", "", "B"]
    assert names == ("b", "b", "a", "", "b")
    assert primitives.named(names, "b") == (0, 1, 4)
    with pytest.raises(ValueError, match="must be one of a, b, but is 'c'"):
        primitives.named(names, "c")
    with pytest.raises(ValueError, match="at least one shape"):
        primitives.grouped([], (Long, Round), len)


def test_joined_along_the_leading_axis():
    parts = [{"x": jnp.zeros((2, 3))}, {"x": jnp.ones((1, 3))}]
    assert primitives.joined(parts)["x"].tolist() == [[0.0] * 3, [0.0] * 3, [1.0] * 3]
    assert primitives.joined(parts[:1]) is parts[0]


@pytest.mark.parametrize("world", ["flatland", "space"])
def test_a_single_emission_is_the_fronts_and_a_single_albedo_both_sides(world):
    primitive, one = {
        "flatland": (flatland.primitive, flatland.Segments((0.0, 0.0), (1.0, 0.0))),
        "space": (space.primitive, space.rectangle((0, 0, 1), (1, 0, 0), (0, 2, 0))),
    }[world]
    np.testing.assert_array_equal(primitive(one, emission=2.0).material.emission, [[2.0, 0.0]])
    both = primitive(one, emission=2.0, two_sided=True).material
    np.testing.assert_array_equal(both.emission, [[2.0, 2.0]])
    np.testing.assert_array_equal(primitive(one, albedo=0.4).material.albedo, [[0.4, 0.4]])
    bands = primitive(one, emission=(1.0, 2.0, 3.0), albedo=(0.1, 0.2, 0.3)).material
    np.testing.assert_array_equal(bands.emission, [[[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]])
    np.testing.assert_array_equal(bands.albedo, [[[0.1, 0.2, 0.3]] * 2])
