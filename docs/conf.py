"""How Sphinx builds the site: from the Markdown pages beside this file, and from the docstrings of the library.

``make docs`` builds it into ``build/docs``. What is told by the code itself is not told again: the reference of the command
and the table of parameters are made from the code by ``from_code.py``.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from barchan.version import VERSION

project = "barchan"
release = version = VERSION
copyright = "the authors of barchan, BSD-3-Clause"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "from_code"]

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "none"
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_attr_annotations = False

smartquotes = False
highlight_language = "none"

html_theme = "furo"
html_title = f"barchan {VERSION}"
html_copy_source = False
