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

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import check_integer, check_one, check_positive, is_concrete
from firstorder._display import Module
from firstorder._labelled import Dataset, data_set
from firstorder.imaging._exact_radiance import exact_radiance, has_gloss
from firstorder.imaging.camera import Pinhole, _check_camera
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._vectors import dot
from firstorder.scene._arguments import check_kind, numbers
from firstorder.scene._bands import by_band
from firstorder.scene._intersect import MISS
from firstorder.space.intersect import first_shape
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Boxes, Cylinders, Shape
from firstorder.space.silhouettes._collisions import check_apart_from, have_collisions

BLOCK = 256  # pixels shaded at a time: silhouettes of all shapes are kept for each
RADIANCE = "W/(m^2 sr)"

Pixel = Float[Array, "2"]
Direction = Float[Array, "3"]


class RenderedImage(Module):
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
    check_one("half_width", half_width)
    for name, number in (("columns", columns), ("rows", rows), ("half_width", half_width)):
        check_positive(name, number)
    side = 2.0 * half_width / columns
    return tuple(side * (np.arange(n) - 0.5 * (n - 1)) for n in (columns, rows))  # pyright: ignore


def pixel_labels(scene: Scene, camera: Pinhole, p: ArrayLike) -> tuple[Array, Array]:
    """Number of the shape that each pixel shows, -1 for none, and a label that separates faces too.

    Args:
        scene: the shapes.
        camera: the eye.
        p: image coordinates.

    Returns:
        Two arrays of integers, shape (n,).

    Raises:
        TypeError: if the scene or the camera is none of space.
        ValueError: if `p` is not rows of two coordinates.

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
    _check_camera(camera)
    p = numbers("p", p)
    if p.ndim != 2 or p.shape[1] != 2:
        raise ValueError(f"Argument `p` must have shape (n, 2), but has {p.shape}.")
    return _labels(scene, camera, p)


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
    gloss = has_gloss(scene)
    return host_blocks(lambda block: run(scene, camera, *block, rays, gloss), (p, index), BLOCK)


def _pixel(scene, camera, p, index, rays: int, gloss: bool):
    return exact_radiance(scene, camera.eye, camera.direction(p), index, rays, gloss)


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

    Valid when: exponents of glossy lobes are 1 or more, for gradients.

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
