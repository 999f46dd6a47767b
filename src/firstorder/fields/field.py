"""The field: radiance as a function of the ray, with its jet, its edges and its other portraits."""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any, Literal, overload

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_one,
    check_real,
    check_real_attributes,
    check_shape,
    what,
)
from firstorder._display import Axes, Module, as_picture, drawn
from firstorder.conventions import UNSTATED, Frame, _check_frame
from firstorder.errors import Refused
from firstorder.fields._held import Held
from firstorder.fields._level_root import root_between
from firstorder.fields._ray import of_ray, stack
from firstorder.fields._series import Series, sampled_series
from firstorder.fields.covariance import Covariance
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.spectrum import Grid, Spectrum, SumSpectrum
from firstorder.numerics._batching import batched
from firstorder.numerics._compiled import compiled
from firstorder.numerics._refinement import Approximation, approximated, refined
from firstorder.numerics._small_matrices import inner
from firstorder.typing import Ray, Scalar, Vector, as_float


class Field(Held):
    """Light near a ray: a function of position and direction, smooth between known edges.

    Subclasses give `at` (one ray) and `jet` (closed form); `edges` where they break; `spectrum`
    and `covariance` where these have a closed form. Parameters are differentiable leaves.
    `field(x, theta)` broadcasts over arrays of coordinates. `jax.jit(field)` and
    `jax.jit(field.jet)` hold the field's parameters as constants; to differentiate by them, pass
    the field as an argument: `jax.grad(lambda field: field.at(u))(field)`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> L = gaussian(center=(0.0, 0.0), sigma=(1.0, 1.0))
        >>> L(jnp.zeros(3), 0.0).shape
        (3,)
    """

    frame: eqx.AbstractVar[Frame]

    _repr_html_ = as_picture

    def __init_subclass__(cls, **named):
        """Let every field's own `at` and `jet` say in one sentence what is no ray."""
        super().__init_subclass__(**named)
        for name in ("at", "jet"):
            if name in cls.__dict__:
                setattr(cls, name, of_ray(cls.__dict__[name]))

    def __check_init__(self):
        """Refuse a frame that is none, and complex numbers: light is real."""
        _check_frame(vars(self).get("frame", UNSTATED))
        check_real_attributes(self)

    @abc.abstractmethod
    def at(self, u: Ray) -> Scalar:
        """Radiance at the ray `u`; on an edge, the mean of the two sides."""

    @abc.abstractmethod
    def jet(self, u: Ray) -> Jet:
        """Value, gradient and Hessian at `u` in closed form; between edges, not across them."""

    def edges(self) -> "tuple[Edge, ...]":
        """Edges at which the field jumps, and the jumps across them."""
        return ()

    def spectrum(self) -> Spectrum:
        """Closed-form Fourier transform."""
        raise Refused(f"{type(self).__name__} has no closed-form spectrum: sample it")

    def covariance(self) -> Covariance:
        """Closed-form covariance of the power spectrum."""
        raise Refused(f"{type(self).__name__} has no closed-form covariance: sample it")

    def series(self, window: Grid) -> Series:
        """Fourier series on a window, for `Multiply`; edges make sampling inaccurate."""
        if self.edges():
            raise Refused(f"{type(self).__name__} has edges: its series needs a closed form")
        return sampled_series(self, window)

    def in_frame(self, frame: Frame, name: str = "field", whose: str = "") -> "Field":
        """The field for light in `frame`: itself, or with the frame that nobody stated filled in.

        Args:
            frame: that of the light.
            name: what the field is called where it was given.
            whose: the event to which it was given.

        Raises:
            ValueError: if the field was stated to be over other coordinates.
        """
        if self.frame.coordinates == frame.coordinates:
            return self
        if self.frame.implied and self.frame.dims == frame.dims:
            copy = _relabelled(self, frame)
            assert isinstance(copy, Field)
            return copy
        of = f" of {whose}" if whose else ""
        raise ValueError(
            f"Argument `{name}`{of} must be over {frame.coordinates} like the light that it meets, "
            f"but is over {self.frame.coordinates}."
        )

    @overload
    def __call__(
        self, *coordinates: Any, with_error: Literal[False] = False
    ) -> Float[Array, "..."]: ...

    @overload
    def __call__(self, *coordinates: Any, with_error: Literal[True]) -> Approximation: ...

    def __call__(
        self, *coordinates: Any, with_error: bool = False
    ) -> Float[Array, "..."] | Approximation:
        """Radiance at broadcast coordinates, in the order of `frame.coordinates`.

        With its error it is an `Approximation`: every law on the light's way that integrates does
        so by finer rules, too. What is hidden in a plain function counts as exact.
        """
        rays = stack(self.frame, coordinates, type(self).__name__)
        if with_error:
            return approximated(lambda step: _values(refined(self, step), rays))
        return _values(self, rays)

    @overload
    def jets(self, *coordinates: Any, with_error: Literal[False] = False) -> Jet: ...

    @overload
    def jets(self, *coordinates: Any, with_error: Literal[True]) -> Approximation: ...

    def jets(self, *coordinates: Any, with_error: bool = False) -> Jet | Approximation:
        """Jets at broadcast coordinates; with their errors as for values, each in a jet's place."""
        rays = stack(self.frame, coordinates, type(self).__name__)
        if with_error:
            return approximated(lambda step: _jets(refined(self, step), rays))
        return _jets(self, rays)

    def plot(self, ax: Axes | None = None, *, window: Grid | None = None) -> Axes:
        """Draws radiance over one coordinate as a curve, over two as an image, with its units.

        A curve is broken at the field's edges. What has no value (NaN, or the places inside of an
        opaque body of a scene) is left blank. On an edge of an image a sample is the mean of both
        sides.

        Args:
            ax: matplotlib axes to draw on; new ones if left out, and no window opens.
            window: where it is sampled; if left out, where the light is, or the scene that sends
                it, and else a unit about zero.

        Returns:
            The axes.

        Raises:
            ValueError: if the field has more than two coordinates, holds no numbers or has no value
                in the window.

        Example:
            >>> from firstorder.fields import Grid, gaussian
            >>> L = gaussian(center=(0.0, 0.0), sigma=(1.0, 0.2))
            >>> L.plot(window=Grid.spanning((64, 64), (2.0, 0.5))).get_xlabel()
            '$x$ (m)'
        """
        return drawn(self, ax, window=window)

    def __add__(self, other: "Field") -> "Sum":
        """Superposition of light."""
        return Sum((self, other), jnp.ones(2))

    def __sub__(self, other: "Field") -> "Sum":
        """Light less other light."""
        return self + -1.0 * other

    def __mul__(self, weight) -> "Sum":
        """The field scaled by a constant."""
        if isinstance(weight, Field):
            raise TypeError(
                "A field is multiplied by a number: by a field `laws.Multiply` does it."
            )
        weight = as_float(weight)
        check_one("weight", weight)
        check_real("weight", weight)
        return Sum((self,), jnp.stack([weight]))

    __rmul__ = __mul__
    __array_ufunc__ = None  # a number of NumPy asks the field, too

    def __truediv__(self, weight) -> "Sum":
        """The field divided by a constant."""
        return self * (1.0 / as_float(weight))

    def __neg__(self) -> "Sum":
        """The field with its sign turned."""
        return self * -1.0

    def __rshift__(self, event: Any) -> Any:
        """`field >> event`: a path, which the event makes."""
        if hasattr(type(event), "__rrshift__"):
            return NotImplemented
        hint = f": write {event.__name__}(...)" if isinstance(event, type) else ""
        raise TypeError(f"Argument `event` must be an event, but is {what(event)}{hint}.")


