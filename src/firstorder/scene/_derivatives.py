"""A value with its gradient and Hessian by named freedoms: the one record of both worlds.

A receiver in flatland has three freedoms: a step along its tangent (x), one along its normal (y),
and a turn of the normal (n). In space it has five: steps along both tangents and the normal (x, y,
z), and tilts of the normal towards each tangent. Every form of irradiance returns derivatives by
all of them, so that translation, rotation and travel along a curved receiver are read off one
result.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._display import Module
from firstorder._labelled import DataFrame, Dataset, derivatives_frame, derivatives_set
from firstorder.numerics._compiled import compiled, compiled_after
from firstorder.numerics._derivatives import twice
from firstorder.numerics._refinement import approximated, counts_of, finer
from firstorder.scene._words import told_derivatives
from firstorder.typing import as_float

P = ParamSpec("P")
R = TypeVar("R")

FLATLAND = ("x", "y", "n")
SPACE = ("x", "y", "z", "tilt_x", "tilt_y")
TANGENTS = {FLATLAND: ("x",), SPACE: ("x", "y")}
TURNS = {FLATLAND: ("n",), SPACE: ("tilt_x", "tilt_y")}
NORMAL = {FLATLAND: "y", SPACE: "z"}
# A turn in flatland is counter-clockwise, which moves the normal against the tangent.
TILT = {FLATLAND: -1.0, SPACE: 1.0}


class Derivatives(Module):
    """A function with its first and second derivatives by m freedoms.

    Steps are along the axes that the receiver has now, turns and tilts in radians.

    Attributes:
        value: the function, say E.
        gradient: its derivatives; units of the value per metre or radian.
        hessian: symmetric; units as products of those.
        freedoms: a name for each of the m.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.scene import Derivatives
        >>> d = Derivatives(jnp.array(1.0), jnp.array([2.0]), jnp.array([[3.0]]), ("x",))
        >>> d.value.item(), d.first.item(), d.second.item()
        (1.0, 2.0, 3.0)
    """

    value: Float[Array, "*k"]
    gradient: Float[Array, "*k m"]
    hessian: Float[Array, "*k m m"]
    freedoms: tuple[str, ...] = eqx.field(static=True)

    def __repr__(self) -> str:
        return told_derivatives(self) or super().__repr__()

    def by(self, *names: str) -> Derivatives:
        """The derivatives by some of the freedoms, the others held fixed.

        Raises:
            ValueError: if there is no such freedom.
        """
        for name in names:
            if name not in self.freedoms:
                known = ", ".join(self.freedoms)
                raise ValueError(f"Argument `names` must be among {known}, but has {name!r}.")
        i = jnp.array([self.freedoms.index(name) for name in names])
        return Derivatives(
            self.value, self.gradient[..., i], self.hessian[..., i[:, None], i], names
        )

    @property
    def first(self) -> Float[Array, "*k"]:
        """The derivative by the only freedom."""
        return self.gradient[..., self._only]

    @property
    def second(self) -> Float[Array, "*k"]:
        """The second derivative by the only freedom."""
        return self.hessian[..., self._only, self._only]

    @property
    def _only(self) -> int:
        if len(self.freedoms) != 1:
            raise ValueError(
                f"There is one derivative for each of {', '.join(self.freedoms)}: ask for "
                "`gradient` and `hessian`, or choose one with `by`."
            )
        return 0

    def translation(self) -> Derivatives:
        """Derivatives by steps along the tangents, the normal held fixed."""
        return self.by(*TANGENTS[self._whole()])

    def rotation(self) -> Derivatives:
        """Derivatives by turns of the normal, the place held fixed."""
        return self.by(*TURNS[self._whole()])

    @compiled
    def along(self, curvature: ArrayLike, change: ArrayLike | None = None) -> Derivatives:
        """Derivatives by steps d along a curved surface with which the receiver turns.

        With the shape operator S, the surface is the graph `d.S d / 2 + dS(d, d, d) / 6`, and the
        normal tilts by `a = -S d - dS(d, d) / 2`:
        `E' = E_d - S E_a` and
        `E'' = E_dd - E_da S - S E_ad + S E_aa S + E_z S - dS.E_a`.
        In flatland S is the curvature `kappa = dn/dx`, and a turn by n tilts by -n:
        `E' = E_x + kappa E_n`.

        Args:
            curvature: positive in a valley, negative on a ball. In flatland kappa [rad/m]; in
                space the shape operator in the receiver's tangents, shape (..., 2, 2), or a number
                for a surface curved alike in all directions [1/m].
            change: its derivative along the surface: of kappa, or of S, shape (..., 2, 2, 2) and
                symmetric in all three indices; zero if left out [1/m^2].
        """
        whole = self._whole()
        tangents, tilts, sign = TANGENTS[whole], TURNS[whole], TILT[whole]
        d = len(tangents)
        S = _operator(as_float(curvature), d)
        t, a = ([whole.index(name) for name in names] for names in (tangents, tilts))
        t, a = jnp.array(t), jnp.array(a)
        g, H = self.gradient, self.hessian
        tilted, risen = sign * g[..., a], g[..., whole.index(NORMAL[whole])]
        first = g[..., t] - jnp.einsum("...ij,...j->...i", S, tilted)
        mixed = jnp.einsum("...ij,...jk->...ik", sign * H[..., t[:, None], a], S)
        bent = jnp.einsum("...ij,...jk,...kl->...il", S, H[..., a[:, None], a], S)
        second = H[..., t[:, None], t] - mixed - jnp.swapaxes(mixed, -1, -2) + bent
        second = second + risen[..., None, None] * S
        if change is not None:
            dS = as_float(change)
            dS = dS[..., None, None, None] if d == 1 else dS
            second = second - jnp.einsum("...ijk,...k->...ij", dS, tilted)
        value = jnp.broadcast_to(self.value, first.shape[:-1])  # curvatures may be many
        return Derivatives(value, first, second, tangents)

    def to_pandas(self, unit: str = "E") -> DataFrame:
        """A table with a row for each receiver: `value`, `d_x`, ..., `d_x_y`, ...

        Args:
            unit: of the value, such as "W/m^2"; those of all columns stand in `attrs["units"]`.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> from firstorder.scene import line_derivatives
            >>> line_derivatives(lambda x: x**3, 2.0).to_pandas().to_dict("records")
            [{'value': 8.0, 'd_x': 12.0, 'd_x_x': 12.0}]
        """
        parts = self.value, self.gradient, self.hessian
        return derivatives_frame(*parts, self.freedoms, unit)

    def to_xarray(self, unit: str = "E") -> Dataset:
        """A data set of `value`, `gradient` and `hessian` over named freedoms.

        Args:
            unit: of the value.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> from firstorder.scene import line_derivatives
            >>> d = line_derivatives(lambda x: x**3, 2.0).to_xarray()
            >>> d.gradient.sel(freedom="x").item()
            12.0
        """
        parts = self.value, self.gradient, self.hessian
        return derivatives_set(*parts, self.freedoms, unit, "freedom", "receiver")

    def _whole(self) -> tuple[str, ...]:
        """The freedoms, if they are all that a receiver has."""
        if self.freedoms not in TANGENTS:
            raise ValueError(
                f"These derivatives are by {', '.join(self.freedoms)} alone, not by all freedoms "
                "of a receiver."
            )
        return self.freedoms


def _operator(S: Array, d: int) -> Array:
    """A curvature as a matrix."""
    if d == 1:
        return S[..., None, None]
    return S * jnp.eye(d, dtype=S.dtype) if S.ndim == 0 else S


def _check_first(
    f: Any,
    *args: Any,
    freedoms: Any = None,
    with_error: bool = False,
    **options: Any,
) -> None:
    """The checks of a function that has some, before the numbers are traced."""
    if not callable(f):
        raise TypeError(
            f"Argument `f` must be a function of a receiver, but is a {type(f).__name__}: write "
            "derivatives(irradiance, scene, at)."
        )
    for check in getattr(f, "checks", ()):
        check(*args, **options)


def _with_errors(function: Callable[P, R]) -> Callable[P, R]:
    """`with_error` for the derivatives of an f, by finer answers of that f."""

    @functools.wraps(function)
    def asked(*args: P.args, **kwargs: P.kwargs) -> R:
        if not kwargs.pop("with_error", False):
            return function(*args, **kwargs)
        ask: Any = function
        f, *rest = args
        counts = counts_of(f, kwargs)

        def answer(step: int) -> Derivatives:
            more = {name: finer(n, step) for name, n in counts.items()}
            return ask(f, *rest, **kwargs | more)

        found: Any = approximated(answer)
        return found

    return asked


@compiled_after(_check_first)
@_with_errors
def derivatives(
    f: Callable[..., Array],
    *args: Any,
    freedoms: tuple[str, ...] | None = None,
    with_error: bool = False,
    **options: Any,
) -> Derivatives:
    """Exact derivatives of a function of a receiver as the receiver moves and turns.

    Forward over forward, so that a function that is exact under differentiation (`irradiance`) has
    its shadow edges in them.

    Args:
        f: a function whose last positional argument is a receiver, such as `irradiance`.
        args: its arguments, the receiver last.
        freedoms: by which to differentiate; all of the receiver's if left out.
        with_error: whether to give an `Approximation`: the answer, and a bound of the error of each
            number in it. For an f that takes `with_error` itself; second derivatives behind a kink
            that nobody declared are wrong by more (see there).
        options: keyword arguments for f.

    Raises:
        ValueError: if the receiver has no such freedom.
        TypeError: if f is no function, the last argument is no receiver, or f does not tell its
            error.

    Example:
        >>> from firstorder import flatland as world
        >>> lamp = world.Segments((1.0, 1.0), (-1.0, 1.0))
        >>> scene = world.Scene.of(world.primitive(lamp, emission=1.0))
        >>> d = world.derivatives(world.irradiance, scene, world.Receiver((0.5, 0.0), 0.0))
        >>> round(float(d.value), 4), round(float(d.gradient[0]), 4)
        (1.2794, -0.5449)
    """
    *others, at = args
    if not hasattr(at, "freedoms"):
        raise TypeError(
            "The last argument must be a Receiver, but is of type "
            f"{type(at).__name__}: write Receiver.at(position, normal)."
        )
    names = at.freedoms if freedoms is None else tuple(freedoms)
    for name in names:
        if name not in at.freedoms:
            known = ", ".join(at.freedoms)
            raise ValueError(f"Argument `freedoms` must be among {known}, but has {name!r}.")
    rows = jnp.array([at.freedoms.index(name) for name in names])
    chosen = jnp.eye(len(at.freedoms), dtype=at.position.dtype)[rows]

    def value(u: Array) -> Array:
        return f(*others, at.displaced(u @ chosen), **options)

    value_, gradient, hessian = twice(value, jnp.zeros(len(names), at.position.dtype))
    return Derivatives(value_, gradient, hessian, names)


def line_derivatives(f: Callable[[Array], Array], x: ArrayLike) -> Derivatives:
    """Derivatives of a function of one coordinate, which is called x.

    Args:
        f: of one number, with any result.
        x: where to differentiate, a number; derivatives are per unit of it.

    Example:
        >>> from firstorder.scene import line_derivatives
        >>> d = line_derivatives(lambda x: x**3, 2.0)
        >>> d.value.item(), d.first.item(), d.second.item()
        (8.0, 12.0, 12.0)
    """
    x = as_float(x)
    return Derivatives(*twice(lambda u: f(x + u[0]), jnp.zeros(1, x.dtype)), ("x",))
