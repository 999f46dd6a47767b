"""Rays through the strata of a hemicircle: the input of every sampled estimator.

Angles are local, counter-clockwise from the receiver's normal, and ascend; the paper measures
towards +x, so its i-th border from the left is ours from the right.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import is_concrete
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.estimators._incident import incident_radiance
from firstorder.flatland.intersect import nearest
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import HORIZON, Receiver
from firstorder.numerics._compiled import compiled
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.scene._arguments import check_asked_one, numbers
from firstorder.typing import as_float


class Strata(Module):
    """Sectors of the hemicircle with one direction in each.

    Attributes:
        borders: local angles from -pi/2 to pi/2, ascending; none may be left out [rad].
        angles: one direction in each sector [rad].
        weights: inverse density of that direction, so that `sum(weights f(angles))` estimates
            `int f dtheta` [rad].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland.estimators import Strata
        >>> whole = Strata(jnp.array([-1.57, 1.57]), jnp.array([0.0]), jnp.array([3.14]))
        >>> whole.angles.shape
        (1,)
    """

    borders: Float[Array, " n_1"]
    angles: Float[Array, " n"]
    weights: Float[Array, " n"]


class Samples(Module):
    """First hits of the rays of all strata; vectors are in the receiver's frame (tangent, normal).

    Attributes:
        strata: where was looked.
        radiance: arriving along each direction [W/(m rad)].
        distance: to what is seen, infinity where nothing is [m].
        normal: of the seen side; opposite to the direction where nothing is seen.
        cosine: between that normal and the way back, positive.
        curvature: of the seen curve there, without sign [1/m].
        index: number of the seen shape, -1 for none.
        front: whether its front is seen.
        s: the parameter on it.
    """

    strata: Strata
    radiance: Float[Array, " n"]
    distance: Float[Array, " n"]
    normal: Float[Array, "n 2"]
    cosine: Float[Array, " n"]
    curvature: Float[Array, " n"]
    index: Int[Array, " n"]
    front: Bool[Array, " n"]
    s: Float[Array, " n"]


def hemicircle_strata(
    borders: ArrayLike,
    key: PRNGKeyArray | None = None,
    cosine: bool = False,
) -> Strata:
    """Sectors of the hemicircle and a direction in each: jittered, or in the middle.

    Args:
        borders: how many sectors of equal measure, or the borders themselves, ascending from
            -pi/2 to pi/2 [rad].
        key: for a random direction in each sector; None takes the middle.
        cosine: measure by the sine (cosine-weighted) and not by the angle.

    Raises:
        ValueError: if there is no sector, or borders do not ascend from -pi/2 to pi/2.

    Example:
        >>> from firstorder.flatland.estimators import hemicircle_strata
        >>> hemicircle_strata(4).angles.round(4).tolist()
        [-1.1781, -0.3927, 0.3927, 1.1781]
    """
    edges = _borders(borders, cosine)
    low, high = edges[:-1], edges[1:]
    share = 0.5 if key is None else jax.random.uniform(key, low.shape, low.dtype)
    if not cosine:
        return Strata(edges, low + share * (high - low), high - low)
    low, high = jnp.sin(low), jnp.sin(high)
    angles = jnp.arcsin(low + share * (high - low))
    return Strata(edges, angles, (high - low) / jnp.cos(angles))


def _borders(borders, cosine: bool) -> Array:
    if isinstance(borders, (int, np.integer)):
        if borders < 1:
            raise ValueError(f"Argument `borders` must be positive, but is {borders}.")
        even = jnp.linspace(-1.0, 1.0, borders + 1)
        return jnp.arcsin(even) if cosine else HORIZON * even
    edges = as_float(borders)
    if edges.ndim != 1 or edges.shape[0] < 2:
        raise ValueError(
            "Argument `borders` must be how many sectors, or a row of borders, but has shape "
            f"{edges.shape}."
        )
    if is_concrete(edges):
        ascends = bool(jnp.all(edges[1:] > edges[:-1]))
        spans = bool(jnp.max(jnp.abs(jnp.abs(edges[jnp.array([0, -1])]) - HORIZON)) < 1e-6)
        if not (ascends and spans):
            raise ValueError("Argument `borders` must ascend from -pi/2 to pi/2.")
    return edges


def gap_quadrature(ends: ArrayLike, nodes: int) -> Strata:
    """A quadrature over gaps between silhouettes, as strata of which each node is one.

    The sine of a new variable takes the place of the angle in each gap, so that integrands that
    grow like an inverse square root at an occluding contour are integrated as fast as smooth ones.

    Args:
        ends: ends of the gaps, `view(scene, receiver).angles` [rad].
        nodes: in each gap.

    Raises:
        ValueError: if `nodes` is not positive, or `ends` are not those of one receiver.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland.estimators import gap_quadrature
        >>> strata = gap_quadrature(jnp.array([-0.5, 0.0, 0.5]), 8)
        >>> round(jnp.sum(strata.weights * jnp.cos(strata.angles)).item(), 6)  # 2 sin 0.5
        0.958851
    """
    ends = numbers("ends", ends)
    if ends.ndim != 1 or ends.shape[0] < 2:
        raise ValueError(
            f"Argument `ends` must be a row of two angles or more, but has shape {ends.shape}."
        )
    t, w = (jnp.asarray(a, ends.dtype) for a in gauss_legendre(nodes))
    half, middle = 0.5 * (ends[1:] - ends[:-1])[:, None], 0.5 * (ends[1:] + ends[:-1])[:, None]
    angles = (middle + half * jnp.sin(HORIZON * t)).ravel()
    weights = (half * HORIZON * jnp.cos(HORIZON * t) * w).ravel()
    inner = 0.5 * (angles[1:] + angles[:-1])
    return Strata(jnp.concatenate([ends[:1], inner, ends[-1:]]), angles, weights)


@compiled
def trace_strata(
    scene: Scene, at: Receiver, *, where: Strata, radiance: Radiance | None = None
) -> Samples:
    """First hits of one ray in each stratum.

    Automatic differentiation of what rays see knows of no shadow edge: it is finite, and wrong.
    The forms made from them are derivatives already.

    Args:
        scene: shapes and environment; point lights cannot be met by a ray and do not count.
        at: one receiver.
        where: directions.
        radiance: what shapes send out in place of their emission (see `irradiance`).

    Raises:
        ValueError: for a row of receivers.

    Example:
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.estimators import hemicircle_strata, trace_strata
        >>> from firstorder.flatland.library import scene_a
        >>> rays = trace_strata(scene_a(), Receiver((0.0, 0.0), 0.0), where=hemicircle_strata(5))
        >>> rays.radiance.tolist()  # the lamp is straight above
        [0.0, 0.0, 1.0, 0.0, 0.0]
    """
    check_asked_one(scene, Scene, at, Receiver)
    along = direction(at.n + where.angles)
    hits = nearest(scene, jnp.broadcast_to(at.position, along.shape), along, at.on)
    met = hits.index >= 0
    number = jnp.maximum(hits.index, 0)

    def one(i, s, d):
        frame = scene.frame(i, s)
        front = cross_2d(frame.tangent, d) < 0.0
        normal = jnp.where(front, 1.0, -1.0) * frame.normal
        local = jnp.stack([dot_2d(normal, at.tangent), dot_2d(normal, at.normal)])
        return front, local, -dot_2d(normal, d), jnp.abs(frame.kappa)

    front, normal, cosine, curvature = jax.vmap(one)(number, hits.s, along)
    L = jax.vmap(lambda i, s, f, d: incident_radiance(scene, radiance, i, s, f, d))(
        hits.index, hits.s, front, along
    )
    return Samples(
        where,
        L,
        hits.t,
        jnp.where(met[:, None], normal, -direction(where.angles)),
        jnp.where(met, cosine, 1.0),
        jnp.where(met, curvature, 0.0),
        hits.index,
        front & met,
        hits.s,
    )
