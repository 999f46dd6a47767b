"""Tables of caches in print; `test_cache.py` writes and reads them."""

import numpy as np

from firstorder.caching._columns import printed


def test_numbers_stand_below_their_names():
    table = {"x": np.array([1.0 / 3.0, 2.0]), "clamp": np.array(["raised", ""])}
    assert printed(table) == "      x   clamp\n0.33333  raised\n      2"
