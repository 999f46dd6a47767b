r"""Distant light as nodes: a sky, or a lamp that is far enough to be taken for one.

Distant light has no SV: when the point moves, its nodes move along (R07 §5.2). A sky's nodes are
directions, each with the solid angle of its cell; `imaging._area_lights` takes them in place of a
lamp's, as nodes 1 m away that face the point. Even nodes stand in the middles of cells of equal
solid angle, `z` along the rows and the azimuth along the columns: shadows that move over them are
known. Nodes by luminance stand closer where the sky is bright. Nodes by cosine stand about each
surface's own normal, none below it and more where light counts more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_count, check_not_negative
from firstorder._display import Module
from firstorder.conventions import cylindrical
from firstorder.imaging._lamps import Lamp
from firstorder.numerics._vectors import cross, orthonormal_frame
from firstorder.typing import as_float

Direction = Float[Array, "3"]
Sky = Callable[[Array], Array]
_FULL = 2.0 * np.pi


class DistantLight(Module):
    """Light whose nodes look the same from everywhere. Make it with the functions of this module.

    Attributes:
        way: to the nodes, the same from every point [m].
        area: vectors of the nodes' pieces, along the side that emits [m^2].
        radiance: of each node; bands last [W/(m^2 sr)].
        shape: rows and columns of nodes.
        even: whether they are the middles of cells in `axis . w` and the azimuth, all around.
        axis: unit vector about which even nodes stand.
        steep: rows of even nodes per unit of `axis . w`, of each or of all.
    """

    BANDED: ClassVar = {"radiance": 1}

    way: Float[Array, "k 3"]
    area: Float[Array, "k 3"]
    radiance: Float[Array, "k *bands"]
    shape: tuple[int, int] = eqx.field(static=True)
    even: bool = eqx.field(static=True)
    axis: Direction = eqx.field(converter=as_float, default=(0.0, 0.0, 1.0))
    steep: Float[Array, "*k"] = eqx.field(converter=as_float, default=0.0)

    @property
    def near(self) -> bool:
        """Whether nodes stay in place when the point moves: they move with it."""
        return False

    @property
    def wraps(self) -> bool:
        """Whether the last column is a neighbour of the first: the azimuth goes around."""
        return True

    def toward(self, x: Direction) -> tuple[Float[Array, "k 3"], Float[Array, "k 3"]]:
        """Directions to the nodes, and their area vectors, the same from every point."""
        return self.way, self.area

    def slide(self, x: Direction, nodes: Any = slice(None)) -> Float[Array, "k 2 3"]:
        """Derivatives of the cell coordinates: of even nodes, `d(axis . w)` and `dphi`."""
        w, n = self.way[nodes], self.axis
        steep = self.steep[nodes] if self.steep.ndim else self.steep
        up = steep[..., None] * (n - (w @ n)[:, None] * w)
        across = cross(jnp.broadcast_to(n, w.shape), w)
        flat = jnp.maximum(jnp.sum(across**2, -1, keepdims=True), 1e-12)
        return jnp.stack([up, across / flat * (self.shape[1] / _FULL)], 1)


def _dome(sky: Sky, rows: int = 16, shift: tuple[float, float] = (0.0, 0.0)) -> DistantLight:
    """A sky as `rows` times `2 rows` directions, each the middle of a cell of equal solid angle.

    Cells are long at the poles: gradients of a shadow that covers one come out with twice to ten
    times the error that they have elsewhere (4 % against 0.4 % with 256 rows, a ball on a floor).

    Args:
        sky: radiance from unit vectors, such as `space.skies` has.
        rows: of equal height in z.
        shift: of the nodes out of the middles of their cells, in cells, in [-1/2, 1/2].

    Raises:
        ValueError: if there is no row.

    Example:
        >>> from firstorder.space import ConstantSky
        >>> from firstorder.imaging.sky_lights import _dome
        >>> light = _dome(ConstantSky(2.0), 4)
        >>> light.shape, round(-(light.area * light.way).sum().item(), 6)  # all around: 4 pi
        ((4, 8), 12.566371)
    """
    check_count("rows", rows)
    columns = 2 * rows
    i, j = np.meshgrid(np.arange(rows) + 0.5, np.arange(columns) + 0.5, indexing="ij")
    z = 2.0 * (i.ravel() + shift[0]) / rows - 1.0
    phi = _FULL * (j.ravel() + shift[1]) / columns
    w = cylindrical(jnp.asarray(np.sqrt(1.0 - z * z)), jnp.asarray(phi), jnp.asarray(z))
    L = jax.vmap(sky)(w)
    area = -w * (2.0 * _FULL / len(z))
    return DistantLight(w, area, L, (rows, columns), True, steep=0.5 * rows)


FINE = 256  # rows of the table by which directions are chosen


def _by_luminance(
    sky: Sky, rows: int = 16, shift: tuple[float, float] = (0.0, 0.0), floor: float = 0.02
) -> DistantLight:
    """A sky as `rows` times `2 rows` directions, each of a cell that sends as much light.

    Rows hold equal light, and so do the cells of each row: no derivative of a moving shadow comes
    from such a lattice (`even` is False).

    Args:
        sky: radiance from unit vectors.
        rows: of nodes.
        shift: of the nodes out of the middles of their cells, in cells, in [-1/2, 1/2].
        floor: share of directions that are spread evenly, so that none is left out.

    Raises:
        ValueError: if there is no row, or the sky is dark or negative somewhere.

    Example:
        >>> from firstorder.space import GaussianSky
        >>> from firstorder.imaging.sky_lights import _by_luminance
        >>> light = _by_luminance(GaussianSky((0.0, 0.0, 1.0), 0.2), 8)
        >>> bool((light.way[:, 2] > 0.8).mean() > 0.9)
        True
    """
    check_count("rows", rows)
    table = _dome(sky, FINE)
    L = np.asarray(table.radiance, float).reshape(FINE, 2 * FINE, -1).mean(-1)  # of all bands
    check_not_negative("sky", L)
    if not L.sum() > 0.0:
        raise ValueError("Argument `sky` must send light, but is dark.")
    density = (1.0 - floor) * L / L.mean() + floor  # over that of even directions
    columns = 2 * rows
    u = (np.arange(rows) + 0.5 + shift[0]) / rows
    v = (np.arange(columns) + 0.5 + shift[1]) / columns
    row, inside = _inverted(density.sum(1), u)
    found = [_inverted(density[r], v) for r in row]
    column, across = (np.stack(a) for a in zip(*found, strict=True))
    z = 2.0 * (row + inside) / FINE - 1.0
    phi = _FULL * (column + across) / (2 * FINE)
    z = np.repeat(z, columns)
    w = cylindrical(jnp.asarray(np.sqrt(1.0 - z * z)), jnp.asarray(phi.ravel()), jnp.asarray(z))
    share = jnp.asarray(1.0 / (density[row[:, None], column].ravel() * rows * columns))
    return DistantLight(
        w, -w * (2.0 * _FULL * share)[:, None], jax.vmap(sky)(w), (rows, columns), False
    )  # fmt: skip


def _inverted(weights: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell in which a share u of all weight ends, and the share of that cell."""
    ends = np.concatenate([[0.0], np.cumsum(weights)]) / weights.sum()
    cell = np.clip(np.searchsorted(ends, u, side="right") - 1, 0, len(weights) - 1)
    return cell, np.minimum((u - ends[cell]) / (ends[cell + 1] - ends[cell]), 1.0)


