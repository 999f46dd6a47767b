"""Random rooms with a lamp and a block, as in J12 Fig. 15, and the radii of records on their floor.

Each is the unit square, all albedos 0.5: a lamp somewhere in the ceiling, and somewhere near the
middle a block, clear of the walls. What surfaces reflect is solved for on panels by rays, all
bounces, and kept as a smooth function along each side, so that one program answers for every room:
E of that light, E' and E'' on the floor are exact (Fig. 15 itself has the radiosity solution).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.j12.shared.caching import Asked, compare, limits, pointwise, split
from firstorder.caching import Candidates, harmonic_mean_distance, minimum_distance
from firstorder.conventions import direction
from firstorder.flatland import Receiver, Scene, irradiance, nearest, receiver
from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_integral,
    stratified_estimate,
)
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.flatland.library._scenes import fig15
from firstorder.numerics._batching import in_batches

WIDTHS = (0.1, 0.2, 0.4, 0.8)  # of the lamp [m]
SPLIT = ("minimum", "harmonic mean")
HESSIANS = ("arc-length", "stratified", "more strata", "exact")
DEFINITIONS = ("average", "integrated squared", "relative")  # beside the total, of the exact one
PANELS, RAYS, DEGREE, NODES = 16, 256, 4, 12
FLOOR = 0


class Room(NamedTuple):
    """The lamp's width, and the scene."""

    width: float
    scene: Scene


def random_rooms(count: int, seed: int) -> list[Room]:
    """Rooms with lamps of all widths in turn; the block is half a metre up, give or take."""
    rng, found = np.random.default_rng(seed), []
    for i in range(count):
        width = WIDTHS[i % len(WIDTHS)]
        left = rng.uniform(0.05, 0.95 - width)
        middle = 0.5 + rng.uniform(-1.0, 1.0, 2) * (0.15, 0.12)
        half = 0.5 * rng.uniform((0.15, 0.1), (0.45, 0.35))
        low, high = ((float(x), float(y)) for x, y in (middle - half, middle + half))
        scene = fig15(lamp=(left, left + width), low=low, high=high)
        found.append(Room(width, scene))
    return found


class Judged(NamedTuple):
    """What one room says.

    Attributes:
        errors: mean RMS error of each method's caches of 20 records over orders of insertion [W/m].
        alike: rank correlation of |E'| on the floor with the inverse harmonic mean of distances.
        dark: share of the floor that sees nothing of the lamp.
    """

    errors: dict[str, float]
    alike: float
    dark: float


def judged(room: Room, key, strata: tuple[int, int], count: int, orders: int) -> Judged:
    """Caches by every method from `count` candidates; sampled Hessians from that many strata."""
    s = (np.arange(count) + 0.5) / count
    dense = (np.arange(2 * count) + 0.3183) / (2 * count)
    found = {k: np.asarray(v) for k, v in _survey(room.scene, s, dense, key, strata).items()}
    candidates = Candidates.of(
        s,
        found["E"],
        found["gradient"][:, None],
        found["exact"][:, None, None],
        minimum=found["minimum"],
        harmonic=found["harmonic mean"],
    )
    held = limits(1.0, count)
    bend = {name: found[name][:, None, None] for name in HESSIANS}
    methods = {name: split(found[name], held) for name in SPLIT}
    methods |= {name: pointwise(bend[name], held) for name in HESSIANS}
    methods |= {
        name: pointwise(bend["exact"], held, definition=name, value=found["E"])
        for name in DEFINITIONS
    }
    outcomes = compare(candidates, methods, Asked(dense[:, None], found["truth"]), orders)
    alike = rank_correlation(1.0 / found["harmonic mean"], np.abs(found["gradient"]))
    dark = float(np.mean(found["direct"] < 1e-9))
    return Judged({name: o.mean for name, o in outcomes.items()}, alike, dark)


def rank_correlation(a, b) -> float:
    """Spearman's: the correlation of the ranks."""
    ranks = [np.argsort(np.argsort(np.asarray(v))) for v in (a, b)]
    return float(np.corrcoef(*ranks)[0, 1])


