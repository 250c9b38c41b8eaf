"""Labels: positions at which they do not overlap, and texts shortened to the available space."""

from collections.abc import Callable, Sequence

ELLIPSIS = "…"
_WORD_TAIL_CHARS = 12
"""Characters at the end of a long word that stay when it is shortened in its middle."""


def spread_labels(positions: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Spread labels along a line so that they do not overlap.

    The result minimizes the sum of squared shifts. Labels keep their order; labels at the same position are
    in the order of the input.

    Parameters
    ----------
    positions : (n,) sequence of float
        Where the labels should be.
    gap : float
        Minimum distance between neighbors.
    low, high : float
        Limits of the positions. If there is too little space for all gaps, the last labels keep to `high`,
        and the first ones are below `low`.

    Returns
    -------
    (n,) list of float

    Examples
    --------
    >>> spread_labels([10.0, 11.0, 40.0], 5.0, 0.0, 42.0)
    [8.0, 13.0, 40.0]
    """
    order = sorted(range(len(positions)), key=lambda label: positions[label])
    # Without the gaps, the sorted positions only have to ascend: an isotonic regression.
    targets = [positions[label] - gap * rank for rank, label in enumerate(order)]
    last_rank = len(positions) - 1
    spread = [0.0] * len(positions)
    for rank, (label, level) in enumerate(zip(order, _fit_ascending(targets), strict=True)):
        position = max(level + gap * rank, low + gap * rank)
        spread[label] = min(position, high - gap * (last_rank - rank))
    return spread


def _fit_ascending(values: Sequence[float]) -> list[float]:
    """Return the ascending sequence that is nearest to values (pool adjacent violators)."""
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
        Number of characters that stay even if they are too wide.

    Returns
    -------
    str
        The text itself if it fits, an empty one if nothing does.

    Examples
    --------
    >>> shorten_text("Lloyd's algorithm", len, 8)
    "Lloyd's…"
    """
    if measure(text) <= width:
        return text
    fitting = min(min_chars, len(text))
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
    """Shorten a word in its middle, since the ends of long names, such as those of files, tell them apart.

    Examples
    --------
    >>> shorten_word("a-very-long-name-of-a-map-of-2024.json", 24)
    'a-very-long…of-2024.json'
    """
    if len(word) <= max_chars:
        return word
    head = word[: max_chars - _WORD_TAIL_CHARS - len(ELLIPSIS)]
    return f"{head}{ELLIPSIS}{word[-_WORD_TAIL_CHARS:]}"
