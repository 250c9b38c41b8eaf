"""Line breaks: numbers stay next to their units, and ranges and options such as ``--radius`` in one piece."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from docutils import nodes
from sphinx.transforms.post_transforms import SphinxPostTransform

if TYPE_CHECKING:
    from sphinx.application import Sphinx

NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"
UNITS = r"[cmµ]?m|m[²³]|m/s²?|m?s|kg|N|J|Hz|[kMG]B|MiB"
SPACE_BEFORE_UNIT = re.compile(rf"(?<=\d) (?=(?:{UNITS})(?![\w/²³]))")
SPACE_IN_RANGE = re.compile(r"(?<=\d) to (?=\d)")
MAX_UNBROKEN_CHARS = 32
"""A line of a phone has space for about 40 characters of code."""


def setup(app: Sphinx) -> dict[str, Any]:
    """Register this module as a Sphinx extension."""
    app.add_post_transform(LineBreaks)
    return {"parallel_read_safe": True}


class LineBreaks(SphinxPostTransform):
    """Prevent unfortunate line breaks in text and inline code."""

    default_priority = 900
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Change the tree of one page."""
        for text in list(self.document.findall(nodes.Text)):
            if not is_code(text):
                text.parent.replace(text, nodes.Text(prevent_breaks(text.astext())))
        for literal in self.document.findall(nodes.literal):
            if max(map(len, literal.astext().split()), default=0) <= MAX_UNBROKEN_CHARS:
                literal["classes"].append("unbroken")


def prevent_breaks(text: str) -> str:
    """Replace the spaces before units and within ranges of numbers by spaces that do not break."""
    text = SPACE_BEFORE_UNIT.sub(NO_BREAK_SPACE, text)
    return SPACE_IN_RANGE.sub(f"{NO_BREAK_SPACE}to{NO_BREAK_SPACE}", text)


def is_code(text: nodes.Text) -> bool:
    """Return whether a text is code or the source of a diagram."""
    parent: nodes.Node | None = text.parent
    while parent is not None:
        if isinstance(parent, (nodes.literal, nodes.FixedTextElement, nodes.raw)):
            return True
        parent = parent.parent
    return False
