"""One compilation whatever the number of rows, and the rows' answers in their order."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._batching import host_blocks, host_rows, in_batches, in_blocks, one_list


@pytest.mark.parametrize("count", [0, 1, 6, 7, 8, 21, 23, 64])
def test_rows_keep_their_order_whatever_their_number(count):
    x = np.random.default_rng(0).normal(size=(count, 3))
    n = np.arange(count)
    total, number = in_batches(lambda r: (jnp.sum(r[0]), r[1]), (jnp.asarray(x), n), 7)
    np.testing.assert_allclose(total, x.sum(1), rtol=1e-14)
    np.testing.assert_array_equal(number, n)


@pytest.mark.parametrize("count", [1, 6, 7, 8, 21, 23])
def test_blocks_keep_the_order_and_the_axes_of_rows(count):
    x, n = np.random.default_rng(0).normal(size=(count, 3)), np.arange(count)
    seen = []

    def f(rows):
        seen.append(rows[0].shape)
        return rows[0][:, :, None] * jnp.arange(2.0), rows[1]

    table, number = in_blocks(f, (jnp.asarray(x), jnp.asarray(n)), 7)
    np.testing.assert_array_equal(table, x[:, :, None] * np.arange(2.0))
    np.testing.assert_array_equal(number, n)
    assert set(seen) == {(min(count, 7), 3)}


@pytest.mark.parametrize("count", [5, 14, 23, 100])
def test_a_function_is_traced_once(count):
    traced = []

    def f(x):
        traced.append(x)
        return 2.0 * x

    jax.jit(lambda x: in_batches(f, x, 7))(jnp.arange(float(count)))
    assert len(traced) == 1


def test_rows_are_at_most_so_many_at_a_time():
    """The sizes of intermediate arrays, as the compiler is given them."""
    program = jax.make_jaxpr(lambda x: in_batches(jnp.sin, x, 7))(jnp.arange(23.0))
    assert "f64[6] = sin" in str(program)
    assert str(program).count(" sin ") == 1


def test_what_fills_a_batch_up_leaves_no_trace_in_derivatives():
    x = jnp.linspace(0.1, 2.0, 23)
    slopes = jax.grad(lambda x: jnp.sum(in_batches(jnp.sqrt, x, 7)))(x)
    np.testing.assert_allclose(slopes, 0.5 / np.sqrt(x), rtol=1e-14)


def test_a_batch_has_rows():
    with pytest.raises(ValueError, match="most"):
        in_batches(jnp.sin, jnp.arange(3.0), 0)


@pytest.mark.parametrize("count", [0, 1, 6, 7, 8, 23])
def test_blocks_on_the_host_keep_rows_and_are_compiled_once(count):
    x = np.random.default_rng(0).normal(size=(count, 3))
    n = np.arange(count)
    traced = []

    @jax.jit
    def f(rows):
        traced.append(rows)
        return jnp.sum(rows[0], 1), rows[1]

    total, number = host_blocks(f, (x, n), 7)
    assert isinstance(total, np.ndarray)
    np.testing.assert_allclose(total, x.sum(1), rtol=1e-14)
    np.testing.assert_array_equal(number, n)
    assert len(traced) == 1
    assert traced[0][0].shape == (7, 3)


def test_blocks_abreast_are_the_same_blocks():
    """The first is done alone, so that what it compiles is there for the others."""
    done = []

    def f(x):
        done.append(len(done))
        return jnp.cumsum(x)

    x = np.arange(64.0)
    one, several = (host_blocks(f, x, 5, abreast) for abreast in (1, 3))
    np.testing.assert_array_equal(one, several)
    assert len(done) == 2 * 13


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 64, 65])
def test_rows_on_the_host_are_filled_up_to_a_power_of_two(count):
    seen = []
    found = host_rows(lambda x: seen.append(x.shape[0]) or 2.0 * x, np.arange(float(count)), 8)
    np.testing.assert_array_equal(found, 2.0 * np.arange(count))
    assert seen == [8 if count < 9 else 16 if count < 17 else 64 if count < 65 else 128]


def test_a_block_has_rows():
    with pytest.raises(ValueError, match="least"):
        host_rows(jnp.sin, np.arange(3.0), 0)
    with pytest.raises(ValueError, match="block"):
        host_blocks(jnp.sin, np.arange(3.0), 0)


@pytest.mark.parametrize("over", [(None, 0), (0, 0), (0, None)], ids=["rows", "both", "shared"])
def test_one_list_answers_as_if_each_batch_were_alone(over):
    rng = np.random.default_rng(0)
    shared, rows = (jnp.asarray(rng.normal(size=(3,) * (a == 0) + (5,))) for a in over)
    seen = []

    def f(s, x):
        seen.append(x.shape)
        return jnp.sum(s) * x, x + s[0], x[:, None, None] * s[:, None] + jnp.arange(2.0)

    found = jax.jit(jax.vmap(one_list(f), in_axes=over))(shared, rows)

    def batch(k):
        return [a if axis is None else a[k] for a, axis in zip((shared, rows), over, strict=True)]

    alone = [f(*batch(k)) for k in range(3)]
    for a, b in zip(found, zip(*alone, strict=True), strict=True):
        np.testing.assert_allclose(a, np.stack(b), rtol=1e-14)


def test_rows_and_answers_of_more_axes_keep_them():
    rng = np.random.default_rng(2)
    shared, rows = jnp.asarray(rng.normal(size=(3, 2))), jnp.asarray(rng.normal(size=(4, 5, 3)))

    def f(s: Any, x: Any) -> Any:
        return x[:, None] @ s

    found = jax.vmap(lambda rows: one_list(f)(shared, rows))(rows)
    np.testing.assert_allclose(found, (rows @ shared)[:, :, None], rtol=1e-14)


def test_of_what_rows_share_a_part_may_be_of_one_batch():
    rng = np.random.default_rng(1)
    own, common, x = (jnp.asarray(rng.normal(size=size)) for size in ((3, 5), (5,), (3, 4)))

    def f(shared, x):
        return x * (shared[0] @ shared[1])

    found = jax.vmap(lambda own, x: one_list(f)((own, common), x))(own, x)
    np.testing.assert_allclose(found, x * (own @ common)[:, None], rtol=1e-14)


def test_rows_of_batches_in_batches_are_one_list():
    seen = []

    def f(s, x):
        seen.append(x.shape)
        return s * x

    x = jnp.arange(24.0).reshape(2, 3, 4)
    found = jax.vmap(jax.vmap(lambda x: one_list(f)(2.0, x)))(x)
    np.testing.assert_array_equal(found, 2.0 * x)
    assert seen[-1] == (24,)


def test_rows_that_all_batches_share_are_given_to_each():
    x, y = jnp.arange(12.0).reshape(3, 4), jnp.array([1.0, 5.0, 2.0, 7.0])

    def line(s: Any, rows: Any) -> Any:
        return s * rows[0] + rows[1]

    f = one_list(line)
    np.testing.assert_array_equal(jax.vmap(lambda x: f(2.0, (x, y)))(x), 2.0 * x + y)
