"""The explorer's parts lie beside its notebook, outside of the package."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "notebooks"))
