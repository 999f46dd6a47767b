"""Exact light on the floor of J12's box, of any sizes, with or without the block.

The lamp lights the left wall and the block's sides, and the floor gathers what these send: one
reflection. What they send is known in closed form; the floor's irradiance, its exact gradient (with
shadow edges), the Hessians by surface area and the mean lengths of rays are quadratures over
what a place sees, cut wherever anything breaks. No ray is cast, so that caches can be compared
without noise. `shared.box` has the same scenes with rays.

In the empty room all of these are smooth: they are computed at the nodes of a grid that is even in
`log(x / (1 - x))` and interpolated by splines of fifth degree, whose derivatives are those of E.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy import interpolate

from figures.j12.shared.caching import (
    Asked,
    Limits,
    Outcome,
    Regions,
    compare,
    pointwise,
    split,
)
from figures.timing import Ratio, of_rounds
from firstorder.caching import Candidates, geometric_bound
from firstorder.space.estimators._gather_sums import surface_area_sums


class Room(NamedTuple):
    """Sizes of a box with a floor of 1 m by 1 m; those left out are the library's [m].

    Attributes:
        lamp: half the side of the square lamp, which shines down with radiance 1.
        across: x of the lamp's middle.
        height: of the walls and of the lamp.
        wall: 1 with the black right wall, 0 without.
        block: height of the block; its place is `BLOCK`.
        albedo: of the block; the left wall's is 0.5.
    """

    lamp: float = 0.2
    across: float = 0.5
    height: float = 1.0
    wall: float = 1.0
    block: float = 0.25
    albedo: float = 0.5


# Lower and upper corner of the block, and as a mirror at x = 1/2 shows it.
BLOCK = np.array([(0.35, 0.35), (0.55, 0.65)])
MIRRORED = np.array([(0.45, 0.35), (0.65, 0.65)])


class Light(NamedTuple):
    """What records could hold at places of the floor, and what metrics ask for.

    Attributes:
        position: [m].
        E: irradiance [W/m^2].
        gradient: exact [W/m^3].
        hessian: by surface area; exact where nothing is hidden [W/m^4].
        geometric: the same with radiance 1 on all surfaces [1/m^2].
        bound: largest eigenvalue of `geometric_bound` for radiances up to 1 [1/m^2].
        minimum: shortest ray [m].
        harmonic: harmonic mean of the rays' lengths [m].
    """

    position: np.ndarray
    E: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray
    geometric: np.ndarray
    bound: np.ndarray
    minimum: np.ndarray
    harmonic: np.ndarray

    def candidates(self) -> Candidates:
        """As candidates for records."""
        return Candidates.of(self.position, self.E, self.gradient, self.hessian)

    def metrics(self, within: Limits | None = None) -> dict[str, Regions]:
        """Radii by every metric; without limits, those of `FREE`."""
        within = within or FREE
        bound = self.bound[:, None, None] * np.eye(2)
        return {
            "minimum": split(self.minimum, within),
            "harmonic": split(self.harmonic, within),
            "radiometric": pointwise(self.hessian, within),
            "geometric": pointwise(self.geometric, within),
            "bound": pointwise(bound, within),
        }


# No limit acts: a radius of 1 nm covers its own place, one of 1.5 m the floor.
FREE = Limits(1e-9, 1.5, 2)


# --- what is seen --------------------------------------------------------------------------------


class Seen(NamedTuple):
    """Nodes on a surface: weights of the projected solid angle, and what is there.

    Attributes:
        weight: cosine times solid angle.
        radiance: that comes back [W/(m^2 sr)].
        toward: unit vectors to the nodes, x and y.
        normal: normals of the surface over their cosine with the way back, x and y.
        inverse: one over the length of the ray [1/m].
    """

    weight: Float[Array, " n"]
    radiance: Float[Array, " n"]
    toward: Float[Array, "2 n"]
    normal: Float[Array, "2 n"]
    inverse: Float[Array, " n"]


class Nodes(NamedTuple):
    """Gauss-Legendre nodes along a surface and up."""

    around: int
    up: int


EMPTY, BLOCKED = Nodes(20, 16), Nodes(16, 12)


def lit(room: Room, low, high, y, z):
    """Irradiance on an upright plane from the lamp, `low` to `high` before it along its normal.

    `int int X Z / (X^2 + Y^2 + Z^2)^2 dX dY`; what lies behind the plane does not count.
    """
    Z = room.height - z
    ends = 0.5 + room.lamp - y, 0.5 - room.lamp - y

    def part(X):
        far = jnp.sqrt(X * X + Z * Z)
        return 0.5 * Z * (jnp.arctan(ends[0] / far) - jnp.arctan(ends[1] / far)) / far

    return part(jnp.maximum(low, 0.0)) - part(jnp.maximum(high, 0.0))


def _upright(distance, y, borders, top, floor, light, nodes: Nodes) -> Seen:
    """An upright plane at a distance, whose normal is the first axis, between borders along it.

    Args:
        distance: of the place from the plane, positive.
        y: of the place along the plane.
        borders: of the pieces along the plane, ascending.
        top: height of the plane.
        floor: step to nodes to the tangent of the lowest elevation at which they are seen.
        light: y and z of nodes to what they send.
        nodes: for each piece.
    """
    t, w = (jnp.asarray(a) for a in np.polynomial.legendre.leggauss(nodes.around))
    # What changes fastest is right before the place: a piece ends there.
    foot = jnp.clip(y, borders[0], borders[-1])
    borders = jnp.sort(jnp.concatenate([borders, foot[None]]))
    ends = jnp.arcsinh((borders - y) / distance)
    half = 0.5 * jnp.diff(ends)[:, None]
    tau = (0.5 * (ends[1:] + ends[:-1])[:, None] + half * t).ravel()
    azimuth = (half * w).ravel() / jnp.cosh(tau)
    along, flat = distance * jnp.sinh(tau), distance * jnp.cosh(tau)
    t, w = (jnp.asarray(a) for a in np.polynomial.legendre.leggauss(nodes.up))
    low, high = jnp.arcsinh(floor(along)), jnp.arcsinh(top / flat)
    half = 0.5 * jnp.maximum(high - low, 0.0)[:, None]
    mu = low[:, None] + half * (1.0 + t)
    weight = azimuth[:, None] * half * w * jnp.tanh(mu) / jnp.cosh(mu) ** 2
    along, flat = along[:, None] + 0.0 * mu, flat[:, None] + 0.0 * mu
    inverse = 1.0 / (flat * jnp.cosh(mu))
    toward = jnp.stack([jnp.full_like(along, -distance), along]) * inverse
    normal = jnp.stack([-1.0 / toward[0], jnp.zeros_like(along)])
    every = weight, light(y + along, flat * jnp.sinh(mu)), toward, normal, inverse
    return Seen(*(a.reshape((*a.shape[:-2], -1)) for a in every))


def _entered(p, step, block):
    """Share of a step at which it enters the block, and whether it does."""
    one, two = ((corner[:, None] - p[:, None]) / step for corner in block)
    enter = jnp.max(jnp.minimum(one, two), axis=0)
    leave = jnp.min(jnp.maximum(one, two), axis=0)
    hit = (enter < leave) & (enter > 0.0)
    return jnp.where(hit, enter, 1.0), hit


def _wall(room: Room, p, block, light, nodes: Nodes) -> Seen:
    """The wall at x = 0, above the block (None for none) where that stands before it."""
    if block is None:
        return _upright(
            p[0], p[1], jnp.array([0.0, 1.0]), room.height, jnp.zeros_like, light, nodes
        )
    before = block[:, 0] < p[0]
    reach = p[0] / jnp.where(before, p[0] - block[:, 0], 1.0)
    cut = p[1] + (block[:, 1] - p[1]) * reach[:, None]
    cut = jnp.where(before[:, None], jnp.clip(cut, 0.0, 1.0), 0.0).ravel()
    borders = jnp.concatenate([jnp.zeros(1), jnp.sort(cut), jnp.ones(1)])

    def lowest(along):
        step = jnp.stack([jnp.full_like(along, -p[0]), along])
        enter, hit = _entered(p, step, block)
        return jnp.where(hit, room.block / (enter * jnp.sqrt(p[0] ** 2 + along**2)), 0.0)

    return _upright(p[0], p[1], borders, room.height, lowest, light, nodes)


def wall_light(room: Room, y, z):
    """What the left wall sends."""
    return 0.5 / jnp.pi * lit(room, room.across - room.lamp, room.across + room.lamp, y, z)


def side_light(room: Room, axis: int, sign: float):
    """What a side of the block sends, whose normal is `sign` along an axis: of y and z on it."""
    middle = jnp.array([room.across, 0.5])
    before = sign * (middle[axis] - BLOCK[int(sign > 0.0), axis])
    shift = 0.5 - middle[1 - axis]  # `lit` has the lamp's middle at 1/2 along the plane

    def light(y, z):
        light = lit(room, before - room.lamp, before + room.lamp, y + shift, z)
        return room.albedo / jnp.pi * light

    return light


def _side(room: Room, p, axis: int, sign: float, nodes: Nodes) -> Seen:
    """One side of the block, whose normal is `sign` along an axis; nothing from behind it."""
    plane = BLOCK[int(sign > 0.0), axis]
    away = sign * (p[axis] - plane)
    light = side_light(room, axis, sign)
    seen = away > 0.0
    found = _upright(
        *(jnp.where(seen, away, 1.0), p[1 - axis], jnp.asarray(BLOCK[:, 1 - axis])),
        *(room.block, jnp.zeros_like, light, nodes),
    )
    turned = [a * jnp.array([sign, 1.0])[:, None] for a in (found.toward, found.normal)]
    toward, normal = (a[::-1] if axis else a for a in turned)
    weight = jnp.where(seen, found.weight, 0.0)
    return found._replace(weight=weight, toward=toward, normal=normal)


def lamp_seen(room: Room, p, block, count: int = 12) -> Seen:
    """The lamp; it sends nothing, since the floor's indirect light is asked for."""
    t, w = (room.lamp * jnp.asarray(a) for a in np.polynomial.legendre.leggauss(count))
    step = jnp.stack(jnp.meshgrid(room.across + t - p[0], 0.5 + t - p[1])).reshape(2, -1)
    inverse = 1.0 / jnp.sqrt(jnp.sum(step**2, 0) + room.height**2)
    weight = jnp.outer(w, w).ravel() * room.height**2 * inverse**4
    if block is not None:
        enter, hit = _entered(p, step, block)
        weight = jnp.where(hit & (enter * room.height < room.block), 0.0, weight)
    toward = step * inverse
    return Seen(weight, jnp.zeros_like(weight), toward, jnp.zeros_like(toward), inverse)


