"""Candidate records on a flat floor: irradiance, derivatives and ray distances, computed once.

Filling a cache, bisecting its threshold and comparing metrics are then choices among rows of a
table; no ray is cast again. The sums are those of `space.estimators._gather_sums` for steps in the
receiver's plane. They run on the host and in single precision, since half a billion rays are
common: what does not depend on the place is computed once for each set of directions, and the
places that share it are done one after the other, with nothing larger than one place's rays.
"""

from __future__ import annotations

import concurrent.futures
import math
import operator
import os
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_index,
    check_integer,
    check_not_negative,
    check_shape,
)
from firstorder._display import in_print
from firstorder.caching._records import checked_places
from firstorder.caching.candidates import Candidates
from firstorder.scene._intersect import ranks, tie
from firstorder.space.bounces._radiance_maps import FLAT, RadianceMaps, face_layout
from firstorder.space.estimators._gather_sums import WallSweeps, jumps_across, surface_area_sums

CASTS = ("Rectangles", "Boxes", "Ellipsoids")
Single = Float[np.ndarray, " r"]


class CandidateTable(NamedTuple):
    """Irradiance at places of a plane, with its derivatives by steps along x and y.

    Attributes:
        position: [m].
        E: irradiance [W/m^2].
        gradient: stratified, shadow edges included [W/m^3].
        area_gradient: by surface area, shadow edges left out [W/m^3].
        hessian: by surface area [W/m^4].
        geometric: the same with radiance 1 on all surfaces [1/m^2].
        minimum: shortest ray; infinite if none meets anything [m].
        harmonic: harmonic mean of the rays' lengths [m].
        brightest: largest radiance that a ray met [W/(m^2 sr)].
    """

    position: Float[np.ndarray, "m 2"]
    E: Float[np.ndarray, " m"]
    gradient: Float[np.ndarray, "m 2"]
    area_gradient: Float[np.ndarray, "m 2"]
    hessian: Float[np.ndarray, "m 2 2"]
    geometric: Float[np.ndarray, "m 2 2"]
    minimum: Float[np.ndarray, " m"]
    harmonic: Float[np.ndarray, " m"]
    brightest: Float[np.ndarray, " m"]

    __repr__ = in_print

    def candidates(self, hessian: ArrayLike | None = None) -> Candidates:
        """The rows as candidates for records, with the stratified gradient."""
        H = self.hessian if hessian is None else hessian
        return Candidates.of(
            self.position,
            self.E,
            self.gradient,
            H,
            minimum=self.minimum,
            harmonic=self.harmonic,
        )


class GatherDirections(NamedTuple):
    """Sets of directions that places share: one in each of m x n cells of equal projected angle.

    Attributes:
        directions: k sets; z is up.
        theta, phi: borders of the cells [rad].
        noise: what each ray's radiance is multiplied by; None for nothing.
    """

    directions: Float[np.ndarray, "k 3 m n"]
    theta: Float[np.ndarray, " m_1"]
    phi: Float[np.ndarray, " n_1"]
    noise: Float[np.ndarray, "k m n"] | None

    __repr__ = in_print


def gather_directions(
    rows: int, columns: int, sets: int = 16, seed: int = 0, noise: bool = False
) -> GatherDirections:
    """Jittered directions in `rows * columns` cells of equal projected solid angle.

    Args:
        rows: of theta.
        columns: of phi.
        sets: how many; as many as there are places makes these independent.
        seed: of the random numbers.
        noise: whether each ray's radiance gets a factor, uniform in [0, 2], as in J12 Fig. 21.

    Raises:
        ValueError: if a count is not positive, or the seed negative.

    Example:
        >>> from firstorder.caching import gather_directions
        >>> gather_directions(2, 4, sets=3).directions.shape
        (3, 3, 2, 4)
    """
    for name, number in (("rows", rows), ("columns", columns), ("sets", sets)):
        check_count(name, number)
    check_integer("seed", seed)
    check_not_negative("seed", seed)
    rng = np.random.default_rng(seed)
    up, across = rng.random((2, sets, rows, columns))
    square = (np.arange(rows)[:, None] + up) / rows
    phi = 2.0 * np.pi * (np.arange(columns) + across) / columns
    sine = np.sqrt(square)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - square)], 1)
    return GatherDirections(
        directions.astype(np.float32),
        np.arcsin(np.sqrt(np.arange(rows + 1) / rows)),
        2.0 * np.pi * np.arange(columns + 1) / columns,
        (2.0 * rng.random(up.shape)).astype(np.float32) if noise else None,
    )


