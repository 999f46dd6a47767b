"""The shapes of flatland, as structures of arrays whose every number can be differentiated.

A class holds many shapes of its kind: each leaf has one leading axis, the shapes. Its methods
speak of one shape and are called on a slice (`Scene` picks it). All kinds are curves `c(s)`, s in
[0, 1], with one rule for sides: the normal lies to the left of the direction of travel. Segments
travel from start to end; circles, ellipses and closed curves clockwise, so that normals point
outward.

`hit` and `silhouettes` are exact and differentiable; where there is no hit the answer is infinity
with a gradient of zero, never NaN.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import (
    check_between,
    check_count,
    check_finite,
    check_positive,
    is_concrete,
    warn_of_degrees,
)
from firstorder.conventions import direction
from firstorder.flatland.shapes._base import Point, Shape, column, rows, same, spread, stack
from firstorder.flatland.shapes._fourier import MOST_TANGENTS, CurveRoots, PreparedCurves
from firstorder.flatland.shapes._prepared import PreparedArcs, PreparedEllipses
from firstorder.flatland.shapes._unit_circle import (
    SLACK,
    on_circle,
    turns,
    under_the_root,
    unit_circle_roots,
    unit_circle_tangents,
)
from firstorder.numerics._planar import cross_2d, dot_2d, left
from firstorder.numerics._quadratic import first_root
from firstorder.numerics._select import grazing

# --- straight ------------------------------------------------------------------------------------


class Segments(Shape):
    """Straight segments, `c(s) = start + s (end - start)`; the normal is to their left.

    That side is the front, from which they shine: `Segments((0, 0), (1, 0))` looks up, and
    `Segments((1, 1), (-1, 1))` down. `primitive(..., facing=point)` turns them to a point.

    Args:
        start: where they begin, shape (n, 2) or (2,) [m].
        end: where they end [m].

    Raises:
        ValueError: if a number is not finite, the shapes differ, or a segment has no length.

    Example:
        >>> from firstorder.flatland import Segments
        >>> Segments((0.0, 0.0), (1.0, 0.0)).count
        1
    """

    lengths = ("start", "end")
    silhouette_count = 2

    start: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))
    end: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))

    def __check_init__(self):
        """Refuse what is no segment."""
        check_finite("start", self.start)
        check_finite("end", self.end)
        same("end", self.end, self.start)
        if is_concrete((self.start, self.end)):
            short = np.all(np.asarray(self.start) == np.asarray(self.end), -1)
            if short.any():
                raise ValueError(
                    "Argument `end` must differ from `start`, but segment "
                    f"{int(np.argmax(short))} has no length."
                )

    def turned(self, which):
        """Start and end exchanged."""
        start = jnp.where(which[:, None], self.end, self.start)
        return Segments(start, jnp.where(which[:, None], self.start, self.end))

    def height(self, p):
        """By the side of each segment's line."""
        start, end = np.asarray(self.start), np.asarray(self.end)
        ex, ey, wx, wy = *(end - start).T, *(p - start).T
        return ex * wy - ey * wx

    @property
    def count(self) -> int:
        """Number of segments."""
        return self.start.shape[0]

    def motion(self, s: Float[Array, ""]) -> tuple[Point, Point, Point]:
        """Uniform motion from end to end."""
        edge = self.end - self.start
        return self.start + s * edge, edge, jnp.zeros_like(edge)

    def hit(self, origin, along, on):
        """Solution of two equations in two unknowns, by cross products."""
        t, s, size, there = self._crossing(origin, along, on)
        # A near miss has its quotients too: rounding may decide in two ways whether it is one.
        nearly = (size > 0.0) & (jnp.abs(s - 0.5 * size) <= 0.75 * size)
        t, s, size = (jnp.where(nearly, a, b) for a, b in ((t, 0.0), (s, 0.0), (size, 1.0)))
        return jnp.where(there, t / size, jnp.inf), s / size

    def distance(self, origin, along, on):
        """The distance of `hit`, with one division: innermost loop of searches.

        What is divided is chosen before it is divided: a quotient that only one arm of a choice
        wants keeps the compiler from computing several rays at once.
        """
        t, _, size, there = self._crossing(origin, along, on)
        return jnp.where(there, t, jnp.inf) / jnp.where(size > 0.0, size, 1.0)

    def _crossing(self, origin, along, on):
        """Distance and parameter, both times a size that is not negative; whether they are a hit.

        Search and hit ask alike, so that they agree on a ray that grazes an end.
        """
        (ex, ey), (wx, wy), (dx, dy) = (
            jnp.unstack(a) for a in (self.end - self.start, self.start - origin, along)
        )
        det = dx * ey - dy * ex
        sign = jnp.where(det < 0.0, -1.0, 1.0).astype(det.dtype)
        size, t, s = det * sign, (wx * ey - wy * ex) * sign, (wx * dy - wy * dx) * sign
        return t, s, size, (t > 0.0) & (s >= 0.0) & (s <= size) & (size > 0.0) & ~on

    def front(self, origin, along, on):
        """By the side of the segment's line."""
        return cross_2d(self.end - self.start, along) < 0.0

    def silhouettes(self, p, on):
        """The two ends."""
        ends = jnp.stack([self.start, self.end])
        return ends, jnp.broadcast_to(~on, (2,))