def _bright(room: Room, p, blocked: bool, nodes: Nodes) -> Seen:
    """Surfaces that send light to a place."""
    light = functools.partial(wall_light, room)
    found = [_wall(room, p, BLOCK if blocked else None, light, nodes)]
    if blocked:
        found += [_side(room, p, axis, sign, nodes) for axis in (0, 1) for sign in (-1.0, 1.0)]
    return _joined(found)


def _black(room: Room, p, blocked: bool, nodes: Nodes) -> Seen:
    """Surfaces that only geometry knows; the right wall is a left one in a mirror."""
    other, flip = jnp.stack([1.0 - p[0], p[1]]), jnp.array([-1.0, 1.0])[:, None]
    wall = _wall(room, other, MIRRORED if blocked else None, lambda y, z: 0.0 * z, nodes)
    wall = wall._replace(
        weight=room.wall * wall.weight, toward=flip * wall.toward, normal=flip * wall.normal
    )
    return _joined([wall, lamp_seen(room, p, BLOCK if blocked else None)])


def _joined(parts: list[Seen]) -> Seen:
    return Seen(*(jnp.concatenate(a, axis=-1) for a in zip(*parts, strict=True)))


# --- light at places -----------------------------------------------------------------------------


def _irradiance(room: Room, p, blocked: bool, nodes: Nodes):
    seen = _bright(room, p, blocked, nodes)
    E = jnp.sum(seen.weight * seen.radiance)
    return E, (E, seen)


