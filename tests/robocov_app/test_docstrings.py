"""Attributes that are parsed from docstrings."""

from __future__ import annotations

import inspect

from robocov_app.docstrings import parse_attributes


class Disc:
    """A disc.

    Parameters
    ----------
    color : str
        Not an attribute.

    Attributes
    ----------
    radius : float
        Its radius, m,
        at least 0.
    center : (2,) array
    name : str
        Its name.

        A second paragraph.

    Notes
    -----
    remark : not an attribute
        Its text.
    """


def test_only_attributes_are_parsed() -> None:
    assert parse_attributes(inspect.getdoc(Disc) or "") == {
        "radius": "Its radius, m, at least 0.",
        "center": "",
        "name": "Its name. A second paragraph.",
    }


def test_a_docstring_without_attributes_has_none() -> None:
    assert parse_attributes("A disc.") == {}
