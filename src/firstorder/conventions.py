"""Every sign, every origin and every unit of the library, written once.

Other modules import the names below and never repeat a sign of their own.

Flatland
    The receiver lies along +x, its normal is +y. Angles turn counter-clockwise from the
    normal, so `direction(a) = (-sin a, cos a)`. The slope is `v = tan(theta)`.
Sense
    *incoming* light is labelled by the direction it comes from, *outgoing* light by the
    direction it goes to. A ray labelled by where it comes from leans against its own motion,
    so travel shears the two with opposite signs (`travel_sign`).
Normal
    `n(x)` is the angle of the shading normal, `kappa = dn/dx`; `kappa > 0` is a valley. The angle
    in the local frame is `theta - n(x)`, so `L_local(x, theta) = L(x, theta + n(x))`.
Space
    The receiver's normal is +z, theta the polar angle from it, phi the azimuth from +x to +y, w the
    direction to where light comes from (`polar`, `azimuth_axes`). Frames are matrices with the axes
    (t, b, n) as columns, local to global. The shape operator is `S = -dn`: a sphere with outward
    normals has curvature -1/R (`normal_rate`).
Fourier
    `F(Omega) = int f(u) exp(-2 pi i Omega . u) du`: cycles per unit, no prefactor.
Units
    x in metres, theta in radians, v without unit, t in seconds, Omega in cycles per unit of its
    coordinate, radiance in any unit the user likes (the library is linear in it).
Time
    A frame may have the coordinate t, last: `("x", "t")`, `("x", "v", "t")`. Light does not age on
    its way: an event acts at every time alike, but for maps and factors that name t.
"""

from __future__ import annotations

import dataclasses
from typing import Literal, overload

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

Sense = Literal["incoming", "outgoing"]

ANGLES = ("theta", "phi")
SLOPES = ("v", "w")
POSITIONS = ("x", "y")
TIMES = ("t",)


