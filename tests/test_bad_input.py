import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.fields import (
    Gaussian,
    GaussianProfile,
    Grid,
    SampledSpectrum,
    Wavelet,
    gaussian,
    haar_matrix,
    half_plane,
)
from firstorder.laws import Convolve, Integrate, Move
from firstorder.transport import Curvature, Mirror, Reflection, Travel, half_plane_blocker

LIGHT = gaussian((0.1, 0.0), (1.0, 0.5))
OUT = gaussian((0.1, 0.0), (1.0, 0.5), frame=FLATLAND.turned())

WRONG = {
    "negative distance": lambda: Travel(-1.0),
    "infinite distance": lambda: Travel(jnp.inf),
    "NaN curvature": lambda: Curvature(jnp.nan),
    "singular matrix": lambda: Move([[1.0, 2.0], [2.0, 4.0]]),
    "NaN matrix": lambda: Move([[1.0, jnp.nan], [0.0, 1.0]]),
    "shift of the wrong size": lambda: Move(np.eye(2), [1.0, 2.0, 3.0]),
    "matrix that is a vector": lambda: Move([1.0, 2.0]),
    "width of zero": lambda: gaussian((0.0, 0.0), (0.0, 1.0)),
    "negative lobe": lambda: GaussianProfile(-0.1),
    "NaN lobe": lambda: GaussianProfile(jnp.nan),
    "no bell": lambda: Gaussian(jnp.zeros(2), jnp.array([[1.0, 2.0], [2.0, 1.0]])),
    "not symmetric": lambda: Gaussian(jnp.zeros(2), jnp.array([[1.0, 0.5], [0.0, 1.0]])),
    "centre of the wrong size": lambda: Gaussian(jnp.zeros(3), jnp.eye(2)),
    "empty grid": lambda: Grid((0, 4), (1.0, 1.0)),
    "grid of no axes": lambda: Grid((), ()),
    "negative step": lambda: Grid((4, 4), (1.0, -1.0)),
    "steps of the wrong number": lambda: Grid((4, 4), (1.0,)),
    "samples of the wrong shape": lambda: SampledSpectrum(
        jnp.zeros((3, 3)), Grid((4, 4), (1.0, 1.0)), FLATLAND
    ),
    "no nodes": lambda: Integrate("theta", -1.0, 1.0, 0),
    "unknown axis": lambda: Integrate("phi", -1.0, 1.0)(LIGHT).frame,
    "unknown axis of a kernel": lambda: GaussianProfile(0.1, "v"),
    "transparency above one": lambda: half_plane_blocker(0.0, FLATLAND, 1.5),
    "Haar of three": lambda: haar_matrix(3),
    "wavelets of an odd grid": lambda: Wavelet.of(LIGHT, Grid((6, 8), (1.0, 1.0))),
    "too few coordinates": lambda: LIGHT(1.0),
    "mirror of mirrored light": lambda: Mirror()(OUT),
    "lobe on light that is not mirrored": lambda: Reflection(GaussianProfile(0.1))(LIGHT),
    "curvature in slopes": lambda: Curvature(1.0)(gaussian((0, 0), (1, 1), frame=FLATLAND_SLOPE)),
    "travel in angles of space": lambda: Travel(1.0)(
        Gaussian(jnp.zeros(4), jnp.eye(4), frame=SPACE)
    ),
    "sum over two frames": lambda: LIGHT + OUT,
    "blocker in other coordinates": lambda: half_plane_blocker(0.0, FLATLAND_SLOPE)(LIGHT),
    "half-plane on no axis": lambda: half_plane(0.0, axis="y"),
    "frame without that coordinate": lambda: Frame(("x", "v")).without("theta"),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_bad_input_gets_one_sentence(wrong):
    with pytest.raises((ValueError, TypeError)) as caught:
        wrong()
    message = str(caught.value)
    assert message.endswith(".")
    assert "\n" not in message
    assert 10 < len(message) < 130
    assert "must" in message or "needs" in message


@pytest.mark.parametrize(
    "make",
    [
        lambda d: Travel(d)(gaussian((0, 0), (1, 1), frame=FLATLAND_SLOPE))(0.1, 0.2),
        lambda s: Convolve(GaussianProfile(s))(LIGHT)(0.1, 0.2),
        lambda s: gaussian((0.0, 0.0), (s, 1.0))(0.1, 0.2),
    ],
    ids=["distance", "lobe", "light"],
)
def test_an_invalid_traced_argument_gives_nan_and_never_a_plausible_number(make):
    assert np.isnan(jax.jit(make)(-1.0))
    assert np.isfinite(jax.jit(make)(1.0))