def _at(room: Room, p, blocked: bool, nodes: Nodes):
    """The columns of `Light` at one place, without its position."""
    gradient, (E, bright) = jax.jacfwd(_irradiance, 1, has_aux=True)(room, p, blocked, nodes)
    seen = _joined([bright, _black(room, p, blocked, nodes)])
    nearer = (seen.weight * seen.inverse**2)[:, None]
    single = (jnp.moveaxis(a, 0, -1)[..., None] for a in (seen.toward, seen.normal))
    _, each = surface_area_sums(nearer[..., None], nearer, *single)
    H = jnp.tensordot(seen.radiance, each, 1)
    bound = jnp.max(jnp.linalg.eigvalsh(geometric_bound(each)))
    harmonic = jnp.pi / jnp.sum(seen.weight * seen.inverse)
    return E, gradient, H, jnp.sum(each, 0), bound, _nearest(room, p, blocked), harmonic


def _nearest(room: Room, p, blocked: bool):
    """Distance to the nearest surface."""
    to = [p[0], room.height, jnp.where(room.wall > 0.0, 1.0 - p[0], jnp.inf)]
    if blocked:
        off = jnp.maximum(jnp.maximum(BLOCK[0] - p, p - BLOCK[1]), 0.0)
        to.append(jnp.sqrt(jnp.sum(off**2)))
    return jnp.min(jnp.stack(to))