@dataclasses.dataclass(frozen=True)
class Frame:
    """Names of a light field's coordinates, and the sense in which its rays are labelled.

    Positions stand before directions, and both before time: `("x", "theta")`, `("x", "v")`, in
    space `("x", "y", "v", "w")`, in motion `("x", "t")`. A frame is static: it never becomes a
    traced value.

    Example:
        >>> from firstorder.conventions import Frame
        >>> Frame(("x", "v")).axis("v")
        1
    """

    coordinates: tuple[str, ...] = ("x", "theta")
    sense: Sense = "incoming"
    # A default that nobody stated: a factor made with it takes the frame of the light that it meets
    # (`Field.in_frame`). It is no part of what the frame is.
    implied: bool = dataclasses.field(default=False, compare=False, repr=False)

    @property
    def dims(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    def axis(self, name: str) -> int:
        """Position of the coordinate called `name`."""
        if name not in self.coordinates:
            known = ", ".join(self.coordinates)
            raise ValueError(f"Argument `axis` must be one of {known}, but is {name!r}.")
        return self.coordinates.index(name)

    @property
    def positions(self) -> tuple[int, ...]:
        """Axes that are positions."""
        return tuple(i for i, c in enumerate(self.coordinates) if c in POSITIONS)

    @property
    def directions(self) -> tuple[int, ...]:
        """Axes that are angles or slopes."""
        return tuple(i for i, c in enumerate(self.coordinates) if c in ANGLES + SLOPES)

    @property
    def uses_slopes(self) -> bool:
        """Whether directions are slopes `v = tan(theta)` (travel is then linear)."""
        return any(c in SLOPES for c in self.coordinates)

    def without(self, name: str) -> Frame:
        """The frame that is left when the coordinate `name` is integrated out."""
        axis = self.axis(name)
        rest = self.coordinates[:axis] + self.coordinates[axis + 1 :]
        return dataclasses.replace(self, coordinates=rest)

    def appended(self, name: str) -> Frame:
        """The frame with one more coordinate, last."""
        return dataclasses.replace(self, coordinates=(*self.coordinates, name))

    def turned(self) -> Frame:
        """Frame with these coordinates and the other sense."""
        sense: Sense = "outgoing" if self.sense == "incoming" else "incoming"
        return dataclasses.replace(self, sense=sense)


FLATLAND = Frame(("x", "theta"))
FLATLAND_SLOPE = Frame(("x", "v"))
# Defaults of what is made before light is there, with angles or with slopes until it meets light.
UNSTATED = Frame(("x", "theta"), implied=True)
UNSTATED_SLOPE = Frame(("x", "v"), implied=True)
SPACE = Frame(("x", "y", "theta", "phi"))
SPACE_SLOPE = Frame(("x", "y", "v", "w"))


def _check_frame(frame: object, name: str = "frame") -> None:
    """Refuse what is no frame, such as the name of a coordinate."""
    if not isinstance(frame, Frame):
        raise TypeError(f"Argument `{name}` must be a `Frame`, such as FLATLAND, but is {frame!r}.")


def frame_with(axis: str, frame: Frame) -> Frame:
    """The frame that the name of an axis states: "theta" says angles and "v" says slopes.

    A frame that was stated is returned as it is.

    Raises:
        TypeError: if it is none, such as the name of a coordinate.

    Example:
        >>> from firstorder.conventions import UNSTATED, frame_with
        >>> frame_with("v", UNSTATED).coordinates
        ('x', 'v')
    """
    _check_frame(frame)
    stated = {"theta": FLATLAND, "v": FLATLAND_SLOPE}
    return stated.get(axis, frame) if frame.implied else frame


@overload
def direction(a: Float[np.ndarray, "..."]) -> Float[np.ndarray, "... 2"]: ...
@overload
def direction(a: Float[Array, "..."]) -> Float[Array, "... 2"]: ...
def direction(a: Float[Array | np.ndarray, "..."]) -> Float[Array | np.ndarray, "... 2"]:
    """Unit vector at angle `a`, counter-clockwise from the normal +y.

    Args:
        a: angles [rad], of any shape; by NumPy if they are an array of it, which compiles nothing.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import direction
        >>> direction(jnp.array(-jnp.pi / 2)).round(9).tolist()  # to the right
        [1.0, 0.0]
    """
    xp = np if isinstance(a, np.ndarray) else jnp
    return xp.stack([-xp.sin(a), xp.cos(a)], axis=-1)


def cylindrical(
    rho: Float[Array, "..."], phi: Float[Array, "..."], z: Float[Array, "..."]
) -> Float[Array, "... 3"]:
    """The point of space at the distance rho from the normal, azimuth phi and height z.

    Args:
        rho: distances from the normal [m].
        phi: azimuths from +x towards +y [rad].
        z: heights [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import cylindrical
        >>> cylindrical(jnp.array(2.0), jnp.array(0.0), jnp.array(1.0)).tolist()
        [2.0, 0.0, 1.0]
    """
    return jnp.stack(jnp.broadcast_arrays(rho * jnp.cos(phi), rho * jnp.sin(phi), z), axis=-1)


def polar(theta: Float[Array, "..."], phi: Float[Array, "..."]) -> Float[Array, "... 3"]:
    """Unit vector of space at the polar angle theta from the normal +z and the azimuth phi.

    Args:
        theta: polar angles [rad].
        phi: azimuths from +x towards +y [rad].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import polar
        >>> polar(jnp.array(0.0), jnp.array(0.3)).tolist()
        [0.0, 0.0, 1.0]
    """
    return cylindrical(jnp.sin(theta), phi, jnp.cos(theta))


def azimuth_axes(
    phi: Float[Array, "..."],
) -> tuple[Float[Array, "... 3"], Float[Array, "... 3"]]:
    """Horizontal axes along an azimuth and across it: `e_rho` and `e_phi = d e_rho / d phi`.

    Args:
        phi: azimuths from +x towards +y [rad].

    Returns:
        Unit vectors, which have no unit.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import azimuth_axes
        >>> azimuth_axes(jnp.array(0.0))[0].tolist()
        [1.0, 0.0, 0.0]
    """
    cos, sin, zero = jnp.cos(phi), jnp.sin(phi), jnp.zeros_like(phi)
    return jnp.stack([cos, sin, zero], axis=-1), jnp.stack([-sin, cos, zero], axis=-1)


def normal_rate(S: Float[Array, "2 2"], x: Float[Array, "2"]) -> Float[Array, "2"]:
    """`dn = -S x`: how the normal moves on a walk of x along the tangents.

    Args:
        S: shape operator in the tangents [1/m].
        x: the walk [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import normal_rate
        >>> S = -jnp.eye(2) / 2.0  # a sphere of radius 2
        >>> normal_rate(S, jnp.array([1.0, 2.0])).tolist()
        [0.5, 1.0]
    """
    return -(S @ x)


def shape_operator(tangents: Float[Array, "3 2"], n_D: Float[Array, "3 2"]) -> Float[Array, "2 2"]:
    """`S = -T^T dn` from how the normal moves along each tangent: the columns of `n_D`.

    Args:
        tangents: two unit vectors, as columns.
        n_D: derivatives of the normal along them, as columns [1/m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import shape_operator
        >>> T = jnp.eye(3)[:, :2]
        >>> shape_operator(T, T / 2.0)[0, 0].item()  # on a sphere of radius 2
        -0.5
    """
    return -(tangents.T @ n_D)


def slope(theta: Float[Array, "..."]) -> Float[Array, "..."]:
    """`v = tan(theta)` for rays from above the line; NaN for the others, which have no slope.

    The tangent itself repeats there: it would take light from below for light from above.

    Args:
        theta: angles from the normal [rad].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import slope
        >>> slope(jnp.array([0.0, 2.0])).tolist()
        [0.0, nan]
    """
    return jnp.where(jnp.cos(theta) > 0, jnp.tan(theta), jnp.nan)


def travel_sign(sense: Sense) -> float:
    """Sign s in `l'(x, v) = l(x + s v d, v)`: -1 for incoming, +1 for outgoing light.

    Example:
        >>> from firstorder.conventions import travel_sign
        >>> travel_sign("incoming"), travel_sign("outgoing")
        (-1.0, 1.0)
    """
    return -1.0 if sense == "incoming" else 1.0


def to_local(theta, n):
    """Angle in the frame of a normal at angle `n`.

    Args:
        theta: global angle, a number or an array [rad].
        n: angle of the normal [rad].

    Example:
        >>> from firstorder.conventions import to_local
        >>> to_local(0.75, 0.5)
        0.25
    """
    return theta - n


def to_global(theta, n):
    """Inverse of `to_local`.

    Args:
        theta: local angle, a number or an array [rad].
        n: angle of the normal [rad].

    Example:
        >>> from firstorder.conventions import to_global
        >>> to_global(0.25, 0.5)
        0.75
    """
    return theta + n


def mirror_direction(theta, n):
    """Angle `2 n - theta` of the mirror image of `theta` about the normal (R07 eq. 23).

    Args:
        theta: angle of the light, a number or an array [rad].
        n: angle of the normal [rad].

    Example:
        >>> from firstorder.conventions import mirror_direction
        >>> mirror_direction(0.25, 0.5)
        0.75
    """
    return 2.0 * n - theta


def fourier_kernel(
    Omega: Float[Array | np.ndarray, "*#b n"], u: Float[Array | np.ndarray, "*#b n"]
) -> Complex[Array, "..."]:
    """`exp(-2 pi i Omega . u)`: the one place where the Fourier sign and scale are written.

    Args:
        Omega: frequencies, one per coordinate [cycles per unit].
        u: rays.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import fourier_kernel
        >>> kernel = fourier_kernel(jnp.array([0.25, 0.0]), jnp.array([1.0, 7.0]))
        >>> round(kernel.imag.item(), 12)  # a quarter of a cycle, backwards
        -1.0
    """
    return jnp.exp(-2j * jnp.pi * jnp.sum(Omega * u, axis=-1))
