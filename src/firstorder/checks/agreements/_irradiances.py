"""E, E' and E'' at one receiver in nine ways, each judged beside the first that applies."""

from __future__ import annotations

import functools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements import _digits as decimal
from firstorder.checks.agreements import (
    _edges as edges,
)
from firstorder.checks.agreements import (
    _exact as exact,
)
from firstorder.checks.agreements import (
    _laws as laws,
)
from firstorder.checks.agreements import (
    _random as random,
)
from firstorder.checks.agreements import (
    _traced as traced,
)
from firstorder.checks.agreements._digits import Digits
from firstorder.checks.agreements._record import Found, Row, attempted, judged
from firstorder.checks.agreements.sizes import Sizes
from firstorder.checks.statistics import z_threshold
from firstorder.checks.tolerance import _epsilon
from firstorder.errors import Refused
from firstorder.flatland.direct_lighting import irradiance
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import HORIZON, Receiver, local_angle
from firstorder.numerics._batching import host_rows

QUANTITIES = ("E", "E'", "E''")
DIGITS, INTERVALS = "50 digits, differences", "intervals, autodiff"
IN_LINE = "two edges are in line here: derivatives are one-sided, and differences straddle it"


def irradiance_rows(
    scene: Scene, at: Receiver, sizes: Sizes, seed: int = 0, ways: tuple[str, ...] | None = None
) -> tuple[Row, ...]:
    """Direct irradiance and two derivatives along the tangent, in all ways that apply.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        sizes: how much work each way may be.
        seed: of paths and photons.
        ways: beginnings of the names of those wanted; all if left out.
    """
    known = attempted(lambda: decimal.digits(scene, at, sizes.reach))
    found = known if isinstance(known, Digits) else None
    asked = {
        name: ask
        for name, ask in _ways(scene, at, sizes, seed, known).items()
        if ways is None or name in (DIGITS, INTERVALS) or name.startswith(ways)
    }
    said = {name: _three(ask) for name, ask in asked.items()}
    if found is not None and not found.reach > 0.0:
        for name in said:
            if name != INTERVALS:
                said[name] = [said[name][0], IN_LINE, IN_LINE]
    why = exact.partly_hidden(found)
    if "arc length (J12 37-39)" in said and why is not None:
        said["arc length (J12 37-39)"][1:] = [_or(said["arc length (J12 37-39)"][1], why)] * 2
    limit = z_threshold(3 * 2, freedom=sizes.runs - 1)
    rows: tuple[Row, ...] = ()
    for k, quantity in enumerate(QUANTITIES):
        column = {name: three[k] for name, three in said.items()}
        first = DIGITS if isinstance(column[DIGITS], Found) else INTERVALS
        rows += judged(quantity, column, first, limit)
    return rows


def _or(said: Found | str, why: str) -> str:
    """A refusal that stands already, or a new one."""
    return said if isinstance(said, str) else why


def _ways(scene, at, sizes: Sizes, seed: int, known: Digits | str) -> dict[str, Callable]:
    """Each way by name, as a question that answers with three numbers or refuses."""
    found = known if isinstance(known, Digits) else None
    scales = _rough(scene, at) if found is None else found.scales
    reach = sizes.reach if found is None else found.reach
    curve = functools.partial(_curve, scene, at)
    step = max(reach, 1e-3)

    def by_digits():
        if found is None:
            raise Refused(str(known))
        numbers = found.value, found.first, found.second
        return tuple(Found(v, 4.0 * _epsilon() * abs(v)) for v in numbers)

    return {
        DIGITS: by_digits,
        INTERVALS: lambda: exact.by_intervals(scene, at, scales),
        "visible edges (R07 36-37)": lambda: edges.by_edges(scene, at, scales),
        "laws on the light field": lambda: laws.by_laws(scene, at, scales),
        "arc length (J12 37-39)": lambda: exact.by_arc_length(scene, at, scales),
        "rays, edges mended (J12 47, 51)": lambda: traced.by_mended(scene, at, sizes.rays, scales),
        "rays, a plain sum": lambda: traced.by_rays(scene, at, sizes.rays),
        "a cached record (J12 52)": lambda: exact.by_cache(scene, at, reach, scales),
        "random paths (J12 29)": lambda: random.by_paths(
            scene, at, curve, step, sizes.paths, sizes.runs, seed
        ),
        "photons (J12 30)": lambda: random.by_photons(
            scene, at, curve, sizes.width, sizes.photons, sizes.runs, seed + 1
        ),
    }


def _three(ask) -> list[Found | str]:
    """The answers of a way to each quantity; of E alone, the others are refused."""
    try:
        said = ask()
    except Refused as refusal:
        return [refusal.reason] * 3
    if isinstance(said, Found):
        why = "a sum over rays is constant between shadow edges: its derivative knows of none"
        return [said, why, why]
    return list(said)


@eqx.filter_jit
def _many(E: Callable, scene: Scene, positions, n, on):
    return jax.vmap(lambda p: E(scene, Receiver(p, n, on), nodes=exact.NODES))(positions)


def _curve(scene: Scene, at: Receiver, steps) -> np.ndarray:
    """E by intervals at steps along the tangent, filled up to a power of two: few programs."""
    positions = np.asarray(at.position) + np.multiply.outer(steps, np.asarray(at.tangent))
    return host_rows(lambda p: _many(irradiance, scene, p, at.n, at.on), positions, 4)


@eqx.filter_jit
def _silhouettes(scene: Scene, at: Receiver):
    points, valid = scene.silhouettes(at.position, at.on)
    return points, valid, jax.vmap(lambda p: local_angle(at, p))(points)


def _rough(scene: Scene, at: Receiver) -> tuple[float, float, float]:
    """Magnitudes for rounding where the 50 digits refuse: every silhouette counts as a light's."""
    points, valid, angles = _silhouettes(scene, at)
    shown = np.asarray(valid) & (np.abs(np.asarray(angles)) < HORIZON)
    far = np.linalg.norm(np.asarray(points) - np.asarray(at.position), axis=-1)[shown]
    L = float(jnp.max(scene.material.emission, initial=0.0))
    if scene.environment is not None:
        sky = jax.vmap(scene.sky)(jnp.linspace(-np.pi, np.pi, 257))
        L = max(L, float(jnp.max(sky)))
    size = float(np.max(far, initial=1.0))
    power = np.asarray(scene.points.intensity)
    r = np.linalg.norm(np.asarray(scene.points.position) - np.asarray(at.position), axis=-1)
    return (
        2.0 * L + float(np.sum(power / r)),
        L * float(np.sum(1.0 / far)) + float(np.sum(2.0 * power / r**2)),
        L * float(np.sum(4.0 / far**2 + size / far**3)) + float(np.sum(6.0 * power / r**3)),
    )
