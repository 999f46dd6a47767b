"""Occlusion: the light is multiplied by the transparency of what stands in its way."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import (
    check_between,
    check_count,
    check_inside,
    check_kind,
    check_not_negative,
    check_one,
    check_positive,
    is_concrete,
    nan_unless,
    traced_nan_unless,
)
from firstorder.conventions import Frame
from firstorder.fields._coerce import field_of, fields_of
from firstorder.fields.apertures import Bars, Grating
from firstorder.fields.field import Affine, Field
from firstorder.fields.mask import half_plane
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.multiply import Multiply
from firstorder.transport.event import Event
from firstorder.transport.events.travel import Travel
from firstorder.typing import Array, Scalar, as_float


class Occlusion(Event):
    """`l'(x, v) = l(x, v) V(x, v)`, V the transparency in [0, 1].

    A planar blocker depends on x alone. One that stands `depth` behind the plane (towards where
    the light comes from) is sheared by the travel over that distance. A body that is extended in
    depth is any V(x, v), or several planar blockers (`PlanarBlockers`).

    The spectrum is convolved with that of V. A planar V has energy at zero angular frequency
    alone, one at depth z on the line `(Omega_x, Omega_v) = s (1, -z)` (incoming light).

    Args:
        transparency: field V over the light's coordinates, or a function of them, or of x alone.
        depth: distance from the blocker to the plane, along the light; zero for a planar one.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Called: visibility (D05 §3.2, R07 §6).

    Reference: D05 eqs. 4-5.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Occlusion
        >>> veil = Occlusion(lambda x: 0.5 + 0.0 * x)
        >>> veil(gaussian((0.0, 0.0), (1.0, 1.0)))(0.0, 0.0).item()
        0.5
    """

    transparency: Field = eqx.field(converter=field_of("transparency"))
    depth: Scalar = eqx.field(converter=as_float, default=0.0)
    window: Grid | None = None

    def law(self, frame: Frame) -> Multiply:
        """Multiply by V, sheared to its depth."""
        transparency = self.transparency.in_frame(frame, "transparency", type(self).__name__)
        check_one("depth", self.depth)
        shear = Travel(self.depth).law(frame)
        return Multiply(shear(transparency), self.window, type(self).__name__)


class PlanarBlockers(Event):
    """Several planar blockers, one behind the other: the product of their sheared masks.

    `l'(x, v) = l(x, v) prod_k V_k(x -+ v z_k, v)`, minus for incoming light. The product of two
    lines of energy is the whole parallelogram lattice `s (1, -z_1) + t (1, -z_2)`, so the spectrum
    is *not* restricted to the wedge between the lines, as D05 §3.2 has it: only its singular part,
    the edges, is.

    Args:
        transparencies: one field for each layer, over the light's coordinates.
        depths: distance of each layer from the plane, along the light, an array [m].
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Raises:
        ValueError: if there is not one depth for each layer, or one of them is negative.

    Reference: D05 §3.2.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian, half_plane
        >>> from firstorder.transport import PlanarBlockers
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> V = half_plane(0.0, frame=L.frame)
        >>> PlanarBlockers((V, V), [0.0, 1.0])(L)(0.5, 1.0).item()  # hits the farther one
        0.0
    """

    transparencies: tuple[Field, ...] = eqx.field(converter=fields_of("transparencies"))
    depths: Array = eqx.field(converter=as_float)
    window: Grid | None = None

    def __check_init__(self):
        """Refuse layers without a place."""
        if self.depths.shape != (len(self.transparencies),) or not self.transparencies:
            raise ValueError(
                f"Argument `depths` must have {len(self.transparencies)} entries, at least one, "
                f"but has shape {self.depths.shape}."
            )

    def law(self, frame: Frame) -> Law:
        """Multiply by the product."""
        name = type(self).__name__
        layers = [V.in_frame(frame, "transparencies", name) for V in self.transparencies]
        sheared = [
            Occlusion(V, z).law(frame).factor for V, z in zip(layers, self.depths, strict=True)
        ]
        product = sheared[0]
        for V in sheared[1:]:
            product = Multiply(V)(product)
        return Multiply(product, self.window, type(self).__name__)


def half_plane_blocker(
    edge, frame: Frame, transparency=0.0, window: Grid | None = None
) -> Occlusion:
    """A half-plane that blocks `x < edge`, letting through the fraction `transparency`.

    `l'(x, v) = l(x, v) V(x)` with V = `transparency` for x < `edge`, and 1 beyond it.

    Args:
        edge: where it ends, in metres.
        frame: names of the light's coordinates, of which the first is x.
        transparency: of the half-plane, in [0, 1].
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Returns:
        The event, `light >> half_plane_blocker(...)`; it lies in the plane of the light.

    Raises:
        ValueError: if `transparency` lies outside [0, 1].

    Reference: D05 §3.2, eqs. 4-5, which hold for partly transparent blockers too.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import half_plane_blocker
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> half_plane_blocker(0.5, L.frame)(L)(0.0, 0.0).item()
        0.0
    """
    _check_frame(frame)
    mask = half_plane(
        edge, _fraction("transparency", transparency), 1.0, frame.coordinates[0], frame
    )
    return Occlusion(mask, 0.0, window)


def slit_blocker(
    left, right, frame: Frame, transparency=0.0, depth=0.0, window: Grid | None = None
) -> Occlusion:
    """A screen that is open for `left < x < right` and lets through `transparency` elsewhere.

    Args:
        left: end of the slit, in metres.
        right: its other end, in metres.
        frame: names of the light's coordinates, of which the first is x.
        transparency: of the screen beside the slit, in [0, 1].
        depth: distance from the screen to the plane, along the light, in metres.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Returns:
        The event, `light >> slit_blocker(...)`.

    Raises:
        ValueError: if `transparency` lies outside [0, 1] or `left < right` does not hold.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import slit_blocker
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> slit = slit_blocker(-0.5, 0.5, L.frame)
        >>> slit(L)(0.0, 0.0).item(), slit(L)(0.6, 0.0).item()
        (1.0, 0.0)
    """
    t = _fraction("transparency", transparency)
    heights = jnp.stack([t, jnp.ones_like(t), t])
    check_one("left", left)
    check_one("right", right)
    if is_concrete((left, right)) and not left < right:
        raise ValueError(f"Argument `right` must be greater than `left` = {left}, but is {right}.")
    places = jnp.stack([as_float(left), as_float(right)])
    return Occlusion(Bars(_along(frame), places, heights), depth, window)


def comb_blocker(
    period,
    count: int,
    frame: Frame,
    open=0.5,
    transparency=0.0,
    depth=0.0,
    window: Grid | None = None,
) -> Occlusion:
    """A finite comb: `count` bars of transparency `transparency`, one per `period`, about x = 0.

    Between and beyond the bars nothing stands in the way. For a comb without end see `Grating`.

    Args:
        period: distance from bar to bar, in metres.
        count: how many bars.
        frame: names of the light's coordinates.
        open: fraction of a period that is open, in (0, 1).
        transparency: of the bars, in [0, 1].
        depth: distance from the comb to the plane, along the light.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Raises:
        ValueError: if `count` is not a positive integer or a fraction lies outside its interval.

    Reference: D05 §3.2 for a blocker in a plane; §3.4 for periodic ones.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import comb_blocker
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> comb_blocker(1.0, 3, L.frame)(L)(1.0, 0.0).item()  # on the third bar
        0.0
    """
    t = _fraction("transparency", transparency)
    check_one("open", open)
    check_inside("open", open, 0.0, 1.0)
    open = traced_nan_unless(lambda a: (a > 0) & (a < 1), as_float(open))
    check_one("period", period)
    check_positive("period", period)
    check_count("count", count)
    middles = period * (np.arange(count) - 0.5 * (count - 1))
    half = 0.5 * as_float(period) * (1.0 - open)
    places = jnp.stack([middles - half, middles + half], axis=-1).ravel()
    heights = jnp.append(jnp.ones(1), jnp.tile(jnp.stack([t, jnp.ones_like(t)]), count))
    return Occlusion(Bars(_along(frame), places, heights), depth, window)


def grating_blocker(
    period,
    frame: Frame,
    open=0.5,
    transparency=0.0,
    depth=0.0,
    window: Grid | None = None,
) -> Occlusion:
    """A comb without end; x = 0 is the middle of an opening (see `Grating`).

    Raises:
        ValueError: if `transparency` lies outside [0, 1], or see `Grating`.

    Reference: D05 §3.4.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import grating_blocker
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> grating_blocker(1.0, L.frame)(L)(0.5, 0.0).item()
        0.0
    """
    t = _fraction("transparency", transparency)
    return Occlusion(Grating(_along(frame), period, open, t, 1.0), depth, window)


def pit_blockers(
    period, depth, sheets: int, frame: Frame, open=0.5, window: Grid | None = None
) -> PlanarBlockers:
    """A row of pits with upright walls, as light sees it on its way to their bottom.

    The walls are gratings at the depths `k depth / sheets`, k = 1 ... sheets, the last of them the
    rim: `V(x, v) = prod_k G(x - k v depth / sheets)` for incoming light, x on the bottom, x = 0 the
    middle of a pit.

    Exact at the bottom, in (-open / 2, open / 2) periods, for slopes `|v| <= sheets (1 - open)
    period / depth`: such a ray moves by less than a wall from sheet to sheet and cannot step over
    one. A steeper ray may leak into a neighbour. Under a uniform sky leaks add at most
    `2 (1 - V / sqrt(1 + V^2))` to the irradiance, V that slope, about `V^-2`. One sheet alone is a
    floor below a perforated screen. What the walls reflect is left out: it is a bounce.

    Args:
        period: from pit to pit [m].
        depth: from the bottom to the rim [m].
        sheets: how many gratings stand for the walls.
        frame: names of the light's coordinates.
        open: fraction of a period that is a pit, in (0, 1).
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Raises:
        ValueError: if `sheets` is not a positive integer, `depth` is negative or no one number, or
            see `Grating`.

    Reference: D05 §3.2 for blockers one behind the other, §7 for pits.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import pit_blockers
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> pits = [pit_blockers(1.0, 1.0, n, L.frame)(L) for n in (1, 2)]
        >>> pits[0](0.0, 1.0).item() > 0.0, pits[1](0.0, 1.0).item()  # through the wall, or not
        (True, 0.0)
    """
    check_count("sheets", sheets)
    check_one("depth", depth)
    check_not_negative("depth", depth)
    grating = Grating(_along(frame), period, open)
    depths = as_float(depth) * np.arange(1.0, sheets + 1.0) / sheets
    return PlanarBlockers((grating,) * sheets, depths, window)


def _fraction(name: str, x) -> Scalar:
    """A number in [0, 1]; NaN for a traced one that is not."""
    check_between(name, x, 0.0, 1.0)
    x = as_float(x)
    return nan_unless((x >= 0) & (x <= 1), x)


def _check_frame(frame: Frame) -> None:
    """Refuse what is no frame."""
    check_kind("frame", frame, Frame, "a `Frame`, such as FLATLAND")


def _along(frame: Frame) -> Affine:
    """The first position as a level."""
    _check_frame(frame)
    return Affine(np.eye(frame.dims)[frame.positions[0]], 0.0, frame)
