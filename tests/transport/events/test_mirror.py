import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import SPACE, mirror_direction
from firstorder.fields import Gaussian, gaussian
from firstorder.transport import Mirror

L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4)


@pytest.mark.smoke
def test_light_leaves_where_the_mirrored_vector_points():
    for theta in (0.3, -1.1):
        to_light = np.array([-np.sin(theta), np.cos(theta)])
        leaving = np.array([-to_light[0], to_light[1]])  # 2 (n . d) n - d about n = (0, 1)
        out = np.arctan2(-leaving[0], leaving[1])
        assert out == pytest.approx(float(mirror_direction(theta, 0.0)))
        assert Mirror()(L)(0.3, out).item() == L(0.3, theta).item()


def test_mirror_turns_incoming_light_into_outgoing_light_once():
    out = Mirror()(L)
    assert out.frame.sense == "outgoing"
    with pytest.raises(ValueError, match="incoming light"):
        Mirror()(out)


def test_in_space_both_directions_flip():
    light = Gaussian(jnp.array([0.1, 0.2, -0.1, 0.3]), jnp.eye(4), 1.0, SPACE)
    assert Mirror()(light)(0.1, 0.2, 0.1, -0.3).item() == 1.0