# --- round ---------------------------------------------------------------------------------------


class Circles(Shape):
    """Circles, travelled clockwise from the top: `c(s) = center + radius (sin 2 pi s, cos 2 pi s)`.

    Args:
        center: shape (n, 2) or (2,) [m].
        radius: shape (n,) or a number, positive [m].

    Raises:
        ValueError: if a radius is not positive or a number is not finite.

    Example:
        >>> from firstorder.flatland import Circles
        >>> import jax.numpy as jnp
        >>> c, _, _ = Circles((0.0, 0.0), 2.0).motion(jnp.array(0.25))
        >>> c[0, 0].item()
        2.0
    """

    lengths = ("center", "radius")
    silhouette_count = 2

    center: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))
    radius: Float[Array, " n"] = eqx.field(converter=lambda r: column(r))

    closed = True

    def __check_init__(self):
        """Refuse what is no circle."""
        spread(self, "radius")
        check_finite("center", self.center)
        check_positive("radius", self.radius)
        same("radius", self.radius, self.center)

    def height(self, p):
        """By the distance from the centre."""
        w, radius = p - np.asarray(self.center), np.asarray(self.radius)
        return np.sum(w * w, -1) - radius * radius

    @property
    def count(self) -> int:
        """Number of circles."""
        return self.radius.shape[0]

    def motion(self, s):
        """Uniform motion around the circle."""
        a = -2.0 * jnp.pi * s
        r, turn = self.radius[..., None], -2.0 * jnp.pi
        u = direction(a)
        return self.center + r * u, turn * r * left(u), -(turn**2) * r * u

    def hit(self, origin, along, on):
        """Solution of a quadratic equation."""
        over, under, there, nearly = self._root(origin, along, on)
        t = jnp.where(nearly, over, 0.0) / under
        h = (origin + t * along - self.center) / self.radius
        return jnp.where(there, t, jnp.inf), turns(h, nearly)

    def distance(self, origin, along, on):
        """The distance of `hit`, with one division (as in `Segments`)."""
        over, under, there, _ = self._root(origin, along, on)
        return jnp.where(there, over, jnp.inf) / under

    def _root(self, origin, along, on):
        """The nearest root ahead as a quotient, and both conditions of `unit_circle_roots`."""
        w, square = origin - self.center, self.radius * self.radius
        a, b = dot_2d(along, along), dot_2d(w, along)
        c, most = jnp.where(on, 0.0, dot_2d(w, w) - square), square * a
        root_of = under_the_root(most - cross_2d(w, along) ** 2, b, on)
        over, under, ahead = first_root(a, b, c, root_of, most)
        return over, under, (root_of > 0.0) & ahead, (root_of > -SLACK * grazing(most)) & ahead

    def front(self, origin, along, on):
        """From outside."""
        w = origin - self.center
        return ~on & (dot_2d(w, w) > self.radius * self.radius)

    def silhouettes(self, p, on):
        """The two points of tangency."""
        points, valid = unit_circle_tangents((p - self.center) / self.radius, on)
        return self.center + self.radius * points, valid