@compiled
def _values(field: Field, rays: Float[Array, "*b n"]) -> Float[Array, "*b"]:
    """Radiance along rays."""
    return batched(field.at)(rays)


@compiled
def _jets(field: Field, rays: Float[Array, "*b n"]) -> Jet:
    """Jets at rays."""
    return batched(field.jet)(rays)


def _relabelled(tree, frame: Frame):
    """A field, or what it consists of, with every frame that nobody stated replaced."""
    if isinstance(tree, Frame):
        return frame if tree.implied and tree.dims == frame.dims else tree
    if type(tree) is tuple:
        return tuple(_relabelled(part, frame) for part in tree)
    if not isinstance(tree, eqx.Module):
        return tree
    copy = object.__new__(type(tree))
    for field in dataclasses.fields(tree):
        if hasattr(tree, field.name):
            object.__setattr__(copy, field.name, _relabelled(getattr(tree, field.name), frame))
    return copy


class Edge(Module):
    """A curve in ray space on which a field jumps.

    The edge is the zero set of `level`; `jump` is the value on the side where `level > 0` minus
    the value on the other. Both are smooth fields in the coordinates of the field, so an edge
    moves, warps and multiplies like one. Solving `level = 0` for one coordinate gives the edge
    as a differentiable function of the others.

    Args:
        level: zero on the edge.
        jump: radiance where the level is positive less that on the other side.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Affine, Constant, Edge
        >>> edge = Edge(Affine([1.0, -2.0], 0.0), Constant(1.0))  # x = 2 theta
        >>> edge.crossing(jnp.array([0.0, 0.5]), 0, jnp.array(-9.0), jnp.array(9.0)).value.item()
        1.0
    """

    level: Field
    jump: Field

    def crossing(self, u: Ray, axis: int, lower: Scalar, upper: Scalar) -> Jet:
        """Point at which the edge meets the line through `u` along `axis`, as a jet in `u`.

        Implicit differentiation of `level(u, b(u)) = 0`:
        `b_i = -l_i / l_a`, `b_ij = -(l_ij + l_ia b_j + l_ja b_i + l_aa b_i b_j) / l_a`.

        Args:
            u: a ray; its coordinate `axis` is ignored.
            axis: the coordinate to solve for.
            lower: start of the interval that is searched.
            upper: its end. A level must have at most one zero in between.

        Returns:
            The jet of `b`, whose derivative along `axis` is zero. If the edge is not met, `upper`
            and no derivatives; on an end of the interval, half of them (a one-sided derivative
            exists on either side, and autodiff takes the same mean).
        """
        b, met = self._solve(u, axis, lower, upper)
        at = self.level.jet(u.at[axis].set(b))
        slope = at.gradient[axis]
        met = met & (slope != 0)
        safe = jnp.where(met, slope, 1.0)
        off = (jnp.arange(u.size) != axis) & met
        first = jnp.where(off, -at.gradient / safe, 0.0)
        mixed = jnp.outer(at.hessian[axis], first)
        bend = at.hessian + mixed + mixed.T + at.hessian[axis, axis] * jnp.outer(first, first)
        second = jnp.where(off[:, None] & off, -bend / safe, 0.0)
        share = jnp.where((b == lower) | (b == upper), 0.5, 1.0)
        return Jet(b, share * first, share * second, self.level.frame)

    def _solve(self, u: Ray, axis: int, lower: Scalar, upper: Scalar) -> tuple[Scalar, Array]:
        """The crossing, and whether there is one; an edge that is not met is put at `upper`."""

        def level(t):
            return self.level.at(u.at[axis].set(t))

        if isinstance(self.level, Affine):
            slope = self.level.normal[axis]
            flat = slope == 0
            t = -level(jnp.zeros_like(lower)) / jnp.where(flat, 1.0, slope)
            met = ~flat & (t >= jnp.minimum(lower, upper)) & (t <= jnp.maximum(lower, upper))
            return jnp.where(met, t, upper), met
        return root_between(level, lower, upper)


