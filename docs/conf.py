"""Settings of the site that `make docs` builds. Nothing is fetched, neither by the build nor by a reader's browser."""

import logging
import sys
from pathlib import Path

from jupyter_client import KernelManager

import ccmodel

HERE = Path(__file__).parent
# Extensions of this folder's own.
sys.path.insert(0, str(HERE / "_extensions"))

# Otherwise the theme's styles set up logging, and libraries tell the build what they do.
logging.basicConfig(level=logging.WARNING)

project = "ccmodel"
author = "ccmodel developers"
project_copyright = "ccmodel developers"
version = release = ccmodel.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_copybutton",
    "sphinx_design",
    "mathml",
    "repository_links",
]
exclude_patterns = ["_extensions"]

# Every reference that leads nowhere is an error (`sphinx-build -n -W`). Other libraries' names have no pages here, and
# their inventories would have to be fetched.
nitpick_ignore_regex = [(r"py:.*", r"(collections|matplotlib|numpy|os|pandas|pathlib|typing|xarray)\..*")]

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
# Anchors as Markdown viewers make them, so that the same links work in the repository.
myst_heading_anchors = 4

# Always: the notebooks must show what the present sources compute.
nb_execution_mode = "force"
nb_execution_timeout = 300
# Without it, each kernel warns that it talks to the build in plain text.
KernelManager.transport_encryption.default_value = "auto"
nb_execution_raise_on_error = True
nb_execution_show_tb = True

# Names in backticks in docstrings are links where they are public.
default_role = "autolink"
autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_class_members_toctree = False
numpydoc_show_class_members = False

copybutton_prompt_text = "$ "

html_theme = "furo"
html_title = "ccmodel"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
# Equations are numbered through all pages.
numfig = True
numfig_secnum_depth = 0
html_copy_source = False
html_show_sphinx = False
