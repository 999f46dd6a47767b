import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

from firstorder.fields import gaussian
from firstorder.ledger import functions_of, put_out
from firstorder.ledger._out_of_true import Dial, turned

HERE = __name__


def half(x):
    return 0.5 * x


def transform():
    return gaussian((0.1, 0.2), (1.0, 0.5)).spectrum()


class Record(eqx.Module):
    number: float
    name: str = eqx.field(static=True)


def test_the_factor_is_what_it_says_and_what_is_no_number_stays():
    with put_out(functions_of(f"{HERE}.half"), 1.5):
        assert half(2.0) == 1.5
        assert half(jnp.float32(2.0)).dtype == jnp.float32
    with put_out(functions_of(f"{HERE}.Record"), 1.5):
        record = Record(2.0, "two")
    assert (record.number, record.name) == (3.0, "two")


def test_a_spectrum_is_off_in_its_values():
    """One whose lengths all grow alike may stay what it was."""
    with put_out(functions_of(f"{HERE}.transform"), 1.5):
        off = transform()(0.1, 0.2)
    assert complex(off) == pytest.approx(1.5 * complex(transform()(0.1, 0.2)), rel=1e-14)


def test_what_is_off_is_right_again_after_an_exception():
    with pytest.raises(KeyError), put_out(functions_of(f"{HERE}.half"), 2.0):
        raise KeyError
    assert half(2.0) == 1.0


@pytest.mark.parametrize("dtype", ["float32", "float64", "complex64", "complex128"])
def test_a_program_is_off_by_what_the_dial_says_when_it_runs(dtype):
    traced, dial = [], Dial(1.5)

    @jax.jit
    def program(x):
        traced.append(x)
        return jax.vmap(half)(x), jax.jvp(half, (x,), (x,))[1]

    x = jnp.array([2.0, 4.0], dtype)
    with turned(functions_of(f"{HERE}.half"), dial):
        for dial.factor in (1.5, -2.0):
            dial.calls = 0
            for found in program(x):
                assert found.tolist() == [dial.factor, 2.0 * dial.factor]
                assert found.dtype == dtype
            assert dial.calls > 0
    assert len(traced) == 1
    assert not dial.baked


def test_a_number_that_a_program_holds_for_good_is_told():
    dial = Dial(1.5)
    with turned(functions_of(f"{HERE}.half"), dial):
        half(2.0)
        assert not dial.baked
        jax.jit(lambda x: x * half(2.0))(1.0)
        assert dial.baked


def test_a_spectrum_in_single_precision_is_off_too():
    with jax.enable_x64(False), put_out(functions_of(f"{HERE}.transform"), 1.5):
        off = jax.jit(lambda w: transform()(w, w))(0.1)
    assert complex(off) == pytest.approx(1.5 * complex(transform()(0.1, 0.1)), rel=1e-6)
