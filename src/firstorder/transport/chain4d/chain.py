"""The whole shading chain in space: from slopes across one ray to slopes across the reflected one.

D05 §5.2 describes its steps in words and omits the formulas. Here they are, each twice: exact, as a
warp (of the osculating surface), and to first order about the central rays, as a linear map of the
four coordinates, through which spectra, covariances and band limits pass.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_positive, check_shape, is_concrete
from firstorder._display import Module
from firstorder.conventions import SPACE, SPACE_SLOPE
from firstorder.fields.kernel import GaussianProfile
from firstorder.fields.spectrum import Grid
from firstorder.transport.chain4d._equator import (
    Bend,
    ComposedMove,
    FromEquator,
    Oblique,
    Roll,
    ToEquator,
    Turn,
    equator_direction,
    plane_rotation,
)
from firstorder.transport.event import Chain, Event
from firstorder.transport.events.cosine import Cosine
from firstorder.transport.events.incidence import Incidence, Outgoing, _check_above
from firstorder.transport.events.mirror import Mirror
from firstorder.transport.events.reflection import Reflection
from firstorder.typing import Scalar, as_float

_LEAVING = SPACE.turned()


def _given(number) -> Scalar | None:
    """A number as an array; one that was left out stays so."""
    return None if number is None else as_float(number)


class GlossyPatch(Module):
    """A small patch of curved, glossy surface between two central rays.

    Its axes: the normal, and in the tangent plane the first axis along the plane of incidence.

    Args:
        S: shape operator `-dn` in these axes [1/m]; a sphere seen from outside has `-1/R`.
        theta0: longitude of the central incoming ray, |theta0| < pi / 2.
        sigma: deviation of the Gaussian lobe about the mirror direction [rad]; `1 / sqrt(s)` for a
            Phong exponent s. None for a mirror.
        theta1: longitude of the central outgoing ray in its own plane; `-theta0`, the mirror
            direction, if left out.
        azimuth: of the outgoing plane about the normal, from the plane of incidence [rad]; None if
            they are one and the same, which spares three rotations.
        roll: by which the axes across the incoming ray must turn about it to have their first one
            in the plane of incidence.
        cosine: whether light is weighed by the cosine of incidence.
        albedo: integral of the lobe; 1 for a mirror.

    Raises:
        ValueError: if S is no 2 x 2 matrix, a central ray does not run above the surface, the
            lobe's width is not positive, or a mirror's albedo is not 1.

    Reference: D05 §5.2 and eq. 19.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import SPACE_SLOPE
        >>> from firstorder.transport import GlossyPatch
        >>> sphere = GlossyPatch(-jnp.eye(2), theta0=jnp.pi / 3)  # radius 1, seen from outside
        >>> M = sphere.mirror_matrix()
        >>> [round(M[i, i - 2].item(), 12) for i in (2, 3)]  # Coddington: 2 / c and 2 c
        [-4.0, -1.0]
    """

    S: Float[Array, "2 2"] = eqx.field(converter=as_float)
    theta0: Scalar = eqx.field(converter=as_float, default=0.0)
    sigma: Scalar | None = eqx.field(converter=_given, default=None)
    theta1: Scalar | None = eqx.field(converter=_given, default=None)
    azimuth: Scalar | None = eqx.field(converter=_given, default=None)
    roll: Scalar = eqx.field(converter=as_float, default=0.0)
    cosine: bool = eqx.field(static=True, default=False)
    albedo: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse what is no patch."""
        check_shape("S", self.S, (2, 2))
        _check_above("theta0", self.theta0)
        _check_above("theta1", self.leaving)
        if self.sigma is not None:
            check_positive("sigma", self.sigma)
        elif is_concrete(self.albedo) and self.albedo != 1.0:
            raise ValueError(f"Argument `albedo` of a mirror must be 1, but is {self.albedo}.")

    @property
    def leaving(self) -> Scalar:
        """Longitude of the central outgoing ray in its own plane."""
        return -self.theta0 if self.theta1 is None else self.theta1

    def chain(self, exact: bool = False, nodes: int = 24, window: Grid | None = None) -> Chain:
        """Slopes across the incoming ray to slopes across the outgoing one, as events.

        Turn the axes, name angles, meet the surface, turn into each point's frame, weigh by the
        cosine, mirror, turn the equator through mirror and outgoing direction, convolve with the
        lobe, turn the equator through normal and outgoing direction, turn back out of each point's
        frame, leave the surface, name slopes.

        Args:
            exact: warps instead of the moves that touch them at the central rays. The lobe is taken
                near the equator in either case.
            nodes: of the two convolutions with the lobe.
            window: box for the cosine's spectrum (see `Multiply`).
        """
        before: list[Event] = [Roll(self.roll), ToEquator(exact)]
        before += [Oblique(self.theta0) if exact else Incidence(self.theta0)]
        before += [Bend(self.S, self.theta0, exact=exact)]
        weight: list[Event] = []
        if self.cosine:
            weight += [Cosine("theta", window=window)]
            weight += [Cosine("phi", window=window)] if exact else []
        between: list[Event] = [Mirror()]
        after: list[Event] = []
        bent = self.S
        if self.azimuth is not None:
            into, out, Q = self._equators(self.azimuth)
            here, there = (None, None) if exact else (jnp.zeros_like(self.theta0), self.leaving)
            between, after = [*between, Turn(into, at=here)], [Turn(out, Q, there)]
            bent = Q.T @ bent @ Q
        after += [Bend(bent, self.leaving, back=True, exact=exact)]
        after += [Oblique(self.leaving) if exact else Outgoing(self.leaving)]
        after += [FromEquator(exact)]
        if exact:
            return Chain((*before, *weight, *between, *self._lobe(nodes), *after))
        moves = [[*before], [*between]] if weight else [[*before, *between]]
        first, *second = (ComposedMove(tuple(m)) for m in moves)
        return Chain((first, *weight, *second, *self._lobe(nodes), ComposedMove(tuple(after))))

    def mirror_matrix(self) -> Float[Array, "4 4"]:
        """First order of the chain without its lobe: the incoming ray from the outgoing one.

        In the plane of incidence and for the mirror direction it is
        `[[1, 0], [2 P, -1]]` with `P = (S_11 / c, S_12; S_12, S_22 c)`, `c = cos(theta0)`: the
        tangential and the sagittal power of Coddington's equations. Points of energy move by its
        transpose.
        """
        smooth = GlossyPatch(self.S, self.theta0, None, self.theta1, self.azimuth, self.roll)
        return ComposedMove(smooth.chain().events).law(SPACE_SLOPE).M

    def _lobe(self, nodes: int) -> list[Event]:
        """Two convolutions: a Gaussian of the distance is the product of two, near the equator."""
        if self.sigma is None:
            return []
        return [
            Reflection(GaussianProfile(self.sigma, "theta", _LEAVING, self.albedo), nodes=nodes),
            Reflection(GaussianProfile(self.sigma, "phi", _LEAVING), nodes=nodes),
        ]

    def _equators(self, azimuth: Scalar) -> tuple[Array, Array, Array]:
        """Rotation to the equator of mirror and outgoing ray, from there to the outgoing plane's.

        And that of the positions.
        """
        zero = jnp.zeros_like(self.theta0)
        mirror = equator_direction(-self.theta0, zero)
        Q = plane_rotation(azimuth.astype(self.theta0.dtype))
        C = jnp.eye(3, dtype=Q.dtype).at[:2, :2].set(Q)
        out = C @ equator_direction(self.leaving, zero)
        middle = _equator_through(mirror, out)
        return middle, middle.T @ C, Q


def _equator_through(mirror: Float[Array, "3"], out: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Axes as columns: normal along the mirror direction, the other ray on the equator.

    If the two rays are one, the pole is the second axis, across the plane of incidence.
    """
    pole = jnp.cross(mirror, out)
    size = jnp.sum(pole**2)
    apart = size > 1e-12
    second = jnp.array([0.0, 1.0, 0.0], pole.dtype)
    pole = jnp.where(apart, pole / jnp.sqrt(jnp.where(apart, size, 1.0)), second)
    pole = jnp.where(pole[1] < 0, -pole, pole)
    return jnp.stack([jnp.cross(pole, mirror), pole, mirror], axis=-1)
