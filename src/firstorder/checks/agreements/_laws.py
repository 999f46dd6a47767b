"""What laws make of a scene's light field: irradiance, and its windowed spectrum.

The light field knows its silhouettes as edges; a product keeps them, and an integral splits there
and adds the boundary terms of every derivative. Nothing here is told what a shadow is.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder.checks.agreements._record import Found
from firstorder.checks.tolerance import rounding
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Function, Grid, gaussian
from firstorder.flatland.light_fields.field import light_field
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import HORIZON, Receiver
from firstorder.laws import Integrate, Multiply
from firstorder.numerics._batching import host_blocks

NODES = 32  # in each piece between silhouettes
PLACES = 128  # along a line that are asked at a time, by one program for lines of any length
SERIES = 96  # harmonics of the light field along each axis
OPERATIONS = 400  # roundings: both one-sided limits of every panel enter


def by_laws(scene: Scene, at: Receiver, scales) -> tuple[Found, ...]:
    """E, E' and E'' by `Multiply` with the cosine and `Integrate` over the angle.

    The derivatives are the integral's own jet: interior and boundary terms (R07 eqs. 2-3, 33-37).

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        scales: magnitudes of E, E' and E'' that rounding is relative to (`digits`).

    Raises:
        Refused: if there are point lights.

    Example:
        >>> from firstorder.checks.agreements._laws import by_laws
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.library import scene_b
        >>> E, slope, bend = by_laws(scene_b(), Receiver((0.3, 0.0), 0.0), (1.0, 1.0, 1.0))
        >>> round(E.value, 6), round(slope.value, 6)
        (0.392232, 0.942866)
    """
    refuse_points(scene)
    x = jnp.zeros(1)
    fine = np.asarray(_jets(Integrate, _cosine, scene, at, x, NODES))[0]
    coarse = fine
    if scene.environment is not None:
        coarse = np.asarray(_jets(Integrate, _cosine, scene, at, x, NODES // 2))[0]
    return tuple(
        Found(float(v), float(abs(v - w) + rounding(OPERATIONS) * s))
        for v, w, s in zip(fine, coarse, scales, strict=True)
    )


def jets_along(scene: Scene, at: Receiver, x: np.ndarray) -> np.ndarray:
    """E, E' and E'' by the same laws at places x along the tangent: three rows."""
    refuse_points(scene)
    return host_blocks(lambda x: _jets(Integrate, _cosine, scene, at, x, NODES), x, PLACES).T


def windowed_along(
    scene: Scene, at: Receiver, x: np.ndarray, sigma: float, Omega: float
) -> np.ndarray:
    """`int L(x, v) exp(-v^2 / (2 sigma^2) - 2 pi i Omega v) dv` by the same laws, in slopes."""
    refuse_points(scene)

    def part(phase: Array) -> np.ndarray:
        numbers = sigma, Omega, phase
        return host_blocks(lambda x: _windowed(Integrate, _wave, scene, at, x, *numbers), x, PLACES)

    # The phase is an array, so that one program does for both.
    return part(jnp.asarray(0.0)) - 1j * part(jnp.asarray(0.25))


def by_series(
    scene: Scene,
    at: Receiver,
    sigma: tuple[float, float],
    half: tuple[float, float],
    Omega: tuple[float, float],
) -> tuple[complex, float]:
    """The windowed spectrum by the law of a product: the window's spectrum, convolved.

    `F(Omega) = sum_k c_k G(Omega - s_k)` with the light field's own Fourier series on a box, in
    closed form where every silhouette is a point. The bound is the window's mass beyond the box.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        sigma: of the window over x and over v.
        half: of the box.
        Omega: frequency asked for.

    Raises:
        Refused: where the light field has no closed series.
    """
    refuse_points(scene)
    box = Grid.spanning((SERIES, SERIES), half)
    window = gaussian((0.0, 0.0), sigma, frame=FLATLAND_SLOPE)
    light = light_field(scene, at, frame=FLATLAND_SLOPE)
    F = complex(np.asarray(Multiply(light, box)(window.spectrum())(*Omega)))
    most = float(jnp.max(scene.material.emission, initial=0.0))
    if scene.environment is not None:
        most = max(most, float(scene.sky(jnp.zeros(()))))
    beyond = sum(math.erfc(h / (s * math.sqrt(2.0))) for h, s in zip(half, sigma, strict=True))
    mass = 2.0 * math.pi * sigma[0] * sigma[1] * most
    # Harmonics beyond the last one are as far off in the window's spectrum.
    cut = sum(
        math.erfc(math.sqrt(2.0) * math.pi * s * max(0.25 * SERIES / h - abs(o), 0.0))
        for s, h, o in zip(sigma, half, Omega, strict=True)
    )
    return F, mass * (2.0 * beyond + cut + rounding(SERIES**2))


@eqx.filter_jit
def _jets(law, cosine, scene: Scene, at: Receiver, x, nodes: int):
    """The jet of irradiance at each place."""
    weighted = Multiply(Function(cosine))(light_field(scene, at))
    E = law("theta", -HORIZON, HORIZON, nodes)(weighted)

    def one(x):
        jet = E.jet(x[None])
        return jnp.stack([jet.value, jet.gradient[0], jet.hessian[0, 0]])

    return jax.vmap(one)(x)


@eqx.filter_jit
def _windowed(law, wave, scene: Scene, at: Receiver, x, sigma, Omega, phase):
    window = Function(jax.tree_util.Partial(wave, sigma, Omega, phase), FLATLAND_SLOPE)
    seen = Multiply(window)(light_field(scene, at, frame=FLATLAND_SLOPE))
    return law("v", -8.0 * sigma, 8.0 * sigma, 2 * NODES)(seen)(x)


def _cosine(x, theta):
    return jnp.cos(theta)


def _wave(sigma, Omega, phase, x, v):
    """A cosine under a Gaussian; a quarter turn on, a sine."""
    return jnp.exp(-0.5 * (v / sigma) ** 2) * jnp.cos(2.0 * np.pi * (Omega * v - phase))


def refuse_points(scene: Scene) -> None:
    """Refuse point lights: their light field is a Dirac."""
    if scene.points.intensity.shape[0]:
        raise Refused("the light field of a point light is a Dirac: a law has nothing to split")
