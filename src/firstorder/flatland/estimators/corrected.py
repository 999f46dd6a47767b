"""The stratified estimator, corrected for the three terms that it leaves out.

Three terms are corrected, all from rays that are cast anyway or by bisection, none from the exact
visibility: where a border lies, how far away it is, and what its second motion lacks.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import check_integer, check_not_negative
from firstorder.conventions import direction
from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.estimators._incident import incident_radiance
from firstorder.flatland.estimators._irradiance_forms import (
    border_derivatives,
    with_horizon,
)
from firstorder.flatland.estimators.strata import Samples, Strata, trace_strata
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._compiled import compiled
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._derivatives import Derivatives
from firstorder.visibility.edge_angles import edge_at


@compiled
def corrected_estimate(
    scene: Scene,
    at: Receiver,
    *,
    samples: Samples,
    radiance: Radiance | None = None,
    breaks: int = 64,
    halvings: int = 44,
    sliding: ArrayLike = True,
) -> Derivatives:
    """The stratified form, corrected so that its gradient and its Hessian tend to the truth.

    Between two samples that see different curves the edge is found by bisection, in the angle. Its
    distance is that of the nearer curve there; where that is a contour, that of the point of
    tangency. Between two samples of one curve the border's own distance is used, not the smaller of
    theirs. The Hessian by translation gets, with front f and background b of an edge,

        (L_f - L_b) cos(a) R / r_f^3 e e^T  -+  dL_b/da cos(a) (1/r_f - 1/r_b)^2 e e^T

    where `e = (cos a, sin a)`, R is the radius of a curved blocker (0 at an end or a corner), and
    the sign is minus if the background is on the side of greater angles. The first is the sliding
    of the tangent point, the second that the edge uncovers other points of the background.

    Valid for scenes whose edges the samples separate: an object thinner than a stratum may be
    missed, and so may breaks beyond the first `breaks`. `radiance` must be smooth enough along its
    curve for `dL_b/da`; its own jumps (the shadows of a point light) are placed to within a
    stratum, so that the error is of first order in its width there, and of order 3/2 elsewhere.

    Args:
        scene: shapes and environment; as given to `trace_strata`.
        at: one receiver.
        samples: of `trace_strata`.
        radiance: as given to `trace_strata`.
        breaks: most edges that are looked for.
        halvings: of the angle between two samples, to find an edge.
        sliding: one truth value; False leaves the two terms out, and gives the limit of
            `stratified_estimate`.

    Raises:
        ValueError: for a row of receivers, or if a count is negative.

    Reference: J12 §5, eqs. 47 and 51, corrected.

    Example:
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.estimators import corrected_estimate, hemicircle_strata
        >>> from firstorder.flatland.estimators import trace_strata
        >>> from firstorder.flatland.library import scene_a
        >>> at = Receiver((0.25, 0.0), 0.0)
        >>> rays = trace_strata(scene_a(), at, where=hemicircle_strata(64))
        >>> E = corrected_estimate(scene_a(), at, samples=rays, breaks=4)
        >>> round(E.translation().first.item(), 3)  # the truth, too
        -0.401
    """
    check_asked_one(scene, Scene, at, Receiver)
    for name, count in (("breaks", breaks), ("halvings", halvings)):
        check_integer(name, count)
        check_not_negative(name, count)
    w = 1.0 / samples.distance
    code = 2 * samples.index + samples.front
    apart = code[1:] != code[:-1]
    (found,) = jnp.nonzero(apart, size=min(breaks, apart.shape[0]), fill_value=-1)
    there, below = found >= 0, jnp.maximum(found, 0)
    # Each border's own distance on the curve above it, and the found ones' on that below too.
    borders = samples.strata.borders[1:-1]
    own = _inverse(
        scene,
        at,
        jnp.concatenate([borders, borders[below]]),
        jnp.concatenate([samples.index[1:], samples.index[below]]),
    )
    over, under = own[: borders.shape[0]], own[borders.shape[0] :]
    taken = jnp.zeros_like(apart).at[jnp.where(there, found, apart.shape[0])].set(True, mode="drop")
    smooth = edge_at(
        borders,
        jnp.where(apart | ~jnp.isfinite(over), jnp.maximum(w[:-1], w[1:]), over),
        jnp.where(taken, 0.0, samples.radiance[:-1] - samples.radiance[1:]),
    )
    found = there, below, under, over[below]
    cut, drag = _edges(scene, at, samples, radiance, found, halvings, sliding)
    whole = border_derivatives(jax.tree.map(lambda a, b: jnp.concatenate([a, b]), smooth, cut))
    return with_horizon(eqx.tree_at(lambda m: m.hessian, whole, whole.hessian + drag), samples)


def _inverse(
    scene: Scene, at: Receiver, angles: Float[Array, " n"], index: Int[Array, " n"]
) -> Float[Array, " n"]:
    """One over the distance of given shapes in given directions; 0 for the sky, NaN for a miss."""
    along = direction(at.n + angles)
    t, _ = jax.vmap(lambda i, d: scene.hit(jnp.maximum(i, 0), at.position, d, at.on))(index, along)
    return jnp.where(index < 0, 0.0, jnp.where(jnp.isfinite(t), 1.0 / t, jnp.nan))


def _edges(scene, at: Receiver, samples: Samples, radiance, found, halvings: int, sliding):
    """The borders that edges make, three for each, and what the Hessian lacks at them."""
    there, below, own_under, own_over = found
    above = jnp.minimum(below + 1, samples.radiance.shape[0] - 1)
    seen, edge = _bisected(scene, at, samples, radiance, below, above, halvings)
    under, over = (jax.tree.map(lambda a, i=i: a[i], seen) for i in (0, 1))
    w_under, w_over = _limb(under), _limb(over)
    front_under = w_under >= w_over
    w = jnp.where(front_under, w_under, w_over)
    bend = jnp.where(sliding, jnp.where(front_under, _bend(under), -_bend(over)), 0.0)
    # The stratum that an edge cuts gets the radiance beside the edge for its other part.
    border, none = samples.strata.borders[above], jnp.zeros_like(w)
    beyond = edge > border
    at_under = jnp.where(beyond & jnp.isfinite(own_under), own_under, w_under)
    at_over = jnp.where(~beyond & jnp.isfinite(own_over), own_over, w_over)
    jumps = (
        under.radiance - over.radiance,
        samples.radiance[below] - under.radiance,
        over.radiance - samples.radiance[above],
    )
    cut = edge_at(
        jnp.concatenate([edge, jnp.minimum(border, edge), jnp.maximum(border, edge)]),
        jnp.concatenate([w, at_under, at_over]),
        jnp.concatenate([jnp.where(there, jump, 0.0) for jump in jumps]),
        jnp.concatenate([bend, none, none]),
    )
    behind = (jnp.where(front_under, a, b) for a, b in zip(*map(_side, (over, under)), strict=True))
    slope = _slope(scene, at, radiance, edge, *behind)
    strength = jnp.where(front_under, -1.0, 1.0) * slope * jnp.cos(edge) * (w_under - w_over) ** 2
    e = jnp.stack([jnp.cos(edge), jnp.sin(edge)], -1)
    drag = jnp.einsum("k,ki,kj->ij", jnp.where(there & sliding, strength, 0.0), e, e)
    return cut, jnp.pad(drag, (0, 1))


def _bisected(scene, at: Receiver, samples: Samples, radiance, below, above, halvings: int):
    """Samples just below and just above each edge, in two rows, and the edge's angle."""
    index, front = samples.index[below], samples.front[below]
    ends = samples.strata.angles[below], samples.strata.angles[above]
    eps = float(jnp.finfo(ends[0].dtype).eps)

    def seen(angles, radiance):
        flat = angles.ravel()
        found = trace_strata(
            scene,
            at,
            where=Strata(jnp.pad(flat, (0, 1)), flat, jnp.ones_like(flat)),
            radiance=radiance,
        )
        found = eqx.tree_at(lambda s: s.strata, found, None)
        return jax.tree.map(lambda a: a.reshape(*angles.shape, *a.shape[1:]), found)

    def halve(_, ends):
        low, high = ends
        middle = 0.5 * (low + high)
        half = seen(middle, None)  # its radiance is not asked for
        # On a contour the side is decided by rounding; nothing else has a cosine as small.
        same = (half.index == index) & ((half.front == front) | (half.cosine < 4.0 * eps**0.5))
        wide = high - low > eps ** (2.0 / 3.0)
        return jnp.where(wide & same, middle, low), jnp.where(wide & ~same, middle, high)

    low, high = jax.lax.fori_loop(0, halvings, halve, ends)
    return seen(jnp.stack([low, high]), radiance), 0.5 * (low + high)


