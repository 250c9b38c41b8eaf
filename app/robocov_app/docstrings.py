"""Descriptions of attributes in docstrings, for schemas of files and the reference."""

from __future__ import annotations

import re

_SECTION = re.compile(r"^Attributes\n-+\n(.*?)(?=^[A-Z][\w ]+\n-+$|\Z)", re.M | re.S)
"""The section Attributes, up to the next section."""
_ATTRIBUTE = re.compile(r"^(\w+) : [^\n]*\n((?:    [^\n]*(?:\n|\Z)|\n)*)", re.M)
"""An attribute: its name and its description, which is indented."""


def parse_attributes(docstring: str) -> dict[str, str]:
    r"""Parse the section Attributes of a docstring.

    Parameters
    ----------
    docstring : str
        Docstring of a class in the style of numpydoc, without indentation, as `inspect.getdoc` returns it.

    Returns
    -------
    dict of str to str
        Description of each attribute in one line, by name.

    Examples
    --------
    >>> parse_attributes("A disc.\n\nAttributes\n----------\nradius : float\n    Its radius, m.\n")
    {'radius': 'Its radius, m.'}
    """
    section = _SECTION.search(docstring)
    if section is None:
        return {}
    return {name: " ".join(description.split()) for name, description in _ATTRIBUTE.findall(section[1])}
