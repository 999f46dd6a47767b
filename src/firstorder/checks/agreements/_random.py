"""Irradiance by random numbers: paths and photons, with error bars.

Neither has derivatives; both are asked at places beside the receiver, and differences are taken.
One key serves all places of a run, so that paths differ as little as they can; the spread of the
differences over independent runs is the error bar. What a difference of finite step misses is no
matter of chance: it is computed on the exact E (`missed`), by halving the step.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements._exact import OPERATIONS, on_straight
from firstorder.checks.agreements._record import Found
from firstorder.checks.tolerance import rounding
from firstorder.errors import Refused
from firstorder.flatland.bounces import DensityEstimator, photon_irradiance, photon_map
from firstorder.flatland.bounces.pathtrace import path_irradiance
from firstorder.flatland.bounces.photons import split_photons, trace_photons
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._quadrature import gauss_legendre

Three = tuple[Found, ...]
Curve = Callable[[np.ndarray], np.ndarray]  # E at steps along the tangent, exact

STENCIL = np.array([-1.0, 0.0, 1.0])


def by_paths(
    scene: Scene, at: Receiver, E: Curve, step: float, paths: int, runs: int, seed: int = 0
) -> Three:
    """E and its differences by path tracing, direct light alone.

    Args:
        scene: concrete shapes and lights.
        at: one receiver, not on a curved shape.
        E: exact irradiance at steps along the tangent, for what differences miss.
        step: of the differences [m].
        paths: for each receiver and run.
        runs: of one key each; two or more.
        seed: of the random numbers.

    Reference: J12 §4.3, eq. 29, without reflections.
    """
    on_straight(scene, at)
    keys = jax.random.split(jax.random.key(seed), runs)
    tangent = np.array([np.cos(float(at.n)), np.sin(float(at.n))])
    places = [jnp.asarray(np.asarray(at.position) + step * x * tangent) for x in STENCIL]
    found = np.array(
        [
            [
                float(
                    path_irradiance(
                        scene, Receiver(p, at.n, at.on), key=key, paths=paths, bounces=0
                    ).mean
                )
                for p in places
            ]
            for key in keys
        ]
    )
    return _summed(_differences(found, step), missed(E, step), _magnitudes(found, step))


def by_photons(
    scene: Scene, at: Receiver, E: Curve, width: float, count: int, runs: int, seed: int = 0
) -> Three:
    """E by the density of photons within a width, and its differences two widths apart.

    Photons are counted where they land first: direct light. The width smears E, which is part of
    what is missed.

    Args:
        scene: concrete shapes and lights.
        at: one receiver on a straight shape.
        E: exact irradiance at steps along the tangent.
        width: to each side, in which photons count [m].
        count: photons of all runs.
        runs: independent parts, each with its own map; they divide the count.
        seed: of the random numbers.

    Raises:
        Refused: if the receiver lies on no shape, or within three widths of its shape's end.

    Reference: J12 §4.4, eq. 30.
    """
    number = int(at.on)
    if number < 0:
        raise Refused("photons land on shapes, and the receiver lies on none")
    on_straight(scene, at)
    s, front, length = _place(scene, at, number)
    if min(s, 1.0 - s) * length < 3.0 * width:
        raise Refused("the receiver is within three widths of the end of its shape")
    forward = 1.0 if front else -1.0
    places = jnp.asarray(s + 2.0 * forward * width / length * STENCIL)
    photons = trace_photons(scene, jax.random.key(seed), count, 0)
    how = DensityEstimator(radius=width)
    same = jnp.full(3, number), jnp.full(3, front)
    found = np.array(
        [
            np.asarray(photon_irradiance(photon_map(scene, part), how, *same, places))
            for part in split_photons(photons, runs)
        ]
    )
    t, w = gauss_legendre(8)

    def smeared(x):
        return 0.5 * np.reshape(E(np.add.outer(x, width * t).ravel()), (len(x), -1)) @ w

    # Half the step and half the width: both errors are of second order.
    def finer(x):
        return 0.5 * np.reshape(E(np.add.outer(x, 0.5 * width * t).ravel()), (len(x), -1)) @ w

    coarse, fine = (
        _differences(f(h * STENCIL)[None], h)[0]
        for f, h in ((smeared, 2.0 * width), (finer, width))
    )
    bias = 2.0 * abs(coarse - fine)
    return _summed(_differences(found, 2.0 * width), bias, _magnitudes(found, 2.0 * width))


def missed(E: Curve, step: float) -> np.ndarray:
    """Errors of E and of differences of this step: twice the change at half of the step."""
    coarse, fine = (_differences(E(h * STENCIL)[None], h)[0] for h in (step, 0.5 * step))
    return 2.0 * abs(coarse - fine)


def _differences(found: np.ndarray, step: float) -> np.ndarray:
    """E, E' and E'' from three neighbours, for each row."""
    left, here, right = found.T
    return np.stack([here, (right - left) / (2 * step), (right - 2 * here + left) / step**2], -1)


def _magnitudes(found: np.ndarray, step: float) -> np.ndarray:
    """The sizes to which the rounding of E and of its differences is relative."""
    most = float(np.max(np.abs(found), initial=0.0))
    return most * np.array([1.0, 1.0 / step, 4.0 / step**2])


def _summed(each: np.ndarray, bias: np.ndarray, magnitude: np.ndarray) -> Three:
    """Means over runs with their standard errors; what only rounding spreads is not random."""
    spread = np.std(each, 0, ddof=1) / np.sqrt(len(each))
    mean = np.mean(each, 0)
    noise = rounding(OPERATIONS) * magnitude
    spread, bias = np.where(spread > noise, spread, 0.0), bias + noise
    return tuple(
        Found(float(m), float(b), float(s)) for m, b, s in zip(mean, bias, spread, strict=True)
    )


def _place(scene: Scene, at: Receiver, number: int) -> tuple[float, bool, float]:
    """Parameter, side and length of the straight shape that the receiver lies on."""
    start = np.asarray(scene.frame(number, 0.0).position)
    edge = np.asarray(scene.frame(number, 1.0).position) - start
    length = float(np.hypot(*edge))
    s = float((np.asarray(at.position) - start) @ edge) / length**2
    left = np.array([-edge[1], edge[0]]) / length
    return s, bool(left @ np.asarray(at.normal) > 0.0), length