@eqx.filter_jit
def _survey(scene: Scene, s, dense, key, strata: tuple[int, int]) -> dict[str, Any]:
    """All that records on the floor may need, and the true E between them."""
    sent = _reflected(scene)

    def E(s):
        return irradiance(scene, receiver(scene, FLOOR, s), radiance=sent, nodes=NODES)

    def jet(s):
        def slope(s):
            return jax.jvp(E, (s,), (jnp.ones_like(s),))

        (value, first), (_, second) = jax.jvp(slope, (s,), (jnp.ones_like(s),))
        at = receiver(scene, FLOOR, s)
        arc = arc_length_integral(scene, at, radiance=sent, nodes=NODES)
        return value, first, second, arc.translation().second

    def sampled(number):
        def one(asked):
            s, key = asked
            where = hemicircle_strata(number, key, cosine=True)
            seen = trace_strata(scene, receiver(scene, FLOOR, s), where=where, radiance=sent)
            return stratified_estimate(seen).translation().second

        return in_batches(one, (s, jax.random.split(key, s.shape[0])), 32)

    value, first, second, arc = in_batches(jet, s, 32)
    at = jax.vmap(lambda s: receiver(scene, FLOOR, s))(s)
    lengths = _rays(scene, at, FLOOR)[0]
    return {
        "E": value,
        "gradient": first,
        "exact": second,
        "arc-length": arc,
        "stratified": sampled(strata[0]),
        "more strata": sampled(strata[1]),
        "minimum": minimum_distance(lengths),
        "harmonic mean": harmonic_mean_distance(lengths),
        "truth": in_batches(E, dense, 64),
        "direct": in_batches(lambda s: irradiance(scene, receiver(scene, FLOOR, s)), dense, 64),
    }


# --- reflected light -----------------------------------------------------------------------------


def _rays(scene: Scene, at: Receiver, on):
    """Lengths of rays of equal cosine weight, the shapes that they meet, and where on them."""
    sines = -1.0 + (2.0 * jnp.arange(RAYS) + 1.0) / RAYS
    along = direction(at.n[:, None] + jnp.arcsin(sines))
    origins = jnp.broadcast_to(at.position[:, None], along.shape)
    start = jnp.repeat(jnp.broadcast_to(jnp.asarray(on), at.n.shape), RAYS)
    hits = nearest(scene, origins.reshape(-1, 2), along.reshape(-1, 2), start)
    return tuple(a.reshape(along.shape[:-1]) for a in (hits.t, hits.index, hits.s))


def _reflected(scene: Scene):
    """Radiance that surfaces send: emission, and what they reflect of all bounces.

    Direct light on panels is exact, what they gather from each other is counted by rays, and the
    logarithm of the sum is a polynomial along each side.
    """
    number = jnp.repeat(jnp.arange(scene.count), PANELS)
    t = (np.arange(PANELS) + 0.5) / PANELS
    at = jax.vmap(lambda k, s: receiver(scene, k, s))(number, jnp.tile(t, scene.count))
    direct = in_batches(lambda at: irradiance(scene, at), at, 32)
    _, index, s = _rays(scene, at, number)
    panel = index * PANELS + jnp.clip((s * PANELS).astype(int), 0, PANELS - 1)
    rows = jnp.arange(number.size)[:, None]
    gather = jnp.zeros((number.size, number.size)).at[rows, panel].add(1.0 / RAYS)
    albedo = scene.material.albedo[:, 0]
    E = jnp.linalg.solve(jnp.eye(number.size) - gather * albedo[number], direct)
    powers = np.linalg.pinv(np.vander(2.0 * t - 1.0, DEGREE + 1))
    along = jnp.log(E).reshape(scene.count, PANELS) @ powers.T

    def sent(index, s, front, toward):
        light = jnp.exp(jnp.polyval(along[index], 2.0 * s - 1.0))
        side = jnp.where(front, 0, 1)
        return scene.material.emission[index, side] + jnp.where(
            front, 0.5 * albedo[index] * light, 0.0
        )

    return sent
