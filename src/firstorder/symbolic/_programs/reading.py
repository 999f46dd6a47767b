"""Formulas read out of programs: what a function computes, as expressions.

JAX traces a function to a list of operations on arrays. Carried out on arrays of symbols these give
the formula that the function computes, with nothing typed in. So a formula here is never a second
version of the code: it is the code.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder._symbols import SymbolicArray
from firstorder.errors import Refused
from firstorder.symbolic._programs import primitives as rules
from firstorder.symbolic._programs.exact import Expr, exact_array

LONGEST = 64  # turns of a loop that are written out
# What stands for an expression while a program is traced: a call whose name begins so, among those
# of the reading that is going on (one inside another is last).
STAND_IN = "formula "
_NAMED: list[dict[str, Callable]] = []


def read(function: Callable, *args: Any) -> Any:
    """Results of a jittable function, with expressions for all that depends on symbols.

    Args:
        function: of arrays and trees of them.
        args: its arguments, some of them with `SymbolicArray` leaves.

    Returns:
        What the function returns, its arrays as `SymbolicArray` if they depend on symbols.

    Raises:
        Refused: if the function has a loop whose length depends on symbols, or an operation that
            has no expression.

    Example:
        >>> import jax.numpy as jnp, sympy
        >>> from firstorder.symbolic._programs.reading import array, read
        >>> x = sympy.Symbol("x", real=True)
        >>> read(lambda u: jnp.exp(-0.5 * u[0] ** 2), array(x)).entries
        array(exp(-x**2/2), dtype=object)
    """
    leaves, form = jax.tree.flatten(args)
    where = [i for i, leaf in enumerate(leaves) if isinstance(leaf, SymbolicArray)]
    number = jnp.result_type(float)
    shapes = [jax.ShapeDtypeStruct(leaves[i].shape, number) for i in where]
    kept: dict[str, Any] = {}

    def run(*given):
        filled = list(leaves)
        for i, one in zip(where, given, strict=True):
            filled[i] = one
        arrays, kept["rest"] = eqx.partition(function(*form.unflatten(filled)), eqx.is_array)
        kept["form"] = jax.tree.structure(arrays)
        return jax.tree.leaves(arrays)

    _NAMED.append({})
    try:
        program = jax.make_jaxpr(run)(*shapes)
        symbols = [exact_array(leaves[i].entries) for i in where]
        found = [rules.settled(a) for a in evaluated(program.jaxpr, program.consts, symbols)]
    finally:
        _NAMED.pop()
    arrays = [SymbolicArray(a) if a.dtype == object else jnp.asarray(a) for a in found]
    return eqx.combine(kept["form"].unflatten(arrays), kept["rest"])


def reading() -> bool:
    """Whether a program is being read: what is computed now will be a formula."""
    return bool(_NAMED)


def array(*expressions) -> SymbolicArray:
    """Expressions as a vector."""
    return SymbolicArray(list(expressions))


def expression(a: Any) -> Expr:
    """The expression that an array of no axes holds."""
    entries = a.entries if isinstance(a, SymbolicArray) else exact_array(a)
    return entries[()]


def matrix(a: Any) -> Expr:
    """An array of two axes, or of one as a column, as a matrix."""
    entries = a.entries if isinstance(a, SymbolicArray) else exact_array(a)
    return sympy.Matrix(entries.reshape(len(entries), -1).tolist())


def evaluated(program, consts: Sequence, args: Sequence) -> list[np.ndarray]:
    """The outputs of a program, operation after operation."""
    known: dict[Any, np.ndarray] = {}

    def value(name) -> np.ndarray:
        return np.asarray(name.val) if hasattr(name, "val") else known[name]

    for names, values in ((program.constvars, consts), (program.invars, args)):
        known |= {
            n: v if _holds_symbols(v) else np.asarray(v) for n, v in zip(names, values, strict=True)
        }
    for equation in program.eqns:
        try:
            outs = _carried_out(equation, [value(name) for name in equation.invars])
        except (TypeError, ValueError) as error:
            name = equation.primitive.name
            raise Refused(f"SymPy has no expression for {name!r} here: {error}") from None
        outs = map(_decided, outs, (name.aval.dtype for name in equation.outvars))
        known |= dict(zip(equation.outvars, outs, strict=True))
    return [value(name) for name in program.outvars]


def _decided(a: np.ndarray, dtype) -> np.ndarray:
    """Conditions and whole numbers without a symbol are numbers again."""
    if a.dtype != object or dtype.kind not in "biu":
        return a
    if any(e.free_symbols for e in a.ravel()):
        return a
    convert = bool if dtype.kind == "b" else int
    return np.array([convert(e) for e in a.ravel()], dtype).reshape(a.shape)


def _holds_symbols(a) -> bool:
    return getattr(a, "dtype", None) == np.dtype(object)


def _carried_out(equation, args: list[np.ndarray]) -> list[np.ndarray]:
    """The outputs of one operation."""
    name, params = equation.primitive.name, equation.params
    if str(params.get("name")).startswith(STAND_IN):
        return [_put_in(params["name"], *args)]
    inner = next((params[k] for k in ("jaxpr", "call_jaxpr", "fun_jaxpr") if k in params), None)
    if inner is not None and name != "scan":
        return evaluated(getattr(inner, "jaxpr", inner), getattr(inner, "consts", ()), args)
    if not any(map(_holds_symbols, args)):
        return _with_numbers(equation, args)
    if name == "convert_element_type" and np.dtype(params["new_dtype"]).kind in "iu":
        raise Refused("a program that rounds to whole numbers has no formula")
    if name in rules.UNARY:
        return [rules.elementwise(rules.UNARY[name], *args)]
    if name in rules.BINARY:
        return [rules.elementwise(rules.BINARY[name], *args)]
    if name == "integer_pow":
        return [rules.elementwise(lambda a: a ** params["y"], *args)]
    if name == "select_n":
        return [rules.elementwise(rules.chosen, *args)]
    if name == "clamp":
        low, x, high = args
        return [rules.elementwise(lambda a, b, c: sympy.Min(sympy.Max(a, b), c), low, x, high)]
    if name == "optimization_barrier":
        return args
    if name in rules.MOVING:
        return _rearranged(equation, args)
    if name in rules.REDUCING:
        return [rules.reduced(rules.REDUCING[name], args[0], tuple(map(int, params["axes"])))]
    if name in rules.CUMULATING:
        join = rules.CUMULATING[name]
        return [rules.cumulated(join, args[0], params["axis"], params["reverse"])]
    if name == "dot_general":
        return [rules.contracted(*args, params["dimension_numbers"])]
    if name in ("scatter-add", "scatter_add"):
        return [_added(equation, args)]
    if name == "lu":
        return rules.factored(args[0])
    if name == "triangular_solve":
        return [rules.solved(*args, params)]
    if name == "custom_linear_solve":
        return _solved(params, args)
    if name == "cond":
        return _branch(params, args)
    if name == "while":
        return _unrolled(params, args)
    if name == "scan":
        return _scanned(params, args)
    raise Refused(f"a program with the operation {name!r} has no formula")


def _put_in(name: str, *args: np.ndarray) -> np.ndarray:
    """The expression that a call stands for."""
    if name not in _NAMED[-1]:
        raise Refused("a function that was compiled in another reading holds unknown light")
    return _NAMED[-1][name](*args)


def _with_numbers(equation, args, **other) -> list[np.ndarray]:
    """Outputs of an operation on numbers alone: JAX carries it out, perhaps with other settings."""
    with jax.ensure_compile_time_eval():
        out = equation.primitive.bind(*map(jnp.asarray, args), **equation.params | other)
    return [np.asarray(a) for a in (out if equation.primitive.multiple_results else [out])]


def _rearranged(equation, args) -> list[np.ndarray]:
    """Entries in another order; what says which one (indices) are numbers."""
    places = equation.primitive.name in ("gather", "scatter", "dynamic_slice")
    places = places or equation.primitive.name == "dynamic_update_slice"
    indices = [places and a.dtype != object and a.dtype.kind in "iu" for a in args]
    moving = [a for a, index in zip(args, indices, strict=True) if not index]

    def run(*labels):
        given = iter(labels)
        filled = [a if index else next(given) for a, index in zip(args, indices, strict=True)]
        return _with_numbers(equation, filled, **others)

    # What is read beyond an array's end is filled in, and is no label of an entry: NaN is none.
    beyond = equation.params.get("fill_value")
    others = {} if beyond is None else {"fill_value": np.nan}
    return rules.moved(run, *moving, beyond=np.nan if beyond is None else beyond)


def _added(equation, args) -> np.ndarray:
    """`scatter_add`: which updates land on which entries is asked of the operation itself."""
    operand, indices, updates = args
    operand, updates = rules.entries(operand), rules.entries(updates)
    out, zero = operand.copy(), np.zeros(operand.shape)
    for place in np.ndindex(*updates.shape):
        unit = np.zeros(updates.shape)
        unit[place] = 1.0
        (landed,) = _with_numbers(equation, [zero, indices, unit])
        for target in map(tuple, np.argwhere(landed)):
            out[target] = out[target] + updates[place]
    return out


def _solved(params, args) -> list[np.ndarray]:
    """A linear system, by the rule that solves it, whose constants follow those of others."""
    lengths, rule = params["const_lengths"], params["jaxprs"].solve
    first = lengths.matvec + lengths.vecmat
    consts = args[first : first + lengths.solve]
    return evaluated(rule.jaxpr, rule.consts, [*consts, *args[sum(lengths) :]])


def _branch(params, args) -> list[np.ndarray]:
    """The branch that a number chooses."""
    if _holds_symbols(args[0]):
        raise Refused("a program that branches by a symbol has no formula")
    chosen = params["branches"][int(args[0])]
    return evaluated(chosen.jaxpr, chosen.consts, args[1:])


def _unrolled(params, args) -> list[np.ndarray]:
    """A loop whose count is a number, written out."""
    n, m = params["cond_nconsts"], params["body_nconsts"]
    test, body = params["cond_jaxpr"], params["body_jaxpr"]
    state = list(args[n + m :])
    for _ in range(LONGEST + 1):
        (go_on,) = evaluated(test.jaxpr, test.consts, [*args[:n], *state])
        if _holds_symbols(go_on):
            raise Refused("a loop that ends when a symbol says so has no formula")
        if not go_on:
            return state
        state = evaluated(body.jaxpr, body.consts, [*args[n : n + m], *state])
    raise Refused(f"a loop of more than {LONGEST} turns has no formula of use")


def _scan_counts(params) -> tuple[int, int]:
    """How many constants and how many states a scan has; JAX 0.12 says it by trees."""
    if "num_consts" in params:
        return params["num_consts"], params["num_carry"]
    tree = params["ft_in"]
    consts, carry, *_ = tree.unpack() if hasattr(tree, "unpack") else tree
    return len(consts), len(carry)


def _scanned(params, args) -> list[np.ndarray]:
    """A scan, written out."""
    (n, m), body = _scan_counts(params), params["jaxpr"]
    if params["length"] > LONGEST:
        raise Refused(f"a loop of more than {LONGEST} turns has no formula of use")
    consts, state, rows = args[:n], list(args[n : n + m]), args[n + m :]
    turns = range(params["length"])
    outs = []
    for i in reversed(turns) if params["reverse"] else turns:
        found = evaluated(body.jaxpr, body.consts, [*consts, *state, *(r[i] for r in rows)])
        state, out = found[:m], found[m:]
        outs.append(out)
    outs = outs[::-1] if params["reverse"] else outs
    return [
        *state,
        *(np.stack(list(map(rules.entries, column))) for column in zip(*outs, strict=True)),
    ]


# --- expressions inside programs -----------------------------------------------------------------


def inserted(make: Callable[..., Expr], u: jax.Array, dtype=float) -> jax.Array:
    """A number of a program that is an expression when the program is read.

    Args:
        make: the expression from the entries of `u`.
        u: a vector, traced.
        dtype: of the number, float or complex.
    """

    def rows(vectors: np.ndarray) -> np.ndarray:
        vectors = exact_array(vectors)
        out = np.empty(vectors.shape[:-1], dtype=object)
        for place in np.ndindex(*out.shape):
            out[place] = make(*vectors[place])
        return out

    def stand_in(u):
        return _underivable(u).astype(jnp.result_type(dtype))

    if _NAMED:
        name = f"{STAND_IN}{len(_NAMED[-1])} {id(make)}"
        stand_in.__name__ = stand_in.__qualname__ = name
        _NAMED[-1][name] = rows
    return jax.jit(stand_in)(u)


@jax.custom_jvp
def _underivable(u):
    """A number that depends on u."""
    return jnp.nan * jnp.sum(u)


@_underivable.defjvp
def _refused(primals, tangents):
    raise Refused("a program that differentiates unknown light by autodiff has no formula")
