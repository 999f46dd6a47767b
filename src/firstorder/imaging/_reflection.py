"""Light reflected by a curved surface in space: value and full gradient.

With the normal n, the direction `to_eye` and its mirror image `r = 2 n (n . to_eye) - to_eye`,

    B(x, to_eye) = (L (*) rho)(x, r),   (f (*) rho)(r) = int f(w) rho(r . w) dw

When the normal turns by dn, the mirrored direction turns about the axis `n x dn` by twice that:

    dB = L_x (*) rho + 2 (n x dn) . ((w x grad_w L) (*) rho)      [derivative along the surface]
    grad B over directions = (2 n n^T - I) grad_r (L (*) rho)     [derivative in to_eye]

which is R07 (25) in space: the curvature n_x becomes the rate at which the frame turns, a vector
for each direction of motion, and L_theta becomes the rotation of the light. No frame is special,
principal directions are not needed, and where the lobe jumps no Dirac in rho' is met.

Convention: `firstorder.conventions`, Space. `dn = -tangents S`, S the shape operator.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_shape, check_unit
from firstorder._display import Module
from firstorder.laws.zonal import Zonal
from firstorder.typing import Scalar, as_float

Direction = Float[Array, " 3"]
Light = Callable[[Array, Array], Array]


class SurfacePoint(Module):
    """A point of a curved, perhaps bumpy, surface.

    Attributes:
        position: where it is [m].
        tangents: columns t, b: two orthonormal tangents of the base surface, along which
            derivatives are taken. `t x b` is the base's own normal.
        normal: unit normal used for shading; a bump map's may differ from `t x b`.
        turning: columns dn/dt, dn/db: how the shading normal turns [1/m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import SurfacePoint
        >>> x, y, z = jnp.eye(3)
        >>> SurfacePoint(0.0 * x, jnp.stack([x, y], -1), z, jnp.zeros((3, 2))).base_normal.tolist()
        [0.0, 0.0, 1.0]
    """

    position: Direction
    tangents: Float[Array, "3 2"]
    normal: Direction
    turning: Float[Array, "3 2"]

    @property
    def base_normal(self) -> Direction:
        """Unit normal of the surface on which the point moves."""
        return jnp.cross(self.tangents[:, 0], self.tangents[:, 1])

    @property
    def spin(self) -> Float[Array, "3 2"]:
        """Columns `n x dn`: the axis about which the frame turns, and its rate, along t and b."""
        return jnp.cross(self.normal[:, None], self.turning, axis=0)


def surface_point(position, axes, S) -> SurfacePoint:
    """The point of a smooth surface without bumps: `dn = -(t, b) S`.

    Args:
        position: [m], shape (3,).
        axes: orthonormal columns t, b, n (right-handed), shape (3, 3). Any t, b will do.
        S: shape operator in t, b [1/m], shape (2, 2); `-1/R` times the identity on a sphere.

    Raises:
        ValueError: if an argument has another shape.

    Reference: R07 App. B, with principal directions no longer needed.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import surface_point
        >>> ball = surface_point(jnp.array([0.0, 0.0, 2.0]), jnp.eye(3), -0.5 * jnp.eye(2))
        >>> ball.turning[:, 0].tolist()  # the normal of a ball of radius 2 leans along with t
        [0.5, 0.0, 0.0]
    """
    position, axes, S = as_float(position), as_float(axes), as_float(S)
    for name, a, shape in (("position", position, (3,)), ("axes", axes, (3, 3)), ("S", S, (2, 2))):
        check_shape(name, a, shape)
    tangents = axes[:, :2]
    return SurfacePoint(position, tangents, axes[:, 2], -tangents @ S)


def mirrored(to_eye: Direction, normal: Direction) -> Direction:
    """Mirrored direction `2 n (n . v) - v`: a mirror sends light from there to the eye."""
    return 2.0 * jnp.dot(normal, to_eye) * normal - to_eye


def half_turn(normal: Direction) -> Float[Array, "3 3"]:
    """`2 n n^T - I`: reflection about the normal, in space a proper rotation by pi."""
    return 2.0 * normal[:, None] * normal - jnp.eye(3, dtype=normal.dtype)


# --- light in the surface's frame: steps 1 and 2 ------------------------------------------------


class FrameGradient(Module):
    """Gradient of light seen in the surface's own frame.

    Attributes:
        spatial: along t and b.
        angular: over local directions; a vector in the local frame, tangent at the direction.
    """

    spatial: Float[Array, " 2"]
    angular: Direction


def turning_of_directions(
    axes: Float[Array, "3 3"], S: Float[Array, "2 2"], w: Direction
) -> Float[Array, "3 2"]:
    """Rotation rates along t and b, in the world, of a direction fixed in the surface's frame.

    `d(R w) = (n x dn) x R w`, the frame being carried without twist. In principal directions the
    columns are R07's `mu_1 kappa_1 l` and `mu_2 kappa_2 m`; l and m are unit vectors that are *not*
    orthogonal to each other: `l . m = w_1 w_2 / (mu_1 mu_2)`.

    Args:
        axes: columns t, b, n: local to global.
        S: shape operator in t, b [1/m].
        w: direction in the local frame.

    Reference: R07 eqs. 60-63, where R and P must have their vectors as columns.
    """
    turning = -axes[:, :2] @ S
    spin = jnp.cross(axes[:, 2, None], turning, axis=0)
    return jnp.cross(spin, (axes @ w)[:, None], axis=0)


def in_frame(
    L_x: Direction,
    L_w: Direction,
    axes: Float[Array, "3 3"],
    S: Float[Array, "2 2"],
    w: Direction,
) -> FrameGradient:
    """Gradient of `L_s(x, w) = L(x, R[n(x)] w)` from the gradients of L at `(x, R w)`.

    `L_s,t = L_t + (dR/dt w) . grad_w L` and `grad L_s = R^T grad_w L`, tangent part.
    Valid when the frame is carried along without twist about n; a twist would add its own rotation,
    which light reflected by a radially symmetric lobe does not notice.

    Args:
        L_x: gradient of the light in position, in the world's axes [per m].
        L_w: its gradient over directions; a part along `R w` is ignored.
        axes: columns t, b, n.
        S: shape operator in t, b [1/m].
        w: direction in the local frame.

    Reference: R07 eqs. 56-63.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._reflection import in_frame
        >>> up, slope = jnp.array([0.0, 0.0, 1.0]), jnp.array([3.0, 0.0, 0.0])
        >>> in_frame(jnp.zeros(3), slope, jnp.eye(3), -0.5 * jnp.eye(2), up).spatial.tolist()
        [1.5, 0.0]
    """
    spatial = L_x @ axes[:, :2] + L_w @ turning_of_directions(axes, S, w)
    angular = axes.T @ L_w
    return FrameGradient(spatial, angular - jnp.dot(w, angular) * w)


# --- reflected light -----------------------------------------------------------------------------


class ReflectedRadiance(Module):
    """Reflected light at a point, with its gradient, term by term.

    Attributes:
        value: B [radiance].
        SV: the light's spatial variation along t and b [radiance/m].
        DV: gradient of the convolved light at the lobe's argument; tangent there.
        argument_D_x: how the lobe's argument turns along t and b [1/m].
        argument_D_to_eye: how it turns with the eye.

    Reference: R07 §7; footnote 6 for partial derivatives along unit vectors.
    """

    value: Scalar
    SV: Float[Array, " 2"]
    DV: Direction
    argument_D_x: Float[Array, "3 2"]
    argument_D_to_eye: Float[Array, "3 3"]

    @property
    def CDV(self) -> Float[Array, " 2"]:
        """Curvature-weighted directional variation along t and b [radiance/m]."""
        return self.DV @ self.argument_D_x

    @property
    def spatial(self) -> Float[Array, " 2"]:
        """`B_t, B_b` with the eye's direction held fixed [radiance/m]."""
        return self.SV + self.CDV

    @property
    def angular(self) -> Direction:
        """Gradient over outgoing directions: a vector, tangent at `to_eye`."""
        return self.DV @ self.argument_D_to_eye


def reflected_radiance(
    light: Light,
    point: SurfacePoint,
    to_eye: Direction,
    lobe: Zonal | None = None,
    argument: str = "mirror",
    through: str = "kernel",
) -> ReflectedRadiance:
    """Radiance that a point sends to the eye, and its gradient by place and direction.

    Valid when: the light is smooth on the scale of the lobe's quadrature, as R07 has it over the
    whole sphere; that the eye is in front of the surface is the caller's business. Wrong when the
    lobe also depends on the angle to the normal.

    Args:
        light: incident radiance, a jittable function of a position and of the unit vector to where
            the light comes from; differentiable in the position (and, for a mirror or
            `through="light"`, in the direction).
        point: where, with the turning of its normal.
        to_eye: unit vector to where the light goes.
        lobe: convolution with a radially symmetric lobe; None is a perfect mirror.
        argument: whether the lobe is centred on the mirrored direction, or on the normal
            (diffuse; then nothing depends on the eye).
        through: whether the angular derivative is put on the lobe (R07 eq. 67: needs rho' and its
            jumps) or on the light, as a rotation (needs the light's own derivative).

    Raises:
        ValueError: if `to_eye` is not a unit vector, or an option is not one of the above.

    Reference: R07 App. B, eqs. 64-67, put together as §4.3 does in flatland; general frames and the
        route through the light are ours.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import reflected_radiance, surface_point
        >>> ball = surface_point(jnp.zeros(3), jnp.eye(3), -jnp.eye(2))  # radius 1
        >>> up = jnp.array([0.0, 0.0, 1.0])
        >>> B = reflected_radiance(lambda x, w: 1.0 + w[0], ball, up)
        >>> B.value.item(), B.spatial.tolist(), B.angular.tolist()
        (1.0, [2.0, 0.0], [-1.0, 0.0, 0.0])
    """
    check_unit("to_eye", to_eye)
    _check_option("argument", argument, ("mirror", "normal"))
    _check_option("through", through, ("kernel", "light"))
    n = point.normal
    if argument == "mirror":
        centre = mirrored(to_eye, n)
        centre_D_x = 2.0 * jnp.cross(point.spin, centre[:, None], axis=0)
        centre_D_to_eye = half_turn(n)
    else:
        centre, centre_D_x = n, point.turning
        centre_D_to_eye = jnp.zeros((3, 3), n.dtype)
    value, SV, DV = _convolved(light, point, centre, lobe, through)
    return ReflectedRadiance(value, SV, DV, centre_D_x, centre_D_to_eye)


def _convolved(light: Light, point: SurfacePoint, centre: Direction, lobe, through):
    """Value, spatial derivatives and angular gradient of `L (*) rho` at a fixed centre."""
    x, T = point.position, point.tangents
    if lobe is None:
        value, (L_x, L_w) = jax.value_and_grad(light, (0, 1))(x, centre)
        return value, L_x @ T, L_w - jnp.dot(centre, L_w) * centre

    def moved(step):
        return lobe.value(lambda w: light(x + T @ step, w), centre)

    SV = jax.jacfwd(moved)(jnp.zeros(2, x.dtype))
    if through == "kernel":
        jet = lobe.jet(lambda w: light(x, w), centre)
        return jet.value, SV, jet.gradient

    def rotated(spin):
        return lobe.value(lambda w: light(x, w + jnp.cross(spin, w)), centre)

    # d/d(spin) is int (w x grad L) rho dw = centre x DV, and DV is tangent at the centre.
    turned = jax.jacfwd(rotated)(jnp.zeros(3, x.dtype))
    return rotated(jnp.zeros(3, x.dtype)), SV, jnp.cross(turned, centre)


def _check_option(name: str, value: str, known: tuple[str, ...]) -> None:
    """Refuse a word that is not known."""
    if value not in known:
        raise ValueError(f"Argument `{name}` must be one of {', '.join(known)}, but is {value!r}.")


# --- the paper's short cut -----------------------------------------------------------------------


def scalar_curvature(S: Float[Array, "2 2"], reading: str) -> Float[Array, " 2"]:
    """The scalar in place of n_x in R07 §5.1's "direct extension", for t and for b.

    - `"gaussian"`: `det S`, as printed. Its unit is 1/m^2; it cannot tell a hill from a valley.
    - `"root"`: `sqrt|det S|` with the sign of the mean curvature: the unit corrected.
    - `"mean"`: half the trace.
    - `"normal"`: the normal curvatures along t and b, the diagonal of S; principal curvatures
      where t, b are principal.

    Raises:
        ValueError: if the reading is not one of these.

    Reference: R07 §5.1.
    """
    _check_option("reading", reading, ("gaussian", "root", "mean", "normal"))
    if reading == "normal":
        return jnp.diagonal(S)
    gaussian = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    mean = 0.5 * (S[0, 0] + S[1, 1])
    flat = gaussian == 0
    root = jnp.where(flat, 0.0, jnp.sqrt(jnp.where(flat, 1.0, jnp.abs(gaussian)))) * jnp.sign(mean)
    return jnp.broadcast_to({"gaussian": gaussian, "root": root, "mean": mean}[reading], (2,))


def direct_extension(
    B: ReflectedRadiance,
    point: SurfacePoint,
    to_eye: Direction,
    S: Float[Array, "2 2"],
    reading: str,
) -> Float[Array, " 2"]:
    """R07 (25) read literally in space: `B_t = SV_t + 2 k L_u (*) rho`, `B_b` with L_v.

    u and v are t and b carried from the normal to the mirrored direction by the smallest rotation;
    their sign is that of flatland's angle. Exact for the normal curvatures on a surface whose
    principal directions are t, b, seen along the normal; elsewhere wrong by what
    `derivations/imaging/reflection.py` measures. For a lobe about the mirrored direction only.

    Args:
        B: what `reflected_radiance` gives; its SV and DV are used.
        point: the same point.
        to_eye: the same direction.
        S: shape operator in t, b [1/m].
        reading: which scalar stands for n_x.

    Reference: R07 §5.1; the derived form is `ReflectedRadiance.spatial`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._reflection import direct_extension, reflected_radiance
        >>> from firstorder.imaging import surface_point
        >>> S, up = -0.5 * jnp.eye(2), jnp.array([0.0, 0.0, 1.0])  # a ball of radius 2
        >>> ball = surface_point(jnp.zeros(3), jnp.eye(3), S)
        >>> B = reflected_radiance(lambda x, w: w[0], ball, up)
        >>> B.spatial[0].item(), direct_extension(B, ball, up, S, "gaussian")[0].item()
        (1.0, -0.5)
    """
    k, n = scalar_curvature(S, reading), point.normal
    r = mirrored(to_eye, n)
    # The smallest rotation from n to r, on vectors orthogonal to n; NaN where r is -n.
    along = r @ point.tangents
    carried = point.tangents - (n + r)[:, None] * along / (1.0 + jnp.dot(n, r))
    return B.SV - 2.0 * k * (B.DV @ carried)
