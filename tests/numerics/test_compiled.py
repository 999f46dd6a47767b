"""Functions that compile themselves: once for each form of a call, and not under the caller's."""

import functools
import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.flatland.library._scenes import scene_b
from firstorder.numerics import _compiled
from firstorder.numerics._compiled import compiled, own_programs
from firstorder.space.azimuthal import transport


class Counted:
    """A compiled function that says how often it ran as Python."""

    def __init__(self):
        self.runs = 0

        @compiled
        def scaled(x, *, by=2.0, power=1, bend=None):
            """What it does."""
            self.runs += 1
            return by * (x if bend is None else bend(x)) ** power

        self.f = scaled


@pytest.fixture
def counted():
    return Counted()


def test_numbers_are_arguments_and_words_are_part_of_the_program(counted):
    f = counted.f
    assert [float(f(jnp.array(x), by=b)) for x, b in ((1.0, 2.0), (3.0, 4.0))] == [2.0, 12.0]
    assert counted.runs == 1
    assert float(f(np.array(3.0), by=np.float64(4.0), power=2)) == 36.0
    assert counted.runs == 2
    f(jnp.zeros(3))
    assert counted.runs == 3  # another shape


@pytest.mark.parametrize("way", [jax.jit, jax.vmap, jax.grad, jax.jacfwd])
def test_in_a_program_of_the_callers_it_is_the_plain_function(way, counted):
    x = jnp.ones(3) if way is jax.vmap else jnp.array(1.0)
    np.testing.assert_allclose(way(counted.f)(x), way(lambda x: 2.0 * x)(x))
    inside = jax.make_jaxpr(lambda x: way(counted.f)(x))(x)
    assert str(inside) == str(jax.make_jaxpr(lambda x: way(counted.f.__wrapped__)(x))(x))
    assert str(jax.make_jaxpr(counted.f)(x)) == str(jax.make_jaxpr(counted.f.__wrapped__)(x))
    assert "jit" not in str(jax.make_jaxpr(counted.f)(x))


@pytest.mark.parametrize("way", [jax.vmap, jax.grad, jax.jacfwd, jax.hessian])
def test_under_grad_or_vmap_alone_it_is_one_program(way, counted):
    """Of which JAX makes programs for derivatives, and keeps them."""
    x = jnp.ones(3) if way is jax.vmap else jnp.array(1.0)
    for _ in range(3):
        np.testing.assert_allclose(way(counted.f)(x), way(lambda x: 2.0 * x)(x))
    assert counted.runs == 1


def test_inside_a_program_it_is_plain_for_what_comes_from_outside_too(counted):
    """A tracer of `grad` that a program of the caller's closes over."""
    slope = jax.grad(lambda a: jax.jit(lambda x: counted.f(x) * a)(jnp.array(3.0)))(2.0)
    assert slope == 6.0


def cube(x):
    return x**3


class Bend(eqx.Module):
    rate: jax.Array

    def __call__(self, x):
        return self.rate * x


def test_a_function_that_has_a_name_is_compiled_with_at_once(counted):
    for _ in range(3):
        assert float(counted.f(jnp.array(2.0), bend=cube)) == 16.0
    assert counted.runs == 1
    for rate in (1.0, 2.0):
        assert float(counted.f(jnp.array(2.0), bend=Bend(jnp.array(rate)))) == 4.0 * rate
    assert counted.runs == 2


@pytest.mark.parametrize("wrap", [lambda f: f, functools.partial, jax.tree_util.Partial])
def test_a_nameless_function_is_compiled_with_when_it_comes_back(wrap, counted):
    for number in range(5):  # made anew for every call: none of them is kept
        bend = wrap(lambda x, number=number: x + number)
        assert float(counted.f(jnp.array(1.0), bend=bend)) == 2.0 * (1 + number)
    assert counted.runs == 5
    kept = wrap(lambda x: x + 1.0)
    for _ in range(4):
        assert float(counted.f(jnp.array(1.0), bend=kept)) == 4.0
    assert counted.runs == 7  # as written, then compiled


WIDTH = {"w": 1.0}


def widened(x):
    return _stretched(x)


def _stretched(x):
    return WIDTH["w"] * x


@pytest.mark.parametrize("bend", [widened, lambda x: _stretched(x)])
def test_what_a_function_reads_from_outside_is_read_again_when_it_changes(
    bend, counted, monkeypatch
):
    for width in (1.0, 3.0, 4.0, 1.0):
        monkeypatch.setitem(WIDTH, "w", width)
        for _ in range(3):
            assert float(counted.f(jnp.array(2.0), bend=bend)) == 4.0 * width


@pytest.mark.parametrize("wrap", [jnp.asarray, np.asarray, list, lambda w: {"w": w}])
def test_what_a_function_is_closed_over_may_be_put_in_the_place_of_something_else(wrap, counted):
    number = wrap([1.0])

    def bend(x):
        return x * jnp.sum(jnp.asarray(jax.tree.leaves(number)))

    for change in (1.0, 2.0, 5.0):
        number = wrap([change])
        for _ in range(3):
            assert float(counted.f(jnp.array(2.0), bend=bend)) == 4.0 * change
    assert counted.runs <= 6  # as written, then compiled


