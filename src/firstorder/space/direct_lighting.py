"""Net visibility and irradiance along silhouettes, exact and differentiable.

    E = sum over edges (L_left - L_right) contour + horizon

with the contour integrals of `visibility._contour`. For shapes of constant radiance under a
constant sky nothing else is needed: straight edges are closed forms, elliptic arcs smooth functions
of their parameter. Points of the edges and the cuts between them are differentiable functions of
receiver, blockers and lights, so automatic differentiation gives exact gradients and Hessians,
shadow edges included. `boundary_gradient` is the contour form of the first one, for any radiance.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import nan_unless
from firstorder.numerics._compiled import compiled_after
from firstorder.numerics._refinement import with_errors
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.numerics._vectors import unit
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._bands import by_band
from firstorder.scene._questions import check_lit, check_question
from firstorder.space.receiver import Receiver
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.silhouettes._closure import edges_close
from firstorder.space.silhouettes._collisions import check_apart, warn_of_collisions
from firstorder.space.silhouettes._edge_integrals import (
    arc_angle,
    arc_light,
    arc_upward,
    segment_angle,
    segment_light,
    segment_upward,
)
from firstorder.space.silhouettes._sides import SilhouetteSides
from firstorder.space.silhouettes.analytic import _Outlines
from firstorder.space.silhouettes.visible import (
    _cut_outlines,
    _eps,
    _harmless_parts,
    _is_outside,
    _outlines_from,
    _Pieces,
    visible_silhouettes,
)
from firstorder.visibility._contour import translation_rate

# What is seen in a direction of the receiver's frame: number of the shape or -1, and the direction.
Radiance = Callable[[Array, Array], Array]


@compiled_after(check_question)
@with_errors("nodes")
def net_visibility(
    scene: Scene, at: Receiver, *, nodes: int = 16, with_error: bool = False
) -> Float[Array, ""]:
    """The solid angle of the sky that a receiver sees [sr].

        B = integral over the hemisphere of V(w) dw

    Valid when: the receiver is outside of all closed shapes; inside there is no answer but NaN, and
    on an inner wall that `Receiver.on` names the sky is seen through the wall. An arc is given
    `nodes` Gauss-Legendre nodes between two cuts; the error falls geometrically.

    Args:
        scene: the blockers; what they emit does not count.
        at: the receiver.
        nodes: on each arc.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: for a row of receivers, or if `nodes` is not positive.

    Reference: R07 §7.2, eq. 47.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Scene, net_visibility, receiver, sphere, primitive
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
        >>> blocked = 2.0 * jnp.pi - net_visibility(scene, receiver((0.0, 0.0, 0.0)))
        >>> print(round(float(blocked / (2.0 * jnp.pi)), 6))  # 1 - cos(30 degrees)
        0.133975
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    found = _outlines_from(scene, at, common=False)  # which of two planes hides does not matter
    seen = jnp.zeros(scene.count + 1, at.position.dtype).at[-1].set(1.0)
    edges, sides, level, above, ways = _contours(found, at.axes, segment_angle, arc_angle, nodes)
    jump, over = sides.jump(seen), seen[above]
    total = jump @ edges + over @ level
    # Regions about axes below the horizon may have counted the whole sphere.
    whole = 4.0 * jnp.pi
    total = total - whole * jnp.floor(jax.lax.stop_gradient(total + jnp.pi) / whole)
    sound = _is_outside(scene, found) & edges_close([jump, over], ways, seen, _eps(found, at.axes))
    return nan_unless(sound, total)


