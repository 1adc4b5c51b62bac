"""Sphinx configuration: `make docs` builds into out/docs."""

from importlib.metadata import version as _version

project = "rodatlas"
copyright = "the rodatlas authors"
release = _version("rodatlas")
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
html_theme = "pydata_sphinx_theme"
html_title = "rodatlas"
html_theme_options = {"show_toc_level": 2}
html_sidebars = {"index": []}
html_show_sourcelink = False
