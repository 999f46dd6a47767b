"""A scene of flatland: shapes, their materials, and lights that have no shape.

A scene is a pytree; positions, radii, radiances and albedos are its leaves and can be
differentiated. Shapes of one kind are kept together, so a scene has at most five groups however
many shapes it has. A shape's number counts through the groups in the order segments, arcs, circles,
ellipses, curves.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import (
    check_between,
    check_index,
    check_one,
    is_concrete,
)
from firstorder._display import Axes, Module, as_picture, drawn
from firstorder.flatland.point_lights import PointLights
from firstorder.flatland.primitives import Material, Primitive
from firstorder.flatland.shapes._bounds import bounds
from firstorder.flatland.shapes._crossings import Crossings, any_crossing, find_crossings
from firstorder.flatland.shapes.kinds import (
    Arcs,
    Circles,
    Curves,
    Ellipses,
    Point,
    Segments,
    Shape,
)
from firstorder.numerics._compiled import compiled
from firstorder.numerics._planar import cross_2d, dot_2d, left
from firstorder.scene._arguments import check_kind, check_primitives, check_sky, made_elsewhere
from firstorder.scene._bands import bands_of, by_band, one_band
from firstorder.scene._intersect import picked
from firstorder.scene._primitives import grouped, joined, named
from firstorder.scene._words import told
from firstorder.typing import as_float

KINDS = (Segments, Arcs, Circles, Ellipses, Curves)


class _FunctionSky(Module):
    """A plain function of the angle as an environment, with the angles at which it jumps."""

    radiance: Callable[[Array], Array]
    breaks: Float[Array, " b"] | None

    def __call__(self, angle: Float[Array, ""]) -> Float[Array, ""]:
        """Radiance from a direction."""
        return self.radiance(angle)


def _breaks_of(environment: Any) -> Array | None:
    breaks = getattr(environment, "breaks", None)
    return None if breaks is None else as_float(breaks)


class Frenet(Module):
    """A point of a curve and its frame: the local x runs along `tangent`, y along `normal`.

    Attributes:
        position: [m].
        tangent, normal: unit vectors; the normal is to the left.
        n: the normal's angle, counter-clockwise from +y [rad].
        speed: arc length per parameter [m].
        kappa: `dn/dx`, positive in a valley [rad/m].
    """

    position: Point
    tangent: Point
    normal: Point
    n: Float[Array, ""]
    speed: Float[Array, ""]
    kappa: Float[Array, ""]


@made_elsewhere
class Scene(Module):
    """Shapes with materials, point lights and a distant environment.

    Make one with `Scene.of`. It may be built inside a jitted or differentiated function.

    Attributes:
        groups: the shapes, at most one group a kind.
        material: one row for each shape.
        points: lights without size.
        environment: radiance as a function of the world angle (counter-clockwise from +y) of the
            direction to where light comes from, or None for a black sky. If it has an attribute
            `breaks`, the angles in it are where it jumps.
        crossings: where shapes cross each other. A scene whose leaves are replaced keeps those it
            had: they move with the shapes, but where shapes newly cross it must be made anew.

    Example:
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> scene = Scene.of(
        ...     primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.5),
        ...     primitive(Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=1.0),
        ... )
        >>> scene.count, scene.named("lamp")
        (2, (1,))
    """

    groups: tuple[Shape, ...]
    material: Material
    points: PointLights
    environment: Callable[[Array], Array] | None
    crossings: Crossings
    names: tuple[str, ...] = eqx.field(static=True)

    @staticmethod
    def of(
        *things: Primitive,
        points: PointLights | None = None,
        environment: Callable[[Array], Array] | None = None,
        crossings: Crossings | None = None,
    ) -> Scene:
        """A scene of primitives, point lights and an environment.

        Of surfaces in the same place, such as a lamp drawn on a wall, the one that shines is seen,
        and of two that do the later one: of all that a ray meets within a share `eps^(3/4)` of the
        distance to the first.

        Args:
            things: primitives, shapes with materials, in any order.
            points: lights without size.
            environment: radiance of the sky as a function of the world angle.
            crossings: where shapes cross; found here if the shapes are concrete. Traced ones
                cannot be searched: give the crossings of a similar concrete scene. Without
                them, traced segments or circles that cross one that shines turn what is seen
                into NaN; all others are taken not to cross.

        Raises:
            ValueError: if there is nothing in the scene; or if so much overlaps that crossings
                would be looked for in more than 10 million pairs of shapes, or in more than 500
                million pairs of chords (128 for a round shape), or are more than a million. With
                `crossings` given, nothing is looked for.
            TypeError: if something in it is no primitive of flatland, the environment is no
                function or a sky of space, or points or crossings are something else.
        """
        check_primitives(things, Primitive, Shape)
        check_sky(environment, Scene)
        if environment is not None and not callable(environment):
            raise TypeError(
                "Argument `environment` must be a function of the angle, such as "
                f"ConstantSky(1.0), but is {environment!r}."
            )
        groups, materials, names = grouped(things, KINDS, _join)
        if points is None:
            points = PointLights(np.zeros((0, 2)), np.zeros((0,)))
        check_kind("points", points, PointLights)
        if environment is not None and not isinstance(environment, eqx.Module):
            environment = _FunctionSky(jax.tree_util.Partial(environment), _breaks_of(environment))
        if crossings is not None:
            check_kind("crossings", crossings, Crossings)
        else:
            crossings = find_crossings(groups)
            if not is_concrete(groups):
                shines = jnp.any(joined(materials).emission.reshape(len(names), -1) != 0.0, -1)
                unsound = any_crossing(groups, shines) | ~_sized(groups)
                groups = jax.tree.map(lambda a: jnp.where(unsound, jnp.nan, a), groups)
        made = Scene(tuple(groups), joined(materials), points, environment, crossings, names)
        bands_of(made)  # refuses those that disagree
        return made

    _repr_html_ = as_picture

    def __repr__(self) -> str:
        return told(self, "flatland", bounds)

    def plot(
        self, ax: Axes | None = None, *, names: bool = True, normals: bool = True, sky: bool = True
    ) -> Axes:
        """Draws a map of the scene, as `plotting.draw_scene` does, with its coordinates in metres.

        Args:
            ax: matplotlib axes to draw on; new ones if left out, and no window opens.
            names: whether names are written.
            normals: whether short ticks are drawn on the fronts.
            sky: whether the environment is drawn, as a ring around it all.

        Returns:
            The axes.

        Raises:
            ValueError: if the scene is traced, or a batch of scenes.

        Example:
            >>> from firstorder.flatland.library import named_scene
            >>> named_scene("scene_b").plot().get_xlabel()
            '$x$ (m)'
        """
        return drawn(self, ax, names=names, normals=normals, sky=sky)

    @property
    def count(self) -> int:
        """Number of shapes."""
        return len(self.names)

    @property
    def bands(self) -> int | None:
        """Number of bands of its light and its materials; None for one without an axis."""
        return bands_of(self)

    def band(self, number: int) -> Scene:
        """The scene as one of its bands sees it.

        Args:
            number: of the band, from 0.

        Raises:
            ValueError: if there is no such band.
        """
        return one_band(self, number)

    def named(self, name: str) -> tuple[int, ...]:
        """The numbers of the shapes of that name.

        Raises:
            ValueError: if there is none.
        """
        return named(self.names, name)

    def _pick(self, index: ArrayLike, ask: Callable[[Shape], Any], *, ray: bool = False) -> Any:
        """Result of a function for the shape of that number; `ray`, if it asks for rays."""
        check_index("index", index, self.count)
        check_one("index", index)
        # One shape of a known number is made ready by its question.
        many = ray and not is_concrete(index)
        return picked([g.ready() for g in self.groups] if many else self.groups, index, ask)

    def motion(self, index: Int[Array, ""], s: Float[Array, ""]) -> tuple[Point, Point, Point]:
        """Position of a point of a shape, with its first and second derivative in s."""
        check_one("s", s)
        return self._pick(index, lambda shape: shape.motion(s))

    def frame(self, index: ArrayLike, s: ArrayLike) -> Frenet:
        """The frame at the parameter s in [0, 1] of a shape.

        Args:
            index: the shape's number.
            s: where on it, along its travel.

        Raises:
            ValueError: if there is no such shape, s is none of [0, 1], or there are several.
            TypeError: if the index is no integer.
        """
        check_one("s", s)
        check_between("s", s, 0.0, 1.0)
        return self._pick(index, lambda shape: _frame(shape, as_float(s)))

    def hit(
        self, index: Int[Array, ""], origin: Point, along: Point, on: ArrayLike = -1
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """First hit of a ray with one shape: distance along the unit vector, and parameter.

        Args:
            index: the shape's number.
            origin: of the ray [m].
            along: its direction, a unit vector.
            on: number of the shape on which the origin lies, or -1.

        Returns:
            Distance (infinity for a miss) and parameter; differentiable in everything.
        """
        index, on = jnp.asarray(index), jnp.asarray(on)
        return self._pick(index, lambda shape: shape.hit(origin, along, on == index), ray=True)

    def front(
        self, index: Int[Array, ""], origin: Point, along: Point, on: ArrayLike = -1
    ) -> Bool[Array, ""]:
        """Whether a ray that meets a shape first meets the side that its normal is on.

        Args:
            index: the shape's number.
            origin: of the ray [m].
            along: its direction, a unit vector.
            on: number of the shape on which the origin lies, or -1.
        """
        index, on = jnp.asarray(index), jnp.asarray(on)
        return self._pick(index, lambda shape: shape.front(origin, along, on == index), ray=True)

    def silhouettes(
        self, p: Point, on: ArrayLike = -1
    ) -> tuple[Float[Array, "m 2"], Bool[Array, " m"]]:
        """Points at which the view of an eye at p may change, and which of them exist."""
        points, valid, first = [], [], 0
        on = jnp.asarray(on)
        for group in self.groups:
            own = jnp.arange(first, first + group.count) == on
            found = jax.vmap(lambda shape, own: shape.silhouettes(p, own))(group, own)
            points.append(found[0].reshape(-1, 2))
            valid.append(found[1].reshape(-1))
            first += group.count
        if self.crossings.pairs.shape[0]:
            crossed = jax.vmap(lambda pair, s: self.crossing(pair, s)[1:])(
                self.crossings.pairs, self.crossings.near
            )
            points.append(crossed[0])
            valid.append(crossed[1])
        return jnp.concatenate(points), jnp.concatenate(valid)

    def crossing(
        self, pair: Int[Array, "2"], near: Float[Array, "2"]
    ) -> tuple[Float[Array, "2"], Point, Bool[Array, ""]]:
        """Where two shapes cross, from a start near by: by Newton's method.

        Args:
            pair: numbers of the two shapes.
            near: parameters on both, as `crossings` has them.

        Returns:
            The parameters, the point, and whether there is a crossing.
        """

        def step(scene, s):
            a, va, _ = scene.motion(pair[0], s[0])
            b, vb, _ = scene.motion(pair[1], s[1])
            det = cross_2d(va, vb)
            gap = b - a
            safe = jnp.where(det == 0.0, 1.0, det)
            return s + jnp.stack([cross_2d(gap, vb), cross_2d(gap, va)]) / safe, a, gap

        fixed = jax.lax.stop_gradient(self)
        s = jax.lax.fori_loop(0, 8, lambda _, s: step(fixed, s)[0], near)
        s = jax.lax.stop_gradient(s)
        closed = self._closed[pair]
        s = jnp.where(closed, jnp.mod(s, 1.0), s)  # past the start of a closed shape it goes on
        inside = jnp.all((s >= 0.0) & (s <= 1.0)) & jnp.all(jnp.isfinite(s))
        s = jnp.where(inside, s, 0.5)
        for _ in range(2):
            s, *_ = step(self, s)
        _, point, gap = step(self, s)
        # Judged by the shapes' own size, so that it is the same wherever the scene lies.
        speeds = sum(jnp.sum(jnp.abs(self.motion(k, t)[1])) for k, t in zip(pair, s, strict=True))
        met = jnp.sum(jnp.abs(gap)) < jnp.finfo(s.dtype).eps ** 0.5 * speeds
        return s, point, inside & met

    @property
    def _closed(self) -> Bool[Array, " n"]:
        """Mask of the shapes that have no ends."""
        return jnp.concatenate([jnp.full(g.count, g.closed) for g in self.groups])

    @by_band()
    def sky(self, angle: Float[Array, ""]) -> Float[Array, "*bands"]:
        """Radiance of the environment at an angle in [-pi, pi]; zero without one."""
        if self.environment is None:
            return jnp.zeros_like(angle)
        turns = jnp.round(jax.lax.stop_gradient(angle) / (2.0 * jnp.pi))
        return self.environment(angle - 2.0 * jnp.pi * turns)

    @property
    def unsound(self) -> Bool[Array, ""]:
        """Whether a shape is NaN: a traced scene that would be refused if it were concrete."""
        return jnp.any(jnp.stack([jnp.any(jnp.isnan(a)) for a in jax.tree.leaves(self.groups)]))

    def length(self, index: ArrayLike) -> Float[Array, ""]:
        """Arc length of a shape [m].

        By quadrature on 256 nodes: exact to rounding for what does not bend sharply, to 1e-7 for an
        ellipse 50 times as long as wide.
        """
        t, w = np.polynomial.legendre.leggauss(256)
        s = jnp.asarray(0.5 + 0.5 * t)
        speed = jax.vmap(lambda s: self.frame(index, s).speed)(s)
        return jnp.sum(0.5 * jnp.asarray(w) * speed)


@compiled
def _frame(shape: Shape, s: Float[Array, ""]) -> Frenet:
    """The frame of one shape."""
    c, v, a = shape.motion(s)
    speed = jnp.sqrt(dot_2d(v, v))
    tangent = v / speed
    normal = left(tangent)
    n = jnp.arctan2(-normal[0], normal[1])
    return Frenet(c, tangent, normal, n, speed, cross_2d(v, a) / speed**3)


def _sized(groups: list[Shape]) -> Bool[Array, ""]:
    """Whether all radii and semi-axes are positive; concrete shapes refuse others themselves."""
    names = ("radius", "semi")
    sizes = [getattr(g, name) for g in groups for name in names if hasattr(g, name)]
    sizes += [jnp.abs(g.sweep) for g in groups if isinstance(g, Arcs)]
    return jnp.all(jnp.stack([jnp.all(size > 0.0) for size in sizes] or [jnp.array(True)]))


def _join(shapes: list) -> Any:
    """Several shapes of one kind as one."""
    several = len(shapes) > 1 and isinstance(shapes[0], Curves)
    return joined(_padded(shapes) if several else shapes)


def _padded(curves: list[Curves]) -> list[Curves]:
    """Fourier series of one length."""
    most = max(c.cosines.shape[1] for c in curves)
    samples = max(c.samples for c in curves)

    def fill(a):
        return jnp.pad(a, ((0, 0), (0, most - a.shape[1]), (0, 0)))

    return [Curves(fill(c.cosines), fill(c.sines), samples) for c in curves]
