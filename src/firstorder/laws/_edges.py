"""Edges that survive an integral, or a convolution."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Float

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import Kernel, Profile
from firstorder.fields.spectrum import Grid
from firstorder.typing import Array, Ray, Scalar


def surviving_edges(edges: tuple[Edge, ...], a: int) -> tuple[Edge, ...]:
    """The edges that do not change along axis a, hence outlive an integral over it.

    For a straight edge whose normal can be looked at that is a fact. For any other, the jump is
    put to zero wherever the level does change: such an edge is carried along in vain, but none is
    lost.
    """
    found = []
    for e in edges:
        level = e.level
        if not isinstance(level, Affine) or isinstance(level.normal, Tracer):
            found.append(Edge(level, _Along(e.jump, level, a)))
        elif level.normal[a] == 0:
            found.append(e)
    return tuple(found)


class _Along(Field):
    """A jump where the level does not change along axis a, zero elsewhere."""

    jump: Field
    level: Field
    a: int = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the jump."""
        return self.jump.frame

    def _here(self, u: Ray) -> Array:
        return self.level.jet(u).gradient[self.a] == 0

    def at(self, u: Ray) -> Scalar:
        """The jump, or zero."""
        return jnp.where(self._here(u), self.jump.at(u), 0.0)

    def jet(self, u: Ray) -> Jet:
        """Jet of the jump, or zeros."""
        here = self._here(u)
        return jax.tree.map(lambda leaf: jnp.where(here, leaf, 0.0), self.jump.jet(u))

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the jump."""
        return self.jump.edges()


def kernel_jumps(kernel: Kernel) -> tuple[tuple[Field, Kernel], ...]:
    """Levels at which a kernel jumps at every angle, and the kernels by which it does."""
    if isinstance(kernel, Profile):  # it varies along its axis alone
        return ()
    return tuple(
        (e.level, _Jump(part, e.jump))
        for part in kernel.parts()
        for e in surviving_edges(part.edges(), part.frame.axis(part.axis))
    )


class _Jump(Kernel):
    """The jump of a kernel across an edge: a kernel that reaches as far."""

    kernel: Kernel
    jump: Field

    @property
    def axis(self) -> str:
        """Axis of the kernel."""
        return self.kernel.axis

    @property
    def frame(self) -> Frame:
        """Frame of the kernel."""
        return self.kernel.frame

    def at(self, u: Ray) -> Scalar:
        """The jump."""
        return self.jump.at(u)

    def jet(self, u: Ray) -> Jet:
        """Jet of the jump."""
        return self.jump.jet(u)

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the jump."""
        return self.jump.edges()

    def half_width(self) -> Scalar:
        """Reach of the kernel."""
        return self.kernel.half_width()

    def knots(self) -> Float[Array, " m"]:
        """Knots of the kernel."""
        return self.kernel.knots()

    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> Series:
        """Refused: a jump is part of a field, and no light is convolved with it alone."""
        raise Refused("the jump of a kernel has no series of its own")