@compiled_after(check_lit, check_apart, traced=warn_of_collisions)
@with_errors("nodes")
@by_band()
def irradiance(
    scene: Scene, at: Receiver, *, nodes: int = 16, with_error: bool = False
) -> Float[Array, "*bands"]:
    """Irradiance from shapes of constant radiance and a constant sky [W/m^2].

        E = integral over the hemisphere of L(w) cos(theta) dw

    Emitted light only: what shapes reflect is not gathered. Exact, shadow edges included, for the
    value and for every derivative, in the receiver (`Receiver.moved`, `Receiver.tilted`) and in
    all leaves of the scene: to rounding for straight edges and contours of balls. Rims of discs and
    cylinders and contours of ellipsoids take `nodes` on each arc between two cuts, which crowd
    where it is near. In a plane 1 m below a disc of 1 m and unit radiance E errs by up to 2e-10
    with 16 nodes and 2e-15 with 32, and 0.3 m below it by 3e-5 and 5e-10: `with_error` tells.

    Valid when: the sky is a number; the receiver is outside of all closed shapes (else NaN); shapes
    of different radiance do not run into each other: concrete ones that do are refused, and a
    traced receiver among them is warned. Traced ones are not looked at, but every answer is checked
    for edges of light that do not close, and is NaN then: of 1,920 random lamps that run into a
    body 12 were wrong and not NaN, where the body goes through the inside of the lamp and crosses
    none of its edges. A receiver on the inner wall of a room, a closed shape which `Receiver.on`
    names, gets the light of all that is in the room; the wall itself neither shines nor hides
    there, so that nothing may be outside and the sky must be 0.
    Where two edges are in line derivatives are one-sided. The unit of length does not matter:
    lengths may be 1e-30 to 1e30 in single precision, in which edges within 1e-5 of each other may
    be taken for one: of random scenes one in ten thousand is off by 3e-5 to 4e-5 times the largest
    radiance.

    Args:
        scene: shapes and sky.
        at: the receiver.
        nodes: on each arc between two cuts.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: if the sky is a function of direction, such as a panorama, which
            `azimuthal.transport_by_azimuth` takes, or concrete shapes that send unlike light
            to the receiver run into each other above its horizon, as two planes do. A corner or a
            rim that enters another shape by less than a tenth of its size may be missed.

    Reference: J12 §7.1; R07 §7.3.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.space import Scene, irradiance, receiver, rectangle, primitive
        >>> lamp = rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0))
        >>> at = receiver((0.5, 0.0, 0.0))
        >>> E, dE_dx = jax.value_and_grad(lambda x: irradiance(scene, at.moved(x)))(jnp.zeros(2))
        >>> print(round(float(E), 4), round(float(dE_dx[0]), 4))
        0.5666 -0.6324
    """
    check_asked_one(scene, Scene, at, Receiver)
    return _light(scene, at, segment_upward, arc_upward, nodes)[0]


@compiled_after(check_lit, check_apart, traced=warn_of_collisions)
@with_errors("nodes")
@by_band()
def vector_irradiance(
    scene: Scene, at: Receiver, *, nodes: int = 16, with_error: bool = False
) -> Float[Array, "3 *bands"]:
    """The vector of light in the receiver's frame: `integral of L(w) w dw` [W/m^2].

    Its z is the irradiance; turning the receiver's normal by `tilt` changes that by x and y.

    Args:
        scene: shapes and lights.
        at: one receiver.
        nodes: on each piece between two cuts.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: as `irradiance` does.

    Reference: J12 §7; Lambert.

    Example:
        >>> from firstorder.space import Scene, primitive, receiver, rectangle, vector_irradiance
        >>> lamp = rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0))
        >>> [round(a, 4) for a in vector_irradiance(scene, receiver((0.0, 0.0, 0.0))).tolist()]
        [0.0, 0.0, 0.7523]
    """
    check_asked_one(scene, Scene, at, Receiver)
    return jnp.stack(_light(scene, at, segment_light, arc_light, nodes))


def _light(scene: Scene, at: Receiver, segment, arc, nodes: int) -> list[Float[Array, ""]]:
    """The vector of light by those coordinates that the integrals find, of which z is the last."""
    if callable(scene.environment):
        raise ValueError(
            "Argument `scene` must have a sky of one radiance here, but it is a function: "
            "space.azimuthal.transport_by_azimuth takes one."
        )
    warn_of_collisions(scene, at)
    found = _outlines_from(scene, at)
    seen = _shown(scene, at, found)
    edges, sides, level, above, ways = _contours(found, at.axes, segment, arc, nodes)
    jump, over = sides.jump(seen), seen[above]
    total = [jump @ e for e in edges]
    total[-1] = total[-1] + 0.5 * (over @ level)
    sound = _is_outside(scene, found) & edges_close([jump, over], ways, seen, _eps(found, at.axes))
    return [nan_unless(sound, e) for e in total]


def _shown(scene: Scene, at: Receiver, found: _Outlines) -> Float[Array, " n_1"]:
    """The radiance that each shape turns towards a receiver, and last the sky's."""
    closed = np.repeat([g.closed for g in scene.groups], [g.count for g in scene.groups])
    sides = scene.material.emission
    facing = either(closed | (found.eye[:, 2] > 0.0), sides[:, FRONT], sides[:, BACK])
    return jnp.concatenate([facing, scene.sky(at.normal)[None]])


