"""Every exported name under jit, vmap and grad, in float32 and in float64.

A new export is one line of `PROBES` in `tests/probes`: a function of one number s that builds the
thing from s and returns what it computes. The walk differentiates it through that number. Abstract
classes are walked through what extends them.
"""

import importlib
import importlib.util
import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.probes import fields, flatland, methods, space, transport, visibility

# Wherever numbers are computed; `checks`, `plotting` and `io` work on the host.
PACKAGES = [
    name
    for name in (
        "fields", "laws", "transport", "visibility", "sampling", "flatland", "space",
        "bandwidth", "reconstruction",
    )
    if importlib.util.find_spec(f"firstorder.{name}")
]  # fmt: skip

PROBES = (
    fields.PROBES
    | flatland.PROBES
    | methods.PROBES
    | space.PROBES
    | transport.PROBES
    | visibility.PROBES
)


def exported():
    """Dotted names of all that is exported and can be made."""
    for package in PACKAGES:
        module = importlib.import_module(f"firstorder.{package}")
        for name in getattr(module, "__all__", ()):
            if not inspect.isabstract(getattr(module, name)):
                yield f"{package}.{name}"


def test_every_export_is_walked():
    assert sorted(set(exported()) ^ set(PROBES)) == []


def numbers(tree):
    """All floating arrays of a result."""
    leaves = [leaf for leaf in jax.tree.leaves(tree) if eqx.is_inexact_array(leaf)]
    assert leaves
    return leaves


def total(leaves):
    return sum(jnp.sum(jnp.real(leaf)) + jnp.sum(jnp.imag(leaf)) for leaf in leaves)


def walk(probe, bits):
    """Evaluates a probe and its gradient at three numbers, compiled; the faults that it finds."""

    def summed(s):
        leaves = numbers(probe(s))
        return total(leaves), leaves

    with jax.enable_x64(bits == 64):
        s = jnp.array([0.31, 0.47, 0.63])
        assert s.dtype == f"float{bits}"
        compiled = jax.jit(
            jax.vmap(jax.value_and_grad(summed, has_aux=True)),
            compiler_options={"xla_backend_optimization_level": 0},  # it runs once
        )
        (_, leaves), gradient = compiled(s)
    right = (f"float{bits}", f"complex{2 * bits}")
    faults = [f"a result in {leaf.dtype}" for leaf in leaves if leaf.dtype not in right]
    if not all(np.all(np.isfinite(leaf)) for leaf in leaves):
        faults.append("a value that is not finite")
    if not np.all(np.isfinite(gradient)):
        faults.append("a gradient that is not finite")
    return faults


@pytest.mark.parametrize("bits", [32, 64])
@pytest.mark.parametrize("name", sorted(PROBES))
def test_jit_vmap_and_grad_are_finite_and_keep_the_precision(name, bits):
    assert walk(PROBES[name], bits) == []


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (lambda s: jnp.sqrt(0.0 * s), "a gradient that is not finite"),
        (lambda s: 1.0 / jnp.floor(s), "a value that is not finite"),
        (lambda s: s.astype("float16"), "a result in float16"),
    ],
)
def test_the_walk_sees_what_is_wrong(wrong, fault):
    assert fault in walk(wrong, 32)