def _side(seen: Samples):
    """Shape and side that each sample sees."""
    return seen.index, seen.front


def _is_limb(seen: Samples):
    """Whether the ray grazes a curve that bends: only a contour has such a cosine.

    The bisection stops `eps^(2/3)` from it, where the cosine is the root of `2 r / R` times that.
    """
    small = max(1e-2, 16.0 * float(jnp.finfo(seen.cosine.dtype).eps) ** (1.0 / 3.0))
    return (seen.cosine < small) & (seen.curvature > 0.0)


def _limb(seen: Samples):
    """One over the distance of the edge: a contour's point of tangency is `R cos_y` further on."""
    limb = _is_limb(seen)
    R = 1.0 / jnp.where(limb, seen.curvature, 1.0)
    return 1.0 / (seen.distance + jnp.where(limb, R * seen.cosine, 0.0))


def _bend(seen: Samples):
    """`R / r^3` at a contour, else 0."""
    limb = _is_limb(seen)
    R = 1.0 / jnp.where(limb, seen.curvature, 1.0)
    return jnp.where(limb, R * _limb(seen) ** 3, 0.0)


def _slope(scene, at: Receiver, radiance, angles, index, front):
    """`dL/da` of the surface behind an edge, at the edge, as if nothing stood before it."""

    def L(angle, index, front):
        along = direction(at.n + angle)
        _, s = scene.hit(jnp.maximum(index, 0), at.position, along, at.on)
        return incident_radiance(scene, radiance, index, s, front, along)

    def one(angle, index, front):
        return jax.jvp(lambda a: L(a, index, front), (angle,), (jnp.ones_like(angle),))[1]

    return jax.vmap(one)(angles, index, front)
