"""Irradiance and its derivatives by the motion of a receiver, in arc-length and stratified form.

A receiver in the plane has three freedoms: along its tangent, along its normal, and a turn of the
normal. All forms return value, gradient and Hessian by all three (`Derivatives`), so that
translation, rotation and travel along a bent receiver are read off one result.

Both forms are the paper's approximations; `derivatives` of `irradiance` are exact. What each form
leaves out is said in its docstring. `corrected_estimate` is the stratified form with what it leaves
out put back. J12 measures angles towards +x; here they are counter-clockwise, so differences of
radiance across a border have the other sign.
"""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from firstorder._argument_checks import check_count, check_shape
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.estimators._incident import incident_radiance, seen_from
from firstorder.flatland.estimators.strata import Samples, gap_quadrature, trace_strata
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver, view
from firstorder.numerics._compiled import compiled
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.numerics._refinement import with_errors
from firstorder.scene._arguments import check_asked_one, numbers
from firstorder.scene._derivatives import FLATLAND, Derivatives
from firstorder.scene._geometry_term import linear_jet
from firstorder.visibility.edge_angles import EdgeAngle, edge_at

# --- arc length ----------------------------------------------------------------------------------


@compiled
def arc_length_estimate(samples: Samples) -> Derivatives:
    """Derivatives with radiance and visibility frozen on the curves: only the geometry term moves.

    `d E = int L V dG dl(y)`, over the hemicircle by `dl = r dtheta / cos_y`.

    Valid where no shadow edge and no horizon lies on anything that shines: exact then, and free of
    bias when sampled. Wrong in a penumbra (the edge on the surface behind moves, and the form keeps
    it), for `E_nn` where something shines at the horizon (it gives `-E`, which is `L(pi/2) +
    L(-pi/2)` too little), and noisy before occluding contours: by angle the integrand grows as `1 /
    cos_y`, whose square is not integrable; sample by arc length there
    (`arc_length_estimate_on_curves`). Point lights do not count.

    Args:
        samples: of `trace_strata`.

    Reference: J12 §5.1-5.2, eqs. 37, 39, 48 (the measure of 37 is misprinted).

    Example:
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.estimators import arc_length_estimate, hemicircle_strata
        >>> from firstorder.flatland.estimators import trace_strata
        >>> from firstorder.flatland.library import scene_a
        >>> rays = trace_strata(scene_a(), Receiver((0.0, 0.0), 0.0), where=hemicircle_strata(64))
        >>> round(arc_length_estimate(rays).value.item(), 2)  # 2 sin(atan 0.5) is 0.89
        0.86
    """
    a, b = samples.strata.angles, samples.cosine
    met = jnp.isfinite(samples.distance)
    r = jnp.where(met, samples.distance, 1.0)
    share = samples.strata.weights * samples.radiance * r / jnp.where(b > 0.0, b, 1.0)
    share = jnp.where((b > 0.0) & (samples.strata.weights > 0.0), share, 0.0)
    return _weighted(share, r, direction(a), samples.normal, b, met)


@compiled
@with_errors("nodes")
def arc_length_integral(
    scene: Scene,
    at: Receiver,
    *,
    radiance: Radiance | None = None,
    nodes: int = 16,
    with_error: bool = False,
) -> Derivatives:
    """The arc-length form as an integral: Gauss-Legendre between silhouettes, no sampling.

    What it lacks against the truth is the shadow edges alone (see `arc_length_estimate`).

    Args:
        scene: shapes and environment.
        at: one receiver.
        radiance: what shapes send out in place of their emission (see `irradiance`).
        nodes: in each gap between silhouettes.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: for a row of receivers, or if `nodes` is not positive.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver, Scene, Segments, primitive
        >>> from firstorder.flatland.estimators import arc_length_integral
        >>> lamp = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
        >>> motion = jax.jit(lambda at: arc_length_integral(lamp, at))(Receiver((0.5, 0.0), 0.0))
        >>> round(float(motion.translation().first), 3)
        -0.545
    """
    ends = jax.lax.stop_gradient(view(scene, at).angles)
    return arc_length_estimate(
        trace_strata(scene, at, where=gap_quadrature(ends, nodes), radiance=radiance)
    )


@compiled
def arc_length_estimate_on_curves(
    scene: Scene,
    at: Receiver,
    *,
    radiance: Radiance | None = None,
    count: int,
    key: PRNGKeyArray | None = None,
) -> Derivatives:
    """The arc-length form by strata of arc length: `count` points on each shape.

    Points are spread evenly in the parameter s and weighted by the speed. Valid as
    `arc_length_estimate`, with a finite variance before occluding contours; the environment has no
    arc length and is left out, and a point near the receiver makes the estimate noisy, as `1 / r`
    to `1 / r^3`.

    Args:
        scene: shapes; what the sky sends does not count.
        at: one receiver.
        radiance: what shapes send out in place of their emission (see `irradiance`).
        count: strata on each shape.
        key: for a random point in each; None takes the middle.

    Raises:
        ValueError: for a row of receivers, or if `count` is not positive.

    Reference: J12 §5.1, eq. 39.
    """
    check_asked_one(scene, Scene, at, Receiver)
    check_count("count", count)
    share = 0.5
    if key is not None:
        share = jax.random.uniform(key, (scene.count, count), at.position.dtype)
    s = ((jnp.arange(count) + share) / count) * jnp.ones((scene.count, 1))
    return arc_length_sum(scene, at, s=s, weights=jnp.full_like(s, 1.0 / count), radiance=radiance)


