"""Everything that a key does: the window, its help, its tool tips and its palette go by this list."""

from __future__ import annotations

from dataclasses import dataclass

KEY_REPEAT = (350, 40)
"""Milliseconds after which a key that is held down is pressed again, the first time and from then on."""


@dataclass(frozen=True)
class Action:
    """Something that a key does.

    Attributes
    ----------
    name : str
        ``kind`` or ``kind:what``.
    title : str
    group : str
        Under which heading the help shows it.
    keys : tuple of str
        As ``ctrl+shift+z``; the last part is what pygame calls the key.
    """

    name: str
    title: str
    group: str
    keys: tuple[str, ...]


def key_words(key: str) -> str:
    """Return a key as people write it.

    >>> [key_words(key) for key in ("ctrl+shift+z", "page down", "f1", "space", "`", "left")]
    ['Ctrl Shift Z', 'Page down', 'F1', 'Space', '`', '←']
    """
    arrows = {"left": "←", "right": "→", "up": "↑", "down": "↓", "return": "Enter"}
    parts = [*key[:-1].split("+")[:-1], "+"] if key.endswith("++") or key == "+" else key.split("+")
    return " ".join(arrows.get(part, part[:1].upper() + part[1:]) for part in parts)


def matching(actions: list[Action], typed: str) -> list[Action]:
    """Return the actions whose titles hold all words typed, those that begin with them first.

    >>> [a.name for a in matching([Action("step", "Single step", "Run", ())], "single")]
    ['step']
    """
    words = typed.lower().split()
    found = [action for action in actions if all(word in action.title.lower() for word in words)]
    return sorted(found, key=lambda action: not action.title.lower().startswith(typed.lower().strip()))
