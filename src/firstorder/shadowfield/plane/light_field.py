"""The shadow light field: the part of a flat light that each ray from it brings to a receiver.

A light lies along a line, the receiver along a parallel line at the distance d1 from it, and the
blockers between them. Positions on all planes are measured from one origin, distances from the
light. A ray has two names:

    (y, v): the position y on the light, and its offset v for each metre on the way: at the
            distance d it passes y + d v. This name knows no receiver.
    (x, y): the positions on the receiver and on the light, x = y + d1 v.

Light that is seen from below through the line y = const of a receiver is *incoming* light in the
sense of `conventions`, and E11's v is the library's slope. E11 writes (v, y) and
(Omega_v, Omega_y); here positions stand first.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_positive, nan_unless
from firstorder.conventions import Frame
from firstorder.fields.field import Field, Sum
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.numerics._refinement import finer, refined, with_errors
from firstorder.typing import Ray, Scalar, as_float

ON_LIGHT = Frame(("y", "v"))
TWO_PLANES = Frame(("x", "y"))
PLANE = Frame(("y",))
ON_RECEIVER = Frame(("x",))


def planar_blocker(g: Field, d2) -> Field:
    """A blocker in a plane: `f(y, v) = g(y + d2 v)`.

    Args:
        g: transparency over the position on the blocker's own plane, in `PLANE`.
        d2: distance of that plane from the light, positive [m].

    Raises:
        ValueError: if `d2` is not positive; NaN if it is traced.

    Reference: E11 eq. 1.

    Example:
        >>> from firstorder.fields import Affine, Bars
        >>> from firstorder.shadowfield import PLANE, planar_blocker
        >>> slit = Bars(Affine([1.0], 0.0, PLANE), [-0.1, 0.1], [0.0, 1.0, 0.0])
        >>> f = planar_blocker(slit, 0.5)
        >>> f(0.3, -0.6).item(), f(0.3, 0.0).item()
        (1.0, 0.0)
    """
    check_positive("d2", d2)
    d2 = _positive(d2)
    return Move(jnp.stack([jnp.ones_like(d2), d2])[None], to=ON_LIGHT)(g)


def planar_blockers(layers: Sequence[Field], depths) -> Field:
    """Several planar blockers: the product of their layers.

    The product of two lines of energy is not on either line and need not lie between them: see
    `wedge` for what that does to E11's wedge.

    Args:
        layers: transparencies over the position on each plane, in `PLANE`.
        depths: distance of each plane from the light [m].

    Raises:
        ValueError: if there is not one depth for each layer, and at least one layer.

    Reference: E11 §3, Fig. 3.

    Example:
        >>> from firstorder.fields import Affine, Bars
        >>> from firstorder.shadowfield import PLANE, planar_blockers
        >>> slit = Bars(Affine([1.0], 0.0, PLANE), [-0.1, 0.1], [0.0, 1.0, 0.0])
        >>> planar_blockers([slit, slit], [0.4, 0.6])(0.0, 0.2).item()  # through one, not the other
        0.0
    """
    depths = as_float(depths)
    if not layers or depths.shape != (len(layers),):
        raise ValueError(
            f"Argument `depths` must have {len(layers)} entries, at least one, "
            f"but has shape {depths.shape}."
        )
    f = planar_blocker(layers[0], depths[0])
    for g, d2 in zip(layers[1:], depths[1:], strict=True):
        f = Multiply(planar_blocker(g, d2))(f)
    return f


def to_two_planes(d1) -> Move:
    """The law that names rays by (x, y): `f((x - y) / d1, y)` from a field over (y, v).

    Its Jacobian is `dy dv = dx dy / d1`.

    Args:
        d1: distance of the receiver from the light, positive [m].

    Raises:
        ValueError: if `d1` is not positive.

    Reference: E11 §3 and eqs. 11-12 (its inverse is a shear of -1 and a scale of 1 / d1).

    Example:
        >>> from firstorder.shadowfield import to_two_planes
        >>> to_two_planes(2.0).M.tolist()
        [[0.0, 1.0], [0.5, -0.5]]
    """
    check_positive("d1", d1)
    s = 1.0 / _positive(d1)
    zero, one = jnp.zeros_like(s), jnp.ones_like(s)
    return Move(jnp.stack([jnp.stack([zero, one]), jnp.stack([s, -s])]), to=TWO_PLANES)


class FormFactor(Field):
    """`K(x, y) = d1^2 / ((x - y)^2 + d1^2)^(3/2)`: what a piece of the light counts at a receiver.

    `E = int K V L dy`: two cosines over a distance, for a light and a receiver that face each
    other. Over an endless light its integral is 2.

    Args:
        d1: distance between light and receiver, positive [m].

    Raises:
        ValueError: if `d1` is not positive.

    Reference: E11 eq. 2, whose r(x) is its mean over the light.

    Example:
        >>> from firstorder.shadowfield import FormFactor
        >>> FormFactor(2.0)(0.5, 0.5).item()  # straight below: 1 / d1
        0.5
    """

    d1: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a light that the receiver lies in or behind."""
        check_positive("d1", self.d1)

    @property
    def frame(self) -> Frame:
        """Receiver and light."""
        return TWO_PLANES

    def at(self, u: Ray) -> Scalar:
        """The kernel."""
        d1 = _positive(self.d1)
        square = (u[0] - u[1]) ** 2 + d1**2
        return d1**2 / (square * jnp.sqrt(square))

    def jet(self, u: Ray) -> Jet:
        """By autodiff of four operations."""
        return autodiff_jet(self.at, u, self.frame)


