"""The documentation site: .venv/bin/pip install -e ".[docs]" && .venv/bin/sphinx-build -W docs site

Nothing in it is fetched from elsewhere: formulas are MathML, which browsers show by themselves.
"""

from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

project = "damper"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = "damper"
html_show_copyright = False
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_heading_anchors = 3
myst_all_links_external = False
nb_execution_mode = "force"
nb_execution_raise_on_error = True
# A cell that compiles takes minutes on a slow machine; a site is not wrong because of that.
nb_execution_timeout = -1
nb_output_stderr = "remove"
autodoc_typehints = "description"
autodoc_member_order = "bysource"


def setup(app: Any) -> None:
    """Write formulas as MathML."""

    def inline(writer: Any, node: Any) -> None:
        writer.body.append(convert(node.astext()))
        raise SkipNode

    def block(writer: Any, node: Any) -> None:
        writer.body.append(convert(node.astext(), display="block"))
        raise SkipNode

    app.add_html_math_renderer("mathml", (inline, None), (block, None))
