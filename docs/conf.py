"""Sphinx configuration of the site: pages in Markdown, executed tutorials, docstrings; no internet is needed."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from _site import FullSizeFigures, MathML, ProjectLinks, descriptions_below, digest, write_generated, write_notebooks

import finger3d

project = "finger3d"
author = "The finger3d authors"
copyright = author
version = release = finger3d.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["_build", "_generated", "paper", "**/.ipynb_checkpoints"]
nitpicky = True
# Types in signatures are text; only what the pages themselves refer to has to lead somewhere.
nitpick_ignore_regex = [("py:.*", ".*")]

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
# Outputs are kept until a tutorial or the package changes.
nb_execution_cache_path = str(Path(__file__).parent / "_build" / f".executed-{digest()}")
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_show_tb = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"finger3d {release}"
html_copy_source = True
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"


def _prepare(app, what, name, obj, options, lines):
    """Prepare a docstring for Napoleon; keep the bars of absolute values from being read as substitutions."""
    lines[:] = [
        line if line.lstrip().startswith(">>>") else line.replace("|", r"\|") for line in descriptions_below(lines)
    ]


def setup(app):
    """Write the generated pages; set formulas as MathML; turn links to files of the project into pages or downloads."""
    app.add_html_math_renderer("mathml", inline_renderers=(MathML.inline, None), block_renderers=(MathML.block, None))
    app.add_post_transform(ProjectLinks)
    app.add_transform(FullSizeFigures)
    app.connect("autodoc-process-docstring", _prepare, priority=400)  # Napoleon has 500
    write_generated(Path(__file__).parent)
    write_notebooks(Path(__file__).parent / "tutorials")
