"""The light from the lamp's middle to the probe, by the mirror if there is one, as a path of events."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.conventions import FLATLAND
from firstorder.fields import Covariance, gaussian
from firstorder.transport import Arrival, Curvature, Incidence, Mirror, Outgoing, Path, Travel

from .board import Board, Part, angle_from
from .handles import probe_frame

SPREAD = 0.3  # of the Gaussian that stands for the lamp, in angle [rad]
# Which steps of a path are shown, and their titles.
STRAIGHT = {0: "lamp", 2: "travel", 3: "on the receiver"}
BY_MIRROR = {
    0: "lamp",
    1: "travel",
    3: "on the mirror",
    4: "curved frame",
    6: "reflected",
    7: "across the ray",
    8: "travel",
    10: "on the receiver",
}


@dataclasses.dataclass(frozen=True)
class CentralRay:
    """The ray about which a path is told.

    Attributes:
        points: lamp, mirror (if any), probe [m].
        sigma: standard deviation of the lamp across the ray, were it a Gaussian [m].
        received: angle from the probe's normal at which the ray arrives [rad].
        incidence: angle from the mirror's normal at which it meets the mirror [rad].
        kappa: `dn/dx` of the mirror there, on the side that it meets [rad/m].
    """

    points: tuple[tuple[float, float], ...]
    sigma: float
    received: float
    incidence: float = 0.0
    kappa: float = 0.0

    @property
    def distances(self) -> list[float]:
        """Lengths of its legs [m]."""
        return [float(d) for d in np.hypot(*np.diff(np.array(self.points), axis=0).T)]

    @property
    def mirrored(self) -> bool:
        """Whether it goes by a mirror."""
        return len(self.points) == 3


def central_ray(board: Board) -> CentralRay | None:
    """The ray from the first lamp with a length to the probe; None if it arrives from behind.

    By the first mirror that can reflect it, or else straight. What stands in its way is not asked:
    the path tells of light that passes.
    """
    lamps = [p for k, p in enumerate(board.shapes) if p.shines and k != board.receiver]
    if not lamps or lamps[0].kind != "segment":
        return None
    lamp, (probe, n) = lamps[0].middle, probe_frame(board)
    n = n + board.tilt
    for part in board.shapes:
        found = _reflection(part, lamp, probe) if part.reflects else None
        if found is not None:
            place, normal, kappa = found
            received = angle_from(n, place - probe)
            if abs(received) < 0.49 * np.pi:
                facing = np.arctan2(-normal[0], normal[1])
                points = tuple(tuple(float(v) for v in p) for p in (lamp, place, probe))
                sigma = _across(lamps[0], place - lamp)
                return CentralRay(points, sigma, received, angle_from(facing, lamp - place), kappa)
    received = angle_from(n, lamp - probe)
    if abs(received) > 0.49 * np.pi:
        return None
    points = tuple(tuple(float(v) for v in p) for p in (lamp, probe))
    return CentralRay(points, _across(lamps[0], probe - lamp), received)


def _across(lamp: Part, way: np.ndarray) -> float:
    """Standard deviation of a uniform lamp across a direction [m]."""
    e = np.diff(lamp.outline(), axis=0)[0]
    width = abs(e[0] * way[1] - e[1] * way[0]) / np.hypot(*way)
    return max(float(width), 1e-3 * float(np.hypot(*e))) / 12.0**0.5


def _reflection(part: Part, lamp: np.ndarray, probe: np.ndarray):
    """Where a mirror reflects the lamp's middle to the probe: place, normal and curvature there.

    By halving between samples whose sums of the two unit directions lean to different sides.
    """
    if part.kind not in ("segment", "arc"):
        return None

    def at(s):
        (p,), (way,) = part.motion(np.array([s]))
        return p, way / np.hypot(*way)

    def lean(s):
        p, e = at(s)
        u, w = lamp - p, probe - p
        return float((u / np.hypot(*u) + w / np.hypot(*w)) @ e)

    s = np.linspace(0.0, 1.0, 129)
    leans = np.array([lean(v) for v in s])
    found = []
    for k in np.flatnonzero(leans[:-1] * leans[1:] < 0.0):
        low, high = s[k], s[k + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if lean(middle) * leans[k] > 0.0 else (low, middle)
        p, e = at(0.5 * (low + high))
        normal = np.array([-e[1], e[0]])
        sides = (lamp - p) @ normal, (probe - p) @ normal
        if sides[0] * sides[1] > 0.0:
            sign = float(np.sign(sides[0]))
            bent = 0.0
            if part.kind == "arc":
                bent = float(np.sign(part.numbers["sweep"])) / part.numbers["radius"]
            length = np.hypot(*(lamp - p)) + np.hypot(*(probe - p))
            found.append((length, p, sign * normal, sign * bent))
    return min(found, key=lambda f: f[0])[1:] if found else None


def path_of(numbers: Float[Array, "6"], mirrored: bool) -> Path:
    """The path of events, to first order about its central ray.

    Args:
        numbers: sigma, received, first and second distance, incidence and kappa.
        mirrored: whether it goes by the mirror.
    """
    sigma, received, d1, d2, incidence, kappa = numbers
    here = jnp.zeros(2)
    spread = jnp.asarray(SPREAD, sigma.dtype)
    light = gaussian(here, jnp.stack([sigma, spread]), frame=FLATLAND.turned())

    def travel(d):
        return Travel(d).linearised(here)

    if not mirrored:
        return Path(light) >> Arrival() >> travel(d1) >> Incidence(received)
    there = Path(light) >> travel(d1) >> Arrival() >> Incidence(incidence)
    leaves = there >> Curvature(kappa) >> Mirror() >> Curvature(kappa, back=True)
    return leaves >> Outgoing(-incidence) >> travel(d2) >> Arrival() >> Incidence(received)


@eqx.filter_jit
def covariances(numbers: Float[Array, "6"], mirrored: bool) -> Float[Array, "steps 2 2"]:
    """Second moments of the power spectrum after each step of the path [cycles/m, cycles/rad]."""
    found = path_of(numbers, mirrored).covariances  # a Gaussian's moves refuse nothing
    return jnp.stack([step.matrix for step in found if isinstance(step, Covariance)])