class CosineSkyLight(Module):
    r"""A sky as directions about a surface's normal n: cells that light it alike.

    Rows end at `n . w = sqrt(k / rows)`, so that each cell has the same `integral of n . w dw`; the
    node is the middle of a cell in `n . w` and counts its solid angle, which makes that integral
    and the solid angle exact. Shifted nodes keep the solid angle; the integral errs in proportion
    to the first shift, so that it is exact for the mean of opposite ones, as an image's passes are
    (`rendering.renderer`: after an odd number of them). Errors of smooth light fall with the power
    3/2 of the rows, for the value and for what a turning normal changes.

    Beside a ball on a floor under a bright zenith, light errs 2.5 to 3.3 times less than with as
    many rays of `_dome` (8 to 32 rows), and what its moving shadow adds to the gradient 6 to 7
    times less (16 and 64 rows). Nothing is known here of mirrors and small suns.

    The lattice turns with the base surface, and gradients are those of light from directions that
    stay: on a curved surface they are the derivative of what is rendered up to that error.

    Args:
        sky: radiance from unit vectors.
        rows: of nodes; twice as many columns.
        shift: of the nodes out of the middles of their cells, in cells, in [-1/2, 1/2].

    Raises:
        ValueError: if there is no row.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import ConstantSky
        >>> from firstorder.imaging import CosineSkyLight
        >>> n = jnp.array([0.6, 0.0, 0.8])
        >>> light = CosineSkyLight(ConstantSky(1.0), 4).about(n)
        >>> round(-jnp.sum(light.area @ n).item(), 12)  # pi
        3.14159265359
    """

    sky: Sky
    rows: int = eqx.field(static=True)
    shift: Float[Array, "2"] = eqx.field(converter=as_float, default=(0.0, 0.0))

    def __check_init__(self):
        """Refuse a sky without nodes."""
        check_count("rows", self.rows)

    @property
    def near(self) -> bool:
        """Whether nodes stay in place when the point moves: they move with it."""
        return False

    @property
    def even(self) -> bool:
        """Whether the nodes are the middles of equal cells: in `(n . w)^2` and the azimuth."""
        return True

    @property
    def wraps(self) -> bool:
        """Whether the last column is a neighbour of the first: the azimuth goes around."""
        return True

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of nodes."""
        return self.rows, 2 * self.rows

    def about(self, n: Direction) -> DistantLight:
        """Light with its nodes above a surface of unit normal n."""
        local, frame = self.local, orthonormal_frame(n)
        w, area = local.way @ frame.T, local.area @ frame.T
        L = jax.vmap(self.sky)(w)
        return DistantLight(w, area, L, self.shape, True, n, local.steep)

    @property
    def local(self) -> DistantLight:
        """The nodes of every surface in its own frame (`orthonormal_frame`), with radiance 1."""
        rows, columns = self.shape
        ends = np.sqrt(np.arange(rows + 1) / rows)
        width = np.repeat(np.diff(ends), columns)
        z = np.repeat(0.5 * (ends[1:] + ends[:-1]), columns) + self.shift[0] * width
        phi = _FULL / columns * (jnp.tile(jnp.arange(columns) + 0.5, rows) + self.shift[1])
        w = cylindrical(jnp.sqrt(jnp.maximum(1.0 - z * z, 0.0)), phi, z)
        area = -w * (_FULL / columns * width)[:, None]
        return DistantLight(w, area, jnp.ones(len(w), w.dtype), self.shape, True, steep=1.0 / width)


def sky_light(
    sky: Any, kind: str, rows: int, shift: tuple[float, float] = (0.0, 0.0)
) -> DistantLight | CosineSkyLight:
    """A sky as nodes of some kind.

    Args:
        sky: a function, radiance from unit vectors.
        kind: "even" (`_dome`), "cosine" (`CosineSkyLight`) or "luminance" (`_by_luminance`).
        rows: of nodes; twice as many columns.
        shift: of the nodes out of the middles of their cells, in cells.

    Raises:
        ValueError: if the kind is not known, there is no row, or the sky is no function.

    Example:
        >>> from firstorder.space import ConstantSky
        >>> from firstorder.imaging import sky_light
        >>> sky_light(ConstantSky(1.0), "cosine", 4).shape
        (4, 8)
    """
    if not callable(sky):
        raise ValueError(
            "Argument `sky` must be a function of a direction, such as "
            f"space.skies.ConstantSky(1.0), but is {sky!r}."
        )
    match kind:
        case "even":
            return _dome(sky, rows, shift)
        case "cosine":
            return CosineSkyLight(sky, rows, shift)
        case "luminance":
            return _by_luminance(sky, rows, shift)
    raise ValueError(f"Argument `sky_nodes` must be even, cosine or luminance, but is {kind!r}.")


def distant_lamp(lamp: Lamp, place: Direction) -> DistantLight:
    """A lamp as seen from one place, taken to look so from everywhere.

    Right at the place; elsewhere the radiance is wrong by SV times the way from there, to first
    order, and the gradient by SV. Where CDV is much larger (R07's far light) little is lost.

    Args:
        lamp: near light.
        place: such as the middle of an object [m].

    Reference: R07 §5.2, "light sources could be treated as distant".

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import Lamp
        >>> from firstorder.imaging import distant_lamp
        >>> far = distant_lamp(Lamp((0, 0, 9), (0, 1, 0), (1, 0, 0), count=1), jnp.zeros(3))
        >>> far.way.tolist(), far.near
        ([[0.0, 0.0, 9.0]], False)
    """
    way, area = lamp.toward(place)
    radiance = jnp.broadcast_to(lamp.radiance, (way.shape[0], *lamp.radiance.shape))
    return DistantLight(way, area, radiance, lamp.shape, False)
