"""The spectrum of a scene's light in a box of ray space, in closed form.

Over (x, v) the silhouette of a point is a straight line. Where every silhouette is a point and the
light is uniform, the field is constant on polygons, and Gauss' theorem leaves its edges alone:

    F(Omega) = int_box f exp(-2 pi i Omega . u) du
             = sum_edges J (Omega x e) exp(-2 pi i Omega . m) sinc(Omega . e) i / (2 pi |Omega|^2)

with the middle m, the vector e and the jump J of each straight piece. A piece ends where two lines
of silhouettes cross (two points in line with the eye), for there the jump changes.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import is_concrete, nan_unless
from firstorder.conventions import Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.flatland.light_fields.field import LightField
from firstorder.flatland.shapes.kinds import Segments
from firstorder.flatland.skies import ConstantSky
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.typing import ComplexScalar, Frequency


class StraightEdges(Spectrum):
    """Transform of a function that is constant on polygons and zero far away, from its edges.

    Exact. The rounding error, relative to the function's integral, grows as eps / |Omega| towards
    zero frequency, which has a formula of its own.

    Attributes:
        middle: of each straight piece.
        along: from its start to its end.
        jump: value to the left of it less value to the right.
        frame: of the function, two coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.flatland import StraightEdges
        >>> right, up = jnp.array([1.0, 0.0]), jnp.array([0.0, 1.0])  # a square, walked around
        >>> middle = 0.5 * jnp.stack([-up, right, up, -right])
        >>> F = StraightEdges(middle, jnp.stack([right, up, -right, -up]), jnp.ones(4),
        ...                   FLATLAND_SLOPE)
        >>> F(0.0, 0.0).real.item(), round(F(0.5, 0.0).real.item(), 6)  # sinc
        (1.0, 0.63662)
    """

    middle: Float[Array, "m 2"]
    along: Float[Array, "m 2"]
    jump: Float[Array, " m"]
    frame: Frame = eqx.field(static=True)

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Closed form."""
        square = dot_2d(Omega, Omega)
        safe = jnp.where(square > 0.0, square, 1.0)
        wave = fourier_kernel(Omega, self.middle) * jnp.sinc(self.along @ Omega)
        across = cross_2d(jnp.broadcast_to(Omega, self.along.shape), self.along)
        F = jnp.sum(self.jump * across * wave) * (0.5j / (jnp.pi * safe))
        area = 0.5 * jnp.sum(self.jump * cross_2d(self.middle, self.along))
        return jnp.where(square > 0.0, F, area)


def spectrum_in(light: LightField, window: Grid) -> StraightEdges:
    """The transform of a light field over slopes, restricted to a box, at any frequency.

    Valid for: segments with uniform emission, under no sky or the same sky everywhere.

    Args:
        light: over (x, v).
        window: the box; its size does not matter.

    Raises:
        Refused: where there is no closed form, with the reason; among them a shape that the line
            passes through inside the box (NaN if traced).

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import Grid
        >>> from firstorder.flatland import Receiver, Scene, Segments, light_field, primitive
        >>> from firstorder.flatland.light_fields import spectrum_in
        >>> lamp = Scene.of(primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0))
        >>> L = light_field(lamp, Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)
        >>> F = spectrum_in(L, Grid.spanning((8, 8), (5.0, 1.0)))
        >>> round(F(0.0, 0.0).real.item(), 6)  # a strip of width 2 and height 2
        4.0
    """
    _refuse(light, window)
    low, high = _corners(window, light.line.position.dtype)
    a, h = _lines(light)
    pieces = [_edge(light, a, h, low, high), *_sides(light, a, h, low, high)]
    middle, along, jump = (jnp.concatenate(rows) for rows in zip(*pieces, strict=True))
    return StraightEdges(middle, along, nan_unless(~_pierced(light, window), jump), light.frame)