class Constant(Field):
    """A field of one radiance along every ray (an overcast sky, or a jump of fixed height).

    Args:
        height: one number [unit of radiance].
        frame: names of the coordinates.

    Raises:
        ValueError: if `height` is more than one number.

    Example:
        >>> from firstorder.fields import Constant
        >>> Constant(2.0)(0.0, 0.3).item()
        2.0
    """

    height: Scalar = eqx.field(converter=as_float)
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse more than one number."""
        check_one("height", self.height)

    def at(self, u: Ray) -> Scalar:
        """The constant."""
        return self.height + 0.0 * u[0]

    def jet(self, u: Ray) -> Jet:
        """The constant, and zeros."""
        n = u.size
        return Jet(self.at(u), jnp.zeros(n, u.dtype), jnp.zeros((n, n), u.dtype), self.frame)


class Affine(Field):
    """`normal . u + offset`: the level of every straight edge.

    Args:
        normal: n numbers, the gradient.
        offset: the value at the origin.
        frame: names of the coordinates.

    Raises:
        ValueError: if the normal has not one number for each coordinate, or the offset is more
            than one.

    Example:
        >>> from firstorder.fields import Affine
        >>> Affine([1.0, -2.0], 0.5)(3.0, 1.0).item()
        1.5
    """

    normal: Vector = eqx.field(converter=as_float)
    offset: Scalar = eqx.field(converter=as_float)
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse a normal of other coordinates."""
        _check_frame(self.frame)
        check_shape("normal", self.normal, (self.frame.dims,))
        check_one("offset", self.offset)

    def at(self, u: Ray) -> Scalar:
        """Signed level."""
        return inner(self.normal, u) + self.offset

    def jet(self, u: Ray) -> Jet:
        """Level, its constant gradient and no Hessian."""
        return Jet(
            self.at(u), self.normal + 0.0 * u, jnp.zeros((u.size, u.size), u.dtype), self.frame
        )


