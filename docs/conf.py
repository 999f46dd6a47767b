"""Sphinx reads this: `make docs` builds the site into `docs/_build`."""

import json
import logging
import pathlib
import sys

ROOT = pathlib.Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from docs import generate  # noqa: E402
from firstorder import __version__, session  # noqa: E402

project = "firstorder"
author = "the authors of firstorder"
release = __version__

extensions = ["myst_parser", "docs.mathml", "docs.navigation"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
html_math_renderer = "mathml"
# Every link to a name must lead to one that is described.
nitpicky = True
smartquotes = False
add_module_names = False
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"
exclude_patterns = ["_build", "generate", "kept"]

html_theme = "furo"
html_title = "firstorder"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["filter.js"]
html_copy_source = False
# A search from files may not read other files for their first lines.
html_show_search_summary = False


def setup(app):
    """Write what the code knows before Sphinx looks for pages."""
    # Pages that were generated a moment ago, as JSON, so that they are not generated again.
    app.add_config_value("pages", "", "")
    app.connect("builder-inited", lambda app: _generate(app.config.pages))


def _generate(pages):
    if pages:
        generate.write(pages=json.loads(pathlib.Path(pages).read_text(encoding="utf-8")))
        return
    logging.getLogger("jax").setLevel(logging.WARNING)  # it tells of each device that is not there
    session.start()
    generate.write()