@functools.partial(jax.jit, static_argnums=(2, 3))
def _at_many(room: Room, x, blocked: bool, nodes: Nodes):
    return jax.lax.map(lambda p: _at(room, p, blocked, nodes), x, batch_size=16)


def middles(cells: int) -> np.ndarray:
    """Middles of equal cells of the floor, rows along x first."""
    s = (np.arange(cells) + 0.5) / cells
    return np.stack(np.meshgrid(s, s), -1).reshape(-1, 2)


def is_open(x: np.ndarray) -> np.ndarray:
    """Which places are not under the block."""
    return ~np.all((x > BLOCK[0]) & (x < BLOCK[1]), axis=1)


def blocked_light(room: Room, x: np.ndarray, nodes: Nodes = BLOCKED) -> Light:
    """Light at places beside the block, by quadrature at each that lies in y up to 1/2.

    The others are its mirror images: x must hold them too, if it holds them at all.
    """
    near = np.minimum(x[:, 1], 1.0 - x[:, 1])
    key = np.stack([x[:, 0], np.round(near, 12)], -1)
    half, back = np.unique(key, axis=0, return_inverse=True)
    found = [np.asarray(a)[back.ravel()] for a in _at_many(room, jnp.asarray(half), True, nodes)]
    flip = np.where(x[:, 1] > 0.5, -1.0, 1.0)
    E, gradient, H, geometric, *rest = found
    gradient[:, 1] *= flip
    for h in (H, geometric):
        h[:, 0, 1] *= flip
        h[:, 1, 0] *= flip
    return Light(x, E, gradient, H, geometric, *rest)


REACH, KNOTS = 7.0, 90  # places from 0.0009 m to 0.9991 m


@functools.cache
def empty_light(room: Room, knots: int = KNOTS, nodes: Nodes = EMPTY):
    """Light in the room without the block: a function of places (m, 2) to `Light`."""
    u = np.linspace(-REACH, REACH, knots)
    s = 1.0 / (1.0 + np.exp(-u))
    below = (knots + 1) // 2
    x = np.stack(np.meshgrid(s, s[:below], indexing="ij"), -1).reshape(-1, 2)
    E, _, _, G, bound, _, harmonic = (
        np.asarray(a) for a in _at_many(room, jnp.asarray(x), False, nodes)
    )

    def spline(values, mirror=1.0):
        half = values.reshape(knots, below)
        both = np.concatenate([half, mirror * half[:, : knots - below][:, ::-1]], axis=1)
        return interpolate.RectBivariateSpline(u, u, both, kx=5, ky=5)

    geometric = spline(G[:, 0, 0]), spline(G[:, 0, 1], -1.0), spline(G[:, 1, 1])
    return functools.partial(
        _read, room, spline(E), geometric, spline(np.log(bound)), spline(np.log(harmonic))
    )


