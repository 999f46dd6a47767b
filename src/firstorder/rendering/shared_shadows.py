r"""Images with soft shadows on a budget: few pixels are shaded, and these share few shadow rays.

    I(p) = L(p) V(p),    dI/dp = V dL/dp + L dV/dp

L is the light of a rectangular lamp that nothing hides, in closed form (`imaging.shade_pixels`), V
the share of the lamp that is seen. On one shape V comes from rays that all of its pixels share
(`shadowfield.sheared_shadow`), and dV/dp from its differences over a pixel; on the others from
stratified rays of each place's own, and there the gradient leaves out that shadows move.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import check_count, check_finite, check_positive
from firstorder._display import in_print
from firstorder.imaging import (
    Lamp,
    Pinhole,
    PrimaryHits,
    ShadedPixels,
    primary_hits,
    shade_pixels,
)
from firstorder.numerics._batching import host_blocks
from firstorder.reconstruction import ImageSamples, ShadedSamples, delaunay_image
from firstorder.scene._arguments import check_kind
from firstorder.shadowfield import (
    LampFrame,
    RayTable,
    band_limit_sweep,
    lamp_frame,
    own_visibility,
    scene_blockers,
    sheared_shadow,
    trace_shadow_rays,
)
from firstorder.shadowfield.rendering import below
from firstorder.space.scene import Scene

BLOCK = 1024  # places at a time

Places = Float[np.ndarray, "n 2"]
Numbers = Float[np.ndarray, " n"]
Image = Float[np.ndarray, "c r"]


class ExpectedImage(NamedTuple):
    """An image from few samples, and how far off it is expected to be.

    Attributes:
        value: radiance, first axis px, second py [W/(m^2 sr)].
        error: expected root mean square error of each pixel.
    """

    value: Image
    error: Image

    __repr__ = in_print


class SharedShadows(NamedTuple):
    """A lamp's light in an image with its soft shadows; pixels of one shape share shadow rays.

    Places are in pixels, (0, 0) is a corner of the image: as `reconstruction.sample_image` asks.

    Attributes:
        scene: what is seen and what hides the lamp, which is not in it.
        camera: the eye.
        lamp: a rectangle.
        hits: what each pixel shows.
        on: number of the shape whose pixels share rays.
        table: these rays.
        Omega_y: band limit on the lamp [cycles/m].
        strata: of the own rays of each place, along each edge of the lamp.
        seed: of the own rays.
    """

    scene: Scene
    camera: Pinhole
    lamp: Lamp
    hits: PrimaryHits
    on: int
    table: RayTable
    Omega_y: float
    strata: int
    seed: int

    __repr__ = in_print

    @property
    def frame(self) -> LampFrame:
        """The frame in which the rays are given."""
        return lamp_frame(self.lamp.center, self.lamp.u, self.lamp.v)

    @property
    def side(self) -> float:
        """Side of a pixel in image coordinates."""
        p = np.asarray(self.hits.p)
        return float(p[1, 0, 0] - p[0, 0, 0] if len(p) > 1 else p[0, 1, 1] - p[0, 0, 1])

    @property
    def pixel(self) -> float:
        """Side of a pixel on the shape whose pixels share rays, across the view: the median [m]."""
        far = np.asarray(self.hits.distance)[np.asarray(self.hits.index) == self.on]
        return float(np.median(far)) * self.side / float(self.camera.gamma)

    def seen(self, p: Places) -> PrimaryHits:
        """First hits through places of the image."""
        corner = np.asarray(self.hits.p[0, 0]) - 0.5 * self.side
        return primary_hits(self.scene, self.camera, p=corner + self.side * p)

    def unshadowed(self, hits: PrimaryHits) -> ShadedPixels:
        """Light of the lamp as if nothing hid it."""
        index = np.asarray(hits.index)
        return shade_pixels(
            self.scene, self.camera, [self.lamp], np.asarray(hits.p), index, shadows=False
        )

    def visible(self, hits: PrimaryHits) -> tuple[Numbers, Places]:
        """Share of the lamp that is seen, and how it changes from pixel to pixel."""
        share, moved = self._own(hits), np.zeros((len(hits.index), 2))
        some = self._shared(hits)
        if np.any(some):
            at, moves = np.asarray(hits.position)[some], self._moves(hits, some)
            steps = 0.5 * np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
            beside = at + np.einsum("nij,kj->kni", moves, steps)
            own = np.tile(share[some], len(steps))
            found = sheared_shadow(
                self.frame, self.table, beside.reshape(-1, 3), self.Omega_y, self.pixel, own
            )
            # Half a pixel from what is below the lamp there may be what is not.
            seen = np.where(below(self.frame, beside.reshape(-1, 3)), found.visible, 0.0)
            share[some], left, right, low, high = seen.reshape(len(steps), -1)
            moved[some] = np.stack([right - left, high - low], -1)
        return share, moved

    def shade(self, p: Places) -> ShadedSamples:
        """Radiance at places of the image with its gradient [per pixel].

        Returns:
            For `reconstruction.sample_image`; `more` is the gradient if shadows did not move.

        Raises:
            ValueError: if a place is not finite.
        """
        check_finite("p", p)
        hits = self.seen(p)
        light, (share, moved) = self.unshadowed(hits), self.visible(hits)
        value, slope = np.asarray(light.value), self.side * np.asarray(light.gradient)
        still = share[:, None] * slope
        return ShadedSamples(share * value, still + value[:, None] * moved, still)

    def expected_error(self, p: Places) -> Numbers:
        """Expected error of the radiance at places, by what their shadow rays say of themselves.

        Own rays are tosses of a coin, each of them; shared ones as in `band_limit_sweep`. Both are
        spread evenly and do better, so that the error is expected too large where rays are few:
        with the image of `examples/image_on_a_budget.py` 1.5 to 1.9 times at 1 ray a pixel, 1.0 to
        1.1 times at 2 and at 4 (a band limit of 1 cycle over the lamp).

        Args:
            p: places all over the image: neighbours have a say in each other's error.
        """
        hits, columns = self.seen(p), max(self.hits.index.shape)
        own, some = self._own(hits), self._shared(hits)
        error = np.sqrt(own * (1.0 - own)) / self.strata
        if np.any(some):
            column, row = np.minimum(p[some].astype(int), np.array(self.hits.index.shape) - 1).T
            limits = self.Omega_y * np.array([1.0, 2.0])
            at, image = np.asarray(hits.position)[some], (column * columns + row, columns)
            error[some] = band_limit_sweep(
                self.frame, self.table, at, limits, self.pixel, own[some], image,
                own_rays=float(self.strata**2),
            ).error[0]  # fmt: skip
        return np.asarray(self.unshadowed(hits).value) * error

    def image(self, found: ImageSamples) -> ExpectedImage:
        """Image from samples, not across the edges of shapes, and its expected error.

        Linear between the samples. What that lacks to a rule that is exact for quadratic images
        is the error of interpolation; that of the shadows is interpolated from the samples.

        Args:
            found: samples of `shade`.
        """
        label, labels = self.seen(found.p).index, self.hits.index

        def spread(values, **options) -> Image:
            size = labels.shape
            return delaunay_image(found.p, values, *size, label=label, labels=labels, **options)

        value = spread(found.value)
        curved = spread(found.value, scheme="gradient", gradient=found.gradient)
        return ExpectedImage(value, np.hypot(value - curved, spread(self.expected_error(found.p))))

    def reference(self, strata: int, seed: int) -> Image:
        """Image of which every pixel is shaded, with stratified rays of its own.

        Args:
            strata: along each edge of the lamp, one ray in each.
            seed: of the random numbers; not that of this shadow.
        """
        flat = jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:]), self.hits)
        share = self._replace(strata=strata, seed=seed)._own(flat)
        return (np.asarray(self.unshadowed(flat).value) * share).reshape(self.hits.index.shape)

    def _own(self, hits: PrimaryHits) -> Numbers:
        """Share of the lamp that is seen by rays of each place's own.

        It is 0 where nothing is met, and where a surface is not below the lamp.
        """
        index, at = np.asarray(hits.index), np.asarray(hits.position)
        share, met = np.zeros(len(index)), (index >= 0) & below(self.frame, at)
        some = at[met], index[met]
        share[met] = own_visibility(self.scene, self.frame, *some, self.strata, self.seed)
        return share

    def _shared(self, hits: PrimaryHits) -> Bool[np.ndarray, " k"]:
        """Which places look up the shared rays."""
        return (np.asarray(hits.index) == self.on) & below(self.frame, np.asarray(hits.position))

    def _moves(self, hits: PrimaryHits, some: np.ndarray) -> Float[np.ndarray, "k 3 2"]:
        """Moves of the places that are seen with those in the image [m per pixel]."""
        rays = tuple(np.asarray(a)[some] for a in (hits.p, hits.distance, hits.normal))
        moves = host_blocks(lambda a: _footprints(self.camera, *a), rays, BLOCK)
        return self.side * np.asarray(moves)


@eqx.filter_jit
def _footprints(camera: Pinhole, p: Array, distance: Array, normal: Array) -> Array:
    return jax.vmap(camera.view)(p, distance, normal).position_D_p


def share_shadow_rays(
    scene: Scene,
    camera: Pinhole,
    lamp: Lamp,
    hits: PrimaryHits,
    name: str,
    *,
    rays_per_pixel: float = 1.0,
    band_limit: float = 1.5,
    strata: int = 4,
    seed: int = 0,
) -> SharedShadows:
    """Light and soft shadows of a lamp in an image: traces rays that the pixels of a shape share.

    Args:
        scene: what is seen and what hides the lamp, which must not be in it.
        camera: the eye.
        lamp: a rectangle.
        hits: what each pixel of the image shows (`imaging.primary_hits` with a `size`).
        name: of the shape whose pixels share rays.
        rays_per_pixel: shared rays for each of its pixels; below 1, that share of them has one.
        band_limit: low for few rays, high for sharp shadows [cycles over the lamp's first edge].
        strata: along each edge of the lamp: one own ray in each where rays are not shared, or
            cannot be, since a blocker touches the shape.
        seed: of the random numbers.

    Raises:
        TypeError: if the scene is none.
        ValueError: if no pixel shows the shape, there are several of that name, `band_limit` or
            `strata` is not positive, or the lamp is no rectangle.

    Reference: E11 §5; the gradient by differences of shared rays is ours.

    Example:
        >>> import numpy as np
        >>> from firstorder import imaging, rendering
        >>> from firstorder.space import Scene, plane, primitive, sphere
        >>> floor = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=0.5)
        >>> scene = Scene.of(floor, primitive(sphere((0.0, 0.0, 1.0), 0.3)))
        >>> camera = imaging.pinhole((0.0, -3.0, 2.0), (0.0, 0.0, 0.0), gamma=3.0)
        >>> lamp = imaging.Lamp((0.0, 0.0, 3.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> hits = imaging.primary_hits(scene, camera, 8)
        >>> shadows = rendering.share_shadow_rays(scene, camera, lamp, hits, "floor")
        >>> seen, lit = shadows.shade(np.array([(4.0, 4.0), (7.0, 4.0)])).value  # below the ball
        >>> bool(seen < 0.7 * lit)
        True
    """
    check_kind("scene", scene, Scene)
    check_positive("band_limit", band_limit)
    check_count("strata", strata)
    if np.size(hits.index) < 2:
        raise ValueError("Argument `hits` must hold at least two pixels, but holds one.")
    on, *others = scene.named(name)
    if others:
        raise ValueError(
            f"Argument `name` must be that of one shape, but {name!r} names {1 + len(others)}."
        )
    points = np.asarray(hits.position)[np.asarray(hits.index) == on]
    if not len(points):
        raise ValueError(f"Argument `name` must be that of a shape that is seen, but is {name!r}.")
    frame = lamp_frame(lamp.center, lamp.u, lamp.v)
    blockers = scene_blockers(scene, on)
    table, _ = trace_shadow_rays(frame, points, rays_per_pixel, blockers, seed + 1)
    Omega_y = band_limit / (2.0 * float(frame.half[0]))
    return SharedShadows(scene, camera, lamp, hits, on, table, Omega_y, strata, seed)
