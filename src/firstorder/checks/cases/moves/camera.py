"""Camera: an eye above a tilted hill, so that no derivative vanishes by symmetry."""

import equinox as eqx
import numpy as np

from firstorder.checks.cases import FLATLAND, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Grid
from firstorder.transport.shading.camera import BaseSurface, Camera, CameraRay

EYE, GAMMA, KAPPA, N = (0.3, 2.0), 1.3, -0.4, 0.15


def brute(u):
    """The ray through px meets a circle; its arc length by the angle about the circle's centre."""
    slope = u[0] / GAMMA
    down = np.array([slope, -1.0]) / np.hypot(slope, 1.0)
    radius = 1.0 / abs(KAPPA)
    center = -radius * np.array([-np.sin(N), np.cos(N)])
    q = np.array(EYE) - center
    b = q @ down
    hit = np.array(EYE) + (-b - np.sqrt(b * b - (q @ q - radius**2))) * down
    out = (hit - center) / radius
    n_0 = np.arctan2(-out[0], out[1])  # the normal there
    return bell(radius * (N - n_0), np.arctan(slope))


CASES = (
    Case(
        "camera",
        Camera(EYE, GAMMA, BaseSurface(KAPPA, N)),
        light(FLATLAND.turned()),
        Grid.spanning((64,), (1.0,)),
        (np.array([-0.3, 0.1]),),
        np.array([[-0.25], [0.05], [0.3]]),
        brute,
        expected=dict.fromkeys(("spectrum", "covariance", "wavelet"), "refused"),
    ),
)


def _changed(**changes):
    """A camera whose view has some derivatives scaled."""

    def derivatives(self, px):
        v = Camera.derivatives(self, px)
        parts = {f: getattr(v, f) * changes.get(f, 1.0) for f in CameraRay.__dataclass_fields__}
        return CameraRay(**parts)

    return lambda s: twin(s, derivatives=derivatives)


def _mirrored(s):
    """A camera whose image is the wrong way round."""
    return twin(s, derivatives=lambda self, px: Camera.derivatives(self, -px))


ALL, JET = ("value", "gradient", "hessian"), ("gradient", "hessian")
FAULTS = (
    Fault(
        "forget the focal length", lambda s: eqx.tree_at(lambda c: c.gamma, s, s.gamma / GAMMA), ALL
    ),
    Fault("let px grow to the left", _mirrored, JET),
    Fault("forget the tilt", lambda s: Camera(s.eye, s.gamma, BaseSurface(KAPPA)), ALL),
    Fault(
        "take a hill for a valley", lambda s: Camera(s.eye, s.gamma, BaseSurface(-KAPPA, N)), ALL
    ),
    Fault("clockwise theta", _changed(dtheta=-1.0, ddtheta=-1.0), JET),
    Fault("forget the cosine at the surface", _changed(dx=0.9), JET),
    Fault("drop the second derivative of x", _changed(ddx=0.0), ("hessian",)),
    Fault("drop the second derivative of theta", _changed(ddtheta=0.0), ("hessian",)),
)
