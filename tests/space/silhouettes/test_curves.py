"""Points of silhouettes, by hand."""

import jax.numpy as jnp
import numpy as np

from firstorder.space.silhouettes._curves import TURN, SilhouetteArcs, SilhouetteSegments

YES = jnp.asarray(True)


def test_a_segment_runs_from_its_start_to_its_end():
    one = SilhouetteSegments(
        jnp.array([1.0, 2.0, 3.0]), jnp.array([2.0, 0.0, 7.0]), jnp.array(0), YES
    )
    found = one.point(jnp.array([0.0, 0.25, 1.0]))
    np.testing.assert_allclose(found, [[1.0, 2.0, 3.0], [1.25, 1.5, 4.0], [2.0, 0.0, 7.0]])


def test_an_arc_turns_from_its_first_radius_to_its_second():
    center, a, b = jnp.array([[1.0, 2.0, 3.0], [2.0, 0.5, 0.0], [0.0, -1.0, 4.0]])
    arc = SilhouetteArcs(center, a, b, jnp.array(0.0), jnp.array(TURN), jnp.array(0), YES)
    t = TURN * np.array([0.0, 0.25, 0.5, 0.125, 1.0])
    half = np.sqrt(0.5)
    true = center + jnp.stack([a, b, -a, half * (a + b), a])
    np.testing.assert_allclose(arc.point(jnp.asarray(t)), true, rtol=0.0, atol=1e-12)
    true = jnp.stack([b, -a, -b, half * (b - a), b])
    np.testing.assert_allclose(arc.velocity(jnp.asarray(t)), true, rtol=0.0, atol=1e-12)
