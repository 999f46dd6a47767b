"""Expressions as jitted functions of arrays."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.numerics._quadrature import composite_gauss_legendre
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.functions import Unknown
from firstorder.symbolic._programs.moments import moment
from firstorder.transport import bessel_zk1

NODES = 32  # of each panel of a quadrature
MOST = 2  # variables of an integral
PANELS = 12  # of an integral without ends
MOST_WHOLE = 2**31  # in single precision JAX's whole numbers have 32 bits
# Functions that SymPy's printer for JAX does not know.
SPECIAL: dict[str, Callable] = {
    "erf": jax.scipy.special.erf,
    "erfc": jax.scipy.special.erfc,
    "besselk": lambda order, z: _bessel(order, z),
    "Choice": lambda yes, no, condition: jnp.where(condition, yes, no),
    "Moment": moment,
}
NEAR = tuple(sign * 8.0**-k for k in (1, 2, 3) for sign in (-1.0, 1.0))
FAR = 4.0  # where such an integral is cut off, on the axis of `_stretched`: |t| = 5e18


def lowered(
    expression: Any,
    coordinates: Sequence[sympy.Symbol],
    parameters: Sequence[sympy.Symbol],
    unknowns: dict[str, Any],
) -> Callable:
    """A jitted function of the coordinates, in order, and of the parameters by name."""
    shape = getattr(expression, "shape", ())
    entries = list(expression) if shape else [expression]
    names = [s.name for s in parameters]
    function = _function([*coordinates, *parameters], entries, unknowns)

    @jax.jit
    def run(*values, **given):
        found = function(*values, *(given[name] for name in names))
        found = jnp.broadcast_arrays(*(jnp.asarray(a) for a in found))
        stacked = jnp.stack(found, -1) if shape else found[0]
        return stacked.reshape(stacked.shape[:-1] + shape) if shape else stacked

    def checked(*values, **given):
        for missing in set(names) - set(given):
            raise TypeError(f"Argument `{missing}` is missing: a parameter of the formula.")
        if len(values) != len(coordinates):
            wanted = ", ".join(s.name for s in coordinates)
            raise TypeError(f"The coordinates {wanted} are asked, but {len(values)} are given.")
        return run(*values, **{name: given[name] for name in names})

    return checked


def _function(symbols, entries, unknowns: dict[str, Any], calls=None) -> Callable:
    """Entries as one function of arrays; parts that are common are computed once."""
    calls = dict(calls or SPECIAL)
    entries = [_without_integrals(e, calls, unknowns) for e in entries]
    for entry in entries:
        for part in entry.atoms(Unknown):
            calls[type(part).__name__] = _numeric(part, unknowns)
    return as_function(symbols, entries, calls)


def as_function(symbols: Sequence[Expr], entries: Sequence[Expr], calls: dict[str, Callable]):
    """Expressions without integrals as one function of arrays, with JAX and the given functions."""
    # The names of coordinates may be words of Python (lambda): dummies have names of their own.
    dummies = [sympy.Dummy() for _ in symbols]
    pairs = dict(zip(symbols, dummies, strict=True))
    replaced = [e.xreplace(pairs | _floats(e)) for e in entries]
    return sympy.lambdify(dummies, replaced, modules=[calls, "jax"], cse=True)


def _floats(entry: Expr) -> dict[Expr, Expr]:
    """Floating numbers for whole ones that may have too many bits for whole numbers of JAX."""
    return {n: sympy.Float(n) for n in entry.atoms(sympy.Integer) if abs(n) >= MOST_WHOLE}


def _bessel(order: int | float, z) -> jax.Array:
    """K_1, the one that spectra of slopes need."""
    if order != 1:
        raise Refused(f"the Bessel function K_{order} has no numbers here")
    return bessel_zk1(z**2) / z


# --- unknown functions ---------------------------------------------------------------------------


def _numeric(part: Any, unknowns: dict[str, Any]) -> Callable:
    """An unknown function, or a derivative of one, from what was given for it."""
    if part.base not in unknowns:
        raise Refused(
            f"{part.base} is unknown, so its formula has no numbers: give it, as in "
            f"lower({part.base}=...)"
        )
    given, orders = unknowns[part.base], part.orders
    axes = [i for i, k in enumerate(orders) for _ in range(k)]
    if isinstance(given, Field):
        places = _places(part, given)
        if len(axes) <= 2:
            return _from_jets(given, places, axes)
        given = _from_jets(given, places, [])
    function = given
    for axis in axes:
        function = _derivative(function, axis)
    return lambda *u: _everywhere(function, *u)


def _places(part: Any, field: Field) -> list[int]:
    """Which coordinates of a field those of an unknown function are: by name, else in order."""
    own = field.frame.coordinates
    if set(part.names) <= set(own):
        return [own.index(name) for name in part.names]
    if len(part.names) == len(own):
        return list(range(len(own)))
    raise ValueError(
        f"Argument `{part.base}` must be over {', '.join(part.names)}, but is over "
        f"{', '.join(own)}."
    )


def _from_jets(field: Field, places: list[int], axes: list[int]) -> Callable:
    """A value, or an entry of the gradient or the Hessian, of a field.

    Coordinates of the field on which the function does not depend are zero.
    """
    entries = tuple(places[axis] for axis in axes)

    def one(*u):
        ray = jnp.zeros(field.frame.dims, u[0].dtype).at[np.array(places)].set(jnp.stack(u))
        if not entries:
            return field.at(ray)
        jet = field.jet(ray)
        return jet.gradient[entries] if len(entries) == 1 else jet.hessian[entries]

    return lambda *u: _everywhere(one, *u)


def _derivative(function: Callable, axis: int) -> Callable:
    def rate(*u):
        def along(t):
            return function(*u[:axis], t, *u[axis + 1 :])

        return jax.jvp(along, (u[axis],), (jnp.ones_like(u[axis]),))[1]

    return rate


def _everywhere(function: Callable, *u) -> jax.Array:
    """A function of numbers on arrays that broadcast."""
    rays = jnp.broadcast_arrays(*(jnp.asarray(a, jnp.result_type(float)) for a in u))
    for _ in range(rays[0].ndim if rays else 0):
        function = jax.vmap(function)
    return function(*rays)


# --- integrals -----------------------------------------------------------------------------------


def _without_integrals(entry, calls: dict[str, Callable], unknowns: dict[str, Any]):
    """The expression with each integral, the innermost last, replaced by a call."""
    for integral in sorted(entry.atoms(sympy.Integral), key=sympy.count_ops, reverse=True):
        if entry.has(integral):
            entry = entry.xreplace({integral: _called(integral, calls, unknowns)})
    return entry


def _called(integral: Expr, calls: dict[str, Callable], unknowns: dict[str, Any]):
    """A call of a quadrature in place of an integral, one integration after the other."""
    part = integral.function
    if len(integral.limits) > MOST:
        raise Refused(f"an integral over {len(integral.limits)} variables has no quadrature here")
    for limits in integral.limits:
        one = sympy.Integral(part, limits)
        free = sorted(one.free_symbols, key=lambda s: (s.name, str(s)))
        name = f"integral_{len(calls)}"
        calls[name] = _quadrature(one, free, unknowns, dict(calls))
        part = sympy.Function(name)(*free)
    return part


def _quadrature(
    integral: Expr, free, unknowns: dict[str, Any], calls: dict[str, Callable]
) -> Callable:
    """A single integral as a function of the symbols that it depends on."""
    (limits,) = integral.limits
    if len(limits) != 3 or (limits[1].is_infinite != limits[2].is_infinite):
        raise Refused(f"{integral} has no quadrature here: give it two ends, or none")
    t, lower, upper = limits
    endless = bool(lower.is_infinite)
    # K_1 has a logarithm where it breaks: panels shrink towards it.
    steps = NEAR if integral.function.has(sympy.besselk) else ()
    # An integral inside jumps at places of its own variable, and is smooth along this one.
    breaks = [place for place in _breaks(integral.function, t) if place.free_symbols <= set(free)]
    ends = breaks if endless else [lower, upper, *breaks]
    integrand = _function([t, *free], [integral.function], unknowns, calls)
    places = _function(free, ends, unknowns, calls) if ends else lambda *values: []

    def one(*values):
        found = [jnp.asarray(a, jnp.result_type(float)) for a in places(*values)]
        if endless:
            marks = [_squeezed(a + step) for a in found for step in (0.0, *steps)]
            marks += list(jnp.linspace(-FAR, FAR, PANELS + 1)[1:-1])
            s, w = composite_gauss_legendre(jnp.asarray(-FAR), jnp.asarray(FAR), marks, NODES)
            nodes, rate = _stretched(s)
            w = w * rate
        else:
            nodes, w = composite_gauss_legendre(found[0], found[1], found[2:], 2 * NODES)
        f = jax.vmap(lambda x: jnp.asarray(integrand(x, *values)[0]))(nodes)
        # Far out a bell is 0 and its weight is huge: what is not finite there is nothing. A panel
        # without length lies on a break, where the integrand may be 0 / 0.
        return jnp.sum(jnp.where((f == 0) | (w == 0), 0.0, f * w))

    return lambda *values: _everywhere(one, *values)


def _stretched(s):
    """`t = sinh(pi/2 sinh(s))` and its derivative: the whole line on a short one."""
    inner = 0.5 * np.pi * jnp.sinh(s)
    return jnp.sinh(inner), 0.5 * np.pi * jnp.cosh(s) * jnp.cosh(inner)


def _squeezed(t):
    """The inverse of `_stretched`."""
    return jnp.arcsinh(jnp.arcsinh(t) / (0.5 * np.pi))


def _breaks(integrand, t: sympy.Symbol) -> list[Expr]:
    """Where the integrand jumps or bends, if that is where a straight level is zero."""
    levels = [part.args[0] for part in integrand.atoms(sympy.sign, sympy.Abs, sympy.Heaviside)]
    relations = integrand.atoms(sympy.core.relational.Relational)
    levels += [relation.lhs - relation.rhs for relation in relations]
    for part in integrand.atoms(sympy.Max, sympy.Min):
        levels += [a - b for a, b in itertools.combinations(part.args, 2)]
    found = []
    for level in levels:
        slope = sympy.diff(level, t)
        if slope != 0 and not slope.has(t):
            found.append(-level.subs(t, 0) / slope)
        elif slope != 0 and isinstance(level, sympy.Expr):
            found += _sides(level, t)
    return found


def _sides(level: Expr, t: sympy.Symbol) -> list[Expr]:
    """Where `a |b t + c| + d` is zero, on both sides."""
    rest, bent = level.as_independent(t, as_Add=True)
    weight, side = bent.as_independent(t, as_Add=False)
    if side.func is not sympy.Abs:
        return []
    slope = sympy.diff(side.args[0], t)
    if slope == 0 or slope.has(t):
        return []
    middle = -side.args[0].subs(t, 0) / slope
    return [middle + rest / weight / slope, middle - rest / weight / slope]
