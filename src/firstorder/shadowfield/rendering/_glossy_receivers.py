r"""Glossy receivers under shared shadow rays: light times BRDF in each cell of the lamp.

E11 §3 pulls the form factor out of the shadow's integral, and §7 proposes for other BRDFs to put
light times BRDF in place of light. Here the lamp is cut into cells, as in `sheared_filter`. With
the seen share V_c of each cell, from `gather`, the reflected radiance is

    L(x) = sum_c V_c(x) int_c l(y) K(x, y) rho(x, y) dy,    K = cos_x cos_y / |x - y|^2
    rho = albedo / pi + specular (e + 2) / (2 pi) cos^e(w, mirrored eye)

with integrals by a few nodes of each cell. One cell is the paper's factoring. What is left out is
the covariance, inside each cell, of visibility with what multiplies it: see the figures'
`cell_factoring`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_kind,
    check_not_negative,
    check_positive,
    check_shape,
)
from firstorder._display import in_print
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering._filter_shape import filter_shape, or_lit, own_share
from firstorder.shadowfield.rendering._weighted_sums import gather
from firstorder.shadowfield.rendering.depth_bounds import _check_each, _known_depths
from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows
from firstorder.shadowfield.rendering.ray_table import Plane, RayTable, _check_rays

AT_ONCE = 1 << 20  # receivers times nodes

Numbers = Float[np.ndarray, " m"]
Cells = Float[np.ndarray, "m c"]
Points = Float[np.ndarray, "m 3"]
Falloff = Callable[[Plane], Float[np.ndarray, " n"]]


class GlossySurface(NamedTuple):
    """Diffuse and glossy reflection at receivers: normals, directions to the eye, albedo, lobes.

    Attributes:
        normal: unit vectors, towards the lit side.
        to_eye: unit vectors towards the eye.
        albedo: share of light that is reflected evenly.
        specular: share that goes into the lobe at normal incidence; less at a slant.
        exponent: e of the lobe `cos^e` about the mirrored direction of the eye, not negative.
    """

    normal: Points
    to_eye: Points
    albedo: Numbers
    specular: Numbers
    exponent: Numbers

    __repr__ = in_print


def glossy_surface(
    normal: Points,
    to_eye: Points,
    albedo: float | int | Numbers = 0.0,
    specular: float | int | Numbers = 0.0,
    exponent: float | int | Numbers = 1.0,
) -> GlossySurface:
    """Receivers of one or of many materials.

    Args:
        normal: at each receiver, of any length.
        to_eye: from each receiver towards the eye, of any length.
        albedo: of the even part.
        specular: of the lobe.
        exponent: of the lobe.

    Raises:
        ValueError: if shares or exponents are negative, vectors have no direction, or shapes do not
            fit.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import glossy_surface
        >>> up = np.array([[0.0, 0.0, 2.0]])
        >>> glossy_surface(up, up, specular=0.5, exponent=20.0).normal.tolist()
        [[0.0, 0.0, 1.0]]
    """
    unit = []
    for name, a in (("normal", normal), ("to_eye", to_eye)):
        a = np.asarray(a, float)
        check_shape(name, a, (len(np.asarray(normal)), 3))
        length = np.linalg.norm(a, axis=1, keepdims=True)
        check_positive(name, length)
        unit.append(a / length)
    parts = []
    for name, value in (("albedo", albedo), ("specular", specular), ("exponent", exponent)):
        check_not_negative(name, value)
        if np.ndim(value):
            check_shape(name, np.asarray(value), (len(unit[0]),))
        parts.append(np.broadcast_to(np.asarray(value, float), len(unit[0])))
    return GlossySurface(*unit, *parts)


# --- integrals over cells of the lamp ------------------------------------------------------------


def cell_light(
    lamp: LampFrame,
    receivers: Points,
    surface: GlossySurface,
    cells: int,
    falloff: Falloff | None = None,
    nodes: int = 4,
) -> Cells:
    """Reflected radiance that each cell of a lamp without blockers brings, in `gather`'s order.

    Args:
        lamp: the lamp; its radiance is `falloff`.
        receivers: in the world [m].
        surface: what they reflect.
        cells: along each edge of the lamp.
        falloff: radiance over the lamp, from places in [-1, 1]^2; None for 1.
        nodes: Gauss-Legendre nodes along each edge of a cell.

    Valid when: the lobe is no narrower than the nodes' distance as the receiver sees it. Where the
    receiver's horizon cuts a cell, nodes converge slowly.

    Reference: E11 §7, "General BRDFs".

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering._glossy_receivers import cell_light
        >>> from firstorder.shadowfield import glossy_surface
        >>> from firstorder.shadowfield import lamp_frame
        >>> lamp = lamp_frame((0, 0, 1), (0, 0.01, 0), (0.01, 0, 0))  # 4e-4 m^2, 1 m above
        >>> up = np.array([[0.0, 0.0, 1.0]])
        >>> light = cell_light(lamp, 0 * up, glossy_surface(up, up, albedo=np.pi), 2)
        >>> (1e4 * light).round(2).tolist()
        [[1.0, 1.0, 1.0, 1.0]]
    """
    check_count("nodes", nodes)
    g, w = np.polynomial.legendre.leggauss(nodes)
    parts = [
        (k.value * k.light * (w[:, None, None] * w)).sum((2, 4))
        for k in integrand(lamp, receivers, surface, cells, g, falloff)
    ]
    area = np.prod(lamp.half) / cells**2  # of the place [-1, 1]^2 of a cell
    none = np.zeros((0, cells, cells))  # there may be no receivers
    return area * np.concatenate([none, *parts]).reshape(len(receivers), cells**2)


class Integrand(NamedTuple):
    """Light times BRDF at nodes: axes are receivers, cells and nodes along either edge."""

    value: Float[np.ndarray, "k a p b q"]  # K rho
    light: Float[np.ndarray, "a p b q"]  # l


def integrand(
    lamp: LampFrame,
    receivers: Points,
    surface: GlossySurface,
    cells: int,
    places: Float[np.ndarray, " p"],
    falloff: Falloff | None,
) -> Iterator[Integrand]:
    """Products of light and BRDF over the lamp, for as many receivers at once as memory allows.

    All cosines are linear over the lamp, so they are sums of one number for each axis.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        surface: what they reflect.
        cells: along each edge of the lamp.
        places: of nodes along each edge of a cell, in [-1, 1].
        falloff: radiance over the lamp, from places in [-1, 1]^2; None for 1.
    """
    check_count("cells", cells)
    check_finite("receivers", receivers)
    x = ((2.0 * np.arange(cells)[:, None] + 1.0 + places) / cells - 1.0).ravel()
    shape = (cells, len(places), cells, len(places))
    light = np.ones(shape)
    if falloff is not None:
        plane = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
        light = np.asarray(falloff(plane), float).reshape(shape)
    at = lamp.local(np.asarray(receivers, float))
    normal = surface.normal @ lamp.axes.T
    slant = np.sum(surface.normal * surface.to_eye, 1, keepdims=True)
    mirrored = (2.0 * slant * surface.normal - surface.to_eye) @ lamp.axes.T
    step = max(AT_ONCE // len(x) ** 2, 1)
    for begin in range(0, len(at), step):
        some = slice(begin, begin + step)
        p = at[some]
        first = x * lamp.half[0] - p[:, :1]  # the way to the lamp, one axis each
        second = x * lamp.half[1] - p[:, 1:2]

        def along(d, first=first, second=second, p=p):
            a = d[:, :1] * first - d[:, 2:] * p[:, 2:]
            return np.maximum(a[:, :, None] + (d[:, 1:2] * second)[:, None], 0.0)

        square = (first**2 + p[:, 2:] ** 2)[:, :, None] + (second**2)[:, None]
        depth = np.maximum(p[:, 2], 0.0)[:, None, None]
        albedo, specular, e = (a[some, None, None] for a in surface[2:])
        across = along(mirrored[some]) / np.sqrt(square)
        lobe = np.where(across > 0.0, across**e, 0.0)  # 0^0 would be light from behind
        rho = albedo / np.pi + specular * (e + 2.0) / (2.0 * np.pi) * lobe
        value = along(normal[some]) * depth / square**2 * rho
        yield Integrand(value.reshape(-1, *shape), light)


# --- shadows -------------------------------------------------------------------------------------


class CellVisibility(NamedTuple):
    """Visibility of each cell of the lamp at receivers; NaN for receivers not below it.

    Attributes:
        cells: share of each cell that is seen, in `gather`'s order.
        samples: effective number of shared rays.
        own: 1 among the blockers, or where no ray came by: there `cells` says nothing.
    """

    cells: Cells
    samples: Numbers
    own: Numbers


def cell_visibility(
    lamp: LampFrame,
    table: RayTable,
    receivers: Points,
    Omega_y: float | int,
    pixel: float,
    cells: int = 4,
    bounds: tuple[Numbers, Numbers] | None = None,
) -> CellVisibility:
    """Visibility of the lamp's cells at receivers, from rays that were traced anywhere.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receivers [m].
        cells: along each edge of the lamp.
        bounds: of the blockers' depths at each receiver; by default those of `blocker_depths`.

    Reference: E11 §5, before it sums over the lamp.
    """
    check_count("cells", cells)

    def answer(points, bounds) -> CellVisibility:
        local = lamp.local(points)
        near, far = _known_depths(lamp, table, points, pixel, bounds)
        shape = filter_shape(local[:, 2], near, far, Omega_y, pixel, float(np.max(lamp.half)))
        sums = gather(lamp, table, local, shape.sigma, shape.shear, cells)
        return CellVisibility(or_lit(sums.seen, sums).T, sums.samples, own_share(sums, near, shape))

    found = where_below(lamp, receivers, answer, bounds)
    return found._replace(cells=found.cells.T)


class ShearedReflection(NamedTuple):
    """Radiance that glossy receivers send to the eye; NaN for receivers not below the lamp.

    Attributes:
        radiance: reflected, in units of the lamp's.
        unshadowed: the same without blockers.
        samples: effective number of shared rays.
        own: share of `fallback` in it.
    """

    radiance: Numbers
    unshadowed: Numbers
    samples: Numbers
    own: Numbers

    __repr__ = in_print


def sheared_reflection(
    lamp: LampFrame,
    table: RayTable,
    receivers: Points,
    surface: GlossySurface,
    Omega_y: float | int,
    pixel: float,
    fallback: Numbers,
    cells: int = 4,
    falloff: Falloff | None = None,
    bounds: tuple[Numbers, Numbers] | None = None,
    nodes: int = 4,
) -> ShearedReflection:
    """Radiance that receivers reflect of a partly hidden lamp, from rays traced anywhere.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        surface: what they reflect.
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receivers [m].
        fallback: what to take among the blockers: the radiance by rays of each receiver's own;
            elsewhere it may be NaN.
        cells: along each edge of the lamp.
        falloff: radiance over the lamp, from places in [-1, 1]^2; None for 1.
        bounds: of the blockers' depths at each receiver; by default those of `blocker_depths`.
        nodes: Gauss-Legendre nodes along each edge of a cell.

    Valid when: a cell is small beside the lobe; else off by up to
    `worst_factoring`. Smaller cells hold fewer rays: a sharp lobe shares less, as
    E11 §7 foresees.

    Raises:
        TypeError: if lamp, table or surface are none.
        ValueError: if shapes do not fit, or a number that must be positive is not.

    Reference: E11 §7; the cells are ours.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import glossy_surface
        >>> from firstorder.shadowfield import sheared_reflection
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield import trace_shadow_rays
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> def left_half(a, b):  # a sheet close to the lamp
        ...     hit = b[:, 0] < 0
        ...     return np.where(hit, 0.001, np.inf), np.where(hit, 0.001, -np.inf)
        >>> place, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
        >>> table, _ = trace_shadow_rays(lamp, place, 256, left_half)
        >>> mirror = glossy_surface(up, up, specular=1.0, exponent=50.0)
        >>> found = sheared_reflection(lamp, table, place, mirror, 1.0, 0.1, np.zeros(1))
        >>> (found.radiance / found.unshadowed).round(3).tolist()
        [0.5]
    """
    _check_rays(lamp, table)
    check_kind("surface", surface, GlossySurface, "a surface of `glossy_surface`")
    at = _receiver_rows(receivers)
    check_shape("surface", surface.normal, at.shape)
    _check_each(len(at), fallback, bounds)

    def answer(points, surface, fallback, bounds) -> ShearedReflection:
        light = cell_light(lamp, points, surface, cells, falloff, nodes)
        seen = cell_visibility(lamp, table, points, Omega_y, pixel, cells, bounds)
        known = np.where(seen.own > 0.0, fallback, 0.0)
        radiance = (1.0 - seen.own) * np.sum(light * seen.cells, 1) + seen.own * known
        return ShearedReflection(radiance, np.sum(light, 1), seen.samples, seen.own)

    return where_below(lamp, at, answer, surface, np.asarray(fallback), bounds)
