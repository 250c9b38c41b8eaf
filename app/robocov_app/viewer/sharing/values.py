"""Numbers and strings in commands and in Python: as short as possible, but exact."""

import math

from robocov.errors import format_exactly


def format_time(seconds: float) -> str:
    """Return a multiple of the control period, s, without its rounding error.

    Parameters
    ----------
    seconds : float

    Returns
    -------
    str

    Examples
    --------
    >>> format_time(0.30000000000000004)
    '0.3'
    """
    return f"{seconds:.12g}"


def format_gain_value(value: float | str | None, *, is_json: bool) -> str:
    """Return the value of a gain as in the option ``--set``, or else as in Python.

    Parameters
    ----------
    value : float, str or None
    is_json : bool

    Returns
    -------
    str
    """
    if value is None:
        return "null" if is_json else "None"
    if isinstance(value, str):
        return value if is_json else format_python_text(value)
    return format_exactly(value)


def format_python_text(text: str) -> str:
    """Return text as a string literal of Python, in double quotes if it contains no quotes.

    Parameters
    ----------
    text : str

    Returns
    -------
    str

    Examples
    --------
    >>> print(format_python_text("rooms"))
    "rooms"
    """
    literal = repr(text)
    if "'" in text or '"' in text:
        return literal
    return f'"{literal[1:-1]}"'


def format_python_number(value: float) -> str:
    """Return a number as in Python.

    Parameters
    ----------
    value : float

    Returns
    -------
    str

    Examples
    --------
    >>> format_python_number(float("inf"))
    'float("inf")'
    """
    if math.isinf(value):
        return 'float("inf")'
    return format_exactly(value)
