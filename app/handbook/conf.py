"""Settings of Sphinx for the handbook; `robocov handbook --out site` builds it."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "robocov"
author = copyright = "The robocov authors"  # noqa: A001
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "reference", "typography"]
exclude_patterns = ["README.md"]
myst_enable_extensions = ["attrs_inline", "colon_fence"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "robocov"
html_static_path = ["static"]
html_css_files = ["handbook.css"]
html_copy_source = False
html_show_sphinx = False
default_role = "py:obj"  # a link where the name is documented
# A plain list: entries of their own would describe the attributes of a dataclass twice.
napoleon_custom_sections = [("Attributes", "params_style")]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 90
toc_object_entries_show_parents = "hide"
# The highlighter knows no language for terminal output and maps with comments; and words such as "path" in
# the types of parameters are also names of attributes, of several classes.
suppress_warnings = ["misc.highlighting_failure", "ref.python"]