@compiled
def arc_length_sum(
    scene: Scene,
    at: Receiver,
    *,
    s: Float[Array, "k n"],
    weights: Float[Array, "k n"],
    radiance: Radiance | None = None,
) -> Derivatives:
    """The arc-length form as a weighted sum over given points of every shape; sums may be added.

    Args:
        scene: k shapes; what the sky sends does not count.
        at: one receiver.
        s: parameters of the points on each shape.
        weights: of the points, one over the density in s.
        radiance: what shapes send out in place of their emission (see `irradiance`).

    Raises:
        ValueError: for a row of receivers, or if there are not points of every shape.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.estimators import arc_length_sum
        >>> from firstorder.flatland.library import scene_a
        >>> s = jnp.broadcast_to((jnp.arange(16) + 0.5) / 16, (2, 16))
        >>> at, weights = Receiver((0.0, 0.0), 0.0), jnp.full((2, 16), 1 / 16)
        >>> round(arc_length_sum(scene_a(), at, s=s, weights=weights).value.item(), 3)
        0.895
    """
    check_asked_one(scene, Scene, at, Receiver)
    s, weights = numbers("s", s), numbers("weights", weights)
    if s.ndim != 2 or s.shape[0] != scene.count:
        raise ValueError(
            f"Argument `s` must have a row for each of {scene.count} shapes, but has shape "
            f"{s.shape}."
        )
    check_shape("weights", weights, s.shape)
    number = jnp.broadcast_to(jnp.arange(scene.count)[:, None], s.shape).ravel()
    frames = jax.vmap(scene.frame)(number, s.ravel())
    way = frames.position - at.position
    square = dot_2d(way, way)
    r = jnp.sqrt(jnp.where(square > 0.0, square, 1.0))
    along = way / r[:, None]
    front = cross_2d(frames.tangent, along) < 0.0
    normal = jnp.where(front, 1.0, -1.0)[:, None] * frames.normal
    L = jax.vmap(lambda i, s, f, d: incident_radiance(scene, radiance, i, s, f, d))(
        number, s.ravel(), front, along
    )
    lit = (along @ at.normal > 0.0) & seen_from(scene, at, number, frames)
    share = jnp.where(lit, L * frames.speed * weights.ravel(), 0.0)
    local = jnp.stack([normal @ at.tangent, normal @ at.normal], -1)
    u = jnp.stack([along @ at.tangent, along @ at.normal], -1)
    return _weighted(share, r, u, local, -dot_2d(normal, along), square > 0.0)


def _weighted(share, r, u, normal, cos_y, met) -> Derivatives:
    """Sum of `share` times the geometry term and its derivatives by all three freedoms.

    A turn puts minus the tangent in the place of the normal, and twice a turn minus the normal.
    """
    up, back = jnp.array([0.0, 1.0], r.dtype), jnp.array([-1.0, 0.0], r.dtype)
    moved = linear_jet(r, u, up, normal, u[:, 1], cos_y)
    turned = linear_jet(r, u, back, normal, -u[:, 0], cos_y)
    value, turn = jnp.sum(share * moved.value), jnp.sum(share * turned.value)
    near = jnp.where(met, share, 0.0)  # what is infinitely far does not change by a step
    step, mixed = near @ moved.gradient, near @ turned.gradient
    H = jnp.tensordot(near, moved.hessian, 1)
    last = jnp.concatenate([mixed, -value[None]])
    hessian = jnp.concatenate([jnp.concatenate([H, mixed[:, None]], 1), last[None]], 0)
    return Derivatives(value, jnp.concatenate([step, turn[None]]), hessian, FLATLAND)


# --- strata --------------------------------------------------------------------------------------


def border_derivatives(borders: EdgeAngle) -> Derivatives:
    """Value and derivatives of `sum of jump sin(angle)`, each border an edge that a receiver sees.

        grad = sum J cos(a) grad a,   H = sum J (cos(a) H a - sin(a) grad a grad a^T)

    with the derivatives of `edge_at`: fixed points of the plane, and contours that slide.

    Args:
        borders: a row of them, by the receiver's steps and its turn.

    Reference: J12 eqs. 44-46, 50 (with the sign corrected).
    """
    c, s = borders.jump * jnp.cos(borders.value), borders.jump * jnp.sin(borders.value)
    g = borders.gradient
    hessian = jnp.tensordot(c, borders.hessian, 1) - (s[:, None] * g).T @ g
    return Derivatives(jnp.sum(s), c @ g, hessian, FLATLAND)


