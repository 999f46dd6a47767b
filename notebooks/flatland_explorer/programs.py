"""Compiled functions of a scene: sizes depend on how many shapes there are, never on their places.

What a scene keeps as words and whole numbers (its names, which shapes cross) would be part of a
compiled program. `movable` makes arrays of it, so that a shape may be dragged across another one.
"""

from __future__ import annotations

import functools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.conventions import direction
from firstorder.fields import Grid
from firstorder.flatland import (
    Circles,
    Curves,
    Ellipses,
    Receiver,
    Scene,
    Segments,
    derivatives,
    derivatives_on_shape,
    irradiance,
    nearest,
    occluded,
    primitive,
    receiver,
    view,
)
from firstorder.numerics._planar import cross_2d, left
from firstorder.shadowfield import Wedge, energy_outside, power_spectrum

SLOTS = 8  # crossings of shapes
SHADOW = 96  # rays along each axis of the shadow's light field
SHOWN = 24  # frequencies shown to each side
MARGIN = 2.0  # cycles per receiver
AWAY = 1e6  # where a shape goes that should not be met [m]


class Movable(eqx.Module):
    """A scene whose shapes may be dragged anywhere without another compilation.

    Attributes:
        scene: the shapes, without names and without crossings, which would be part of a program.
        cuts: the points in which shapes cross; further directions in which views are cut. A
            receiver moves, and they do not: so derivatives along it are exact as ever.
        bodies: 1 for each shape that bounds a body.
    """

    scene: Scene
    cuts: Float[Array, "c 2"]
    bodies: Float[Array, " n"]


def movable(scene: Scene, bodies: np.ndarray) -> Movable:
    """The scene, its crossings in a fixed number of slots; twice as many where there are more."""
    found = np.asarray(scene.crossings.pairs)
    count = SLOTS
    while count < len(found):
        count *= 2
    pairs, near = np.zeros((count, 2), np.int32), np.zeros((count, 2))
    pairs[: len(found)], near[: len(found)] = found, np.asarray(scene.crossings.near)
    none = Scene.of(primitive(Segments((0.0, 0.0), (1.0, 0.0)))).crossings
    bare = Scene(
        scene.groups, scene.material, scene.points, scene.environment, none, ("",) * scene.count
    )
    return Movable(bare, _crossed(bare, jnp.asarray(pairs), jnp.asarray(near)), jnp.asarray(bodies))


@eqx.filter_jit
def _crossed(scene: Scene, pairs: Int[Array, "c 2"], near: Float[Array, "c 2"]) -> Array:
    """The points of crossings by Newton's method; an empty slot, of a shape with itself, its start."""

    def one(pair, s):
        def step(_, s):
            (a, u, _), (b, v, _) = (scene.motion(k, t) for k, t in zip(pair, s, strict=True))
            det, gap = cross_2d(u, v), b - a
            safe = jnp.where(det == 0.0, 1.0, det)
            return s + jnp.stack([cross_2d(gap, v), cross_2d(gap, u)]) / safe

        return scene.motion(pair[0], jax.lax.fori_loop(0, 6, step, s)[0])[0]

    return jax.vmap(one)(pairs, near)


# --- along the receiver --------------------------------------------------------------------------


@eqx.filter_jit
def looked(world: Movable, index: Int[Array, ""], s: Float[Array, " m"], tilt: Float[Array, " m"]):
    """Views of places of the receiver: gaps between edges, exact, and what shines in each.

    Args:
        world: the scene.
        index: number of the receiver.
        s: parameters on it.
        tilt: by which its normal is turned at each place [rad].

    Returns:
        `angles` (m, k + 1) of the gaps' ends, from the normal; `seen` (m, k), numbers of shapes or
        -1; `L` (m, k), emission in each gap's middle, of shapes alone; `inside` (m,), whether the
        place lies in a body; `lit` (m, p), which point lights are seen; places and normals' angles.
    """
    scene = world.scene

    def one(s, tilt):
        on = receiver(scene, index, s)
        at = Receiver(on.position, on.n + tilt, on.on)
        gaps = view(scene, at, cuts=world.cuts)
        middle = direction(at.n + 0.5 * (gaps.angles[1:] + gaps.angles[:-1]))
        number = jnp.maximum(gaps.seen, 0)
        front = jax.vmap(lambda k, d: scene.front(k, at.position, d, at.on))(number, middle)
        L = scene.material.emission[number, jnp.where(front, 0, 1)]
        return {
            "angles": gaps.angles,
            "seen": gaps.seen,
            "L": jnp.where(gaps.seen >= 0, L, 0.0),
            "inside": _inside(world, at),
            "lit": _lit(scene, at),
            "place": at.position,
            "n": at.n,
        }

    return jax.vmap(one)(s, tilt)


