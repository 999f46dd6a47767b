"""Tabulate: light replaced by a table of itself, so that two bounces do not nest two integrals."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from firstorder._argument_checks import check_kind
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid
from firstorder.fields.spline import Spline
from firstorder.laws.base import Law, Portrait
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Ray, Scalar


class Tabulate(Event):
    """The cubic spline through the light's values on a grid; nothing happens to the light.

    Values miss by `O(step^4)`, gradients by `O(step^3)`, Hessians by `O(step^2)`: `error` measures
    it. Each later evaluation costs 16 products (in flatland) instead of an integral.
    Spectrum, covariance and wavelets pass unchanged, which is right to the table's error.

    Valid when the light is smooth and dies out inside the grid, or is periodic on it. Refused for
    light with edges, which a table would smooth away, and for a jet at one ray.

    Args:
        grid: where the light is sampled.
        boundary: what lies beyond the grid, per axis (see `Spline`).

    Raises:
        TypeError: if `grid` is no grid.
        ValueError: if the grid does not have the light's number of coordinates.

    Example:
        >>> from firstorder.fields import Grid, gaussian
        >>> from firstorder.transport import Tabulate
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> table = Tabulate(Grid.spanning((64, 64), (6.0, 6.0)))(L)
        >>> abs(table(0.3, 0.2).item() - L(0.3, 0.2).item()) < 1e-5
        True
    """

    grid: Grid
    boundary: str | tuple[str, ...] = eqx.field(static=True, default="zero")

    def __check_init__(self):
        """Refuse what is no grid."""
        check_kind("grid", self.grid, Grid, "a grid, as `Grid.spanning` makes one")

    def law(self, frame: Frame) -> Law:
        """Refused: a table is made of the whole field, and is no law at a ray."""
        raise Refused("a table is made of the whole field: apply it to one")

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Refused, for the same reason."""
        raise Refused("a table is made of the whole field, not of its jet at one ray")

    def __call__(self, portrait: Portrait) -> Portrait:
        """The table of a field; other portraits unchanged."""
        if isinstance(portrait, Jet):
            raise Refused("a table is made of the whole field, not of its jet at one ray")
        if not isinstance(portrait, Field):
            return portrait
        need = f"a grid of {portrait.frame.dims} axes"
        require_frame(portrait.frame.dims == len(self.grid.size), self, portrait.frame, need)
        if portrait.edges():
            raise Refused("a table would smooth the edges away: tabulate the light before them")
        samples = eqx.filter_jit(self.grid.sample)(portrait)
        return Spline(samples, self.grid, portrait.frame, self.boundary)

    def error(self, field: Field) -> Scalar:
        """Largest difference between light and table at the centres of the grid's cells.

        There, half a step from every sample, a spline is worst.
        """
        size = tuple(n - 1 for n in self.grid.size)
        centres = Grid(size, self.grid.step, self.grid.center)
        between = eqx.filter_jit(centres.sample)
        return jnp.max(jnp.abs(between(self(field)) - between(field)))
