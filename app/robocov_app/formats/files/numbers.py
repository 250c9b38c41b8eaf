"""Numbers in the text of foreign files."""

import warnings
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray


def parse_number(text: str) -> float:
    """Convert text to a number, or to nan if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return np.nan


def parse_integers(text: str | bytes, separator: str) -> NDArray[np.int64] | None:
    """Return the integers in a text, or None if it contains anything but integers and separators."""
    if not text.strip():
        return np.empty(0, np.int64)
    # NumPy reports text that is not a number by a DeprecationWarning, which becomes an error here.
    with warnings.catch_warnings(), suppress(DeprecationWarning, ValueError, OverflowError):
        warnings.simplefilter("error", DeprecationWarning)
        return np.fromstring(text, dtype=np.int64, sep=separator)
    return None
