"""Radiosity from bounce to bounce, on maps over a scene's faces.

The first reflection is that of rectangular lights in closed form (Lambert's sum over edges), times
the share of the light that stratified shadow rays see; each later one is gathered from the map of
the one before. What is computed from maps is exact for the light that the maps hold: comparisons
of methods take truth and estimate from the same ones.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_count,
    check_integer,
    check_not_negative,
    check_unit,
    nan_unless,
)
from firstorder.conventions import cylindrical
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._vectors import cross, dot, matvec, norm, orthonormal_frame, unit
from firstorder.sampling._paths import check_many
from firstorder.scene._arguments import numbers
from firstorder.scene._bands import by_band
from firstorder.scene._primitives import FRONT
from firstorder.scene._questions import check_shines
from firstorder.space.bounces._radiance_maps import (
    RadianceMaps,
    cell_centers,
    face_layout,
    trace_maps,
)
from firstorder.space.intersect import occluded
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Rectangles

# --- direct light --------------------------------------------------------------------------------


def rectangle_irradiance(
    point: ArrayLike, normal: ArrayLike, corners: ArrayLike
) -> Float[Array, ""]:
    """Irradiance from an unoccluded rectangle of radiance 1 (Lambert's polygon formula).

    Lambert's sum over edges, `E = 1/2 sum angle_i (n . g_i)`, with the angle under which an edge
    appears and the unit normal g_i of the plane through it and the eye, after the polygon is cut at
    the receiver's horizon. The side counts from which the corners run clockwise.

    Valid for any plane convex polygon. Zero in the polygon's plane.

    Args:
        point: of the receiver, shape (3,) [m].
        normal: unit vector, shape (3,).
        corners: four, shape (4, 3), counter-clockwise as seen from the front, which emits [m].

    Returns:
        Irradiance [W/m^2], not negative; NaN where a number is none.

    Raises:
        ValueError: if `normal` is no unit vector.

    Reference: Lambert 1760; derived in `tests/space/bounces/test_radiosity.py` by quadrature.

    Example:
        >>> import jax.numpy as jnp
        >>> up, high = jnp.array([0.0, 0.0, 1.0]), 1e4
        >>> sky = jnp.array([(-high, -high, 1.0), (-high, high, 1.0), (high, high, 1.0),
        ...                  (high, -high, 1.0)])
        >>> round(rectangle_irradiance(jnp.zeros(3), up, sky).item(), 3)  # all of the sky: pi
        3.142
    """
    normal = numbers("normal", normal)
    check_unit("normal", normal)
    p = numbers("corners", corners) - numbers("point", point)
    known = jnp.all(jnp.isfinite(p)) & jnp.all(jnp.isfinite(normal))
    # Directions alone count, and squares of lengths leave the range.
    p = p / power_of_two(p.ravel())
    q = jnp.roll(p, -1, axis=0)
    facing = dot(cross(p[1] - p[0], p[2] - p[0]), p[0]) < 0.0
    hp, hq = p @ normal, q @ normal
    up, uq = hp > 0.0, hq > 0.0
    cuts = up != uq
    across = jnp.where(cuts, hp / jnp.where(cuts, hp - hq, 1.0), 0.0)[:, None]
    at = p + across * (q - p)
    start, end = jnp.where(up[:, None], p, at), jnp.where(uq[:, None], q, at)
    seen = up | uq
    # The horizon closes the polygon, from where it sets to where it rises.
    sets = jnp.sum(jnp.where((up & ~uq)[:, None], at, 0.0), axis=0)
    rises = jnp.sum(jnp.where((uq & ~up)[:, None], at, 0.0), axis=0)
    start = jnp.concatenate([start, sets[None]])
    end = jnp.concatenate([end, rises[None]])
    seen = jnp.append(seen, jnp.any(cuts))
    safe = jnp.where(seen[:, None], start, jnp.array([1.0, 0.0, 0.0], p.dtype))
    other = jnp.where(seen[:, None], end, jnp.array([0.0, 1.0, 0.0], p.dtype))
    plane = cross(safe, other - safe)  # of a small light the two are all but one
    angle = jnp.arctan2(norm(plane), dot(safe, other))
    total = -0.5 * jnp.sum(jnp.where(seen, angle * (unit(plane) @ normal), 0.0))
    return nan_unless(known, jnp.where(facing, jnp.maximum(total, 0.0), 0.0))


@eqx.filter_jit
@by_band()
def _direct(
    scene: Scene,
    point: Float[Array, "r 3"],
    normal: Float[Array, "r 3"],
    own: Int[Array, " r"],
    shadow: int,
    lights: tuple[int, ...],
) -> Float[Array, " r"]:
    """Irradiance that a scene's rectangular lights give points of its surfaces.

    Closed form times the share of the light that is seen, weighted by the two cosines over the
    squared distance in the middles of `shadow^2` cells of the light. Exact where nothing is in
    between; beside a shadow it errs by some `1 / shadow` of the light.

    Args:
        scene: with rectangles that emit from their fronts.
        point: [m].
        normal: unit vectors.
        own: the shapes on which the points lie.
        shadow: cells along each side of a light; 0 for no shadows.
        lights: numbers of the shapes that emit, as `_lights` gives them.
    """
    E = jnp.zeros(point.shape[0], point.dtype)
    for light in lights:
        shape = _row(scene, light)
        signs = jnp.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], point.dtype)
        corners = shape.center + signs @ shape.axes[:, :2].T
        full = jax.vmap(lambda x, n, c=corners: rectangle_irradiance(x, n, c))(point, normal)
        part = _share(scene, point, normal, own, shape, light, shadow) if shadow else 1.0
        E = E + scene.material.emission[light, FRONT] * full * part
    return E


def _share(scene, point, normal, own, shape, light: int, shadow: int) -> Array:
    """Share of a light that points see, by the middles of its cells."""
    s = (jnp.arange(shadow, dtype=point.dtype) + 0.5) / shadow * 2.0 - 1.0
    st = jnp.stack(jnp.meshgrid(s, s), -1).reshape(-1, 2)
    places = shape.center + st @ shape.axes[:, :2].T
    out = unit(cross(shape.axes[:, 0], shape.axes[:, 1]))

    def add(sums, place):
        d = place - point
        r2 = dot(d, d)
        weight = jnp.maximum(dot(d, normal), 0.0) * jnp.maximum(-d @ out, 0.0) / r2**2
        ends = jnp.broadcast_to(place, point.shape)
        hidden = occluded(scene, point, ends, own, jnp.full(own.shape, light))
        return (sums[0] + weight, sums[1] + jnp.where(hidden, 0.0, weight)), None

    zero = jnp.zeros(point.shape[0], point.dtype)
    (most, seen), _ = jax.lax.scan(add, (zero, zero), places)
    return jnp.where(most > 0.0, seen / jnp.where(most > 0.0, most, 1.0), 1.0)


def _lights(scene: Scene) -> tuple[int, ...]:
    """Shapes whose fronts emit.

    Raises:
        ValueError: if something else does.
    """
    if callable(scene.environment) or np.any(np.asarray(scene.environment) > 0.0):
        raise ValueError("Argument `scene` must have no sky here, but rectangles for lights.")
    emission = np.asarray(scene.material.emission)
    emission = emission.reshape(len(emission), 2, -1).max(-1)  # in any band
    found = tuple(int(i) for i in np.flatnonzero(np.any(emission > 0.0, axis=1)))
    for i in found:
        if not isinstance(_group(scene, i)[0], Rectangles) or emission[i, 1] > 0.0:
            raise ValueError(
                "Argument `scene` must have rectangles with one bright side as lights."
            )
    return found


def _group(scene: Scene, index: int):
    for group in scene.groups:
        if index < group.count:
            return group, index
        index -= group.count
    raise IndexError(index)


def _row(scene: Scene, index: int):
    group, row = _group(scene, index)
    return jax.tree.map(lambda a: a[row], group)


# --- light from bounce to bounce -----------------------------------------------------------------


def solve_radiosity(
    scene: Scene, *, cells: int = 64, bounces: int = 1, rays: int = 256, shadow: int = 4
) -> RadianceMaps:
    """Radiance maps of every face after one and more reflections.

    `L_1 = albedo / pi * E_direct`, `L_(k+1) = albedo / pi * E(L_k)`, and the maps hold the sum of
    the first `bounces` of these. What lights emit is not in it. Of several bands rays are traced
    once.

    Planes, the backs of flat shapes and the insides of closed ones have no map: they reflect
    nothing here.

    Args:
        scene: with rectangles as lights.
        cells: along each side of each face, at least 2.
        bounces: reflections that are followed, at least 1.
        rays: gathered at each cell for each bounce after the first.
        shadow: cells along each side of a light for shadows; 0 for none.

    Raises:
        ValueError: if something else than the front of a rectangle emits, the sky included, a
            surface is glossy, or a number is too small or no integer.

    Example:
        >>> from firstorder.space import library
        >>> from firstorder.space.bounces import solve_radiosity
        >>> solve_radiosity(library.j12_box(), cells=8, shadow=0).L.shape
        (4, 8, 8)
    """
    check_many("cells", cells)
    for name, number in (("bounces", bounces), ("rays", rays)):
        check_count(name, number)
    check_integer("shadow", shadow)
    check_not_negative("shadow", shadow)
    if np.any(np.asarray(scene.material.specular) != 0.0):
        raise ValueError(
            "Argument `scene` must be diffuse, but holds a surface with `specular`: "
            "`path_irradiance` follows glossy reflections."
        )
    check_shines(scene)
    lights, plan = _lights(scene), face_layout(scene)
    point, normal = cell_centers(scene, cells)
    albedo = scene.material.albedo[plan.shape, FRONT]
    bright = np.flatnonzero(np.asarray(albedo).reshape(len(albedo), -1).max(-1) > 0.0)
    bands = () if scene.bands is None else (scene.bands,)
    empty = jnp.zeros((len(plan.shape), cells, cells, *bands), point.dtype)
    if not len(bright):
        return RadianceMaps(scene, empty)
    own = jnp.repeat(jnp.asarray(plan.shape[bright]), cells**2)
    point, normal = point[bright].reshape(-1, 3), normal[bright].reshape(-1, 3)
    factor = albedo[bright][:, None, None] / math.pi
    factor = factor.reshape(*factor.shape, *(1,) * (empty.ndim - factor.ndim))

    def sent(E):
        return empty.at[bright].set(factor * E.reshape(-1, *empty.shape[1:]))

    latest = total = sent(_direct(scene, point, normal, own, shadow, lights))
    for _ in range(bounces - 1):
        latest = sent(_gathered(RadianceMaps(scene, latest), point, normal, own, rays))
        total = total + latest
    return RadianceMaps(scene, total)


@eqx.filter_jit
@by_band()
def _gathered(maps: RadianceMaps, point: Array, normal: Array, own: Array, rays: int) -> Array:
    """Irradiance from maps by `rays` directions of a rank-1 lattice, shifted from point to point.

    Ray by ray over all points, so that nothing of the size of their product is kept.
    """
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    around = orthonormal_frame(normal)
    number = jnp.arange(point.shape[0], dtype=point.dtype)
    # Two further irrational steps give each point a shift of its own.
    shift = jnp.mod(number * 0.7548776662466927, 1.0), jnp.mod(number * 0.5698402909980532, 1.0)

    def add(total, k):
        u = jnp.mod((k + 0.5) / rays + shift[0], 1.0)
        phi = 2.0 * math.pi * jnp.mod(k * golden + shift[1], 1.0)
        rho = jnp.sqrt(u)
        local = cylindrical(rho, phi, jnp.sqrt(1.0 - u))
        along = matvec(around, local)
        return total + trace_maps(maps, _apart(point), _apart(along), own).radiance, None

    steps = jnp.arange(rays, dtype=point.dtype)
    total, _ = jax.lax.scan(add, jnp.zeros(point.shape[0], point.dtype), steps)
    return math.pi / rays * total


def _apart(a: Array) -> tuple[Array, Array, Array]:
    return a[:, 0], a[:, 1], a[:, 2]