def series_in(light: LightField, window: Grid) -> Series:
    """The Fourier series of a light field on a box, from `spectrum_in` at its harmonics.

    Args:
        light: over slopes, of a scene of straight shapes.
        window: the box, and how many waves.

    Raises:
        Refused: if the silhouettes or the light have no closed form: round shapes, angles, skies.
    """
    F = spectrum_in(light, window)
    axes = [jnp.asarray(window.frequencies(i)) for i in range(2)]
    nodes = jnp.stack(jnp.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    area = window.extent[0] * window.extent[1]
    return Series(nodes, jax.lax.map(F.at, nodes, batch_size=1024) / area)


def _refuse(light: LightField, window: Grid) -> None:
    """Say why there is no closed form, if there is none."""
    scene = light.scene
    if not light.frame.uses_slopes:
        raise Refused("silhouettes are curved over angles: take the light field over slopes")
    if not all(isinstance(group, Segments) for group in scene.groups):
        raise Refused("the silhouettes of round shapes are curved, also over slopes: sample it")
    uniform = scene.environment is None or isinstance(scene.environment, ConstantSky)
    if light.radiance is not None or not uniform:
        raise Refused("light that varies between silhouettes has no closed-form series: sample it")
    if not is_concrete((light, window)):
        return
    with jax.ensure_compile_time_eval():  # a law asks from inside a traced function
        pierced = bool(_pierced(light, window))
    if pierced:
        raise Refused("the line passes through a shape, where the light jumps from x to x: move it")


def _corners(window: Grid, dtype) -> tuple[Array, Array]:
    """The box's corners."""
    center, extent = (
        jnp.stack([jnp.asarray(e, dtype) for e in p]) for p in (window.center, window.extent)
    )
    return center - 0.5 * extent, center + 0.5 * extent


def _lines(light: LightField) -> tuple[Array, Array]:
    """All silhouettes `x = a + h v`; h is not positive, in the line's sense, for those unseen.

    The common end of two segments is one edge: the jump beside it is that of both.
    """
    line = light.line
    points, valid = light.scene.silhouettes(line.position, line.on)
    gap = points - line.position
    a, h = gap @ line.tangent, jnp.where(valid, gap @ line.normal, 0.0)
    eps = jnp.finfo(a.dtype).eps
    near = eps**0.75 * jnp.max(jnp.abs(h), initial=0.0) + 16.0 * eps * jnp.max(
        jnp.abs(line.position)
    )
    same = (jnp.abs(a[:, None] - a) <= near) & (jnp.abs(h[:, None] - h) <= near)
    again = jnp.any(same & np.tri(a.size, k=-1, dtype=bool), 1)
    return a, jnp.where(again, 0.0, h)


def _pierced(light: LightField, window: Grid) -> Array:
    """Whether a segment meets the line inside the box."""
    found = jnp.zeros((), bool)
    low, high = _corners(window, light.line.position.dtype)
    first = 0
    for group in light.scene.groups:
        assert isinstance(group, Segments)  # of anything else there is no series
        gaps = [p - light.line.position for p in (group.start, group.end)]
        (a, h), (b, k) = ((g @ light.line.tangent, g @ light.line.normal) for g in gaps)
        own = jnp.arange(first, first + group.count) == light.line.on
        flat = (h == 0.0) & (k == 0.0)
        through = (h * k <= 0.0) & ~flat
        place = a + jnp.where(through, h / jnp.where(through, h - k, 1.0), 0.0) * (b - a)
        inside = (place > low[0]) & (place < high[0])
        along = (jnp.minimum(a, b) < high[0]) & (jnp.maximum(a, b) > low[0])
        found |= jnp.any(~own & ((through & inside) | (flat & along)))
        first += group.count
    return found


def _edge(light: LightField, a, h, low, high):
    """The pieces of every silhouette's line inside the box, and their jumps."""
    sign = light.facing
    ahead = sign * h > 0.0
    steep = jnp.where(ahead, h, 1.0)
    ends = jnp.stack([(low[0] - a) / steep, (high[0] - a) / steep])
    start = jnp.clip(jnp.min(ends, 0), low[1], high[1])
    stop = jnp.clip(jnp.max(ends, 0), low[1], high[1])
    apart = h[:, None] - h[None]
    met = (a[None] - a[:, None]) / jnp.where(apart == 0.0, 1.0, apart)
    met = jnp.where(apart == 0.0, start[:, None], met)
    cuts = jnp.sort(jnp.clip(met, start[:, None], stop[:, None]), 1)
    cuts = jnp.concatenate([start[:, None], cuts, stop[:, None]], 1)
    v, dv = 0.5 * (cuts[:, 1:] + cuts[:, :-1]), cuts[:, 1:] - cuts[:, :-1]
    x, dx = a[:, None] + h[:, None] * v, h[:, None] * dv
    jumps = jax.vmap(jax.vmap(lambda x, v, h: _jump(light, x, v, h), (0, 0, None)))(x, v, steep)
    jumps = jnp.where(ahead[:, None], sign * jumps, 0.0)
    return _rows(x, v), _rows(dx, dv), jumps.ravel()


def _jump(light: LightField, x, v, h):
    """Light beside a silhouette's ray, on the counter-clockwise side less on the other."""
    theta = jnp.arctan(v)
    numbers, angles = light.beside(x, theta, jnp.abs(h) * jnp.sqrt(1.0 + v * v))
    low, high = (light.sent(numbers[i], x, angles[i]) for i in range(2))
    return jnp.where(numbers[0] == numbers[1], 0.0, high - low)


def _sides(light: LightField, a, h, low, high):
    """The four sides of the box, walked counter-clockwise, cut where silhouettes meet them."""
    steep = jnp.where(h == 0.0, 1.0, h)
    for i, (fixed, sense) in enumerate(
        ((low[1], 1.0), (high[0], 1.0), (high[1], -1.0), (low[0], -1.0))
    ):
        runs = i % 2  # which coordinate runs along this side
        met = jnp.where(h == 0.0, low[1], (fixed - a) / steep) if runs else a + h * fixed
        met = jnp.sort(jnp.clip(met, low[runs], high[runs]))
        cuts = jnp.concatenate([low[runs][None], met, high[runs][None]])
        middle, step = 0.5 * (cuts[1:] + cuts[:-1]), sense * (cuts[1:] - cuts[:-1])
        still = jnp.broadcast_to(fixed, middle.shape)
        m = _rows(still, middle) if runs else _rows(middle, still)
        e = _rows(0.0 * step, step) if runs else _rows(step, 0.0 * step)
        yield m, e, jax.vmap(light.at)(m)


def _rows(x, v) -> Float[Array, "m 2"]:
    """Points, one a row."""
    return jnp.stack([x.ravel(), v.ravel()], -1)


__all__ = ["StraightEdges", "series_in", "spectrum_in"]
