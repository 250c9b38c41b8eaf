"""Sentence case of messages, tooltips and labels."""

_PUNCTUATION = ",:;"


def to_sentence_case(text: str) -> str:
    """Capitalize the first letter of a text, unless its first word looks like a name.

    Words with digits, signs or capitals look like names, such as those of files and parameters.

    >>> to_sentence_case("session saved: rooms.robocov")
    'Session saved: rooms.robocov'
    >>> to_sentence_case("k_rep: expected a number")
    'k_rep: expected a number'
    """
    words = text.split(maxsplit=1)
    if not words:
        return text
    word = words[0].rstrip(_PUNCTUATION)
    if not (word.isalpha() and word.islower()):
        return text
    return text[:1].upper() + text[1:]
