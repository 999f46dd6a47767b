"""Irradiance and its derivatives by the motion of a receiver, from rays gathered over a hemisphere.

A receiver in space has five freedoms that change its irradiance: along its two tangents, along its
normal, and a tilt of the normal towards each tangent. Both forms return value, gradient and Hessian
by all five (`Derivatives`), so that translation, rotation and travel along a curved receiver are
read off one result.

Both forms are the paper's approximations. What each leaves out is said in its docstring.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_kind
from firstorder._display import Module
from firstorder.numerics._compiled import compiled
from firstorder.scene._arguments import check_asked
from firstorder.scene._derivatives import SPACE, Derivatives
from firstorder.space.estimators._gather_sums import WallSweeps, jumps_across, surface_area_sums
from firstorder.space.estimators.strata import Strata
from firstorder.space.intersect import nearest
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


class Samples(Module):
    """Ray samples of a hemisphere, one in each cell; vectors are in the receiver's frame.

    Attributes:
        strata: where was looked.
        radiance: arriving along each direction [W/(m^2 sr)].
        distance: to what is seen, infinity where nothing is [m].
        normal: of the seen side; opposite to the direction where nothing is seen.
        cosine: between that normal and the way back, positive.
        index: number of what is seen, -1 for nothing.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.estimators import Samples, hemisphere_strata
        >>> cells, one = hemisphere_strata(2, 4), jnp.ones((2, 4))
        >>> sky = Samples(cells, one, jnp.inf * one, -cells.directions, one, -jnp.ones((2, 4), int))
        >>> round(jnp.sum(sky.radiance * cells.projected).item(), 6)  # pi
        3.141593
    """

    strata: Strata
    radiance: Float[Array, "*k m n"]
    distance: Float[Array, "*k m n"]
    normal: Float[Array, "*k m n 3"]
    cosine: Float[Array, "*k m n"]
    index: Int[Array, "*k m n"]


class TracedRays(Module):
    """First hits of r rays, as a tracer returns them.

    Attributes:
        distance: to what is met, infinity for nothing [m].
        index: number of what is met, -1 for nothing.
        normal: unit, in world coordinates, of either side.
    """

    distance: Float[Array, " r"]
    index: Int[Array, " r"]
    normal: Float[Array, "r 3"]


Trace = Callable[[Array, Array, Array], TracedRays]
RadianceOf = Callable[[Array, Array, Array, Array], Array]


def scene_tracer(scene: Scene) -> Trace:
    """A tracer of the shapes of a scene, for `gather_samples`: by origins, directions and `on`."""

    def trace(origins, along, on):
        hits = nearest(scene, origins, along, on)
        found = jnp.where(hits.index >= 0, hits.t, 0.0)
        normal = jax.vmap(scene.normal)(
            jnp.maximum(hits.index, 0), origins + found[:, None] * along
        )
        return TracedRays(hits.t, hits.index, normal)

    return trace


@compiled
def trace_strata(
    scene: Scene, at: Receiver, *, where: Strata, radiance: RadianceOf | None = None
) -> Samples:
    """Samples of a scene's shapes and sky by one ray into each cell over each receiver.

    Args:
        scene: shapes, their emission and the sky.
        at: receivers, with any leading axes.
        where: cells, with the same leading axes or none.
        radiance: what shapes send out in place of their emission (see `gather_samples`).

    Raises:
        ValueError: if the receiver is not one, its number is that of no shape, or cells have other
            leading axes than receivers.
        TypeError: if cells are none, or `radiance` is no function.

    Example:
        >>> import jax
        >>> from firstorder.space import Scene, receiver, rectangle, primitive
        >>> from firstorder.space.estimators import trace_strata
        >>> from firstorder.space.estimators import stratified_estimate
        >>> from firstorder.space.estimators import hemisphere_strata
        >>> lamp = rectangle((0.5, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0))
        >>> form = jax.jit(lambda at: stratified_estimate(trace_strata(scene, at,
        ...     where=hemisphere_strata(40, 160))))
        >>> round(form(receiver((0.0, 0.0, 0.0))).translation().gradient[0].item(), 1)
        0.6
    """
    check_asked(scene, Scene, at, Receiver)
    if not (radiance is None or callable(radiance)):
        raise TypeError("Argument `radiance` must be a function of hits, but is none.")
    emitted = jax.vmap(lambda i, p, n, d: scene.emitted(i, p, d))
    return gather_samples(scene_tracer(scene), radiance or emitted, at, where, jax.vmap(scene.sky))


def gather_samples(
    trace: Trace,
    radiance_of: RadianceOf,
    at: Receiver,
    where: Strata,
    sky: Callable[[Array], Array] | None = None,
) -> Samples:
    """Samples of one ray in each cell of each receiver's hemisphere, from one call of the tracer.

    Automatic differentiation of what rays see knows of no shadow edge: it is finite, and wrong.
    The forms made from them are derivatives already.

    Args:
        trace: from origins (r, 3) and directions (r, 3) of rays in world coordinates and the number
            (r,) of the shape on which each starts, or -1, to `TracedRays`.
        radiance_of: from index, point, normal of the seen side, and direction of r rays to the
            radiance that is sent back along them; called for misses too, with an index of 0.
        at: receivers, with any leading axes.
        where: cells, with the same leading axes or none.
        sky: radiance from unit world directions (r, 3) in which nothing is met; None is dark.
    """
    check_kind("where", where, Strata, "cells of `hemisphere_strata`")
    lead, own = where.weights.shape[:-2], at.position.shape[:-1]
    if lead not in ((), own):
        raise ValueError(
            f"Argument `where` must have no leading axes or those of the receivers, {own}, but has "
            f"{lead}."
        )
    cells = (*own, *where.weights.shape[-2:])
    local = jnp.broadcast_to(where.directions, (*cells, 3))
    along = jnp.einsum("...ij,...mnj->...mni", at.axes, local).reshape(-1, 3)
    origins = jnp.broadcast_to(at.position[..., None, None, :], (*cells, 3)).reshape(-1, 3)
    on = jnp.broadcast_to(at.on[..., None, None], cells).ravel()
    met = trace(origins, along, on)
    found = met.index >= 0
    side = -jnp.sum(met.normal * along, -1)
    normal = jnp.where(side < 0.0, -1.0, 1.0)[:, None] * met.normal
    point = origins + jnp.where(found, met.distance, 1.0)[:, None] * along
    L = radiance_of(jnp.maximum(met.index, 0), point, normal, along)
    L = jnp.where(found, L, 0.0 if sky is None else sky(along))
    turned = jnp.einsum("...ji,...mnj->...mni", at.axes, normal.reshape(local.shape))
    seen = found.reshape(cells)
    return Samples(
        where,
        L.reshape(cells),
        jnp.where(found, met.distance, jnp.inf).reshape(cells),
        jnp.where(seen[..., None], turned, -local),
        jnp.where(seen, jnp.abs(side).reshape(cells), 1.0),
        met.index.reshape(cells),
    )


# --- surface area ---------------------------------------------------------------------------------


@compiled
def surface_area_estimate(samples: Samples) -> Derivatives:
    """Derivatives with radiance and visibility frozen on surfaces: the geometry term alone moves.

    `d E = int L V dG da(y)`, over the hemisphere by `da = r^2 dw / cos_y`.

    Valid for diffuse surfaces where no shadow edge lies on anything that shines: free of bias
    then. Wrong in a penumbra (the edge on the surface behind moves, and the form keeps it), and, if
    something shines at the horizon, in what belongs to a step along the normal or a tilt twice
    (E_zz, E_za, E_aa: the horizon itself sweeps over it; E_aa lacks `int L e_rho e_rho^T dphi`).
    By solid angle the integrand grows as `1 / (r cos_y)`, whose square is not integrable before
    occluding contours: noisy there, and near what is close.

    Args:
        samples: of `gather_samples`.

    Reference: J12 §7.1-7.2, eqs. 56-58, 65, 66.

    Example:
        >>> from firstorder.space import receiver
        >>> from firstorder.space.estimators import hemisphere_strata, surface_area_estimate
        >>> from firstorder.space.estimators import trace_strata
        >>> from firstorder.space.library import j12_box
        >>> at = receiver((0.5, 0.5, 0.0), on=0)
        >>> rays = trace_strata(j12_box(), at, where=hemisphere_strata(16, 32))
        >>> round(surface_area_estimate(rays).value.item(), 2)
        0.2
    """
    check_kind("samples", samples, Samples, "samples of `trace_strata`")
    b, where = samples.cosine, samples.strata
    faces = b > 0.0
    met = jnp.isfinite(samples.distance) & faces  # what is infinitely far moves by no step
    share = jnp.where(faces, where.weights * samples.radiance, 0.0)
    x = jnp.where(met, share, 0.0) / jnp.where(met, samples.distance, 1.0)
    y = x / jnp.where(met, samples.distance, 1.0)
    b = jnp.where(faces, b, 1.0)
    directions = jnp.broadcast_to(where.directions, samples.normal.shape)
    u, n = _rays(directions), _rays(samples.normal / b[..., None])
    share, x, y = (w.reshape(*w.shape[:-2], -1) for w in (share, x, y))
    value = jnp.einsum("...r,...ir->...i", share, u)
    rows = jnp.concatenate([x[..., None, :] * u, y[..., None, :]], -2)
    moved, H = surface_area_sums(rows, y * u[..., 2, :], u, n)
    # Row k of a step: of the light through a plane with axis k, whose cosine changes too.
    eye = jnp.eye(3, dtype=b.dtype)
    step = moved[..., :3, :] - jnp.sum(x, -1)[..., None, None] * eye
    fall = eye[2][:, None] * moved[..., 3, None, :]
    H = H - fall - jnp.swapaxes(fall, -1, -2)
    twice = -value[..., 2, None, None] * eye[:2, :2]
    turn, mixed = value[..., :2], jnp.swapaxes(step[..., :2, :], -1, -2)
    gradient = jnp.concatenate([step[..., 2, :], turn], -1)
    return Derivatives(value[..., 2], gradient, _blocks(H, mixed, twice), SPACE)


def _rays(vectors):
    return jnp.swapaxes(vectors.reshape(*vectors.shape[:-3], -1, 3), -1, -2)


def _blocks(H, mixed, twice):
    upper = jnp.concatenate([H, mixed], -1)
    lower = jnp.concatenate([jnp.swapaxes(mixed, -1, -2), twice], -1)
    return jnp.concatenate([upper, lower], -2)


# --- strata ---------------------------------------------------------------------------------------


@compiled
def stratified_estimate(samples: Samples) -> Derivatives:
    """Derivatives from differences of radiance across walls that move as their nearer sample.

    A wall between cells is carried along by the nearer of both, at the distance `min(r, r')`, and
    sweeps the radiance that it separates: with the direction's motion `-(I - w w^T) dx / r`,

    `grad E = sum over circles (L_out - L_in) sin cos / r (cos C, -sin dphi)
    + sum over meridians (L_after - L_before) (sin theta+ - sin theta-) / r (e_phi, 0)`

    with `C = int e_rho dphi` along the circle. Only the motion of a wall along its normal sweeps
    anything, and the normals of a staircase add up to those of the edge that it follows: so this
    tends to the truth, shadow edges included, for any stratification. Cosines are integrated along
    the walls and over the cells, so there is no division by the sine and the pole is a cell's
    corner like any other; the horizon does not move. Misses do not move either.

    The Hessian: by two tilts exact for the cells, the light at the horizon included; by a step and
    a tilt by the same motion of walls. **By two steps strata give none** (a staircase has the
    normals of an edge but not its bends): that block is the
    surface-area form's, without shadow edges.

    Args:
        samples: of `gather_samples`.

    Returns:
        E with derivatives. The value is that of constant radiance in each cell (J12 61).

    Reference: J12 §7.1, eqs. 59-64 (62-64 are misprinted).

    Example:
        >>> from firstorder.space import receiver
        >>> from firstorder.space.estimators import hemisphere_strata, stratified_estimate
        >>> from firstorder.space.estimators import trace_strata
        >>> from firstorder.space.library import j12_box
        >>> at = receiver((0.5, 0.5, 0.0), on=0)
        >>> rays = trace_strata(j12_box(), at, where=hemisphere_strata(16, 32))
        >>> round(stratified_estimate(rays).value.item(), 2)
        0.2
    """
    check_kind("samples", samples, Samples, "samples of `trace_strata`")
    value, turn, twice = _turning(samples)
    step, mixed = _swept(samples)
    H = surface_area_estimate(samples).hessian[..., :3, :3]
    return Derivatives(value, jnp.concatenate([step, turn], -1), _blocks(H, mixed, twice), SPACE)


def _squares(phi):
    """`int e_rho e_rho^T dphi` (n, 2, 2) over each column."""
    half, c = 0.5 * jnp.diff(phi), 0.25 * jnp.diff(jnp.sin(2.0 * phi))
    off = 0.5 * jnp.diff(jnp.sin(phi) ** 2)
    return jnp.stack([jnp.stack([half + c, off], -1), jnp.stack([off, half - c], -1)], -1)


def _turning(samples: Samples):
    """E, its gradient and Hessian by tilts: `int L w_t dw` and `-E I + int L e_rho e_rho^T dphi`.

    The latter runs along the horizon, which a tilt sweeps over what shines there.
    """
    where, L = samples.strata, samples.radiance
    arc, square = WallSweeps.of(where.theta, where.phi).arc, _squares(where.phi)
    value = jnp.einsum("mn,...mn->...", where.projected, L)
    lens = 0.5 * jnp.diff(where.theta - 0.5 * jnp.sin(2.0 * where.theta))  # int sin^2
    turn = jnp.einsum("m,ni,...mn->...i", lens, arc, L)
    horizon = jnp.einsum("nij,...n->...ij", square, L[..., -1, :])
    return value, turn, horizon - value[..., None, None] * jnp.eye(2, dtype=L.dtype)


def _swept(samples: Samples):
    """Gradient of E (3,) and of its gradient by tilts (3, 2): what all walls sweep by a step."""
    theta, phi = samples.strata.theta, samples.strata.phi
    walls, square = WallSweeps.of(theta, phi), _squares(phi)
    (circles, meridians), (near_c, near_m) = wall_jumps(samples)
    circles, meridians = circles * near_c, meridians * near_m
    s, c = jnp.sin(theta[1:-1]), jnp.cos(theta[1:-1])  # a circle's element is sin dphi
    vertical = -jnp.einsum("...mn,m,n->...", circles, c * s * s, jnp.diff(phi))
    across = jnp.einsum("...mn,m,nij->...ij", circles, c * s * s, square)
    down = -jnp.einsum("...mn,m,ni->...i", circles, s * s * s, walls.arc)
    here = jnp.stack([walls.beside[:, 1], -walls.beside[:, 0]], -1)
    falling = -jnp.diff(jnp.cos(theta))
    across = across + jnp.einsum("...mn,m,ni,nj->...ij", meridians, falling, walls.beside, here)
    step = jnp.concatenate([walls.gradient(circles, meridians), vertical[..., None]], -1)
    return step, jnp.concatenate([across, down[..., None, :]], -2)


def wall_jumps(samples: Samples):
    """Jumps of radiance across walls, and one over the distance that carries them."""
    return jumps_across(samples.radiance, 1.0 / samples.distance)
