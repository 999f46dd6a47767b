"""The hemicircle above a receiver: where silhouettes cut it, and what is seen between two cuts.

Only the cuts move with the receiver and the scene, and only they are differentiated. Their order,
the shapes between them and the sides from which these are seen are found once, without derivative,
for blocks of receivers that fit the cache.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import nan_unless
from firstorder.conventions import direction
from firstorder.flatland import _depth_order
from firstorder.flatland.intersect import _first_of_ranked
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import Shape
from firstorder.numerics._batching import in_batches, one_list
from firstorder.numerics._order import nearest_known, order_of
from firstorder.numerics._planar import cross_2d, dot_2d, left, sine_and_cosine
from firstorder.numerics._select import either
from firstorder.scene._intersect import picked, ranks

if TYPE_CHECKING:
    from firstorder.flatland.visible import Receiver

HORIZON = 0.5 * jnp.pi
MANY = 48  # cuts from which on blocks pay for being traced
LEVEL = 8.0  # roundings within which an edge lies in the horizon
FLAT = 1e-3  # and up to which angle [rad]
IN_CACHE = 2**15  # gaps whose tables stay in the cache


class Cuts(NamedTuple):
    """Where the view is cut, in no order; what lies below the horizon cuts it at its end.

    Attributes:
        sine: of the angle, counter-clockwise from the normal.
        cosine: of it, not negative.
        far: square of the distance to what cuts, without derivative; infinite for the sky's.
    """

    sine: Float[Array, " k"]
    cosine: Float[Array, " k"]
    far: Float[Array, " k"]


class Between(NamedTuple):
    """The shape seen in each gap between cuts, from the right edge of the view to the left one.

    Attributes:
        order: numbers of the cuts, counter-clockwise.
        shape: number of the nearest shape in each gap, -1 for none.
        front: whether its front is seen; None if that was not asked.
    """

    order: Int[Array, " k"]
    shape: Int[Array, " k_1"]
    front: Bool[Array, " k_1"] | None


def cuts_of(scene: Scene, at: Receiver, points: Float[Array, "c 2"] | None = None) -> Cuts:
    """The cuts of a view, in a unit in which squares of lengths keep their digits.

    Args:
        scene: the shapes, and an environment that may have breaks.
        at: one receiver.
        points: further ones in whose directions to cut.
    """
    found, valid = scene.silhouettes(at.position, at.on)
    if points is not None:
        found = jnp.concatenate([found, points])
        valid = jnp.concatenate([valid, jnp.ones(points.shape[0], bool)])
    # A point that does not exist is replaced before its angle is asked for: no NaN in gradients.
    way = either(valid[:, None], found - at.position, at.normal)
    side, up = cross_2d(at.normal, way), dot_2d(at.normal, way)
    low = _in_horizon(*jax.lax.stop_gradient((side, up, at.position))) | ~valid
    sine, cosine = sine_and_cosine(either(low, 0.0, side), either(low, 1.0, up))
    end = either(valid & (side < 0.0), jnp.full_like(side, -1.0), 1.0)
    sine, cosine = either(low, end, sine), either(low, 0.0, cosine)
    far = either(valid, jax.lax.stop_gradient(dot_2d(way, way)), jnp.inf)
    breaks = getattr(scene.environment, "breaks", None)
    if breaks is not None:
        angle = jnp.mod(breaks - at.n + jnp.pi, 2.0 * jnp.pi) - jnp.pi
        angle = jnp.clip(angle, -HORIZON, HORIZON)
        sine = jnp.concatenate([sine, jnp.sin(angle)])
        cosine = jnp.concatenate([cosine, jnp.maximum(jnp.cos(angle), 0.0)])
        far = jnp.concatenate([far, jnp.full_like(angle, jnp.inf)])
    known = jnp.isfinite(at.n) & jnp.all(jnp.isfinite(at.position)) & ~scene.unsound
    # As a factor, so that derivatives are NaN too.
    return Cuts(sine * nan_unless(known, jnp.ones_like(sine)), cosine, far)


def _in_horizon(
    side: Float[Array, " c"], up: Float[Array, " c"], position: Float[Array, "2"]
) -> Bool[Array, " c"]:
    """Which ways lead to the horizon, by rounding of the coordinates, or below it.

    An edge in the horizon, like the foot of a lamp on the floor, is the horizon's: there second
    derivatives are those of one side, and it must not be rounding that chooses. A way as short as
    rounding may lead anywhere; it is level only where it is flat.
    """
    flat = jnp.abs(side)
    off = LEVEL * jnp.finfo(up.dtype).eps * (flat + jnp.max(jnp.abs(position)))
    return up <= jnp.minimum(off, FLAT * flat)


def seen_between(scene: Scene, at: Receiver, cuts: Cuts, *, sides: bool = False) -> Between:
    """The shape seen in each gap between the cuts of a view. It has no derivative.

    Where cuts fall together (a visual event: edges in line) the gap between them shows what it
    would show if the nearest of these edges hid the others.

    Args:
        scene: the shapes.
        at: one receiver.
        cuts: of its view.
        sides: whether to tell from which side each is seen.
    """
    scene, at, cuts = jax.lax.stop_gradient((scene, at, cuts))
    # Not in blocks, which know nothing of other bands.
    rank, apart = ranks(scene.material.emission), _depth_order.ordered_by_depth(scene.groups)
    view = at.position, at.n, at.on, cuts
    if cuts.far.shape[0] < MANY:
        return _between(sides, scene.groups, rank, apart, view)
    rows = jax.tree.map(lambda a: a[None], view)
    most = max(1, IN_CACHE // (cuts.far.shape[0] + 1))

    def find(shared, rows):
        return in_batches(partial(_between, sides, *shared), rows, most)

    found = one_list(find)((scene.groups, rank, apart), rows)
    return jax.tree.map(lambda a: a[0], found)


def _between(
    sides: bool,
    groups: tuple[Shape, ...],
    rank: Int[Array, " n"],
    apart: Bool[Array, ""] | None,
    view: tuple,
) -> Between:
    """`seen_between` of one view, for shapes of which is known whether depth orders them."""
    position, n, on, cuts = view
    groups = tuple(group.ready() for group in groups)
    half = cuts.sine / (1.0 + cuts.cosine)  # the tangent of half the angle, which rises with it
    order = order_of(half)
    edge = jnp.ones((1,), half.dtype)
    ends = jnp.concatenate([-edge, half[order], edge])
    far = jnp.concatenate([edge, cuts.far[order], edge])
    middle = 0.5 * (ends[1:] + ends[:-1])
    stretch = 1.0 + middle * middle
    up, side = (1.0 - middle * middle) / stretch, 2.0 * middle / stretch
    normal = direction(n)
    along = up[:, None] * normal + side[:, None] * left(normal)

    def by_rays():
        rays = jnp.broadcast_to(position, along.shape), along, jnp.broadcast_to(on, len(along))
        return _first_of_ranked(groups, rank, rays)

    if apart is None:
        shape = by_rays()
    else:
        by_depth = partial(
            _depth_order.first_shape, groups, rank, (position, on, half, along, order)
        )
        shape = jax.lax.cond(apart, by_depth, by_rays)
    # What a ray through edges in line meets is a matter of rounding, but derivatives depend on it.
    empty = ends[1:] - ends[:-1] <= 8.0 * jnp.finfo(ends.dtype).eps * stretch
    before, after = nearest_known(shape, ~empty)
    shape = either(empty, either(_nearest_is_before(far, empty), after, before), shape)
    if not sides:
        return Between(order, shape, None)

    def seen_from_front(k, d):
        return picked(groups, k, lambda one: one.front(position, d, on == k))

    return Between(order, shape, jax.vmap(seen_from_front)(jnp.maximum(shape, 0), along))


def _nearest_is_before(far: Float[Array, " m_1"], empty: Bool[Array, " m"]) -> Bool[Array, " m"]:
    """Whether, of the cuts in line about each gap without width, the nearest is before it.

    Three on each side are looked at: farther ones count where five edges or more are in line.

    Args:
        far: squares of distances to the cuts, in order, with one number for each edge of the view.
        empty: whether a gap has no width.
    """

    def least(far, empty):  # of those before each gap
        n = empty.shape[0]
        far = jax.lax.pad(far[:-1], jnp.asarray(jnp.inf, far.dtype), [(2, 0, 0)])
        empty = jax.lax.pad(empty, False, [(2, 0, 0)])
        one = empty[1:-1]
        two = one & empty[:n]
        more = jnp.minimum(either(one, far[1:-1], jnp.inf), either(two, far[:n], jnp.inf))
        return jnp.minimum(far[2:], more)

    return least(far, empty) < least(far[::-1], empty[::-1])[::-1]
