"""Warp: a smooth change of ray coordinates that is not linear, `h(u) = f(T(u))`."""

from __future__ import annotations

import abc
import contextlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_kind, check_positive
from firstorder._display import Module
from firstorder.conventions import Frame, _check_frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.numerics._derivatives import twice
from firstorder.numerics._small_matrices import congruence
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar, as_float

INSTEAD = (
    "Linearise the event at a ray, `event.linearised(ray)`, or sample the light, "
    "`SampledSpectrum.of(field, grid)`. A path's `spectra` say which event it was."
)


class Map(Module):
    """A map T of ray space with its first two derivatives, smooth but for folds and jumps."""

    @abc.abstractmethod
    def __call__(self, u: Ray) -> Ray:
        """`T(u)`."""

    def derivatives(
        self, u: Ray
    ) -> tuple[Float[Array, " n"], Float[Array, "n n"], Float[Array, "n n n"]]:
        """`T`, `J_ik = dT_i/du_k` and `d2T_i/du_j du_k`; by autodiff unless overridden."""
        return twice(self, u)

    def folds(self, frame: Frame) -> tuple[Field, ...]:
        """Levels, in the result's frame, on which T is continuous and its derivatives are not."""
        return ()

    def jumps(self, f: Field) -> tuple[Edge, ...]:
        """Edges, in the result's frame, at which T itself jumps, and the light f with it."""
        return ()


class Linearisation(Module):
    """A warp replaced by a move at one ray, with what that costs nearby.

    Attributes:
        move: `T(at) + J (u - at)` as a law; every portrait passes through it.
        displacement: largest `|T(u) - move(u)|` measured on the sphere of the given radius; it
            falls as the radius squared.
        radius: where it was measured.
    """

    move: Move
    displacement: Scalar
    radius: Scalar


class Warp(Law):
    """`h(u) = f(T(u))`.

    Jet: `grad h = J^T grad f`, `Hess h = J^T Hess f J + sum_k f_k Hess T_k` at `T(u)` (R07 eq. 8;
    the second term is what a linear map does not have). Spectrum, covariance, wavelets: refused;
    `linearise` gives a move that has them.

    Args:
        map: the map T with its derivatives.
        to: frame of the result, the operand's if left out.

    Raises:
        TypeError: if the map is no `Map`, such as a plain function.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Map, Warp
    """

    map: Map
    to: Frame | None = eqx.field(static=True, default=None)

    def __check_init__(self):
        """Refuse what is no map, and what is no frame."""
        check_kind("map", self.map, Map, "an instance of a subclass of `Map`, whose call is T(u)")
        if self.to is not None:
            _check_frame(self.to, "to")

    def frame(self, frame: Frame) -> Frame:
        """The named frame, or the operand's."""
        return self.to or frame

    def value(self, f: Field, u: Ray) -> Scalar:
        """`f(T(u))`."""
        return f.at(self.map(u))

    def jet(self, f: Field, u: Ray) -> Jet:
        """Chain rule at `T(u)`."""
        return self.push(f.jet(self.map(u)), u)

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Chain rule on the numbers at `T(u)`."""
        _, J, curvature = self.map.derivatives(u)
        gradient = jnp.sum(J * jet.gradient[:, None], axis=0)
        bend = jnp.sum(curvature * jet.gradient[:, None, None], axis=0)
        return Jet(jet.value, gradient, congruence(J, jet.hessian) + bend, self.frame(jet.frame))

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges warp with the light; at a fold nothing jumps, but quadrature has to split there."""
        frame = self.frame(f.frame)
        folds = tuple(Edge(level, Constant(0.0, frame)) for level in self.map.folds(frame))
        moved = tuple(Edge(self(e.level), self(e.jump)) for e in f.edges())
        return moved + folds + self.map.jumps(f)

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """Refused: the linearised warp has a formula."""
        with _noted():
            return super().spectrum(F, Omega)

    def covariance(self, S: Covariance) -> Covariance:
        """Refused: the linearised warp has a rule."""
        with _noted():
            return super().covariance(S)

    def linearise(self, at: Ray, radius=0.1) -> Linearisation:
        """The move that touches the warp at the ray `at`, and its measured error.

        Args:
            at: the ray.
            radius: how far from it the error is measured (in the units of the coordinates).

        """
        check_positive("radius", radius)
        at, radius = as_float(at), as_float(radius)
        T, J, _ = self.map.derivatives(at)
        # The same directions every time: the axes, and the corners of the cube, made unit.
        corners = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * at.size), -1).reshape(-1, at.size)
        corners = corners[np.any(corners != 0, axis=-1)]
        unit = jnp.asarray(corners / np.linalg.norm(corners, axis=-1, keepdims=True))
        h = radius * unit
        miss = jax.vmap(self.map)(at + h) - (T + h @ J.T)
        displacement = jnp.max(jnp.linalg.norm(miss, axis=-1))
        return Linearisation(Move(J, T - J @ at, self.to), displacement, radius)


@contextlib.contextmanager
def _noted():
    """Context in which a refusal says what to do instead."""
    try:
        yield
    except Refused as refusal:
        refusal.add_note(INSTEAD)
        raise
