"""What Sphinx is told."""

import os
import sys
from pathlib import Path

_REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(_REPOSITORY))

from workbench._version import __version__  # noqa: E402

project = "workbench"
author = "The workbench contributors"
project_copyright = "The workbench contributors, Apache License 2.0"
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "website.mathml"]
root_doc = "index"
html_theme = "furo"
html_title = f"workbench {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = [os.environ.get("WORKBENCH_SITE_EXTRA", str(_REPOSITORY / "build" / "site" / "extra"))]
html_show_sphinx = False
html_copy_source = False
html_last_updated_fmt = None
html_theme_options = {"navigation_with_keys": True}
# A block without a language is no Python.
highlight_language = "text"

# Headings have GitHub's anchors, and ```math is an equation, as GitHub shows it.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_dmath_double_inline = True
# A dollar before a command or a price is no formula.
myst_dmath_allow_space = False
myst_dmath_allow_digits = False

# --from is an option, and C' a derivative.
smartquotes = False
# Single backticks of docstrings are names.
default_role = "literal"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False

copybutton_prompt_text = "$ "
copybutton_exclude = ".linenos, .gp, .go"
# Examples leave things out (...), which no lexer knows.
suppress_warnings = ["misc.highlighting_failure"]