def tabulate_candidates(
    maps: RadianceMaps, position: ArrayLike, given: GatherDirections, on: int, height: float = 0.0
) -> CandidateTable:
    """Candidate records from as many rays at every place.

    Args:
        maps: the light; the scene of rectangles, boxes and ellipsoids.
        position: x and y of places on a level shape that faces up (m, 2) [m].
        given: directions; places take the sets in a random order.
        on: number of the shape they lie on.
        height: z of the places [m].

    Raises:
        ValueError: for maps of several bands, a scene with shapes of another kind, a shape that is
            not there, positions that are not (m, 2) or not finite, or a height that is not
            finite.

    Reference: J12 §7-8: eqs. 58, 61, 64, 66 and 71.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import gather_directions, tabulate_candidates
        >>> from firstorder.space.bounces import RadianceMaps
        >>> from firstorder.space.library import j12_box
        >>> maps, place = RadianceMaps(j12_box(), jnp.ones((4, 2, 2))), jnp.array([[0.5, 0.5]])
        >>> table = tabulate_candidates(maps, place, gather_directions(4, 8), on=0)
        >>> table.E.shape, table.hessian.shape
        ((1,), (1, 2, 2))
    """
    x = checked_places(position)
    check_index("on", on, maps.scene.count)
    check_shape("maps.L", maps.L, maps.L.shape[:3])
    check_finite("height", height)
    solids = _solids(maps, on)
    k = given.directions.shape[0]
    pick = np.random.default_rng(len(x)).permutation(len(x)) % k
    out = np.empty((len(x), 14))

    def work(which):
        rows = np.flatnonzero(pick == which)
        if len(rows):
            noise = None if given.noise is None else given.noise[which].ravel()
            look = _Look(solids, given, given.directions[which].reshape(3, -1), noise)
            for row in rows:
                out[row] = look.at(np.array([*x[row], height]))

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(work, range(k)))
    E, gx, gy, ax, ay, *H, minimum, inverse, brightest = out.T
    light, area = (np.array([[a, b], [b, c]]).transpose(2, 0, 1) for a, b, c in (H[:3], H[3:]))
    harmonic = np.divide(1.0, inverse, out=np.full(len(x), np.inf), where=inverse > 0.0)
    gradient, by_area = np.stack([gx, gy], -1), np.stack([ax, ay], -1)
    return CandidateTable(x, E, gradient, by_area, light, area, minimum, harmonic, brightest)


# --- one place -----------------------------------------------------------------------------------


class _Solid(NamedTuple):
    """A shape: world to canonical coordinates, and its maps (None where nothing is sent)."""

    kind: str
    center: np.ndarray
    turn: np.ndarray
    maps: np.ndarray | None


def _solids(maps: RadianceMaps, on: int) -> list[_Solid]:
    """Shapes that rays from one of them can meet, by rank: of those in one place the last shows."""
    first, found, number = face_layout(maps.scene).first, [], 0
    rank = ranks(maps.scene.material.emission).tolist()
    L = np.asarray(maps.L, np.float32)
    for group in maps.scene.groups:
        kind = type(group).__name__
        if kind not in CASTS:
            raise ValueError(f"Argument `maps` must have shapes of {CASTS}, but has {kind}.")
        for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
            faces = 6 if kind == "Boxes" else 1
            own = L[first[number] : first[number] + faces]
            if number != on:
                sent = own if own.any() else None
                found.append((rank[number], _Solid(kind, center, np.linalg.inv(axes), sent)))
            number += 1
    return [solid for _, solid in sorted(found, key=operator.itemgetter(0))]


class _Look:
    """Quantities that depend on a set of directions only, not on the place."""

    def __init__(self, solids: list[_Solid], given: GatherDirections, along: np.ndarray, noise):
        self.solids, self.along, self.noise = solids, along, noise
        self.shape = given.directions.shape[2:]
        self.ready = []
        for solid in solids:
            d = solid.turn.astype(np.float32) @ along
            with np.errstate(divide="ignore", over="ignore"):
                if solid.kind in FLAT:
                    inverse = 1.0 / d[2]
                    self.ready.append((inverse, d[0] * inverse, d[1] * inverse))
                elif solid.kind == "Boxes":
                    self.ready.append((d, 1.0 / np.where(d == 0.0, np.float32(1e-30), d)))
                else:
                    self.ready.append((d, np.sum(d * d, axis=0)))
        sweeps = WallSweeps.of(given.theta, given.phi)
        self.sweeps = WallSweeps(*(a.astype(np.float32) for a in sweeps))

    def at(self, x: np.ndarray) -> np.ndarray:
        """Row of numbers for one place."""
        count = self.along.shape[1]
        best = np.full(count, np.inf, np.float32)
        small = np.min_scalar_type(-len(self.solids) - 1)  # a byte, where solids are few
        which = np.full(count, -1, small)
        share = np.float32(1.0 - tie(np.float32))
        # `scene._intersect.rounding`, without JAX: thousands of places are asked for.
        # Places, and how far they are from shapes, are in double precision.
        slack = np.float32(8.0 * np.finfo(float).eps * np.max(np.abs(x)))
        for number, (solid, ready) in enumerate(zip(self.solids, self.ready, strict=True)):
            t = _distance(solid, ready, solid.turn @ (x - solid.center))
            nearer = share * t - slack < best  # or in one place and of a higher rank (`Scene.of`)
            np.copyto(best, np.minimum(t, best), where=nearer)
            np.copyto(which, small.type(number), where=nearer)
        L, n = np.zeros(count, np.float32), np.zeros((2, count), np.float32)
        for number, solid in enumerate(self.solids):
            rays = np.flatnonzero(which == number)
            if len(rays):
                self._meet(solid, x, rays, best[rays], L, n)
        inverse = 1.0 / best
        L, w = L.reshape(self.shape), inverse.reshape(self.shape)
        both = w * np.stack([L, np.ones_like(L)])  # of the light, and of the geometry alone
        # Row by row of the cells in single precision, and these few numbers in double.
        step, H = surface_area_sums(both[0, :, None], w * both, *map(self._by_row, (self.along, n)))
        H = np.sum(H, 1, float)[:, (0, 0, 1), (0, 1, 1)]
        sums = (math.pi / count) * np.concatenate([np.sum(step[:, 0], 0, float), H.ravel()])
        gradient = self._walls(L, w)
        value = math.pi * float(np.mean(L, dtype=float))
        inverse = float(np.mean(inverse, dtype=float))
        return np.array([value, *gradient, *sums, best.min(), inverse, L.max()])

    def _by_row(self, vectors):
        return np.swapaxes(vectors[:2].reshape(2, *self.shape), 0, 1)

    def _meet(self, solid: _Solid, x, rays, t, L, n) -> None:
        """Writes what the rays see that meet one shape: radiance into L, normals over cosines."""
        along = self.along[:, rays]
        o = (solid.turn @ (x - solid.center)).astype(np.float32)
        d = solid.turn.astype(np.float32) @ along
        light, normal = _sent(solid, o[:, None] + t * d, d)
        if light is not None and not _inside(solid, o):
            L[rays] = light if self.noise is None else light * self.noise[rays]
        normal = solid.turn.T.astype(np.float32) @ normal
        n[:, rays] = normal[:2] / -np.sum(normal * along, axis=0)  # any length: it cancels

    def _walls(self, L: np.ndarray, inverse: np.ndarray) -> np.ndarray:
        """Stratified gradient: the sum over the walls between cells."""
        (circles, meridians), (near_c, near_m) = jumps_across(L, inverse)
        return np.asarray(self.sweeps.gradient(circles * near_c, meridians * near_m))