def _read(room: Room, E, geometric, bound, harmonic, x: np.ndarray) -> Light:
    """Splines at places; derivatives of E by the chain rule."""
    u = np.log(x / (1.0 - x)).T

    def of(spline, i=0, j=0):
        return spline.ev(*u, dx=i, dy=j)

    slope = 1.0 / (x * (1.0 - x)).T
    bend = (2.0 * x.T - 1.0) * slope**2
    first = of(E, 1), of(E, 0, 1)
    H = np.empty((len(x), 2, 2))
    H[:, 0, 0] = of(E, 2) * slope[0] ** 2 + first[0] * bend[0]
    H[:, 1, 1] = of(E, 0, 2) * slope[1] ** 2 + first[1] * bend[1]
    H[:, 0, 1] = H[:, 1, 0] = of(E, 1, 1) * slope[0] * slope[1]
    a, b, c = (of(spline) for spline in geometric)
    G = np.stack([a, b, b, c], -1).reshape(-1, 2, 2)
    nearest = np.minimum(x[:, 0], room.height)
    if room.wall:
        nearest = np.minimum(nearest, 1.0 - x[:, 0])
    gradient = np.stack([first[0] * slope[0], first[1] * slope[1]], -1)
    return Light(x, of(E), gradient, H, G, np.exp(of(bound)), nearest, np.exp(of(harmonic)))


# --- caches --------------------------------------------------------------------------------------


def some_rooms(count: int, seed: int = 5) -> list[Room]:
    """Rooms of random sizes."""
    found = []
    for lamp, across, height, _ in _draws(count, seed):
        found.append(Room(0.05 + 0.25 * lamp, 0.4 + 0.2 * across, 0.7 + 0.7 * height))
    return found


def rooms_with_block(count: int, seed: int = 5) -> list[Room]:
    """Rooms with blocks of random sizes, all of whose sides the lamp lights.

    So that no place is without light, where the radiometric Hessian has no radius (Fig. 20). The
    block nowhere shades the left wall from the lamp.
    """
    found = []
    for lamp, across, height, block in _draws(count, seed):
        lamp, across, height = 0.2 + 0.15 * lamp, 0.45 + 0.05 * across, 0.7 + 0.7 * height
        highest = min(0.35, height * BLOCK[0, 0] / (across + lamp))
        found.append(Room(lamp, across, height, block=0.08 + (highest - 0.08) * block))
    return found


def _draws(count: int, seed: int) -> np.ndarray:
    """For each room what decides its lamp, the lamp's place, its height and its block."""
    return np.random.default_rng(seed).random((count, 4))


SCANNED = "lamps of 0.1 to 0.6 m from x = 0.4 to 0.6, heights of 0.7 to 1.4 m"
SCANNED_BLOCK = (
    "lamps of 0.4 to 0.7 m from x = 0.45 to 0.5, heights of 0.7 to 1.4 m, blocks of 0.08 to 0.35 m"
)


def empty_case(room: Room, cells: int, judged: int) -> tuple[Light, Asked]:
    """Places for records in the empty room, and places at which caches are judged."""
    read = empty_light(room)
    asked = read(middles(judged))
    return read(middles(cells)), Asked(asked.position, asked.E)


@functools.cache
def blocked_case(room: Room, cells: int) -> tuple[Light, Asked]:
    """The same beside the block, judged at the places of records; 20 divides the cells' number."""
    x = middles(cells)
    light = blocked_light(room, x[is_open(x)])
    return light, Asked(light.position, light.E)


def race(
    light: Light, asked: Asked, methods: dict[str, Regions], records: int, order: int = 1
) -> dict[str, Outcome]:
    """Caches of about as many records by every method, in the same order of insertion."""
    expansions = dict.fromkeys(methods, order)
    return compare(light.candidates(), methods, asked, 1, records, expansions)


def factor(found: list[dict[str, float]], one: str, other: str) -> Ratio:
    """Error by one method over that by another: geometric mean over rooms, and its error."""
    return of_rounds([(here[one], here[other]) for here in found])


def image(x: np.ndarray, values) -> np.ndarray:
    """Numbers at places in the middles of equal cells as an image, NaN under the block."""
    (columns, i), (rows, j) = (np.unique(a, return_inverse=True) for a in np.round(x.T, 12))
    found = np.full((len(rows), len(columns)), np.nan)
    found[j, i] = values
    return found