def shadow_irradiance(
    f: Field, light: Field, d1, lower, upper, form: str = "omitted", nodes: int = 16
) -> Field:
    """Irradiance along a receiver: `h(x) = r(x) int f((x - y) / d1, y) l(y) dy`.

    The integral is split at every edge of the blockers and of the light, so that it is exact for
    planar blockers before a uniform light, and its jet holds the boundary terms.

    Args:
        f: the shadow light field over (y, v).
        light: intensity l over the position on the light, in `PLANE`.
        d1: distance between light and receiver [m].
        lower: where the light begins [m].
        upper: where it ends [m].
        form: "omitted" for r = 1; "factored" for r(x) = int K l dy / int l dy outside the integral,
            as the paper has it; "exact" for the form factor inside.
        nodes: Gauss-Legendre nodes between two edges.

    Returns:
        h over ("x",).

    Valid when: the receiver is a line parallel to the light, at one distance. "factored" is wrong
    by at most `factoring_bound`.

    Raises:
        ValueError: if `form` is none of the three.

    Reference: E11 eq. 2.

    Example:
        >>> from firstorder.fields import Affine, Bars, BoxProfile
        >>> from firstorder.shadowfield import PLANE, planar_blocker, shadow_irradiance
        >>> edge = Bars(Affine([1.0], 0.0, PLANE), [0.0], [0.0, 1.0])
        >>> h = shadow_irradiance(planar_blocker(edge, 0.5), BoxProfile(0.5, "y", PLANE), 1.0, -0.5,
        ...     0.5)
        >>> round(h(0.0).item(), 12), round(h(0.25).item(), 12)
        (0.5, 0.75)
    """
    if form not in ("omitted", "factored", "exact"):
        raise ValueError(f"Argument `form` must be omitted, factored or exact, but is {form!r}.")
    lit = _over_both(light)
    seen = Multiply(lit)(to_two_planes(d1)(f))
    over = Integrate("y", lower, upper, nodes)
    if form == "omitted":
        return over(seen)
    if form == "exact":
        return over(Multiply(FormFactor(d1))(seen))
    return Multiply(mean_form_factor(light, d1, lower, upper, nodes))(over(seen))


def mean_form_factor(light: Field, d1, lower, upper, nodes: int = 32) -> Field:
    """`r(x) = int K(x, y) l(y) dy / int l(y) dy`: the form factor without its blockers.

    Args:
        light: intensity over `PLANE`.
        d1: distance between light and receiver [m].
        lower: where the light begins [m].
        upper: where it ends [m].
        nodes: of the quadrature.

    Raises:
        ValueError: if `nodes` is not positive.

    Reference: E11 eq. 2.

    Example:
        >>> from firstorder.fields import Constant
        >>> from firstorder.shadowfield import PLANE, mean_form_factor
        >>> r = mean_form_factor(Constant(1.0, PLANE), 1.0, -0.75, 0.75)
        >>> round(r(0.0).item(), 6)  # 2 sin(atan(3/4)) / 1.5
        0.8
    """
    lit, over = _over_both(light), Integrate("y", lower, upper, nodes)
    total = over(lit).at(jnp.zeros(1))
    mean = (1.0 / total) * over(Multiply(FormFactor(d1))(lit))
    ends = map(as_float, (d1, lower, upper))
    return _MeanFormFactor(mean.fields, mean.weights, light, *ends, nodes)


@with_errors("nodes")
def factoring_bound(
    light: Field, d1, lower, upper, x, nodes: int = 256, with_error: bool = False
) -> Float[Array, "*n"]:
    """Largest error of pulling r(x) out of (2), over all blockers: `(1/2) int |K - r| l dy`.

    `h - r int f l = int (K - r) f l`, and `int (K - r) l = 0`: with 0 <= f <= 1 the worst blocker
    lets through where K > r. So the bound is reached. Relative to the unblocked irradiance it is of
    order `a / d1` for a light of size a seen obliquely and `(a / d1)^2` below its middle.

    Args:
        light: intensity over `PLANE`.
        d1: distance between light and receiver [m].
        lower: where the light begins [m].
        upper: where it ends [m].
        x: positions on the receiver [m].
        nodes: of the midpoint rule, which the kink where K = r leaves at order 2.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Reference: E11 §3 ("a common approximation"); the bound is ours.

    Example:
        >>> import numpy as np
        >>> from firstorder.fields import Constant
        >>> from firstorder.shadowfield import PLANE, factoring_bound
        >>> bound = lambda a: factoring_bound(Constant(1.0, PLANE), 1.0, -a, a, np.zeros(1))[0]
        >>> bool(bound(0.1) / 0.1 < 0.1 * bound(1.0))  # as the square of the light's size
        True
    """
    x = as_float(x)
    r = mean_form_factor(light, d1, lower, upper)(x)
    step = (as_float(upper) - lower) / nodes
    y = lower + step * (jnp.arange(nodes) + 0.5)
    K = FormFactor(d1)(x[..., None], y)
    return 0.5 * step * jnp.sum(jnp.abs(K - r[..., None]) * light(y), axis=-1)


class _MeanFormFactor(Sum):
    """A mean form factor with what it was made of: a finer rule is one for its norm, too."""

    light: Field
    d1: Scalar
    lower: Scalar
    upper: Scalar
    nodes: int = eqx.field(static=True)

    def _finer(self, step: int) -> Field:
        """The mean by more nodes."""
        light = refined(self.light, step)
        return mean_form_factor(light, self.d1, self.lower, self.upper, finer(self.nodes, step))


def _over_both(light: Field) -> Field:
    """The light over (x, y)."""
    return Move(jnp.array([[0.0, 1.0]]), to=TWO_PLANES)(light)


def _positive(d) -> Scalar:
    """A distance; NaN for a traced one that is none."""
    d = as_float(d)
    return nan_unless(d > 0, d)
