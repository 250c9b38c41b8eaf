"""Labels: positions at which they do not overlap, and texts shortened to the available space."""

from collections.abc import Callable, Sequence

ELLIPSIS = "…"
_WORD_TAIL_CHARS = 12
"""Number of characters at the end of a long word that are kept when it is shortened in the middle."""


def append_unit(number: str, unit: str) -> str:
    """Append a unit to a formatted number, with a space unless the unit is a percent sign or empty.

    Examples
    --------
    >>> append_unit("1.5", "m"), append_unit("12", "%"), append_unit("3", "")
    ('1.5 m', '12%', '3')
    """
    if unit in ("", "%"):
        return number + unit
    return f"{number} {unit}"


def spread_labels(positions: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Move labels along a line so that they do not overlap.

    The sum of squared shifts is minimal. Labels keep their order; labels with the same position stay in the
    order of the input.

    Parameters
    ----------
    positions : (n,) sequence of float
        Desired positions.
    gap : float
        Minimum distance between neighbors.
    low, high : float
        Limits of the positions. If there is not enough space for all gaps, the first labels are below `low`.

    Returns
    -------
    (n,) list of float

    Examples
    --------
    >>> spread_labels([10.0, 11.0, 40.0], 5.0, 0.0, 42.0)
    [8.0, 13.0, 40.0]
    """
    order = sorted(range(len(positions)), key=lambda label: positions[label])
    # With the gaps subtracted, the sorted positions only have to ascend, which is an isotonic regression.
    targets = [positions[label] - gap * rank for rank, label in enumerate(order)]
    last_rank = len(positions) - 1
    spread = [0.0] * len(positions)
    for rank, (label, level) in enumerate(zip(order, _fit_ascending(targets), strict=True)):
        position = max(level + gap * rank, low + gap * rank)
        spread[label] = min(position, high - gap * (last_rank - rank))
    return spread


def _fit_ascending(values: Sequence[float]) -> list[float]:
    """Return the ascending sequence with the least squared distance from values.

    Pool adjacent violators: each block of values that would descend is replaced by its mean.
    """
    means: list[float] = []
    sizes: list[int] = []
    for value in values:
        means.append(value)
        sizes.append(1)
        while len(means) > 1 and means[-2] > means[-1]:
            last_mean = means.pop()
            last_size = sizes.pop()
            total = sizes[-1] + last_size
            means[-1] = (means[-1] * sizes[-1] + last_mean * last_size) / total
            sizes[-1] = total
    fitted: list[float] = []
    for mean, size in zip(means, sizes, strict=True):
        fitted += [mean] * size
    return fitted


def shorten_text(text: str, measure: Callable[[str], float], width: float, *, min_chars: int = 0) -> str:
    """Shorten a text to a width; an ellipsis replaces its end.

    Parameters
    ----------
    text : str
    measure : callable
        Returns the width of a text.
    width : float
        Maximum width, in the unit of `measure`.
    min_chars : int
        Number of characters that are kept even if they are too wide.

    Returns
    -------
    str
        The whole text if it fits; an empty text if no character fits and `min_chars` is 0.

    Examples
    --------
    >>> shorten_text("Lloyd's algorithm", len, 8)
    "Lloyd's…"
    """
    if min_chars >= len(text) or measure(text) <= width:
        return text
    # Bisection: `fitting` characters fit, `too_long` do not.
    fitting = min_chars
    too_long = len(text) + 1
    while too_long - fitting > 1:
        middle = (fitting + too_long) // 2
        if measure(text[:middle].rstrip() + ELLIPSIS) <= width:
            fitting = middle
        else:
            too_long = middle
    if fitting == 0:
        return ""
    return text[:fitting].rstrip() + ELLIPSIS


def shorten_word(word: str, max_chars: int) -> str:
    """Shorten a word in the middle, because long names such as file names often differ only at the end.

    Examples
    --------
    >>> shorten_word("a-very-long-name-of-a-map-of-2024.json", 24)
    'a-very-long…of-2024.json'
    """
    if len(word) <= max_chars:
        return word
    head = word[: max_chars - _WORD_TAIL_CHARS - len(ELLIPSIS)]
    return f"{head}{ELLIPSIS}{word[-_WORD_TAIL_CHARS:]}"
