# SPDX-License-Identifier: MIT
"""How Sphinx builds the site; see scripts/site.sh."""
project = "cilantro"
html_title = "cilantro"
extensions = ["myst_parser"]
html_theme = "furo"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
myst_heading_anchors = 3
smartquotes = False
# Signatures alone are no programs, and the highlighter says so.
suppress_warnings = ["misc.highlighting_failure"]
