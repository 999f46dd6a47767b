"""What J12's figures 3 to 6 share: scenes A and B in closed form, references, photons in runs."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.flatland import Receiver, Scene, irradiance, receiver
from firstorder.flatland.bounces import DensityEstimator, photon_irradiance, photon_map
from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.photons import split_photons, trace_photons
from firstorder.flatland.bounces.radiosity import solve_radiosity

FLUX = 2.0  # of the lamp of scenes A and B: radiance 1, 1 m long [W]


def floor(scene: Scene, s) -> Receiver:
    """Receivers along the floor."""
    number = scene.named("floor")[0]
    return jax.jit(jax.vmap(lambda s: receiver(scene, number, s)))(jnp.asarray(s))


def line_light(x, blocked: bool):
    """Irradiance of scene A, or B, by hand: differences of sines."""
    x = np.asarray(x, float)

    def sine(a):
        return (a - x) / np.hypot(a - x, 1.0)

    E = sine(0.5) - sine(-0.5)
    if blocked:
        low, high = (np.clip(x + 2.0 * (b - x), -0.5, 0.5) for b in (-0.2, 0.2))
        E = E - (sine(high) - sine(low))
    return E


def arrived(blocked: bool):
    """Share of the lamp's flux that arrives left of x, as a function."""
    x = np.linspace(-1.0, 1.0, 40_001)
    middle = line_light(0.5 * (x[1:] + x[:-1]), blocked)
    sums = np.concatenate([[0.0], np.cumsum(middle) * (x[1] - x[0])]) / FLUX
    return lambda at: np.interp(at, x, sums)


def reference(name: str, scene: Scene, at: Receiver, quick: bool):
    """Irradiance of scene C or D with all reflections, and direct light alone: no sampling.

    The radiosity solution takes long to compile; the quick size counts rays (`counted`) and says
    how far a mesh half as fine is off. Returns E, direct E, and that bound.
    """
    if quick:
        x = np.asarray(at.position[:, 0])
        coarse, _ = counted(x, name == "D", 32, 1440)
        fine, direct = counted(x, name == "D", 64, 2880)
        return fine, direct, float(np.max(np.abs(fine - coarse)))
    solution = solve_radiosity(scene, fineness=Discretization(8, 1e-5))

    def both(here):
        return irradiance(scene, here), solution.indirect(here)

    direct, indirect = jax.jit(lambda at: jax.lax.map(both, at))(at)
    return np.asarray(direct + indirect), np.asarray(direct), 0.0


def runs(scene: Scene, key, count: int, number: int, bounces: int):
    """Independent maps of `count` photons each, thrown together."""
    photons = trace_photons(scene, key, count * number, bounces)
    yield from (photon_map(scene, run) for run in split_photons(photons, number))


def viewed(scene: Scene, photons, how: DensityEstimator, s) -> np.ndarray:
    """The map itself along the floor."""
    s = jnp.asarray(s)
    number = jnp.full(s.shape, scene.named("floor")[0])
    return np.asarray(photon_irradiance(photons, how, number, jnp.ones(s.shape, bool), s))


# --- scenes C and D by counting rays, in NumPy alone ---------------------------------------------

_CENTERS = np.array([(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)])
_RADIUS, _ALBEDO, _LIGHT = 0.08, 0.2, np.array([0.5, 0.5])


def counted(x, circles: bool, panels: int, rays: int):
    """Irradiance on the floor, whole and direct, by a fan of rays from every panel of a mesh."""
    t = (np.arange(panels) + 0.5) / panels
    zero, one = np.zeros(panels), np.ones(panels)
    walls = [(t, zero, 0.0), (one, t, 0.5), (1 - t, one, 1.0), (zero, 1 - t, 1.5)]
    place = [np.stack([a, b], -1) for a, b, _ in walls]
    normal = [np.full(panels, np.pi * turn) for *_, turn in walls]
    for center in _CENTERS if circles else ():
        place.append(
            center + _RADIUS * np.stack([np.sin(2 * np.pi * t), np.cos(2 * np.pi * t)], -1)
        )
        normal.append(-2.0 * np.pi * t)
    place, normal = np.concatenate(place), np.concatenate(normal)
    floor_ = np.stack([x, np.zeros(len(x))], -1)
    eyes, angles = np.concatenate([place, floor_]), np.append(normal, np.zeros(len(x)))
    direct = _direct(eyes, angles, circles)
    a = np.pi * ((np.arange(rays) + 0.5) / rays - 0.5)
    share = np.zeros((len(eyes), len(place)))
    for i, (eye, n) in enumerate(zip(eyes, angles, strict=True)):
        along = np.stack([-np.sin(n + a), np.cos(n + a)], -1)
        np.add.at(share[i], _panel(eye, along, circles, panels), np.cos(a) * np.pi / rays)
    own, m = 0.5 * _ALBEDO, len(place)
    E = np.linalg.solve(np.eye(m) - own * share[:m], direct[:m])
    return direct[m:] + own * share[m:] @ E, direct[m:]


def _direct(eyes, angles, circles):
    """The point light where no circle is between: `cos / r`."""
    to = _LIGHT - eyes
    r = np.linalg.norm(to, axis=-1)
    along = to / r[:, None]
    up = np.cos(angles) * along[:, 1] - np.sin(angles) * along[:, 0]
    lit = up > 1e-9
    for center in _CENTERS if circles else ():
        w = center - eyes
        ahead = np.sum(w * along, -1)
        off = np.abs(w[:, 0] * along[:, 1] - w[:, 1] * along[:, 0])
        own = np.linalg.norm(w, axis=-1) < _RADIUS * (1 + 1e-9)
        lit &= own | ~((ahead > 0) & (ahead < r) & (off < _RADIUS))
    return np.where(lit, up / r, 0.0)


def _panel(eye, along, circles, panels):
    """Number of the panel that each ray meets first."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.stack([-eye[1] / along[:, 1], (1 - eye[0]) / along[:, 0]])
        t = np.concatenate([t, [(1 - eye[1]) / along[:, 1], -eye[0] / along[:, 0]]])
    t = np.where(t > 1e-9, t, np.inf)
    wall, far = np.argmin(t, 0), np.min(t, 0)
    hit = eye + far[:, None] * along
    s = np.choose(wall, [hit[:, 0], hit[:, 1], 1 - hit[:, 0], 1 - hit[:, 1]])
    number = wall * panels + np.clip((s * panels).astype(int), 0, panels - 1)
    for i, center in enumerate(_CENTERS if circles else ()):
        w = eye - center
        if np.linalg.norm(w) < _RADIUS * (1 + 1e-9):
            continue  # no ray that leaves a circle outward meets it again
        b = along @ w
        inside = b**2 - (w @ w - _RADIUS**2)
        near = -b - np.sqrt(np.where(inside > 0, inside, 0.0))
        closer = (inside > 0) & (near > 0) & (near < far)
        h = w + near[:, None] * along
        s = np.mod(np.arctan2(h[:, 0], h[:, 1]) / (2 * np.pi), 1.0)
        there = (4 + i) * panels + np.clip((s * panels).astype(int), 0, panels - 1)
        number, far = np.where(closer, there, number), np.where(closer, near, far)
    return number
