"""Attributes of the elements of TMX files: numbers and positions."""

import re

import numpy as np

from robocov.errors import quote
from robocov.typing import FloatArray
from robocov_app.formats.files.xml_tree import Element


def parse_vector(element: Element, x_name: str, y_name: str) -> FloatArray:
    """Return the numbers in two attributes, (2,); a missing one is 0."""
    return np.array([parse_number(element, x_name), parse_number(element, y_name)])


def parse_number(element: Element, name: str) -> float:
    """Return the number in an attribute; 0 if the attribute is missing."""
    return float(element.parse_numbers(name, count=1, default="0")[0])


def parse_integer(element: Element, name: str, minimum: int, default: str = "") -> int:
    """Return the integer in an attribute.

    Parameters
    ----------
    element : Element
    name : str
    minimum : int
        Minimum valid value.
    default : str
        Text to parse if the attribute is missing. By default, a missing attribute is an error.

    Raises
    ------
    MapError
        If the attribute is missing, is not an integer, or is out of range.
    """
    text = element.attributes.get(name, default)
    if not re.fullmatch(r"-?[0-9]{1,10}", text) or not minimum <= int(text) < 2**32:
        element.raise_error(f"expected a whole number from {minimum}, got {name} {quote(text)}")
    return int(text)
