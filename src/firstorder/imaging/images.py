r"""Images of a scene and their gradients: direct light seen by a pinhole camera.

    I(p) = emitted + albedo / pi E + gloss,        dI/dp exact, soft shadows included

Rays find which shape each pixel shows, without derivatives; the one hit of a pixel is then computed
again, and the pixel is a smooth function of its place. Irradiance E comes from silhouettes and is
exact under differentiation; what is gathered along rays (a sky that is no constant, glossy lobes)
gets its boundary term from the silhouettes, which no derivative of sampled light contains.

An image's gradients at a coarse grid are what interpolation lives on (R07 §8). Labels keep it from
crossing edges in the image: the shape a pixel shows, and which of its faces.
"""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_count,
    check_integer,
    check_positive,
    is_concrete,
)
from firstorder._labelled import Dataset, data_set
from firstorder.conventions import cylindrical
from firstorder.imaging.camera import Pinhole
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._vectors import dot, matvec, orthonormal_frame, unit
from firstorder.scene._arguments import check_kind, numbers
from firstorder.scene._bands import by_band
from firstorder.scene._intersect import MISS
from firstorder.scene._primitives import BACK, FRONT
from firstorder.space.direct_lighting import boundary_gradient, irradiance
from firstorder.space.intersect import first_shape
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Boxes, Cylinders, Shape
from firstorder.space.silhouettes._collisions import check_apart_from, have_collisions

BLOCK = 256  # pixels shaded at a time: silhouettes of all shapes are kept for each
RADIANCE = "W/(m^2 sr)"
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)

Pixel = Float[Array, "2"]
Direction = Float[Array, "3"]


class RenderedImage(eqx.Module):
    """An image on a regular grid of pixels.

    Attributes:
        px, py: image coordinates of the columns and of the rows, both rising.
        value: radiance, first axis px, second py, and last that of bands, if there are any
            [W/(m^2 sr)].
        gradient: dI/dpx and dI/dpy in the last axis, behind that of bands.
        label: what each pixel shows: `faces` per shape, -1 for the sky.
    """

    px: Float[np.ndarray, " c"]
    py: Float[np.ndarray, " r"]
    value: Float[np.ndarray, "c r *bands"]
    gradient: Float[np.ndarray, "c r *bands 2"]
    label: Int[np.ndarray, "c r"]

    @property
    def picture(self) -> Float[np.ndarray, "r c *bands"]:
        """Values in the layout of pictures: rows from the top."""
        return self.value.swapaxes(0, 1)[::-1]

    def to_xarray(self) -> Dataset:
        """The image as a data set over px and py, its gradient over `along` too.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> import numpy as np
            >>> from firstorder.imaging import RenderedImage
            >>> px, py, flat = np.array([-0.5, 0.5]), np.zeros(1), np.ones((2, 1))
            >>> image = RenderedImage(px, py, flat, np.zeros((2, 1, 2)), np.zeros((2, 1), int))
            >>> image.to_xarray().value.sel(px=0.5).values.tolist()
            [1.0]
        """
        image = ("px", "py")
        return data_set(
            {
                "value": (image, self.value, RADIANCE),
                "gradient": ((*image, "along"), self.gradient, f"{RADIANCE} / unit of the image"),
                "label": (image, self.label, ""),
            },
            {
                "px": (("px",), self.px, "unit of the image"),
                "py": (("py",), self.py, "unit of the image"),
                "along": (("along",), ["px", "py"], ""),
            },
        )


