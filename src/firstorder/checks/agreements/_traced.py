"""Irradiance by brute force: many rays, and what they tell of the edges between them."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements._record import Found
from firstorder.checks.tolerance import rounding
from firstorder.errors import Refused
from firstorder.flatland.direct_lighting import point_light_irradiance
from firstorder.flatland.estimators.corrected import corrected_estimate
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Segments
from firstorder.flatland.visible import Receiver

Three = tuple[Found, ...]


def by_rays(scene: Scene, at: Receiver, count: int) -> Found:
    """E as a plain sum of traced rays in equal strata of the angle, and the point lights.

    The rule of midpoints errs by half a stratum times the total variation of what it integrates at
    most; the variation is that of the samples themselves. An object thinner than a stratum can be
    missed, which no bound from samples knows.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        count: rays.

    Reference: J12 §4.2, eq. 28 with one reflection; R07 eq. 32.
    """
    f = np.asarray(_sampled(trace_strata, scene, at, count))
    h = np.pi / count
    points = float(point_light_irradiance(scene, at))
    variation = np.sum(np.abs(np.diff(f))) + f[0] + f[-1]
    E = h * np.sum(f) + points
    return Found(float(E), float(0.5 * h * variation + rounding(count) * (abs(E) + 1e-300)))


@eqx.filter_jit
def _sampled(look: Callable, scene: Scene, at: Receiver, count: int):
    samples = look(scene, at, where=hemicircle_strata(count))
    return samples.radiance * jnp.cos(samples.strata.angles)


def by_mended(scene: Scene, at: Receiver, count: int, scales) -> Three:
    """J12's stratified form from traced rays, its shadow edges found by bisection and mended.

    The bound is twice the change from half as many rays: borders between rays that see one surface
    converge at least linearly. Edges themselves are found to rounding of the bisection, `eps^(2/3)`
    in the angle and `eps^(1/3)` beside curved limbs.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        count: rays.
        scales: magnitudes of E, E' and E'' (`digits`).

    Raises:
        Refused: if there are point lights.

    Reference: J12 §5, eqs. 47 and 51, corrected.
    """
    if scene.points.intensity.shape[0]:
        raise Refused("point lights cannot be met by a ray")
    fine, coarse = (
        np.asarray(_mended(corrected_estimate, scene, at, n)) for n in (count, count // 2)
    )
    eps = float(np.finfo(fine.dtype).eps)
    bent = any(not isinstance(group, Segments) for group in scene.groups)
    found = eps ** (np.array([2.0, 2.0, 1.0 if bent else 2.0]) / 3.0)
    bounds = 2.0 * abs(fine - coarse) + 8.0 * found * np.asarray(scales)
    return tuple(Found(float(v), float(b)) for v, b in zip(fine, bounds, strict=True))


@eqx.filter_jit
def _mended(form: Callable, scene: Scene, at: Receiver, count: int):
    seen = trace_strata(scene, at, where=hemicircle_strata(count))
    d = form(scene, at, samples=seen).translation()
    return jnp.stack([d.value, d.first, d.second])
