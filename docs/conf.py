"""How `make manual` builds the manual: https://www.sphinx-doc.org/en/master/usage/configuration.html"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

project = "gaitswarm"
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "scripts.manual"]
include_patterns = [
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "docs/**",
    "research/README.md",
    "research/docs/**",
]
# Not to be walked through in search of pages.
exclude_patterns = [".*", "api", "build", "dist", "gaitswarm", "sim", "tests", "web"]
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
autodoc_typehints = "description"
default_role = "code"
# Attributes of several classes have the same name.
suppress_warnings = ["ref.python"]
html_theme = "pydata_sphinx_theme"
html_title = "gaitswarm"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"navbar_end": ["theme-switcher"], "footer_start": [], "footer_end": []}