def _lit(scene: Scene, at: Receiver) -> Bool[Array, " p"]:
    """Which point lights shine on a receiver."""
    lights = scene.points.position
    if not lights.shape[0]:
        return jnp.zeros(0, bool)
    here = jnp.broadcast_to(at.position, lights.shape)
    return ~occluded(scene, here, lights, at.on) & ((lights - here) @ at.normal > 0.0)


@eqx.filter_jit
def lighting(
    world: Movable,
    index: Int[Array, ""],
    s: Float[Array, " m"],
    tilt: Float[Array, " m"],
    straight: bool,
) -> Float[Array, "m 3"]:
    """E, E' and E'' at places of the receiver, exact [W/m, W/m^2, W/m^3].

    On a straight receiver by steps along the tilted normal's own tangent; on one that bends by arc
    length and without tilt.
    """
    scene = world.scene

    def on_line(s, tilt):
        on = receiver(scene, index, s)
        at = Receiver(on.position, on.n + tilt, on.on)
        d = derivatives(irradiance, scene, at, freedoms=("x",), cuts=world.cuts)
        return jnp.stack([d.value, d.first, d.second])

    def on_curve(s, _):
        E = functools.partial(irradiance, scene, cuts=world.cuts)
        d = derivatives_on_shape(E, scene, index, s)
        return jnp.stack([d.value, d.first, d.second])

    return jax.vmap(on_line if straight else on_curve)(s, tilt)


def _inside(world: Movable, at: Receiver) -> Bool[Array, ""]:
    """Whether the receiver's front lies within a body: no light is there to be asked for."""
    scene = world.scene
    p = at.position + jnp.finfo(at.n.dtype).eps ** 0.5 * at.normal
    inside, first = jnp.zeros((), bool), 0
    for group in scene.groups:
        body = world.bodies[first : first + group.count] > 0.0
        first += group.count
        match group:
            case Segments():  # crossings of a ray upward
                (x, y), (u, v) = group.start.T, group.end.T
                spans = (x > p[0]) != (u > p[0])
                t = (p[0] - x) / jnp.where(spans, u - x, 1.0)
                above = body & spans & (y + t * (v - y) > p[1])
                inside |= jnp.sum(above) % 2 == 1
            case Circles():
                w = group.center - p
                inside |= jnp.any(body & (jnp.sum(w * w, -1) < group.radius**2))
            case Ellipses():
                w = p - group.center
                c, t = jnp.cos(group.tilt), jnp.sin(group.tilt)
                a = (c * w[:, 0] + t * w[:, 1]) / group.semi[:, 0]
                b = (c * w[:, 1] - t * w[:, 0]) / group.semi[:, 1]
                inside |= jnp.any(body & (a * a + b * b < 1.0))
            case Curves():
                inside |= jnp.any(body & jax.vmap(lambda one: _wound(one, p))(group))
            case _:
                pass
    return inside


def _wound(curve: Any, p: Float[Array, "2"]) -> Bool[Array, ""]:
    """Whether a closed curve goes around a point."""
    points = jax.vmap(lambda s: curve.motion(s)[0])(jnp.arange(256) / 256.0) - p
    after = jnp.roll(points, -1, 0)
    cross = points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0]
    return jnp.abs(jnp.sum(jnp.arctan2(cross, jnp.sum(points * after, -1)))) > jnp.pi


# --- along rays ----------------------------------------------------------------------------------


@eqx.filter_jit
def ray_ends(scene: Scene, origins: Float[Array, "r 2"], along: Float[Array, "r 2"], on: Array):
    """The first hit of each ray.

    Returns:
        Distance `t` (infinity for a miss), number `hit` of the shape (-1), its unit `normal` there,
        the radiance `L` that it, or the sky, sends against the ray, and its `mirror` share.
    """
    hits = nearest(scene, origins, along, on)
    number, met = jnp.maximum(hits.index, 0), hits.index >= 0
    front = jax.vmap(scene.front)(number, origins, along, on)
    L = scene.material.emission[number, jnp.where(front, 0, 1)]
    sky = jax.vmap(scene.sky)(jnp.arctan2(-along[:, 0], along[:, 1]))
    velocity = jax.vmap(lambda k, s: scene.motion(k, s)[1])(number, hits.s)
    normal = left(velocity) / jnp.sqrt(jnp.sum(velocity**2, -1, keepdims=True))
    return {
        "t": hits.t,
        "hit": hits.index,
        "normal": normal,
        "L": jnp.where(met, L, sky),
        "mirror": jnp.where(met, scene.material.mirror[number], 0.0),
    }