class Function(Field):
    """Any jittable callable of the coordinates as a field; derivatives by autodiff.

    Valid where it is smooth: its edges are not known, and it has no closed-form spectrum.

    Args:
        function: of one number for each coordinate, in the order of the frame; returns the
            radiance, one number. It may be traced: write it with `jax.numpy`.
        frame: names of the coordinates, and which way directions point; left out, x and theta of
            incoming light, or what the light that it meets has.

    Raises:
        TypeError: if it cannot be called.

    Example:
        >>> from firstorder.fields import Function
        >>> Function(lambda x, theta: x * theta)(2.0, 3.0).item()
        6.0
    """

    function: Callable
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse what cannot be called, and classes, which make something else."""
        if not callable(self.function) or isinstance(self.function, type):
            raise TypeError(
                f"Argument `function` must be a function of the coordinates, but is "
                f"{what(self.function)}."
            )

    def at(self, u: Ray) -> Scalar:
        """The callable at the coordinates of `u`."""
        return self.function(*u)

    def jet(self, u: Ray) -> Jet:
        """Exact autodiff of the callable: no closed form is known here."""
        return autodiff_jet(self.at, u, self.frame)


class Sum(Field):
    """Weighted superposition; every portrait but the covariance is linear in it.

    Args:
        fields: m of them.
        weights: one number for each.

    Raises:
        ValueError: if the fields do not share one frame, are none, or have not one weight each.
        TypeError: if one is no field.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Constant, Sum
        >>> Sum((Constant(2.0), Constant(1.0)), jnp.array([1.0, -0.5]))(0.0, 0.0).item()
        1.5
    """

    fields: tuple[Field, ...]
    weights: Float[Array, " m"]

    @property
    def frame(self) -> Frame:
        """The common frame."""
        return self.fields[0].frame

    def __check_init__(self):
        """Refuse what is no field, and a sum over different coordinates."""
        if not self.fields:
            raise ValueError("Argument `fields` must hold a field, but is empty.")
        if np.shape(self.weights) != (len(self.fields),):
            raise ValueError(
                f"Argument `weights` must be one number for each field, of shape "
                f"({len(self.fields)},), but has shape {np.shape(self.weights)}."
            )
        for f in self.fields:
            if not isinstance(f, Field):
                raise TypeError(
                    f"Argument `fields` must be fields, but has a {type(f).__name__}: light that "
                    "is the same everywhere is a `Constant`."
                )
        stated = [f.frame for f in self.fields if not f.frame.implied]
        if stated:
            fields = [
                _relabelled(f, stated[0])
                if f.frame.implied and f.frame.dims == stated[0].dims and f.frame != stated[0]
                else f
                for f in self.fields
            ]
            object.__setattr__(self, "fields", tuple(fields))
        frames = {f.frame for f in self.fields}
        if len(frames) > 1:
            raise ValueError(f"Argument `fields` must share one frame, but has {len(frames)}.")

    def at(self, u: Ray) -> Scalar:
        """Weighted sum of values."""
        return sum(
            (w * f.at(u) for w, f in zip(self.weights, self.fields, strict=True)), 0.0 * u[0]
        )

    def jet(self, u: Ray) -> Jet:
        """Weighted sum of jets."""
        jets = [f.jet(u).scaled(w) for w, f in zip(self.weights, self.fields, strict=True)]
        return jax.tree.map(lambda *leaves: sum(leaves), *jets)

    def edges(self) -> "tuple[Edge, ...]":
        """The edges of all terms, their jumps weighted."""
        return tuple(
            Edge(e.level, w * e.jump)
            for w, f in zip(self.weights, self.fields, strict=True)
            for e in f.edges()
        )

    def series(self, window: Grid) -> Series:
        """All terms of all series."""
        all_series = [f.series(window) for f in self.fields]
        coefficients = [w * s.coefficients for w, s in zip(self.weights, all_series, strict=True)]
        return Series(
            jnp.concatenate([s.frequencies for s in all_series]), jnp.concatenate(coefficients)
        )

    def spectrum(self) -> Spectrum:
        """Weighted sum of spectra."""
        return SumSpectrum(tuple(f.spectrum() for f in self.fields), self.weights)