class Arcs(Shape):
    """Arcs of circles, `c(s) = center + radius direction(start + s sweep)`.

    A negative sweep runs clockwise and has its normal outward; a positive one, inward.

    Args:
        center: shape (n, 2) or (2,) [m].
        radius: shape (n,) or a number, like all that follows, positive [m].
        start: angle at which they begin, counter-clockwise from +y [rad].
        sweep: how far they turn, in [-2 pi, 2 pi] without zero [rad].

    Raises:
        ValueError: if a radius is not positive, a sweep is zero, or a number is not finite.

    Example:
        >>> import numpy as np
        >>> from firstorder.flatland import Arcs
        >>> bowl = Arcs((0.0, 1.0), 1.0, 0.5 * np.pi, np.pi)  # opens upward, normals inward
        >>> bowl.count
        1
    """

    lengths = ("center", "radius")
    silhouette_count = 4

    center: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))
    radius: Float[Array, " n"] = eqx.field(converter=lambda r: column(r))
    start: Float[Array, " n"] = eqx.field(converter=lambda r: column(r))
    sweep: Float[Array, " n"] = eqx.field(converter=lambda r: column(r))

    def __check_init__(self):
        """Refuse what is no arc."""
        spread(self, "radius", "start", "sweep")
        check_finite("center", self.center)
        check_positive("radius", self.radius)
        check_finite("start", self.start)
        warn_of_degrees("start", self.start)
        check_positive("|sweep|", abs(self.sweep))
        check_between("|sweep|", abs(self.sweep), 0.0, 2.0 * math.pi + 1e-6)
        for name in ("radius", "start", "sweep"):
            same(name, getattr(self, name), self.center)

    def turned(self, which):
        """Travelled from the other end."""
        start = jnp.where(which, self.start + self.sweep, self.start)
        return Arcs(self.center, self.radius, start, jnp.where(which, -1.0, 1.0) * self.sweep)

    @property
    def count(self) -> int:
        """Number of arcs."""
        return self.radius.shape[0]

    def motion(self, s):
        """A uniform motion."""
        u = direction(self.start + s * self.sweep)
        r, turn = self.radius[..., None], self.sweep[..., None]
        return self.center + r * u, turn * r * left(u), -(turn**2) * r * u

    def _parameter(self, h: Point, there: Bool[Array, ""]):
        """Parameter on the arc of a point of its circle; beyond 1 if it is not on the arc."""
        h = on_circle(h, there)
        angle = jnp.arctan2(-h[0], h[1])
        turned = (angle - self.start) * jnp.sign(self.sweep)
        return jnp.mod(turned, 2.0 * jnp.pi) / jnp.abs(self.sweep)

    def prepared(self):
        """With the directions of both ends."""
        ends = jnp.stack([direction(self.start), direction(self.start + self.sweep)])
        return PreparedArcs(self.center, self.radius, ends, self.sweep)

    def hit(self, origin, along, on):
        """The nearer crossing of the circle that lies on the arc."""
        over, under, there, nearly = self.prepared().crossing(origin, along, on)
        t = jnp.where(nearly, over, 0.0) / under
        s = self._parameter((origin + t * along - self.center) / self.radius, nearly)
        # Beside an end by rounding, s is that of the end.
        s = jnp.where(s <= 1.0, s, jnp.where(s < 0.5 + jnp.pi / jnp.abs(self.sweep), 1.0, 0.0))
        return jnp.where(there, t, jnp.inf), jnp.where(there, s, 0.0)

    def silhouettes(self, p, on):
        """The two ends, and those points of tangency that lie on the arc."""
        points, valid = unit_circle_tangents((p - self.center) / self.radius, on)
        s = jnp.stack([self._parameter(h, v) for h, v in zip(points, valid, strict=True)])
        ends = direction(jnp.stack([self.start, self.start + self.sweep]))
        here = self.center + self.radius * jnp.concatenate([points, ends])
        return here, jnp.concatenate([valid & (on | (s <= 1.0)), jnp.ones(2, bool)])


