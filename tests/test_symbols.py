import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder._argument_checks import is_concrete
from firstorder._symbols import SymbolicArray, symbolic
from firstorder.errors import Refused
from firstorder.transport import Travel
from firstorder.typing import as_float

d = sympy.Symbol("d", positive=True)


def test_symbols_are_kept_where_numbers_are_asked():
    assert isinstance(Travel(d).d, SymbolicArray)
    assert as_float([d, 0.5]).shape == (2,)
    assert as_float(sympy.Matrix([[1, d], [d, 2]])).shape == (2, 2)
    assert as_float(d).size == 1
    assert as_float(d).ndim == 0
    assert repr(as_float([d, 2 * d])) == "[d, 2*d]"
    assert not as_float(d).weak_type
    assert as_float(d).dtype == np.dtype(float)


def test_a_symbol_is_an_array_that_cannot_be_looked_at():
    assert isinstance(as_float(d), jax.Array)
    assert not is_concrete(Travel(d))


def test_what_holds_no_symbols_is_none():
    assert symbolic("a lamp") is None
    assert symbolic([1.0, 2.0]) is None
    with pytest.raises(TypeError, match="A number or an array is asked for"):
        as_float("a lamp")


def test_who_computes_with_a_symbol_is_told_what_to_do():
    with pytest.raises(Refused, match="holds symbols and no numbers: ask"):
        jnp.sin(Travel(d).d)


def test_the_numeric_side_does_not_load_sympy():
    code = (
        "import sys, firstorder, firstorder.transport, firstorder.flatland, firstorder.space\n"
        "assert 'sympy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
