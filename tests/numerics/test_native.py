"""Loops in machine code, and what is left of them without numba."""

import numpy as np
import pytest

from firstorder.numerics import _native as module


def squares(values):
    total = 0.0
    for k in range(values.size):
        total += values[k] * values[k]
    return total


@pytest.mark.parametrize("have", [False, pytest.param(True, marks=pytest.mark.skipif(
    not module.HAVE_NATIVE, reason="no numba"))])  # fmt: skip
def test_a_loop_gives_the_same_with_and_without_numba(monkeypatch, have):
    monkeypatch.setattr(module, "HAVE_NATIVE", have)
    loop = module.native(squares)
    for precision in (np.float32, np.float64):
        x = np.linspace(-1.0, 1.0, 101).astype(precision)
        assert abs(loop(x) - np.sum(x * x)) < 1e-4
    assert (loop is squares) is not have


def test_the_checks_of_shapes_are_taken_off(monkeypatch):
    """The decorators that look at annotations are no part of what is compiled."""
    import functools

    @functools.wraps(squares)
    def checked(*args, **options):
        raise AssertionError

    monkeypatch.setattr(module, "HAVE_NATIVE", False)
    assert module.native(checked) is squares