def _distance(solid: _Solid, ready, o: np.ndarray) -> Single:
    """Distances along all rays to one shape, from the canonical place o; infinite for a miss."""
    if solid.kind == "Boxes":
        low, high = ((a - o[:, None]).astype(np.float32) for a in (-1.0, 1.0))
        one, two = low * ready[1], high * ready[1]
        enter = np.max(np.minimum(one, two), axis=0)
        leave = np.min(np.maximum(one, two), axis=0)
        return _first_met(enter <= leave, enter, leave)
    o = o.astype(np.float32)
    if solid.kind in FLAT:
        inverse, across, up = ready
        with np.errstate(invalid="ignore"):
            t = -o[2] * inverse
            hit = (np.abs(o[0] - o[2] * across) <= 1.0) & (np.abs(o[1] - o[2] * up) <= 1.0)
            return np.where(hit & (t > 0.0), t, np.float32(np.inf))
    d, a = ready
    b = o @ d
    square = b * b - a * (o @ o - np.float32(1.0))
    root = np.sqrt(np.maximum(square, 0.0))
    return _first_met(square > 0.0, (-b - root) / a, (root - b) / a)


def _first_met(hit: np.ndarray, enter: Single, leave: Single) -> Single:
    """Distance to a closed shape: where rays enter it, or where they leave it from inside."""
    t = np.where(enter > 0.0, enter, leave)
    return np.where(hit & (t > 0.0), t, np.float32(np.inf))


def _inside(solid: _Solid, o: np.ndarray) -> bool:
    """Whether a canonical place is in a closed shape, whose inside sends nothing."""
    if solid.kind in FLAT:
        return False
    return bool((np.max(np.abs(o)) if solid.kind == "Boxes" else o @ o) <= 1.0)


def _sent(solid: _Solid, q: np.ndarray, d: np.ndarray):
    """Radiance that comes back (None where nothing does) and canonical normals, at hits q."""
    normal = np.zeros_like(q)
    if solid.kind in FLAT:
        normal[2] = np.where(d[2] < 0.0, 1.0, -1.0)
        light = _looked_up(solid.maps, 0, q[0], q[1])
        return (None if light is None else np.where(d[2] < 0.0, light, 0.0)), normal
    if solid.kind == "Boxes":
        a = np.argmax(np.abs(q), axis=0)
        rays = np.arange(q.shape[1])
        high = q[a, rays] > 0.0
        normal[a, rays] = np.where(high, 1.0, -1.0)
        s, t = q[(a + 1) % 3, rays], q[(a + 2) % 3, rays]
        return _looked_up(solid.maps, 2 * a + high, s, t), normal
    return _looked_up(solid.maps, 0, np.arctan2(q[1], q[0]) / math.pi, q[2]), q


def _looked_up(maps: np.ndarray | None, face, s: Single, t: Single):
    """Values of the cells in which places lie."""
    if maps is None:
        return None
    k = maps.shape[-1]
    i, j = (np.clip((0.5 * k) * (a + 1.0), 0, k - 1).astype(np.int32) for a in (s, t))
    return maps.ravel()[(face * k + j) * k + i]
