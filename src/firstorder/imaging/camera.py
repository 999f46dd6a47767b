"""The image of light reflected in space, and its gradient: a pinhole camera's rays and footprints.

A camera looks down -z of its own frame; image coordinates px, py grow with its +x and +y. The ray
through p leaves the eye along `(px, py, -gamma)`, so that px = gamma x_perp / z as in R07.

    dx = D (I - d n_0^T / (n_0 . d)) dd,    d(to_eye) = -dd

d is the ray's unit direction, D the distance, n_0 the normal of the surface that is there, without
bumps. In flatland that is R07 (27).
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_kind,
    check_positive,
    check_shape,
    is_concrete,
)
from firstorder._display import Module
from firstorder.imaging._reflection import ReflectedRadiance, SurfacePoint
from firstorder.typing import Scalar, as_float

Direction = Float[Array, " 3"]
Pixel = Float[Array, " 2"]


class PixelFootprint(Module):
    """A ray of the camera at the surface that it meets, and how it moves with the pixel.

    Attributes:
        position: where it meets the surface [m].
        to_eye: unit vector from there to the eye.
        distance: from the eye [m].
        position_D_p: how the position moves with px, py [m per unit of the image].
        to_eye_D_p: how the direction turns.
    """

    position: Direction
    to_eye: Direction
    distance: Scalar
    position_D_p: Float[Array, "3 2"]
    to_eye_D_p: Float[Array, "3 2"]

    def surface_D_p(self, point: SurfacePoint) -> Float[Array, "2 2"]:
        """The screen-to-surface Jacobian in the tangents of a point; arc lengths per image unit."""
        return point.tangents.T @ self.position_D_p


class Pinhole(Module):
    """A perspective camera.

    Args:
        eye: its position [m].
        axes: columns right, up, back: its frame in the world, orthonormal.
        gamma: focal length, in units of the image.

    Raises:
        ValueError: if `gamma` is not positive, `eye` not a finite point, or `axes` are not
            orthonormal.

    Reference: R07 §5.3, in space.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import Pinhole
        >>> camera = Pinhole(jnp.array([0.0, 0.0, 4.0]), jnp.eye(3), 2.0)
        >>> up = jnp.array([0.0, 0.0, 1.0])
        >>> camera.view(jnp.zeros(2), jnp.array(4.0), up).position_D_p.tolist()
        [[2.0, 0.0], [0.0, 2.0], [0.0, 0.0]]
    """

    eye: Direction = eqx.field(converter=as_float)
    axes: Float[Array, "3 3"] = eqx.field(converter=as_float)
    gamma: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a camera that sees nothing."""
        check_coordinates("eye", self.eye)
        check_finite("eye", self.eye)
        check_positive("gamma", self.gamma)
        check_shape("axes", self.axes, (3, 3))
        if is_concrete(self.axes):
            axes = np.asarray(self.axes)
            if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-4):
                raise ValueError("Argument `axes` must have orthonormal columns, but has not.")

    def direction(self, p: Pixel) -> Direction:
        """Unit vector from the eye into the scene, through p."""
        d = self.axes @ jnp.stack([p[0], p[1], -self.gamma])
        return d / jnp.sqrt(jnp.dot(d, d))

    def direction_D_p(self, p: Pixel) -> Float[Array, "3 2"]:
        """`(I - d d^T) (right, up) / sqrt(gamma^2 + p^2)`."""
        d = self.direction(p)
        plane = self.axes[:, :2]
        return (plane - d[:, None] * (d @ plane)) / jnp.sqrt(self.gamma**2 + jnp.dot(p, p))

    def view(self, p: Pixel, distance: Scalar, base_normal: Direction) -> PixelFootprint:
        """Position and direction seen at p, and how both move with p.

        Infinite at a silhouette, where the ray is tangent to the surface.

        Args:
            p: image coordinates.
            distance: from the eye to the surface along the ray [m].
            base_normal: unit normal of the surface there, without bumps (either side).

        Reference: R07 eq. 27, in space.
        """
        d, d_D_p = self.direction(p), self.direction_D_p(p)
        slide = (base_normal @ d_D_p) / jnp.dot(base_normal, d)
        moved = distance * (d_D_p - d[:, None] * slide)
        return PixelFootprint(self.eye + distance * d, -d, distance, moved, -d_D_p)


def _check_camera(camera: object) -> None:
    """Refuses what is no camera of space.

    Raises:
        TypeError: if it is none.
    """
    check_kind("camera", camera, Pinhole, "a camera, as `imaging.pinhole` makes one")


def pinhole(eye, target, up=(0.0, 0.0, 1.0), gamma=1.0) -> Pinhole:
    """A camera at `eye` that looks at `target`.

    Args:
        eye: [m], shape (3,).
        target: what is seen at p = (0, 0) [m].
        up: what is upwards in the image; not along the line of sight.
        gamma: focal length, in units of the image.

    Raises:
        ValueError: if the eye is at the target or looks along `up`, or a number is not finite.

    Example:
        >>> from firstorder.imaging import pinhole
        >>> pinhole((4.0, 0.0, 0.0), (0.0, 0.0, 0.0)).axes.T.tolist()  # right, up, back
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    """
    eye, target, up = as_float(eye), as_float(target), as_float(up)
    for name, place in (("eye", eye), ("target", target), ("up", up)):
        check_coordinates(name, place)
        check_finite(name, place)
    back = eye - target
    right = jnp.cross(up, back)
    if is_concrete((back, right)) and _vanishes(right, up, back):
        raise ValueError("Argument `up` must not lie along the line of sight, but does.")
    back, right = (a / jnp.sqrt(jnp.dot(a, a)) for a in (back, right))
    return Pinhole(eye, jnp.stack([right, jnp.cross(back, right), back], 1), gamma)


def _vanishes(right: Direction, up: Direction, back: Direction) -> bool:
    """Whether the product of two vectors is zero but for the rounding of its differences."""
    long, one, other = (float(np.linalg.norm(np.asarray(a))) for a in (right, up, back))
    return not long > 8.0 * float(np.finfo(right.dtype).eps) * one * other


def image_gradient(view: PixelFootprint, point: SurfacePoint, B: ReflectedRadiance) -> Pixel:
    """Gradient of the image: `I_p = (B_t, B_b) dx/dp + grad B . d(to_eye)/dp`.

    The surface's own tangents carry the camera's footprint; its bumps are in B.

    Args:
        view: the camera's ray.
        point: where it meets the surface.
        B: light reflected there to the eye.

    Returns:
        Derivatives in px and py [radiance per unit of the image].

    Reference: R07 eq. 26, in space.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import Pinhole, image_gradient
        >>> from firstorder.imaging import reflected_radiance, surface_point
        >>> floor = surface_point(jnp.zeros(3), jnp.eye(3), jnp.zeros((2, 2)))
        >>> camera = Pinhole(jnp.array([0.0, 0.0, 4.0]), jnp.eye(3), 2.0)
        >>> view = camera.view(jnp.zeros(2), jnp.array(4.0), floor.normal)
        >>> B = reflected_radiance(lambda x, w: x[0] + w[0], floor, view.to_eye)  # a mirror
        >>> image_gradient(view, floor, B).tolist()  # 2 from the place, 1/2 from the direction
        [2.5, 0.0]
    """
    return B.spatial @ view.surface_D_p(point) + B.angular @ view.to_eye_D_p