# --- its spectrum --------------------------------------------------------------------------------


@eqx.filter_jit
def shadow(world: Movable, index: Int[Array, ""], lamp: Int[Array, ""]):
    """The shadow light field between the receiver and the lamp, and its power spectrum.

    Two parallel lines of the receiver's length: the receiver's chord, and one through the lamp's
    middle. `f(x, y)` is 1 where nothing but the lamp stands on the ray from x to y.

    Returns:
        `energy` at the shown frequencies, in cycles per receiver; `width` of the receiver [m];
        `d1`, the distance of the lines; `d2_min` and `d2_max`, the depths below the lamp's line
        between which other shapes lie among the rays, NaN if there are none; `outside`, the share of the energy
        outside of their wedge, but for the `MARGIN` that the window smears.
    """
    scene = world.scene
    ends = [scene.frame(index, s).position for s in (0.0, 1.0)]
    middle = scene.frame(index, 0.5)
    width = jnp.sqrt(jnp.sum((ends[1] - ends[0]) ** 2))
    tangent, normal = middle.tangent, middle.normal
    to = scene.frame(lamp, 0.5).position - middle.position
    shift, d1 = to @ tangent, to @ normal
    share = (jnp.arange(SHADOW) + 0.5) / SHADOW - 0.5
    low = middle.position + (share * width)[:, None] * tangent
    top = middle.position + (shift + share * width)[:, None] * tangent + d1 * normal
    a = jnp.repeat(low, SHADOW, 0)
    b = jnp.tile(top, (SHADOW, 1))
    others = _without(_without(scene, lamp), index)
    f = 1.0 - occluded(others, a, b).astype(width.dtype).reshape(SHADOW, SHADOW)
    near = slice(SHADOW // 2 - SHOWN, SHADOW // 2 + SHOWN + 1)
    grid = Grid.spanning((SHADOW, SHADOW), (0.5, 0.5))
    energy = power_spectrum(f, grid)
    across, heights = _places(scene, middle)
    depths, number = d1 - heights, jnp.arange(scene.count)[:, None]
    # Of all rays between the two lines those at a height lie within half a width of their middle.
    among = jnp.abs(across - shift * heights / d1) < 0.5 * width
    stands = (number != index) & (number != lamp) & (depths > 0.0) & (depths < d1) & among
    some = jnp.any(stands)
    d2_min = jnp.where(some, jnp.min(jnp.where(stands, depths, jnp.inf)), jnp.nan)
    d2_max = jnp.where(some, jnp.max(jnp.where(stands, depths, -jnp.inf)), jnp.nan)
    Omega = [jnp.asarray(grid.frequencies(i)) for i in range(2)]
    wedge = Wedge(d2_min, d2_max)
    inside = wedge.contains(*jnp.meshgrid(*Omega, indexing="ij"), d1, MARGIN)
    return {
        "energy": energy[near, near],
        "Omega": Omega[0][near],
        "width": width,
        "d1": d1,
        "d2_min": d2_min,
        "d2_max": d2_max,
        "slopes": jnp.stack(wedge.slopes(d1)),
        "outside": jnp.where(some, energy_outside(energy, inside), jnp.nan),
    }


def _places(scene: Scene, frame) -> tuple[Float[Array, "n 65"], Float[Array, "n 65"]]:
    """Points of all shapes in a frame: along its line, and above it."""
    s = jnp.linspace(0.0, 1.0, 65)
    points = [
        jax.vmap(lambda one: jax.vmap(lambda s: one.motion(s)[0])(s))(group)
        for group in scene.groups
    ]
    gap = jnp.concatenate(points) - frame.position
    return gap @ frame.tangent, gap @ frame.normal


def _without(scene: Scene, index) -> Scene:
    """The scene with one shape put far away."""
    groups, first = [], 0
    for group in scene.groups:
        own = jnp.arange(first, first + group.count) == index
        first += group.count
        by = jnp.where(own, AWAY, 0.0)[:, None]
        keys = {Segments: ("start", "end"), Curves: ()}.get(type(group), ("center",))
        for key in keys:
            moved = getattr(group, key) + by
            group = eqx.tree_at(lambda g, key=key: getattr(g, key), group, moved)
        if isinstance(group, Curves):
            moved = group.cosines.at[:, 0].add(by)
            group = eqx.tree_at(lambda g: g.cosines, group, moved)
        groups.append(group)
    return eqx.tree_at(lambda scene: scene.groups, scene, tuple(groups))
