"""Light along rays, and how it changes across edges: what the search for visual events asks."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import is_concrete
from firstorder.numerics._batching import host_rows
from firstorder.scene._bands import check_one_band
from firstorder.space.discontinuities._edges import dot, unit
from firstorder.space.intersect import first_shape
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


def check_concrete(scene: Scene, at: Receiver) -> None:
    """Refuse what cannot be looked at on the host."""
    if not is_concrete((scene, at)):
        raise ValueError("Arguments `scene` and `at` must be concrete, but are traced.")
    check_one_band("scene", scene)
    if callable(scene.environment):
        raise ValueError(
            "Argument `scene` must have a sky of one radiance here, but it is a function."
        )


def light(scene: Scene, at: Receiver, origins, along) -> np.ndarray:
    """Radiance that arrives along rays, against their directions, shape (...) [W/(m^2 sr)].

    Args:
        scene: of one band.
        at: its shape is not met by the rays, which start on it.
        origins: shape (..., 3) [m].
        along: directions of any length, likewise.
    """
    origins, along = np.broadcast_arrays(origins, unit(np.asarray(along)))
    flat = origins.reshape(-1, 3), along.reshape(-1, 3)
    if not len(flat[0]):
        return np.zeros(origins.shape[:-1])
    dtype = at.position.dtype
    rows = tuple(a.astype(dtype) for a in flat)
    return host_rows(lambda rows: _light(scene, at.on, *rows), rows).reshape(origins.shape[:-1])


@eqx.filter_jit
def _light(scene: Scene, on, origins, along):
    index = first_shape(scene, origins, along, on)

    def one(index, origin, along):
        point, _, _ = scene.surface(jnp.maximum(index, 0), origin, along)
        sent = scene.emitted(jnp.maximum(index, 0), point, along)
        return jnp.where(index >= 0, sent, scene.sky(along))

    return jax.vmap(one)(index, origins, along)


def crossing_sum(
    scene: Scene, at: Receiver, eye, planes, towards, hair
) -> tuple[np.ndarray, np.ndarray]:
    """Alternating sum of radiance about the place where two edges cross for an eye.

        K = L(++) - L(+-) - L(-+) + L(--)

    Zero unless both edges are seen there: then it is the jump, across the one edge, of the jump
    across the other.

    Args:
        scene: of one band.
        at: its shape is not met by the rays.
        eye: shape (n, 3) [m].
        planes: normals of the planes through the eye and each of the two edges, two of (n, 3).
        towards: vectors that point to the positive side of either edge, likewise; and a third,
            about along which the crossing is seen.
        hair: angle from the crossing to the rays, shape (n,) [rad].

    Returns:
        The sums, and the unit directions to the crossings.
    """
    first, second = (unit(n) for n in planes)
    u = unit(np.cross(first, second))
    u = u * np.sign(dot(u, towards[2]))[:, None]
    # Along the image of the second edge the first one is crossed, and the other way round.
    ways = [np.cross(second, u), np.cross(first, u)]
    ways = [w * np.sign(dot(w, q))[:, None] for w, q in zip(ways, towards[:2], strict=True)]
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    aside = np.einsum("sk,knc->snc", signs, np.stack(ways)) * hair[:, None]
    L = light(scene, at, eye, u + aside)
    return L[0] - L[1] - L[2] + L[3], u


def steps(at: Receiver, far: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, " n"], float]:
    """How far eyes are moved off events [m], and the share of that at which rays pass edges.

    Args:
        at: for its precision.
        far: distance of the nearest thing that an event is about [m].
    """
    eps = float(np.finfo(at.position.dtype).eps)
    return far * eps**0.375, eps**0.125


def tangential(at: Receiver, m: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """The part of vectors in the plane of the receivers."""
    normal = np.asarray(at.normal)
    return m - dot(m, normal)[..., None] * normal


def is_seen(scene: Scene, strength) -> np.ndarray:
    """Whether sums of differences of radiance are more than rounding."""
    emission = np.asarray(scene.material.emission)
    most = max(np.max(emission), np.max(np.asarray(scene.environment)))
    return np.abs(strength) > 1e3 * np.finfo(emission.dtype).eps * most
