"""Light through glass: exact irradiance and caustics by differentiable ray maps.

A light sends rays that one number q tells apart: an angle (point light) or an offset (beam). A
*path* says what a ray does on its way: through which shape it goes, from which it is reflected.
Following it gives the place x(q) on a receiver and the share T(q) of the power that Fresnel's law
leaves. Power is kept, so

    E(x) = sum over branches q with x(q) = x of P T(q) / |dx/dq|,   P the power in each unit of q.

Branches meet, and E is infinite, at folds `dx/dq = 0`: there the receiver crosses the caustic, the
envelope of the rays. Everything is exact and differentiable but for the search of the branches.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import (
    check_finite,
    check_index,
    check_not_negative,
    nan_unless,
    not_negative,
)
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.intersect import first_shape
from firstorder.flatland.scene import Scene
from firstorder.numerics._order import order_of
from firstorder.scene._arguments import numbers
from firstorder.transport.events.interface import _dielectric
from firstorder.typing import as_float

THROUGH, BACK, END = KINDS = "through", "back", "end"
MOST_BRANCHES = 8
MOST_RIMS = 16  # where rays begin or end: each thing in their way has two
BISECTIONS = 48

Path = Sequence[tuple[int, str]]


class PointSource(Module):
    """A point light; q is the world angle of a ray, counter-clockwise from +y [rad].

    Args:
        position: [m].
        power: intensity [W/rad].

    Raises:
        ValueError: if a number is not finite or the power is negative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import PointSource
        >>> origin, along = PointSource((0.0, 1.0)).ray(jnp.array(0.0))
        >>> along.tolist()
        [-0.0, 1.0]
    """

    position: Float[Array, "2"] = eqx.field(converter=as_float)
    power: Float[Array, ""] = eqx.field(default=1.0, converter=lambda p: not_negative(as_float(p)))

    def __check_init__(self):
        """Refuse light that is no light."""
        check_finite("position", self.position)
        check_not_negative("power", self.power)

    def ray(self, q):
        """Origin and direction of the ray q."""
        return self.position, direction(q)


class Beam(Module):
    """Parallel light; q is the offset of a ray to the right of the middle one [m].

    Args:
        position: where the middle ray starts [m].
        angle: where all go, counter-clockwise from +y [rad].
        power: power in each metre across [W/m].

    Raises:
        ValueError: if a number is not finite or the power is negative.

    Example:
        >>> from firstorder.flatland import Beam
        >>> origin, along = Beam((0.0, 1.0), 0.0).ray(0.5)
        >>> origin.tolist()
        [0.5, 1.0]
    """

    position: Float[Array, "2"] = eqx.field(converter=as_float)
    angle: Float[Array, ""] = eqx.field(converter=as_float)
    power: Float[Array, ""] = eqx.field(default=1.0, converter=lambda p: not_negative(as_float(p)))

    def __check_init__(self):
        """Refuse light that is no light."""
        check_finite("position", self.position)
        check_not_negative("power", self.power)

    def ray(self, q):
        """Origin and direction of the ray q."""
        across = jnp.stack([jnp.cos(self.angle), jnp.sin(self.angle)])
        return self.position + q * across, direction(self.angle)


class RayEnd(Module):
    """The end of a ray.

    Attributes:
        position: where it ends, or where the last step of its path was [m].
        along: its direction there.
        s: parameter on the receiver.
        share: of the power that it still carries.
        ok: whether it could follow its path and nothing stood in its way.
    """

    position: Float[Array, "2"]
    along: Float[Array, "2"]
    s: Float[Array, ""]
    share: Float[Array, ""]
    ok: Bool[Array, ""]


def fresnel_reflectance(eta: ArrayLike, cosine: ArrayLike) -> Array:
    """Fresnel's reflectance for unpolarised light, 1 beyond the critical angle.

    Args:
        eta: index behind the interface over that before it, a number or an array.
        cosine: of the angle of incidence, positive, a number or an array.

    Returns:
        In [0, 1], of the shape to which both broadcast.

    Example:
        >>> from firstorder.flatland import fresnel_reflectance
        >>> round(float(fresnel_reflectance(1.5, 1.0)), 12)
        0.04
    """
    return _dielectric(as_float(eta), as_float(cosine))[0]


def _refracted(
    along: Float[Array, "2"], normal: Float[Array, "2"], eta: Float[Array, ""]
) -> tuple[Float[Array, "2"], Bool[Array, ""]]:
    """Snell's law with vectors: `t = (u + (c - g) n) / eta`, `g = sqrt(eta^2 - 1 + c^2)`.

    Args:
        along: direction of the ray, a unit vector u.
        normal: unit normal n on the side that the ray comes from; `c = -u . n > 0`.
        eta: index behind the interface over that before it.

    Returns:
        The direction behind the interface, and whether there is one (no total reflection).
    """
    c = -jnp.sum(along * normal)
    square = eta**2 - 1.0 + c**2
    ok = square > 0.0
    g = jnp.sqrt(jnp.where(ok, square, 1.0))
    return jnp.where(ok, (along + (c - g) * normal) / eta, along), ok


def trace_path(
    scene: Scene,
    path: Path,
    origin: ArrayLike,
    along: ArrayLike,
    receiver: int | None = None,
) -> RayEnd:
    """Follows one ray along a path: refracted and reflected where the path says so.

    Valid for: shapes with `ior` set. On the way nothing else may be met first.

    Args:
        scene: shapes; `ior` is the index behind a front over that before it.
        path: steps (shape, `THROUGH` or `BACK`), in order.
        origin: where the ray starts, two coordinates [m].
        along: its direction, a unit vector.
        receiver: the shape on which it should end; None to stop after the last step.

    Raises:
        ValueError: if a step is neither `THROUGH` nor `BACK`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Circles, Scene, Segments, primitive, trace_path
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> scene = Scene.of(floor, primitive(Circles((0.0, 2.0), 1.0), ior=1.5))
        >>> through = ((1, "through"), (1, "through"))
        >>> end = trace_path(scene, through, jnp.array([0.0, 4.0]), jnp.array([0.0, -1.0]), 0)
        >>> round(end.share.item(), 4)  # 0.96 at each surface
        0.9216
    """
    for number, kind in path:
        if kind not in (THROUGH, BACK):
            raise ValueError(f"Argument `path` must say 'through' or 'back', but says {kind!r}.")
        check_index("path", number, scene.count)
    origin, along = numbers("origin", origin), numbers("along", along)
    # A loop carries one precision from step to step: that which scene and ray make together.
    known = jax.tree.leaves(eqx.filter(scene, eqx.is_inexact_array))
    dtype = jnp.result_type(origin, along, *known)
    origin, along = jnp.asarray(origin, dtype), jnp.asarray(along, dtype)
    steps = [*path, *([] if receiver is None else [(receiver, END)])]
    shapes = jnp.asarray([number for number, _ in steps], jnp.int32)
    kinds = jnp.asarray([KINDS.index(kind) for _, kind in steps], jnp.int32)

    def go(ray, step):
        origin, along, share, ok, on, _ = ray
        number, kind = step
        passes, ends = kind == KINDS.index(THROUGH), kind == KINDS.index(END)
        origin, s, met = _met(scene, number, origin, along, on)
        frame = scene.frame(number, s)
        facing = -jnp.sum(frame.normal * along)
        ior = scene.material.ior[number]
        safe = jnp.where(ior > 0.0, ior, 1.0)
        eta = jnp.where(facing > 0.0, safe, 1.0 / safe)
        normal = jnp.where(facing > 0.0, 1.0, -1.0) * frame.normal
        R = fresnel_reflectance(eta, jnp.abs(facing))
        inside, there = _refracted(along, normal, eta)
        mirrored = along + 2.0 * jnp.abs(facing) * normal
        along = jnp.where(ends, along, jnp.where(passes, inside, mirrored))
        share = share * jnp.where(ends, 1.0, jnp.where(passes, 1.0 - R, R))
        ok = ok & met & (ends | (ior > 0.0)) & (there | ~passes)
        return (origin, along, share, ok, number, jnp.where(ends, s, 0.0)), None

    # A loop and not one copy a step: to compile each takes longer than to follow many rays.
    zero, one = jnp.zeros((), dtype), jnp.ones((), dtype)
    start = origin, along, one, jnp.asarray(True), jnp.asarray(-1, jnp.int32), zero
    (origin, along, share, ok, _, s), _ = jax.lax.scan(go, start, (shapes, kinds))
    return RayEnd(origin, along, s, jnp.where(ok, share, 0.0), ok)


def _met(scene: Scene, which, origin, along, on):
    """The point of a shape that a ray meets, and whether it is the first hit."""
    t, s = scene.hit(which, origin, along, on)
    first = first_shape(scene, origin[None], along[None], on[None])[0]
    there = jnp.isfinite(t) & (first == which)
    return origin + jnp.where(there, t, 0.0) * along, jnp.where(there, s, 0.0), there


class Caustic(Module):
    """A light, the path of its rays, and the receiver that they reach.

    Args:
        scene: shapes, those that refract with an `ior`.
        light: `PointSource` or `Beam`.
        path: see `trace_path`.
        receiver: number of the shape that receives; it must not be closed.
        low, high: the rays that count, by q.
        samples: cells among which branches and folds are looked for. Two folds must not fall into
            one cell.

    Example:
        >>> from firstorder.flatland import Circles, Scene, Segments, primitive
        >>> from firstorder.flatland import Beam, Caustic, through_body
        >>> ball = primitive(Circles((0.0, 0.9), 0.5), ior=1.5)
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> light = Beam((0.0, 3.0), 3.14159265)
        >>> lens = Caustic(Scene.of(ball, floor), light, through_body(1), 0, -0.5, 0.5)
        >>> bool(lens.irradiance(0.5) > 1.0)  # more than the beam's 1 W/m
        True
    """

    scene: Scene
    light: PointSource | Beam
    path: tuple[tuple[int, str], ...] = eqx.field(static=True)
    receiver: int = eqx.field(static=True)
    low: float = eqx.field(static=True, converter=float)
    high: float = eqx.field(static=True, converter=float)
    samples: int = eqx.field(static=True, default=256)

    def arrive(self, q: ArrayLike) -> RayEnd:
        """End of the ray q."""
        return trace_path(self.scene, self.path, *self.light.ray(as_float(q)), self.receiver)

    def _jet(self, q: Float[Array, ""]):
        """Parameter on the receiver of the ray q, `ds/dq`, share of power, and if it is real."""

        def end(q):
            arrival = self.arrive(q)
            return arrival.s, (arrival.share, arrival.ok)

        s, slope, (share, ok) = jax.jvp(end, (q,), (jnp.ones_like(q),), has_aux=True)
        return s, slope, share, ok

    def folds(self) -> tuple[Float[Array, " n"], Float[Array, " n"], Bool[Array, " n"]]:
        """Rays at which `dx/dq = 0`: their q, the places on the receiver, and which exist.

        NaN if there are more than eight of them, or more than 16 rims (see `irradiance`).
        """
        return self._searched()[:3]

    def _searched(self):
        """The folds, and rays between which s(q) is monotonic: q, s and whether they are real."""
        fixed = jax.lax.stop_gradient(self)
        q = jnp.linspace(self.low, self.high, self.samples + 1)
        s, slope, _, ok = jax.vmap(fixed._jet)(q)
        turns = (slope[:-1] * slope[1:] < 0.0) & ok[:-1] & ok[1:]
        folds = order_of(~turns)[:MOST_BRANCHES]
        # The last rays before total reflection, or before a rim: the cell beyond them is half dark.
        cut = ok[1:] != ok[:-1]
        rims = order_of(~cut)[:MOST_RIMS]
        count, real = folds.size, turns[folds]
        few = (jnp.sum(turns) <= MOST_BRANCHES) & (jnp.sum(cut) <= MOST_RIMS)

        def found(cell, at_rim):
            rising, lit = slope[cell + 1] > 0.0, ok[cell + 1]

            def beyond(q):
                _, slope, _, ok = fixed._jet(q)
                return jnp.where(at_rim, ok == lit, (slope > 0.0) == rising)

            a, b = _narrowed(beyond, q[cell], q[cell + 1])
            return jnp.where(at_rim, jnp.where(ok[cell], a, b), 0.5 * (a + b))

        cells = jnp.append(folds, rims)
        more = jax.vmap(found)(cells, jnp.arange(cells.size) >= count)
        more = jax.lax.stop_gradient(more)
        there = jax.vmap(self.arrive)(more)
        kept = jnp.append(real, jnp.ones(rims.size, bool))
        old, new, none = (q, s, ok), (more, there.s, there.ok), (self.high, s[-1], ok[-1])
        q, s, ok = (
            jnp.append(o, jnp.where(kept, n, x)) for o, n, x in zip(old, new, none, strict=True)
        )
        order = order_of(q)
        rays = jax.lax.stop_gradient((q[order], s[order], ok[order]))
        q, s = (nan_unless(few, a[:count]) for a in (more, there.s))
        return q, s, real, (*rays, few)

    def irradiance(self, s: ArrayLike) -> Float[Array, "*n"]:
        """Irradiance at parameters of the receiver [W/m]; differentiable, infinite at folds.

        NaN where more than eight rays arrive; everywhere if there are more than eight folds, or
        more than 16 rims, between which rays arrive and beyond which total reflection or another
        shape keeps them off.
        """
        s = as_float(s)
        rays = self._searched()[3]
        return jax.vmap(lambda at: self._at(at, *rays))(s.ravel()).reshape(s.shape)

    def _at(self, s, q, ends, ok, few):
        """The sum over the branches at one place; NaN where they are more than can be followed."""
        fixed, here = jax.lax.stop_gradient((self, s))
        off = ends - here
        crossed = (off[:-1] * off[1:] <= 0.0) & ok[:-1] & ok[1:] & (q[1:] > q[:-1])
        crossed &= off[1:] != 0.0
        which = order_of(~crossed)[:MOST_BRANCHES]
        speed = self.scene.frame(self.receiver, s).speed

        def branch(cell, there):
            rising = off[cell + 1] > 0.0

            def beyond(q):
                return (fixed.arrive(q).s > here) == rising

            a, b = _narrowed(beyond, q[cell], q[cell + 1])
            root = jnp.where(there, 0.5 * (a + b), 0.5 * (self.low + self.high))
            root = jax.lax.stop_gradient(root)

            def newton(root, _):  # no step, but its derivatives
                at, slope, share, ok = self._jet(root)
                step = (at - s) / jnp.where(slope == 0.0, 1.0, slope)
                moved = root - jnp.where(there, step - jax.lax.stop_gradient(step), 0.0)
                return moved, (slope, share, ok)

            _, (slope, share, ok) = jax.lax.scan(newton, root, None, length=3)
            spread = jnp.abs(jnp.where(there, slope[-1], 1.0)) * speed
            return jnp.where(there & ok[-1], self.light.power * share[-1] / spread, 0.0)

        few &= jnp.sum(crossed) <= MOST_BRANCHES
        return nan_unless(few, jnp.sum(jax.vmap(branch)(which, crossed[which])))

    def envelope(self, q: ArrayLike) -> tuple[Float[Array, "2"], Float[Array, ""]]:
        """The point of the caustic on the ray q, as it leaves the last step of its path.

        Rays `p(q) + t u(q)` have the envelope `t = -(p' x u) / (u' x u)`. t may be negative: a
        virtual caustic, on the ray's backward extension.

        Returns:
            The point [m], and t [m].
        """

        def last(q):
            end = trace_path(self.scene, self.path, *self.light.ray(q))
            return end.position, end.along

        q = as_float(q)
        (p, u), (dp, du) = jax.jvp(last, (q,), (jnp.ones_like(q),))
        turn = du[0] * u[1] - du[1] * u[0]
        t = -(dp[0] * u[1] - dp[1] * u[0]) / jnp.where(turn == 0.0, 1.0, turn)
        t = jnp.where(turn == 0.0, jnp.inf, t)
        return p + jnp.where(jnp.isfinite(t), t, 0.0) * u, t


def through_body(*shapes: int, inside: int = 0) -> tuple[tuple[int, str], ...]:
    """The path into a body and out of it.

    Args:
        shapes: where it goes in and where out; one number for a closed shape.
        inside: reflections on the closed shape's inside in between.

    Example:
        >>> from firstorder.flatland import through_body
        >>> through_body(0, inside=1)
        ((0, 'through'), (0, 'back'), (0, 'through'))
        >>> through_body(0, 1)
        ((0, 'through'), (1, 'through'))
    """
    first, last = shapes[0], shapes[-1]
    return ((first, THROUGH), *[(first, BACK)] * inside, (last, THROUGH))


def rainbow_incidence(index: float, inside: int) -> float:
    """Angle of incidence at which a disc's rays turn back: least deflection [rad].

    `cos^2 i = (n^2 - 1) / (k (k + 2))` for k reflections inside a disc of index n in parallel
    light; there is one if `1 < n < k + 1`.

    Raises:
        ValueError: if there is none.

    Example:
        >>> import math
        >>> from firstorder.flatland import rainbow_incidence
        >>> round(math.degrees(rainbow_incidence(4 / 3, 1)), 1)
        59.4
    """
    if not (inside > 0 and 1.0 < index < inside + 1.0):
        raise ValueError(f"Argument `index` must lie in (1, {inside + 1}), but is {index}.")
    return float(np.arccos(np.sqrt((index**2 - 1.0) / (inside * (inside + 2)))))


def _narrowed(beyond, a, b):
    """Two ends as close as bisection brings them; `beyond` tells if a place is as b is, not a."""

    def halve(_, ends):
        a, b = ends
        middle = 0.5 * (a + b)
        past = beyond(middle)
        return jnp.where(past, a, middle), jnp.where(past, middle, b)

    return jax.lax.fori_loop(0, BISECTIONS, halve, (a, b))
