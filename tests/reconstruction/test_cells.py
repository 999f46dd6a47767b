"""In which cell a point lies, by hand."""

import jax.numpy as jnp
import pytest

from firstorder.reconstruction._cells import cell_of

NODES = jnp.array([0.0, 1.0, 1.0, 2.5, 4.0])


@pytest.mark.parametrize(
    ("side", "cells"),
    [("right", [0, 0, 0, 2, 2, 3, 3, 3]), ("left", [0, 0, 0, 0, 2, 2, 3, 3])],
)
def test_a_point_lies_in_the_cell_between_its_nodes(side, cells):
    x = jnp.array([-3.0, 0.0, 0.4, 1.0, 1.2, 2.5, 4.0, 9.0])
    assert cell_of(NODES, x, side).tolist() == cells
    assert cell_of(NODES, x.reshape(2, 4), side).tolist() == [cells[:4], cells[4:]]


def test_a_node_belongs_to_the_cell_that_begins_there_unless_said():
    assert cell_of(NODES, jnp.array(2.5)).item() == 3
    with pytest.raises(ValueError, match="`side` must be 'left' or 'right', but is 'both'"):
        cell_of(NODES, jnp.array(0.0), "both")
