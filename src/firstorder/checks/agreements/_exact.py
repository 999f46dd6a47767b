"""Irradiance by ways that are exact where they apply: intervals, arc length, a cached record."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder import caching
from firstorder.checks.agreements._digits import Digits
from firstorder.checks.agreements._record import Found
from firstorder.checks.tolerance import rounding
from firstorder.errors import Refused
from firstorder.flatland.direct_lighting import irradiance
from firstorder.flatland.estimators import _irradiance_forms as irradiance_forms
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Segments
from firstorder.flatland.visible import Receiver
from firstorder.scene._derivatives import derivatives

OPERATIONS = 100  # roundings, of random sign, that go into one edge
NODES = 64  # in each gap, of what has no closed form

Three = tuple[Found, ...]


def by_intervals(scene: Scene, at: Receiver, scales) -> Three:
    """E with E' and E'' by automatic differentiation of `flatland.irradiance`.

    The bound is rounding, and where there is a sky the change from half as many nodes.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        scales: magnitudes of E, E' and E'' that rounding is relative to (`digits`).
    """
    fine, coarse = np.asarray(_both(irradiance, scene, at))
    return _found(fine, [*abs(fine - coarse)], scales)


def receivers_along(scene: Scene, at: Receiver, steps) -> np.ndarray:
    """E, E' and E'' by intervals at receivers moved along the tangent, a row for each step."""
    moved = _moved(at, steps)
    return np.stack(
        [np.asarray(_both(irradiance, scene, Receiver(p, at.n, at.on)))[0] for p in moved]
    )


def _moved(at: Receiver, steps):
    """Positions along the tangent."""
    tangent = np.array([np.cos(float(at.n)), np.sin(float(at.n))])
    return [jnp.asarray(np.asarray(at.position) + x * tangent) for x in steps]


@eqx.filter_jit
def _both(E: Callable, scene: Scene, at: Receiver):
    """E with two derivatives, with all nodes and with half of them."""

    def three(nodes):
        d = derivatives(E, scene, at, freedoms=("x",), nodes=nodes)
        return jnp.stack([d.value, d.first, d.second])

    fine = three(NODES)
    return jnp.stack([fine, three(NODES // 2) if scene.environment is not None else fine])


def by_arc_length(scene: Scene, at: Receiver, scales) -> Three:
    """J12's arc-length form as an integral: the geometry term moves, light and shadow stay.

    Valid when: nothing that shines is partly hidden (`partly_hidden`); E itself
    needs no such thing.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        scales: magnitudes of E, E' and E''.

    Raises:
        Refused: if there are point lights.

    Reference: J12 §5.1, eqs. 37-39, 48.
    """
    _no_points(scene)
    fine, coarse = (
        np.asarray(_arc_length(irradiance_forms.arc_length_integral, scene, at, n))
        for n in (48, 24)
    )
    return _found(fine, [*abs(fine - coarse)], scales)


@eqx.filter_jit
def _arc_length(form: Callable, scene: Scene, at: Receiver, nodes: int):
    d = form(scene, at, nodes=nodes).translation()
    return jnp.stack([d.value, d.first, d.second])


def partly_hidden(found: Digits | None) -> str | None:
    """Why the arc-length form's derivatives do not hold here; None if they do."""
    if found is None:
        return "whether a light is partly hidden is not known without the 50-digit pattern of edges"
    if found.shadows:
        return "a shadow's edge lies on a light, and moves; arc length keeps it where it is"
    return None


def by_cache(scene: Scene, at: Receiver, reach: float, scales) -> Three:
    """A record made beside the receiver and extrapolated to it (J12 52), with two derivatives.

    The record holds E, E' and E'' by intervals at a distance d on either side. The remainder of its
    parabola falls as d^3 (and d^2, d for the derivatives); it is measured by halving d.

    Valid when: the receiver does not lie on a curved shape, whose tangent leaves it; the pattern of
    edges stays the same up to the record.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        reach: how far the pattern of edges stays the same (`digits`) [m].
        scales: magnitudes of E, E' and E''.

    Raises:
        Refused: if a record cannot be made beside the receiver.

    Reference: J12 §6, eq. 52.
    """
    on_straight(scene, at)
    if not reach > 0.0:
        raise Refused("two edges are in line here, and a record does not reach across")
    d = min(reach, 0.02)
    far, here, near = (
        _extrapolated(receivers_along(scene, at, [-h])[0], h) for h in (d, 0.5 * d, 0.25 * d)
    )
    # Errors of order p fall by 2^p each time; the larger of two estimates, for terms may cancel.
    fall = 2.0 ** np.array([3.0, 2.0, 1.0])
    remainder = np.maximum(abs(far - here), fall * abs(here - near)) / (fall - 1.0)
    return _found(here, [*(2.0 * remainder)], scales)


def _extrapolated(derivatives: np.ndarray, h: float) -> np.ndarray:
    """What a cache of one record says at a distance, with the derivatives of its answer."""
    record = caching.Candidates.on_line(jnp.zeros(1), jnp.asarray(derivatives)[None])
    reach = caching.circular_regions(jnp.array([2.0 * h]), h, 4.0 * h)
    kept = caching.Cache(record, reach, order=2)
    there = caching.Candidates.from_function(lambda x: kept(x).value, jnp.array([h]))
    return np.array([float(there.derivative(k).reshape(())) for k in range(3)])


def on_straight(scene: Scene, at: Receiver) -> None:
    """Refuse a receiver on a curved shape, which leaves it when it moves along its tangent."""
    number = int(at.on)
    for group in scene.groups:
        if 0 <= number < group.count and not isinstance(group, Segments):
            raise Refused("the receiver lies on a curved shape, and its tangent leaves it")
        number -= group.count


def _no_points(scene: Scene) -> None:
    if scene.points.intensity.shape[0]:
        raise Refused("point lights cannot be met by a ray")


def _found(values, steps, scales) -> Three:
    """Numbers with bounds: the step's error, and rounding."""
    bounds = [e + rounding(OPERATIONS) * s for e, s in zip(steps, scales, strict=True)]
    return tuple(Found(float(v), float(b)) for v, b in zip(values, bounds, strict=True))
