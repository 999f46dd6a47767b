"""Skies of scene files: each kind, and what is refused; panoramas are in test_spaces too."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.io import space_from_toml
from firstorder.io.scenes._skies import read_panorama

BALL = 'dimensions = 3\n[[shape]]\nkind = "sphere"\ncenter = [0, 0, 0]\nradius = 1\n[environment]\n'
ALIKE = [
    ('kind = "constant"\nradiance = 2.0', 2.0),
    ('kind = "harmonic"\ncoefficients = [2.0]', 2.0 / np.sqrt(4.0 * np.pi)),
    ('kind = "panorama"\nvalues = [[2, 2, 2, 2], [2, 2, 2, 2]]', 2.0),
]


@pytest.mark.parametrize(("keys", "radiance"), ALIKE)
def test_skies_that_are_alike_everywhere(keys, radiance):
    scene = space_from_toml(BALL + keys).scene
    np.testing.assert_allclose(scene.sky(jnp.array([0.6, 0.0, 0.8])), radiance, rtol=1e-12)


def test_what_is_no_sky_is_refused(tmp_path):
    with pytest.raises(ValueError, match='line 7, environment: kind "blue" is not known'):
        space_from_toml(BALL + 'kind = "blue"')
    with pytest.raises(FileNotFoundError, match=r"none\.hdr: the file cannot be opened"):
        read_panorama(tmp_path / "none.hdr")