@compiled
def stratified_estimate(samples: Samples) -> Derivatives:
    """Derivatives from differences of radiance across borders that move as their nearer sample.

    `grad E = sum over inner borders of (L_below - L_above) cos a grad a`, with `min(r, r')` for the
    distance; E itself is the sum of all borders, the two at the horizon included, which stay there.

    Valid for diffuse surfaces and any strata; it follows shadow edges, which the arc-length form
    does not. The gradient tends to the truth, with an error of first order in the width of a
    stratum, and of order one half before occluding contours, where the sample nearest the contour
    is short by `sqrt(2 R r h)`. The translational Hessian **does not tend to the truth**: it takes
    each shadow edge for a fixed point before a background of constant radiance.
    `corrected_estimate` adds the missing terms. Rotational derivatives are right. Noise in the
    radiance averages out along a surface but not at an edge between two depths: the jump there is
    that of two samples, however many strata there are.

    Args:
        samples: of `trace_strata`.

    Returns:
        E with derivatives. The value is that of constant radiance in each stratum (J12 43).

    Reference: J12 §5.1-5.2, eqs. 42-47, 50-51 (the sign of 50 is misprinted).

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver, Scene, Segments, primitive
        >>> from firstorder.flatland.estimators import stratified_estimate
        >>> from firstorder.flatland.estimators import trace_strata, hemicircle_strata
        >>> lamp = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
        >>> form = jax.jit(lambda at: stratified_estimate(trace_strata(lamp, at,
        ...     where=hemicircle_strata(1000))))
        >>> round(float(form(Receiver((0.5, 0.0), 0.0)).translation().first), 2)
        -0.54
    """
    w = 1.0 / samples.distance
    inner = edge_at(
        samples.strata.borders[1:-1],
        jnp.maximum(w[:-1], w[1:]),
        samples.radiance[:-1] - samples.radiance[1:],
    )
    return with_horizon(border_derivatives(inner), samples)


def with_horizon(motion: Derivatives, samples: Samples) -> Derivatives:
    """Add the two borders at the horizon, which stay where they are when the receiver moves.

    In the paper they drop out of (47) since their cosines vanish. For the second derivative by a
    turn the cosine is not there to do it: they must be left out by hand.
    """
    ends = samples.strata.borders[jnp.array([0, -1])]
    L = samples.radiance[jnp.array([0, -1])] * jnp.array([-1.0, 1.0], ends.dtype)
    return eqx.tree_at(lambda m: m.value, motion, motion.value + jnp.sum(L * jnp.sin(ends)))


# --- error bars ----------------------------------------------------------------------------------


class RepeatedEstimate(Module):
    """The mean of repeated sampling, and how far it may be from its expectation.

    Attributes:
        mean: of all repeats.
        error: standard error of that mean, number by number.
        spread: standard deviation of one repeat.
    """

    mean: Derivatives
    error: Derivatives
    spread: Derivatives


def repeated_estimate(
    form: Callable[[PRNGKeyArray], Derivatives], key: PRNGKeyArray, repeats: int
) -> RepeatedEstimate:
    """Repeats a sampled form with other random numbers: its mean with error bars.

    The bars hold what varies, not the bias: a stratified Hessian has a wrong limit with any bars.

    Args:
        form: from a random key to a `Derivatives`.
        key: split once for each repeat.
        repeats: how often, at least 2.

    Raises:
        ValueError: if there are fewer than two repeats.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver, Scene, Segments, primitive
        >>> from firstorder.flatland.estimators._irradiance_forms import repeated_estimate
        >>> from firstorder.flatland.estimators import stratified_estimate
        >>> from firstorder.flatland.estimators import trace_strata, hemicircle_strata
        >>> lamp = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
        >>> at = Receiver((0.5, 0.0), 0.0)
        >>> form = lambda key: stratified_estimate(trace_strata(lamp, at,
        ...     where=hemicircle_strata(100, key)))
        >>> bars = jax.jit(lambda key: repeated_estimate(form, key, 25))(jax.random.key(0))
        >>> bool(abs(bars.mean.gradient[0] + 0.544873) < 4 * bars.error.gradient[0] + 1e-2)
        True
    """
    if repeats < 2:
        raise ValueError(f"Argument `repeats` must be at least 2, but is {repeats}.")
    runs = jax.vmap(form)(jax.random.split(key, repeats))
    mean = jax.tree.map(lambda a: jnp.mean(a, 0), runs)
    spread = jax.tree.map(lambda a: jnp.std(a, 0, ddof=1), runs)
    return RepeatedEstimate(mean, jax.tree.map(lambda a: a / repeats**0.5, spread), spread)
