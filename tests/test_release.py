"""What a release says of itself agrees."""

import importlib.metadata
import pathlib
import re

import firstorder

ROOT = pathlib.Path(__file__).parents[1]


def test_the_version_is_said_alike_everywhere():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [firstorder.__version__]
    assert importlib.metadata.version("firstorder") == firstorder.__version__
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert headings[0] in ("Not released", firstorder.__version__)


def test_a_type_checker_may_read_the_package():
    assert pathlib.Path(firstorder.__file__).with_name("py.typed").exists()
