"""The perspective camera: an image is the outgoing light field, read along the rays of one eye."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_positive, check_shape, is_concrete
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields.jet import Jet
from firstorder.laws.base import Law
from firstorder.laws.warp import Map, Warp
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Scalar, Vector, as_float

IMAGE = Frame(("px",), "outgoing")


class BaseSurface(Module):
    """A base surface of constant curvature: a line, a hill (kappa < 0) or a valley (kappa > 0).

    The arc-length parameter x is zero at `point`, and the geometric normal's angle is
    `n_0(x) = n + kappa x`.

    Args:
        kappa: curvature in radians per metre.
        n: the normal's angle at `point`, in radians.
        point: where x is zero, in metres.

    Raises:
        ValueError: if an argument is not finite, or `point` has not two coordinates.

    Example:
        >>> from firstorder.transport import BaseSurface
        >>> BaseSurface(0.0).position(2.0).tolist()
        [2.0, 0.0]
    """

    kappa: Scalar = eqx.field(converter=as_float, default=0.0)
    n: Scalar = eqx.field(converter=as_float, default=0.0)
    point: Vector = eqx.field(converter=as_float, default=(0.0, 0.0))

    def __check_init__(self):
        """Refuse what is no number."""
        for name in ("kappa", "n", "point"):
            check_finite(name, getattr(self, name))
        check_shape("point", self.point, (2,))

    def normal_angle(self, x) -> Array:
        """`n + kappa x`."""
        return self.n + self.kappa * x

    def position(self, x) -> Float[Array, "... 2"]:
        """The point at arc length x: a chord `x sinc(kappa x / 2)` along the mean tangent."""
        x = as_float(x)
        half = 0.5 * self.kappa * x
        chord = x * jnp.sinc(half / float(np.pi))
        tangent = jnp.stack([jnp.cos(self.n + half), jnp.sin(self.n + half)], -1)
        return self.point + chord[..., None] * tangent

    def faces(self, eye: Float[Array, " 2"]) -> Array:
        """Whether a point is on the side of the normals."""
        qx, qy = eye[0] - self.point[0], eye[1] - self.point[1]
        up = jnp.cos(self.n) * qy - jnp.sin(self.n) * qx
        return self.kappa * (qx * qx + qy * qy) < 2.0 * up

    def hit(self, eye: Float[Array, " 2"], theta: Scalar) -> Scalar:
        """Arc length of the point from which light reaches `eye` in the direction theta.

        With q the hit from `point`, the base is `kappa q.q = 2 q.normal`: a quadratic in the
        distance along the ray whose right root stays regular as kappa vanishes. NaN if the ray
        misses.
        """
        c, s = jnp.cos(self.n), jnp.sin(self.n)
        qx, qy = eye[0] - self.point[0], eye[1] - self.point[1]
        t0, m0 = c * qx + s * qy, c * qy - s * qx  # along tangent and normal
        # from the eye down along -direction(theta), in the same axes
        et, em = jnp.sin(theta - self.n), -jnp.cos(theta - self.n)
        b = self.kappa * (t0 * et + m0 * em) - em
        free = self.kappa * (t0 * t0 + m0 * m0) - 2.0 * m0
        square = b * b - self.kappa * free
        root = b + jnp.sqrt(jnp.where(square > 0, square, 1.0))
        met = (square > 0) & (root > 0) & (free < 0)
        distance = -free / jnp.where(met, root, 1.0)
        along, up = t0 + distance * et, m0 + distance * em
        return jnp.where(met, _arc(self.kappa, along, 1.0 - self.kappa * up), jnp.nan)


def _arc(kappa, along, rest):
    """`atan2(kappa along, rest) / kappa`, and its limit where kappa vanishes."""
    a = kappa * along
    small = jnp.abs(a) < 1e-3 * rest  # near the start, and not across the circle, where rest < 0
    r = along / jnp.where(small, rest, 1.0)
    a2 = (kappa * r) ** 2
    series = r * (1.0 - a2 / 3.0 + a2 * a2 / 5.0 - a2 * a2 * a2 / 7.0)
    exact = jnp.arctan2(a, jnp.where(small, 1.0, rest)) / jnp.where(small, 1.0, kappa)
    return jnp.where(small, series, exact)


class Camera(Event):
    """`I(px) = B(x(px), theta(px))`, a warp from the image line into the outgoing light field.

    The camera looks down -y; px grows with +x. A point at height z below the eye and x_perp beside
    it is seen at `px = gamma x_perp / z`, in the direction `theta = atan(px / gamma)` (from points
    on the right light goes up and to the left: counter-clockwise). With D the distance,

    `dx/dpx = z^2 / (gamma D cos(theta - n_0))`, `dtheta/dpx = 1 / (gamma + px^2 / gamma)`;

    `cos(theta - n_0)` is the paper's `n_0 . v`, with the base's normal and not the bumps'. The
    surface's curvature does not enter the first derivative, only the second.

    Valid where the ray meets the base from its front. A ray that misses gives NaN.

    Args:
        eye: (x, y) of the centre of projection, in metres.
        gamma: focal length, in the unit of px; positive.
        base: the surface that x runs along.

    Raises:
        ValueError: if `gamma` is not positive, or `eye` not a point in front of the base.

    Called: perspective projection, of image gradients (R07 §5.3).

    Reference: R07 eqs. 26-27 (§5.3); the second derivative is ours.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Camera
        >>> B = gaussian((0.0, 0.0), (1.0, 0.5), frame=gaussian((0, 0), (1, 1)).frame.turned())
        >>> Camera((0.0, 2.0), gamma=1.0)(B)(0.5).item() / B(1.0, 0.4636476090008061).item()
        1.0
    """

    eye: Vector = eqx.field(converter=as_float)
    gamma: Scalar = eqx.field(converter=as_float)
    base: BaseSurface = eqx.field(
        default_factory=BaseSurface
    )  # made when asked: an array keeps its precision

    def __check_init__(self):
        """Refuse a camera that sees nothing."""
        check_shape("eye", self.eye, (2,))
        check_finite("eye", self.eye)
        check_positive("gamma", self.gamma)
        if is_concrete(self) and not self.base.faces(self.eye):
            raise ValueError(
                f"Argument `eye` must be in front of the base, but is {self.eye.tolist()}."
            )

    def law(self, frame: Frame) -> Law:
        """The warp."""
        fits = frame.coordinates == ("x", "theta") and frame.sense == "outgoing"
        require_frame(fits, self, frame, "outgoing light in (x, theta)")
        return Warp(_Rays(self), IMAGE)

    def derivatives(self, px: Scalar) -> "CameraRay":
        """The ray through px, and its first and second derivatives along the image."""
        theta, base = jnp.arctan2(px, self.gamma), self.base
        x = base.hit(self.eye, theta)
        local = theta - base.normal_angle(x)
        z = self.eye[1] - base.position(x)[..., 1]
        turn = jnp.cos(theta) ** 2 / self.gamma
        # z^2 / (gamma D (n_0 . v)) with D = z / cos(theta)
        step = z * jnp.cos(theta) / (self.gamma * jnp.cos(local))
        # d log(step) / dpx: z falls by sin(n_0) per arc length, and n_0 turns by kappa
        rate = -jnp.sin(base.normal_angle(x)) * step / z - jnp.tan(theta) * turn
        rate = rate + jnp.tan(local) * (turn - base.kappa * step)
        bend = -2.0 * jnp.sin(theta) * jnp.cos(theta) * turn / self.gamma
        return CameraRay(x, theta, step, turn, step * rate, bend)


class CameraRay(Module):
    """A camera ray: arc length and direction, and their derivatives in px.

    Attributes:
        x, theta: the ray of the light field, in metres and radians; all entries are numbers, or
            arrays of one shape.
        dx, dtheta: first derivatives by the image coordinate, numbers or arrays likewise: R07 (27).
        ddx, ddtheta: the second derivatives, numbers or arrays likewise.
    """

    x: Array
    theta: Array
    dx: Array
    dtheta: Array
    ddx: Array
    ddtheta: Array


class _Rays(Map):
    """`px -> (x, theta)`."""

    camera: Camera

    def __call__(self, u: Float[Array, "1"]) -> Float[Array, "2"]:
        """The ray that is seen at px."""
        theta = jnp.arctan2(u[0], self.camera.gamma)
        return jnp.stack([self.camera.base.hit(self.camera.eye, theta), theta])

    def derivatives(
        self, u: Float[Array, "1"]
    ) -> tuple[Float[Array, "2"], Float[Array, "2 1"], Float[Array, "2 1 1"]]:
        """R07 (27) and its derivative."""
        v = self.camera.derivatives(u[0])
        J = jnp.stack([v.dx, v.dtheta])[:, None]
        return jnp.stack([v.x, v.theta]), J, jnp.stack([v.ddx, v.ddtheta])[:, None, None]


def image_jet(view: CameraRay, B: Jet) -> tuple[Scalar, Scalar, Scalar]:
    """Image value, gradient and second derivative from numbers at the ray.

    `I_u = B_x x_u + B_theta theta_u`, and
    `I_uu = C^T Hess B C + B_x x_uu + B_theta theta_uu` with `C = (x_u, theta_u)`.

    Args:
        view: the camera ray (`Camera.derivatives`).
        B: jet of the outgoing light there.

    Reference: R07 eq. 26; the second derivative is ours.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Camera, image_jet
        >>> view = Camera((0.0, 2.0), 1.0).derivatives(jnp.array(0.0))
        >>> I, I_u, I_uu = image_jet(view, gaussian((0.0, 0.0), (1.0, 1.0)).jet(jnp.zeros(2)))
        >>> I_uu.item()  # -(2^2 + 1^2): dx/dpx = 2, dtheta/dpx = 1
        -5.0
    """
    C = jnp.stack([view.dx, view.dtheta])
    bend = B.gradient[0] * view.ddx + B.gradient[1] * view.ddtheta
    return B.value, jnp.sum(C * B.gradient), jnp.sum(C[:, None] * C * B.hessian) + bend


def distant_image_gradient(view: CameraRay, n_0, z, gamma, B: Jet) -> Scalar:
    """R07 (28): `I_u ~ z / (gamma n_0 . v) B_x`, the image gradient of a distant camera.

    Neglects `B_theta / gamma` and takes `z / D` for 1, so its relative error is
    `(n_0 . v) B_theta / (z B_x)`, of first order in 1/z, and of second order in x_perp / z. Wrong
    where B_x is small: a flat surface in distant light has none at any distance. A large
    gamma alone does not help: both parts scale with 1/gamma.

    Args:
        view: the camera ray.
        n_0: angle of the base's normal there, in radians.
        z: height of the eye above the point, in metres.
        gamma: focal length.
        B: jet of the outgoing light there.

    Reference: R07 eq. 28.
    """
    return z / (gamma * jnp.cos(view.theta - n_0)) * B.gradient[0]