def pixel_grid(columns: int, rows: int, half_width: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Centres of square pixels that fill [-half_width, half_width] across.

    Returns:
        Coordinates across, shape (columns,), and upwards, shape (rows,).

    Raises:
        ValueError: if a number is not positive.

    Example:
        >>> from firstorder.imaging import pixel_grid
        >>> pixel_grid(2, 1)[0].tolist()
        [-0.5, 0.5]
    """
    check_integer("columns", columns)
    check_integer("rows", rows)
    for name, number in (("columns", columns), ("rows", rows), ("half_width", half_width)):
        check_positive(name, number)
    side = 2.0 * half_width / columns
    return tuple(side * (np.arange(n) - 0.5 * (n - 1)) for n in (columns, rows))  # pyright: ignore


# --- light that surfaces reflect -----------------------------------------------------------------


def _gathered(
    scene: Scene,
    at: Receiver,
    axis: Direction,
    exponent: Array,
    rays: int = 256,
) -> Float[Array, ""]:
    r"""Light that a lobe about an axis gathers: `integral of L(w) cos(theta) cos^e(w, axis) dw`.

    Times `(e + 2) / 2 pi` it is the mean of the light over a glossy lobe, times 1 with e = 0 the
    irradiance. The value comes from `rays` directions spread over the lobe by their density
    (rank-1 lattice), so it errs by some `1 / rays`; at edges of the light by `rays^(-3/4)`.
    Of its derivative, what the lobe's motion adds is gathered along the same rays, and what moving
    edges add is `boundary_gradient`: exact, where differentiating rays would give nothing.

    Wrong for second derivatives: only the first one has its boundary term.

    Args:
        scene: light that is emitted counts, the same over each side of a shape.
        at: where it arrives.
        axis: unit vector of the world, the middle of the lobe.
        exponent: e, not negative; 0 for irradiance, for which rays follow the cosine.
        rays: traced.

    Reference: R07 §7.3: "complex reflectance can be baked into the lighting term".
    """
    held, still = jax.lax.stop_gradient((at, axis))
    flat = exponent == 0.0
    around = orthonormal_frame(jnp.where(flat, held.normal, still))
    power = jax.lax.stop_gradient(jnp.where(flat, 1.0, exponent))
    check_count("rays", rays)
    k = jnp.arange(rays, dtype=at.position.dtype)
    height = ((k + 0.5) / rays) ** (1.0 / (power + 1.0))
    phi, rho = 2.0 * jnp.pi * k * GOLDEN, jnp.sqrt(jnp.maximum(1.0 - height**2, 0.0))
    w = matvec(around, cylindrical(rho, phi, height))
    density = (power + 1.0) / (2.0 * jnp.pi) * height**power
    L = jax.lax.stop_gradient(_seen(scene, held, w))

    def weight(w, normal, axis):
        across = jnp.maximum(dot(w, axis), 1e-30)
        lobe = jnp.where(flat, 1.0, jnp.where(across > 1e-30, across, 0.0) ** exponent)
        return jnp.maximum(dot(w, normal), 0.0) * lobe

    inside = jnp.mean(L * weight(w, at.normal, axis) / density)
    local_axis = held.axes.T @ still
    edges = boundary_gradient(
        scene, held, weight=lambda v: weight(v, jnp.array([0.0, 0.0, 1.0], v.dtype), local_axis)
    )
    step = at.position - held.position
    return inside + dot(held.axes @ jax.lax.stop_gradient(edges), step)


def _seen(scene: Scene, at: Receiver, w: Float[Array, "r 3"]) -> Float[Array, " r"]:
    """Radiance emitted towards a receiver along directions of the world."""
    origins = jnp.broadcast_to(at.position, w.shape)
    index = first_shape(scene, origins, w, at.on)

    def emitted(i, w):
        point, _, _ = scene.surface(jnp.maximum(i, 0), at.position, w, at.on)
        return jnp.where(i < 0, scene.sky(w), scene.emitted(jnp.maximum(i, 0), point, w))

    return jax.vmap(emitted)(index, w)


def _radiance(
    scene: Scene,
    eye: Direction,
    along: Direction,
    index: Int[Array, ""],
    rays: int = 256,
    gloss: bool = True,
) -> Float[Array, ""]:
    r"""Radiance that comes back along a ray whose first hit is known: emitted and reflected once.

    `L = L_e + albedo / pi E + specular (e + 2) / (2 pi) integral L cos(theta) cos^e(w, r) dw` with
    r the mirrored direction: a lobe that is reciprocal and reflects the share `specular` of light
    at normal incidence. Differentiable once in everything; twice, where nothing is glossy and the
    sky is a number.

    Valid when: what is emitted is the same over each side of a shape. Light reflected elsewhere
    does not arrive here: `space.bounces.pathtrace` follows it.

    Args:
        scene: shapes, materials, sky.
        eye: where the ray starts [m].
        along: unit vector.
        index: of the shape that it meets first, -1 for the sky.
        rays: gathered for glossy lobes and for a sky that is a function.
        gloss: whether glossy lobes are computed; False leaves them out.

    Returns:
        Radiance [W/(m^2 sr)].
    """
    met = index >= 0
    shape = jnp.maximum(index, 0)
    # A ray to the shape's centre stands in where nothing is met: finite, and not used.
    toward = unit(scene.ask(shape, lambda s: s.center) - eye)
    along_it = jnp.where(met, along, jnp.where(jnp.sum(toward**2) > 0.0, toward, along))
    point, normal, _ = scene.surface(shape, eye, along_it)
    back = dot(normal, along_it) > 0.0
    normal = jnp.where(back, -normal, normal)
    side = jnp.where(back, BACK, FRONT)
    at = Receiver(point, orthonormal_frame(normal), jnp.zeros((2, 2), point.dtype), shape)
    material = jax.tree.map(lambda a: a[shape], scene.material)
    if callable(scene.environment):
        E = _gathered(scene, at, normal, jnp.zeros_like(material.exponent), rays)
    else:
        E = irradiance(scene, at)
    L = material.emission[side] + material.albedo[side] / jnp.pi * E
    if gloss:
        axis = along_it - 2.0 * dot(along_it, normal) * normal
        e = jnp.maximum(material.exponent, 1e-6)
        lobe = _gathered(scene, at, axis, e, rays)
        L = L + material.specular * (e + 2.0) / (2.0 * jnp.pi) * lobe
    return jnp.where(met, L, scene.sky(along))


def _has_gloss(scene: Scene) -> bool:
    """Whether a scene of concrete materials has a glossy lobe."""
    return bool(np.any(np.asarray(scene.material.specular) > 0.0))


# --- pixels --------------------------------------------------------------------------------------


def pixel_labels(scene: Scene, camera: Pinhole, p: ArrayLike) -> tuple[Array, Array]:
    """Number of the shape that each pixel shows, -1 for none, and a label that separates faces too.

    Args:
        scene: the shapes.
        camera: the eye.
        p: image coordinates.

    Returns:
        Two arrays of integers, shape (n,).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import pinhole, pixel_labels
        >>> from firstorder.space.library import sphere_over_plane
        >>> camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
        >>> p = jnp.array([[0.0, 0.0], [9.0, 9.0]])
        >>> pixel_labels(sphere_over_plane(), camera, p)[0].tolist()  # the ball, the floor
        [0, 1]
    """
    check_kind("scene", scene, Scene)
    return _labels(scene, camera, numbers("p", p))


FACES = 6


@eqx.filter_jit
def _labels(scene: Scene, camera: Pinhole, p: Array) -> tuple[Array, Array]:
    along = jax.vmap(camera.direction)(p)
    index = first_shape(scene, jnp.broadcast_to(camera.eye, along.shape), along)

    def label(i, d):
        shape = jnp.maximum(i, 0)
        point, _, _ = scene.surface(shape, camera.eye, d)
        face = scene.ask(shape, lambda s: _face(s, point))
        return jnp.where(i < 0, MISS, FACES * shape + face)

    return index, jax.vmap(label)(index, along)


def _face(shape: Shape, point: Direction) -> Int[Array, ""]:
    """Number of the smooth part of a shape that holds a point."""
    q = shape.local(point)
    if isinstance(shape, Boxes):
        a = jnp.argmax(jnp.abs(q))
        return (2 * a + (q[a] > 0.0)).astype(jnp.int32)
    if isinstance(shape, Cylinders):
        cap = q[2] ** 2 > q[0] ** 2 + q[1] ** 2
        return jnp.where(cap, jnp.where(q[2] > 0.0, 2, 1), 0).astype(jnp.int32)
    return jnp.zeros((), jnp.int32)


def _render_pixels(
    scene: Scene, camera: Pinhole, p: Any, index: Any, rays: int = 256, gradients: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Values and gradients of pixels whose shapes are known, in blocks of one compiled size.

    Args:
        scene: what is seen.
        camera: the eye.
        p: image coordinates, shape (n, 2).
        index: of the shape at each, -1 for the sky.
        rays: as in `_radiance`.
        gradients: whether they are wanted; zeros if not.

    Returns:
        Radiance (n, bands) and its derivatives in px and py (n, bands, 2); without bands, no axis.
    """
    p, index = np.asarray(p), np.asarray(index)
    run = _with_gradients if gradients else _values
    gloss = _has_gloss(scene)
    return host_blocks(lambda block: run(scene, camera, *block, rays, gloss), (p, index), BLOCK)


def _pixel(scene, camera, p, index, rays: int, gloss: bool):
    return _radiance(scene, camera.eye, camera.direction(p), index, rays, gloss)


@eqx.filter_jit
@by_band((-1, -2))
def _with_gradients(scene, camera, p, index, rays: int, gloss: bool):
    return jax.vmap(jax.value_and_grad(lambda p, i: _pixel(scene, camera, p, i, rays, gloss)))(
        p, index
    )


@eqx.filter_jit
@by_band((-1, -2))
def _values(scene, camera, p, index, rays: int, gloss: bool):
    value = jax.vmap(lambda p, i: _pixel(scene, camera, p, i, rays, gloss))(p, index)
    return value, jnp.zeros_like(p)


def render(
    scene: Scene,
    camera: Pinhole,
    columns: int,
    rows: int,
    *,
    half_width: float = 1.0,
    rays: int = 256,
    gradients: bool = True,
) -> RenderedImage:
    """An image of a scene by direct light, with exact soft shadows and image gradients.

    Args:
        scene: what is seen.
        camera: the eye.
        columns: pixels across.
        rows: pixels upwards.
        half_width: image coordinate of the right edge; gamma is in its unit.
        rays: gathered for glossy lobes and for a sky that is a function.
        gradients: whether the image's gradients are wanted.

    Raises:
        ValueError: if `columns`, `rows` or `half_width` is not positive, or shapes run into each
            other and send unlike light to a surface that is seen (`space.irradiance`).

    Example:
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.space.library import sphere_over_plane
        >>> from firstorder.imaging import render
        >>> camera = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.5), gamma=0.5)
        >>> render(sphere_over_plane(), camera, 2, 2).label.tolist()  # the floor, then the sky
        [[6, -1], [6, -1]]
    """
    px, py = pixel_grid(columns, rows, half_width)
    p = pixel_positions(px, py)
    index, label = pixel_labels(scene, camera, jnp.asarray(p))
    _check_apart(scene, camera, p, np.asarray(index))
    value, gradient = _render_pixels(scene, camera, p, index, rays, gradients)
    shape = (columns, rows)
    value, gradient = (a.reshape(*shape, *a.shape[1:]) for a in (value, gradient))
    return RenderedImage(px, py, value, gradient, np.asarray(label).reshape(shape))


def _check_apart(scene: Scene, camera: Pinhole, p: np.ndarray, index: np.ndarray) -> None:
    """Refuses light that exact integrals do not know, at any surface that is seen."""
    if not (is_concrete(scene) and have_collisions(scene)):
        return
    met = index >= 0
    points, normals = host_blocks(
        lambda block: _surfaces(scene, camera, *block), (p[met], index[met]), BLOCK
    )
    check_apart_from(scene, points, normals)


@eqx.filter_jit
def _surfaces(scene: Scene, camera: Pinhole, p: Array, index: Array) -> tuple[Array, Array]:
    """Points that pixels show, and normals towards the eye."""

    def surface(p, shape):
        along = camera.direction(p)
        point, normal, _ = scene.surface(shape, camera.eye, along)
        return point, jnp.where(dot(normal, along) > 0.0, -normal, normal)

    return jax.vmap(surface)(p, index)


def pixel_positions(px: np.ndarray, py: np.ndarray) -> np.ndarray:
    """Image coordinates of all pixels, shape (columns times rows, 2).

    Args:
        px: image coordinates across, shape (columns,).
        py: image coordinates upwards, shape (rows,).

    Example:
        >>> import numpy as np
        >>> from firstorder.imaging import pixel_positions
        >>> pixel_positions(np.array([-0.5, 0.5]), np.array([0.0])).tolist()
        [[-0.5, 0.0], [0.5, 0.0]]
    """
    return np.stack(np.meshgrid(px, py, indexing="ij"), -1).reshape(-1, 2)