@compiled_after(check_question, check_apart, traced=warn_of_collisions)
@with_errors("nodes")
@by_band()
def boundary_gradient(
    scene: Scene,
    at: Receiver,
    *,
    weight: Callable[[Array], Array] = lambda w: w[..., 2],
    radiance: Radiance | None = None,
    nodes: int = 16,
    with_error: bool = False,
) -> Float[Array, "3 *bands"]:
    """Contribution of moving edges to the gradient of `integral L(w) weight(w) dw`, in local axes.

        grad B = sum over edges of the contour integral of
                 (L_left - L_right) weight(w) (p x p') / |p|^3 dt

    This is the whole translational gradient if radiance depends on direction alone on either side
    (a distant environment, shapes of constant radiance); otherwise the integral of the derivative
    of the radiance at fixed direction comes to it.

    Args:
        scene: the shapes.
        at: the receiver.
        weight: of the direction in the receiver's frame: its cosine for irradiance, one for
            net visibility.
        radiance: of shape `index` (-1: the sky) in direction w of the world; if left out, what the
            scene emits.
        nodes: on each piece between two cuts.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        Rates of change along t, b and n.

    Raises:
        ValueError: for a row of receivers.

    Reference: R07 §7, eq. 48, 49; design §6.

    Example:
        >>> from firstorder.space import Scene, boundary_gradient, primitive, receiver, rectangle
        >>> lamp = rectangle((0.5, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0))
        >>> rates = boundary_gradient(scene, receiver((0.0, 0.0, 0.0)))
        >>> bool(rates[0] > 0.0)  # brighter towards the lamp
        True
    """
    check_asked_one(scene, Scene, at, Receiver)
    found = visible_silhouettes(scene, at)
    lines, rims = found.on_lines(nodes), found.on_arcs(nodes)
    warn_of_collisions(scene, at, radiance=radiance)
    sound = found.sound
    if radiance is None and not callable(scene.environment):
        outlines = _outlines_from(scene, at)
        seen = _shown(scene, at, outlines)
        jumps = [sides.jump(seen) for sides in (found.lines, found.rims)]
        jumps_and_horizon = [*jumps, seen[found.above]]
        sound &= edges_close(jumps_and_horizon, found.chords, seen, _eps(outlines, at.axes))
        jumps = [jump[:, None] for jump in jumps]
    else:
        light = _radiance(scene, at) if radiance is None else radiance
        jumps = _jump(lines, found.lines, at, light), _jump(rims, found.rims, at, light)
    total = _moving(lines, jumps[0], weight) + _moving(rims, jumps[1], weight)
    return nan_unless(sound, total)


def _jump(on, sides: SilhouetteSides, at: Receiver, radiance: Radiance) -> Float[Array, "m k"]:
    """Radiance to the left less that to the right, at the nodes of pieces."""
    world = unit(on[0]) @ at.axes.T
    value = jax.vmap(jax.vmap(radiance, (None, 0)))
    left, right = value(sides.owner, world), value(sides.behind, world)
    return either(sides.seen[:, None], left - either(sides.cut[:, None], right, 0.0), 0.0)


def _moving(on, jump: Float[Array, "m #k"], weight) -> Float[Array, "3"]:
    """The contour integral over some pieces."""
    p, v, w = on
    one = power_of_two(p)[..., None]  # or squares of lengths leave the range of single precision
    p, v = p / one, v / one
    rate = translation_rate(p, v) * (jump * w * weight(unit(p)))[..., None]
    return jnp.sum(rate / one, (0, 1))


def _radiance(scene: Scene, at: Receiver) -> Radiance:
    """Radiance of the scene under a sky that varies."""
    black = Scene(scene.groups, scene.material, jnp.zeros(()), scene.names)
    seen = _shown(black, at, _outlines_from(scene, at))
    return lambda index, along: either(index < 0, scene.sky(along), seen[index])


@partial(jax.custom_jvp, nondiff_argnums=(2, 3, 4))
def _contours(found: _Outlines, axes: Float[Array, "3 3"], segment, arc, nodes: int):
    """Integrals along all visible parts, what lies beside them, the horizon's parts, and chords.

    Ends and cuts do not count in derivatives (`space.silhouettes._edge_integrals`), and so neither
    do the horizon's. A first derivative is told here that it need not ask for them; a second one
    finds them in the rule, where they are functions of the outlines.

    Args:
        found: all silhouettes, in the receiver's frame.
        axes: of that frame.
        segment: integral along a part of a segment.
        arc: integral along an arc.
        nodes: on each arc between two cuts.
    """
    cut = _cut_outlines(found, axes)
    edges = _integrals(cut.lines, cut.arcs, cut, segment, arc, nodes)
    return edges, cut.sides, jnp.diff(cut.azimuths), cut.above, cut.chords


@_contours.defjvp
def _contours_rule(segment, arc, nodes, primals, tangents):
    found, axes = primals
    cut = _cut_outlines(found, axes)

    def fixed(lines, arcs):
        seen = cut.sides.seen
        parts = _harmless_parts(lines, arcs, seen, cut.straight)
        edges = _integrals(*parts, cut, segment, arc, nodes)
        return edges, cut.sides, jnp.diff(cut.azimuths), cut.above, cut.chords

    moves = tangents[0].lines, tangents[0].arcs
    return jax.jvp(fixed, (found.lines, found.arcs), moves)


def _integrals(lines: Array, arcs: Array, cut: _Pieces, segment, arc, nodes: int) -> Any:
    """Integrals along straight and curved parts, behind each other."""
    (low, first), (high, last) = cut.apart(cut.low), cut.apart(cut.high)
    straight = segment(*jnp.unstack(lines, axis=1), low, high)
    curved = arc(*jnp.unstack(arcs, axis=1), first, last, nodes)
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b]), straight, curved)
