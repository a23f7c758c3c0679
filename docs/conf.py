"""Sphinx: the pages that docs/pages prepares in docs/_work."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import rapkm_lite

project = "rapkm_lite"
author = "the rapkm_lite authors"
copyright = "2026, the rapkm_lite authors; lessons under CC-BY-4.0, code under BSD-3-Clause"
version = release = rapkm_lite.__version__
language = "en-GB"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx_copybutton", "pages.hooks"]
root_doc = "contents"
exclude_patterns = ["**/LICENSE*"]
default_role = "py:obj"
add_module_names = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
nb_execution_mode = "off"
nb_merge_streams = True
nb_render_markdown_format = "myst"
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
# What can be run, not what it printed; examples without their prompts.
copybutton_selector = "div:not(.output) > div.highlight pre"
copybutton_prompt_text = ">>> "
# Widgets are left to a kernel, and a part of a lesson may begin with a heading of any level.
suppress_warnings = ["mystnb.unknown_mime_type", "myst.header"]
mathjax_path = "tex-svg.js"
# With its menu every formula would be a stop of the tab key.
mathjax3_config = {"tex": {"tags": "none"}, "svg": {"fontCache": "local"}, "options": {"enableMenu": False}}
html_theme = "furo"
html_title = "rapkm_lite"
html_static_path = ["pages/static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
# An excerpt would show formulas as they are typed, and from disk a browser may not read it.
html_show_search_summary = False
html_favicon = "pages/static/icon.svg"
html_copy_source = False
html_show_sourcelink = False
# A letter or sign alone is a key of the browser and of people who speak to it, not of a page; arrows turn the pages.
html_theme_options = {"navigation_with_keys": True, "enable_search_shortcuts": False}
