"""The examples on the start page, and the choice of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from robocov_app.storage.autosave import Draft


class Target(StrEnum):
    """Part of the application that a choice on the start page opens."""

    WINDOW = "window"
    LESSON = "lesson"
    EDITOR = "editor"


@dataclass(frozen=True)
class StartChoice:
    """A choice of the user on the start page.

    Attributes
    ----------
    title : str
        Title for the message during loading.
    target : Target
    options : mapping
        Options of `robocov demo` that differ from the defaults.
    draft : Draft or None
        Unsaved work to recover; None to start a new session.
    """

    title: str
    target: Target = Target.WINDOW
    options: Mapping[str, Any] = field(default_factory=dict)
    draft: Draft | None = None


@dataclass(frozen=True)
class StartCard:
    """An example on the start page.

    Attributes
    ----------
    choice : StartChoice
        Choice made by a click on the card.
    text : str
        Description of the example, in one or two lines.
    previews : tuple of str
        Names of recorded runs, shown side by side; empty for the drawing of a map.
    labels : tuple of str
        Texts below these runs; empty for none.
    """

    choice: StartChoice
    text: str
    previews: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()


START_CARDS = (
    StartCard(
        StartChoice("Rooms", options={"map": "rooms"}),
        "Six robots explore a building that they do not know.",
        ("rooms",),
    ),
    StartCard(
        StartChoice("The trap", options={"map": "trap"}),
        "A U-shaped wall. Which robots get stuck, and why?",
        ("trap",),
    ),
    StartCard(
        StartChoice("City with 50 robots", options={"map": "city", "robots": 50, "start": "uniform"}),
        "Fifty robots spread through the streets of a city.",
        ("city",),
    ),
    StartCard(
        StartChoice(
            "Compare three controllers",
            options={"map": "blocks-a", "controllers": ("rapf", "rpf", "lloyd")},
        ),
        "Same starting positions. Which one covers best?",
        ("compare-rapf", "compare-rpf", "compare-lloyd"),
        ("RAPF", "RPF", "Lloyd"),
    ),
    StartCard(
        StartChoice("Draw your own", Target.EDITOR),
        "Draw a map, then let robots cover it.",
    ),
    StartCard(
        StartChoice("Lesson: an unknown building", Target.LESSON),
        "Eleven short chapters with questions to answer.",
        ("lesson",),
    ),
)
"""The examples, in the order of their keys 1 to 6."""


def choose_map(name: str) -> StartChoice:
    """Return the choice that opens a bundled map."""
    return StartChoice(name, options={"map": name})


def choose_session(path: Path) -> StartChoice:
    """Return the choice that opens a session or a map file."""
    return StartChoice(path.stem, options={"map": str(path)})


def choose_draft(draft: Draft) -> StartChoice:
    """Return the choice that recovers unsaved work."""
    return StartChoice("the unsaved session", draft=draft)