def test_an_array_that_is_written_into_is_read_again(counted):
    numbers = np.ones(1)

    def bend(x):
        return x * jnp.asarray(numbers)[0]

    for change in (1.0, 2.0, 5.0):
        numbers[0] = change
        assert float(counted.f(jnp.array(2.0), bend=bend)) == 4.0 * change


def test_functions_that_read_each_other_end(counted):
    def even(x, n):
        return x if n == 0 else odd(x, n - 1)

    def odd(x, n):
        return even(x, n - 1)

    assert float(counted.f(jnp.array(2.0), bend=lambda x: even(x, 4))) == 4.0


def test_a_function_closed_over_a_traced_number(counted):
    def through(y):
        def bend(x):
            return x * y

        return counted.f(jnp.array(3.0), bend=bend) + counted.f(jnp.array(5.0), bend=bend)

    for way in (jax.jit(jax.grad(through)), jax.grad(through)):
        assert float(way(7.0)) == 16.0


def test_what_has_no_hash_runs_as_it_is_written(counted):
    class Odd:
        def __eq__(self, other):  # and so no hash
            return self is other

        def __call__(self, x):
            return x + 1.0

    assert float(counted.f(jnp.array(1.0), bend=Odd())) == 4.0
    assert float(counted.f(jnp.array(1.0), bend=Odd())) == 4.0
    assert counted.runs == 2


def test_it_looks_like_the_function(counted):
    assert inspect.isfunction(counted.f)
    assert counted.f.__doc__ == "What it does."
    assert [*inspect.signature(counted.f).parameters] == ["x", "by", "power", "bend"]


def test_precision_is_that_of_the_call(counted):
    assert counted.f(jnp.array(1.0, "float32")).dtype == "float32"
    assert counted.f(jnp.array(1.0, "float64")).dtype == "float64"
    with jax.enable_x64(False):
        assert counted.f(jnp.array(1.0)).dtype == "float32"


def test_programs_of_a_twin_are_their_own(monkeypatch):
    scale = {"by": 1.0}

    @compiled
    def f(x):
        return scale["by"] * x

    assert float(f(jnp.array(1.0))) == 1.0
    scale["by"] = 2.0
    assert float(f(jnp.array(1.0))) == 1.0
    with own_programs():
        assert float(f(jnp.array(1.0))) == 2.0
    assert float(f(jnp.array(1.0))) == 1.0
    # The same by a patch of a test (`tests/conftest.py`), and back.
    monkeypatch.setitem(scale, "by", 3.0)
    monkeypatch.setattr(_compiled, "P", _compiled.P)
    assert float(f(jnp.array(1.0))) == 3.0
    monkeypatch.undo()
    assert float(f(jnp.array(1.0))) == 1.0


# --- the entry points ----------------------------------------------------------------------------


def entries():
    """Calls without a caller's jit, by name."""
    flat = scene_b()
    here = flatland.receiver(flat, 0, 0.8)
    line = flatland.light_field(flat, here)
    ball = space.primitive(space.sphere((0.0, 0.2, 2.0), 1.0), emission=1.0)
    scene, at = space.Scene.of(ball), space.receiver((0.0, 0.0, 0.0))
    return {
        "flatland.irradiance": lambda: flatland.irradiance(flat, here),
        "flatland.derivatives": lambda: flatland.derivatives(flatland.irradiance, flat, here),
        "flatland.view": lambda: flatland.view(flat, here),
        "flatland.light_field": lambda: line(0.1, 0.2),
        "space.irradiance": lambda: space.irradiance(scene, at),
        "space.net_visibility": lambda: space.net_visibility(scene, at),
        "space.boundary_gradient": lambda: space.boundary_gradient(scene, at),
        "space.visibility_by_azimuth": lambda: transport.visibility_by_azimuth(scene, at),
    }


@pytest.fixture(scope="module")
def traced():
    """The programs that JAX traced so far."""
    seen = []

    def listen(event, seconds, **_):
        if event == "/jax/core/compile/jaxpr_trace_duration":
            seen.append(seconds)

    jax.monitoring.register_event_duration_secs_listener(listen)
    return seen


@pytest.mark.parametrize("name", entries())
def test_a_second_call_traces_nothing(name, traced):
    ask = entries()[name]
    before = len(traced)
    first = jax.block_until_ready(ask())
    between = len(traced)
    second = ask()
    assert len(traced) == between > before
    same = jax.tree.map(lambda a, b: np.array_equal(a, b, equal_nan=True), first, second)
    assert all(jax.tree.leaves(same))


@pytest.mark.parametrize("world", [flatland, space])
def test_a_wrong_argument_is_one_sentence_as_before(world):
    with pytest.raises(TypeError, match=r"Argument `scene` must be a Scene|violates type hint"):
        world.irradiance([1.0], None)
