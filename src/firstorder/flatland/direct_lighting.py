"""Irradiance in flatland without sampling, and its exact derivatives.

    E(x) = int L(x <- theta) cos(theta) dtheta = sum over gaps of what is seen     (J12 eq. 16)

A gap in which an emitter of one radiance is seen gives `L (sin theta_+ - sin theta_-)`, so that the
sum is one over the cuts, of `sin theta` times the jump of L there; any other light is integrated by
Gauss-Legendre in its gap. The cuts are differentiable, so automatic differentiation of this sum
holds the interior and the boundary terms of every derivative, for the receiver and for every leaf
of the scene.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import nan_unless
from firstorder.conventions import direction
from firstorder.flatland._hemicircle import Between, Cuts, cuts_of, seen_between
from firstorder.flatland.intersect import occluded
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import (
    Receiver,
    View,
    _in_own_unit,
    _view,
    receiver,
    view,
)
from firstorder.numerics._compiled import compiled, compiled_after
from firstorder.numerics._planar import dot_2d
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._bands import by_band
from firstorder.scene._derivatives import Derivatives, line_derivatives
from firstorder.scene._primitives import BACK, FRONT
from firstorder.scene._questions import check_lit
from firstorder.typing import as_float

# Radiance that a shape sends against a direction: (number, parameter, front?, direction) -> L.
Radiance = Callable[
    [Int[Array, ""], Float[Array, ""], Bool[Array, ""], Float[Array, "2"]], Float[Array, ""]
]


@compiled_after(check_lit)
@with_errors("nodes")
@by_band()
def irradiance(
    scene: Scene,
    at: Receiver,
    *,
    radiance: Radiance | None = None,
    nodes: int = 16,
    cuts: ArrayLike | None = None,
    with_error: bool = False,
) -> Float[Array, "*bands"]:
    """Irradiance at a receiver, exact: `E = int L cos(theta) dtheta` [W/m].

    Emitters are integrated in closed form. The environment, and `radiance` if given, by
    Gauss-Legendre in every gap between silhouettes: to rounding where they are smooth in the angle;
    with an error of order nodes^-3 where `radiance` varies up to the contour of a round shape.

    Valid for: any position off the shapes' own edges; where two edges are in line with the
    receiver the derivatives are one-sided. The unit of length does not matter for emitters and the
    environment: lengths may be 1e-30 to 1e30 in single precision.

    Args:
        scene: shapes and lights.
        at: one receiver; use `jax.vmap` for many.
        radiance: what the shapes send out, in place of their emission: a function of the shape's
            number, the parameter on it, whether its front is seen, and the direction of sight.
            Point lights and the environment still count.
        nodes: nodes in each gap.
        cuts: further points in whose directions `radiance` may have breaks.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        Irradiance [W/m]; NaN at a receiver or in a scene that is none.

    Raises:
        ValueError: for a row of receivers, or if `nodes` is not positive.

    Reference: J12 eqs. 16, 26, 40-43; R07 eqs. 32, 37 for its gradient.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver, Scene, Segments, irradiance, primitive
        >>> lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
        >>> E = lambda x: irradiance(Scene.of(lamp), Receiver((x, 0.0), 0.0))
        >>> round(float(E(0.0)), 6), round(float(jax.grad(E)(0.5)), 6)
        (1.414214, -0.544865)
    """
    check_asked_one(scene, Scene, at, Receiver)
    near, here, cuts = _in_own_unit(scene, at, None if cuts is None else as_float(cuts))
    where = cuts_of(near, here, cuts)
    seen = seen_between(near, here, where, sides=radiance is None)
    E = point_light_irradiance(scene, at)
    if radiance is None:
        E = E + _emitted(scene, where, seen)
    if radiance is not None or scene.environment is not None:
        E = E + _integrated(scene, at, _view(where, seen), radiance, nodes)
    return E


@compiled_after(check_lit)
@with_errors("nodes")
@by_band()
def weighted_irradiance(
    scene: Scene,
    at: Receiver,
    *,
    weight: Callable[[Float[Array, ""]], Float[Array, ""]],
    radiance: Radiance | None = None,
    nodes: int = 16,
    cuts: ArrayLike | None = None,
    with_error: bool = False,
) -> Float[Array, "*bands"]:
    """All light that arrives, under a weight of the angle: `int L(theta) weight(theta) dtheta`.

    With `weight(theta) = f(theta, theta_out) cos(theta)` it is the radiance reflected by the BRDF f
    under shadows: R07 eq. 32 with a general transport T, exact between the edges.

    Args:
        scene: shapes and lights.
        at: one receiver.
        weight: smooth function of the local angle in (-pi/2, pi/2).
        radiance: what the shapes send out; their emission if left out.
        nodes: nodes in each gap between silhouettes; a narrow weight needs many.
        cuts: further points in whose directions the integrand may have breaks.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        The integral, in units of radiance times the weight's [W/m for the cosine].

    Raises:
        TypeError: if `weight` is no function.
        ValueError: for a row of receivers, or if `nodes` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Receiver, Scene, Segments, weighted_irradiance
        >>> from firstorder.flatland import irradiance, primitive
        >>> scene = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
        >>> at = Receiver((0.3, 0.0), 0.1)
        >>> bool(abs(weighted_irradiance(scene, at, weight=jnp.cos) - irradiance(scene, at)) < 1e-5)
        True
    """
    check_asked_one(scene, Scene, at, Receiver)
    if not callable(weight):
        raise TypeError("Argument `weight` must be a function of the local angle, such as jnp.cos.")

    def emitted(index, s, front, along):
        return scene.material.emission[index, jnp.where(front, FRONT, BACK)]

    seen = view(scene, at, cuts=cuts)
    sent = emitted if radiance is None else radiance
    return point_light_irradiance(scene, at, weight=weight) + _integrated(
        scene, at, seen, sent, nodes, weight
    )


@compiled
@by_band()
def point_light_irradiance(
    scene: Scene, at: Receiver, *, weight: Callable[[Array], Array] = jnp.cos
) -> Float[Array, "*bands"]:
    """Irradiance from the point lights alone: `I cos(theta) / r` where nothing is between.

    Args:
        scene: shapes and point lights.
        at: one receiver.
        weight: of the local angle; its cosine, if left out.

    Returns:
        Irradiance [W/m], in each band if there are any; NaN at a receiver or in a scene that is
        none.

    Raises:
        ValueError: for a row of receivers.

    Example:
        >>> from firstorder.flatland import Receiver, point_light_irradiance
        >>> from firstorder.flatland.library import scene_c
        >>> below = Receiver((0.5, 0.0), 0.0)  # by half a metre
        >>> point_light_irradiance(scene_c(), below).item()
        2.0
    """
    check_asked_one(scene, Scene, at, Receiver)
    count = scene.points.intensity.shape[0]
    if not count:
        return jnp.zeros((), at.position.dtype)
    way = scene.points.position - at.position
    unit = power_of_two(way)
    way = way / unit[:, None]
    square = dot_2d(way, way)
    origins = jnp.broadcast_to(at.position, way.shape)
    lit = ~occluded(scene, origins, scene.points.position, at.on)
    lit &= (square > 0.0) & (way @ at.normal > 0.0)
    safe = jnp.where(lit[:, None], way, at.normal)
    theta = jnp.arctan2(-(safe @ at.tangent), safe @ at.normal)
    each = scene.points.intensity * jax.vmap(weight)(theta) / jnp.sqrt(dot_2d(safe, safe)) / unit
    known = jnp.isfinite(at.n) & jnp.all(jnp.isfinite(at.position)) & ~scene.unsound
    return nan_unless(known, jnp.sum(jnp.where(lit, each, 0.0)))


def _emitted(scene: Scene, cuts: Cuts, seen: Between) -> Float[Array, ""]:
    """Emission of the shapes: differences of sines, added up cut by cut.

    A cut counts with what is seen on its right less what is seen on its left. So the sines need no
    order, and their derivatives are those of the silhouettes alone.
    """
    side = either(seen.front, np.int32(FRONT), np.int32(BACK))
    L = scene.material.emission[jnp.maximum(seen.shape, 0), side]
    L = either(seen.shape >= 0, L, 0.0)
    jump = jnp.zeros(cuts.sine.shape, L.dtype).at[seen.order].set(L[:-1] - L[1:])
    return L[0] + L[-1] + jnp.sum(jump * cuts.sine)


def _integrated(
    scene: Scene, at: Receiver, seen: View, radiance: Radiance | None, nodes: int, weight=jnp.cos
) -> Float[Array, ""]:
    """Integral of light without a closed form: nodes in each gap, on the one shape seen there."""
    t, w = (jnp.asarray(a, at.position.dtype) for a in gauss_legendre(nodes))
    half = 0.5 * (seen.angles[1:] - seen.angles[:-1])[:, None]
    middle = 0.5 * (seen.angles[1:] + seen.angles[:-1])[:, None]
    theta = middle + half * t

    def sent(number, angle):
        along = direction(at.n + angle)
        L = jnp.zeros((), at.position.dtype)
        if radiance is not None:
            shape = jnp.maximum(number, 0)
            _, s = scene.hit(shape, at.position, along, at.on)
            L = jnp.where(
                number >= 0, radiance(shape, s, _front(scene, shape, s, along), along), 0.0
            )
        if scene.environment is not None:
            L = L + jnp.where(number < 0, scene.sky(at.n + angle), 0.0)
        return L

    L = jax.vmap(lambda number, row: jax.vmap(lambda a: sent(number, a))(row))(seen.seen, theta)
    return jnp.sum(half * w * jax.vmap(jax.vmap(weight))(theta) * L)


def _front(scene: Scene, number, s, along) -> Bool[Array, ""]:
    """Whether a ray along a direction meets the side that the normal is on."""
    _, v, _ = scene.motion(number, s)
    return v[0] * along[1] - v[1] * along[0] < 0.0


# --- derivatives ---------------------------------------------------------------------------------


@compiled
def derivatives_on_shape(
    f: Callable[[Receiver], Array], scene: Scene, index: ArrayLike, s: ArrayLike
) -> Derivatives:
    """Derivatives by arc length as the receiver follows a shape, bending with it: in total.

    On a curve of `kappa = dn/dx` they are those of `derivatives(f, at).along(kappa, dkappa)`, in a
    third of its time.

    Args:
        f: a function of a receiver.
        scene: the shapes.
        index: number of the shape.
        s: where on it, in [0, 1].

    Example:
        >>> from firstorder.flatland import derivatives_on_shape, point_light_irradiance
        >>> from firstorder.flatland.library import scene_c
        >>> E = lambda at: point_light_irradiance(scene_c(), at)
        >>> round(derivatives_on_shape(E, scene_c(), 0, 0.5).second.item(), 6)  # of h / (h^2 + x^2)
        -16.0
    """
    d = line_derivatives(lambda s: f(receiver(scene, index, s)), s)
    speed = line_derivatives(lambda s: scene.frame(index, s).speed, s)
    v = speed.value[..., None]
    gradient = d.gradient / v
    bent = (d.hessian[..., 0] - gradient * speed.gradient) / v**2
    return Derivatives(d.value, gradient, bent[..., None], ("x",))
