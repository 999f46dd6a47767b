"""Modules that JAX can hold as functions, and whose methods it can hold: `jax.jit(field.jet)`."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any

import equinox as eqx

from firstorder._display import Module


class Held(Module):
    """A module that is equal to itself alone, as functions are; and so are its methods.

    Equinox compares modules, and methods bound to them, by their arrays, which have no hash: JAX
    then refuses them as functions. Methods are trees of the module's leaves as in Equinox.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> L = gaussian(center=(0.0, 0.0), sigma=(1.0, 1.0))
        >>> jax.jit(L.jet)(jnp.zeros(2)).value.item(), jax.jit(L)(0.0, 0.0).item()
        (1.0, 1.0)
    """

    def __hash__(self) -> int:
        return object.__hash__(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    def __getattribute__(self, name: str) -> Any:
        found = object.__getattribute__(self, name)
        bound = isinstance(found, types.MethodType) and found.__self__ is self
        return Method(found.__func__, self) if bound and not name.startswith("__") else found


class Method(Module):
    """A function and the module whose method it is.

    Attributes:
        function: of the module and what it is called with.
        owner: the module, a subtree.
    """

    function: Callable = eqx.field(static=True)
    owner: Held

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Result of the method."""
        return self.function(self.owner, *args, **kwargs)

    def __hash__(self) -> int:
        return hash((self.function, id(self.owner)))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Method):
            return False
        return self.owner is other.owner and self.function is other.function

    @property
    def __name__(self) -> str:
        """Of the method."""
        return self.function.__name__