class Ellipses(Shape):
    """Ellipses, travelled clockwise: `c = center + T(tilt) (semi_x sin 2 pi s, semi_y cos 2 pi s)`.

    Args:
        center: shape (n, 2) or (2,) [m].
        semi: semi-axes along x and y before the tilt, shape (n, 2) or (2,), positive [m].
        tilt: counter-clockwise rotation [rad].

    Raises:
        ValueError: if a semi-axis is not positive or a number is not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Ellipses
        >>> c, _, _ = Ellipses((0.0, 0.0), (2.0, 1.0)).motion(jnp.array([0.25]))
        >>> c[0, 0].item()
        2.0
    """

    lengths = ("center", "semi")
    silhouette_count = 2

    center: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))
    semi: Float[Array, "n 2"] = eqx.field(converter=lambda p: rows(p))
    tilt: Float[Array, " n"] = eqx.field(default=0.0, converter=lambda r: column(r))

    closed = True

    def __check_init__(self):
        """Refuse what is no ellipse."""
        spread(self, "semi", "tilt")
        check_finite("center", self.center)
        check_positive("semi", self.semi)
        check_finite("tilt", self.tilt)
        warn_of_degrees("tilt", self.tilt)
        same("semi", self.semi, self.center)
        same("tilt", self.tilt, self.center)

    @property
    def count(self) -> int:
        """Number of ellipses."""
        return self.center.shape[0]

    def _inward(self, u: Point) -> Point:
        """A vector in the frame in which the ellipse is the unit circle."""
        c, s = jnp.cos(self.tilt), jnp.sin(self.tilt)
        return jnp.stack([c * u[0] + s * u[1], -s * u[0] + c * u[1]]) / self.semi

    def _outward(self, u: Float[Array, "*n 2"]) -> Float[Array, "*n 2"]:
        """A vector back from the frame of the unit circle."""
        c, s = jnp.cos(self.tilt), jnp.sin(self.tilt)
        x, y = u[..., 0] * self.semi[..., 0], u[..., 1] * self.semi[..., 1]
        return jnp.stack([c * x - s * y, s * x + c * y], -1)

    def motion(self, s):
        """Motion of the unit circle, stretched."""
        u, turn = direction(-2.0 * jnp.pi * s), -2.0 * jnp.pi
        return (
            self.center + self._outward(u),
            turn * self._outward(left(u)),
            -(turn**2) * self._outward(u),
        )

    def hit(self, origin, along, on):
        """Solution of a quadratic equation in the frame of the unit circle."""
        w, d = self._inward(origin - self.center), self._inward(along)
        (near, first, one), (far, last, other) = unit_circle_roots(w, d, on)
        t, nearly = jnp.where(one, near, far), one | other
        h = w + jnp.where(nearly, t, 0.0) * d
        return jnp.where(first | last, t, jnp.inf), turns(h, nearly)

    def prepared(self):
        """With the matrix into the frame of the unit circle."""
        c, s = jnp.cos(self.tilt), jnp.sin(self.tilt)
        turn = jnp.stack([jnp.stack([c, s]), jnp.stack([-s, c])])
        return PreparedEllipses(self.center, turn / self.semi[:, None])

    def front(self, origin, along, on):
        """From outside."""
        w = self._inward(origin - self.center)
        return ~on & (dot_2d(w, w) > 1.0)

    def silhouettes(self, p, on):
        """The two points of tangency of the unit circle, which linear maps keep."""
        points, valid = unit_circle_tangents(self._inward(p - self.center), on)
        return self.center + self._outward(points), valid


