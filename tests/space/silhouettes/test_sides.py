"""Jumps across pieces of silhouettes, by hand."""

import jax.numpy as jnp

from firstorder.space.silhouettes._sides import SilhouetteSides


def test_a_jump_is_the_owner_less_what_it_cuts_off_where_it_is_seen():
    """Shapes of 1, 10 and 100 before a sky of 1000."""
    owner, behind = jnp.array([0, 1, 2, 0, 0]), jnp.array([1, 2, -1, 1, 2])
    seen, cut = jnp.array([1, 1, 1, 0, 1], bool), jnp.array([1, 1, 1, 1, 0], bool)
    sides = SilhouetteSides(owner, seen, behind, cut)
    found = sides.jump(jnp.array([1.0, 10.0, 100.0, 1000.0]))
    assert found.tolist() == [-9.0, -90.0, -900.0, 0.0, 1.0]