# --- any smooth closed curve ---------------------------------------------------------------------


class Curves(Shape):
    """Smooth closed curves by Fourier series.

    `c(s) = sum_k cosines[k] cos(2 pi k s) + sines[k] sin(2 pi k s)`, clockwise for outward normals
    (`closed_curve` makes one through points, and turns it the right way).

    Roots are bracketed on `samples` pieces, on more where harmonics turn faster, each cut once more
    at an extremum near zero, and then polished by Newton steps that carry the derivatives. Valid
    when: two features of the curve are further apart than a piece, which a line so touches at most
    once, the curve does not cross itself, no line touches it or nearly touches it in more than four
    places, and no point sees more than eight of its tangents: from there the view is NaN.

    Args:
        cosines: shape (n, K, 2) or (K, 2), from the mean (k = 0) up [m].
        sines: the same shape; sines[0] does nothing [m].
        samples: pieces in which roots are bracketed.

    Raises:
        ValueError: if both do not have one shape, a number is not finite, or there are no pieces.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Curves
        >>> ring = Curves([(0.0, 0.0), (0.0, 1.0)], [(0.0, 0.0), (1.0, 0.0)])
        >>> c, _, _ = ring.motion(jnp.array(0.0))
        >>> c.tolist()
        [[0.0, 1.0]]
    """

    lengths = ("cosines", "sines")
    silhouette_count = MOST_TANGENTS

    cosines: Float[Array, "n k 2"] = eqx.field(converter=lambda c: stack(c))
    sines: Float[Array, "n k 2"] = eqx.field(converter=lambda c: stack(c))
    samples: int = eqx.field(static=True, default=64)
    # As `ready` leaves them for many questions.
    pieces: PreparedCurves | None = eqx.field(default=None, kw_only=True, repr=False)

    closed = True

    def __check_init__(self):
        """Refuse what is no curve."""
        check_finite("cosines", self.cosines)
        check_finite("sines", self.sines)
        check_count("samples", self.samples)
        if self.cosines.shape != self.sines.shape:
            raise ValueError(
                f"Argument `sines` must have shape {self.cosines.shape}, "
                f"but has {self.sines.shape}."
            )

    @property
    def count(self) -> int:
        """Number of curves."""
        return self.cosines.shape[0]

    def _series(self) -> CurveRoots:
        return CurveRoots(self.cosines, self.sines, self.samples)

    def motion(self, s):
        """The series and its two derivatives."""
        return self._series().motion(s)

    def in_unit(self, unit):
        """With its pieces, if it is ready, which are lengths too."""
        pieces = jax.tree.map(lambda length: length / unit, self.pieces)
        scaled = super().in_unit(unit)
        return eqx.tree_at(lambda c: c.pieces, scaled, pieces, is_leaf=lambda a: a is None)

    def ready(self):
        """With its pieces, which cost more than a ray."""
        pieces = jax.vmap(lambda shape: shape.prepared())(self)
        return eqx.tree_at(lambda c: c.pieces, self, pieces, is_leaf=lambda a: a is None)

    def prepared(self):
        """In pieces, on each of which the series is a polynomial."""
        return self._series().prepared() if self.pieces is None else self.pieces

    def hit(self, origin, along, on):
        """The nearest of the bracketed crossings."""
        return self._series().hit(self.prepared(), origin, along, on)

    def silhouettes(self, p, on):
        """The bracketed points of tangency."""
        return self._series().tangents(self.prepared(), p)
