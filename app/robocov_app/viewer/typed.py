"""Commands that are typed, as into the palette: ``k_rep 0.5``, ``robots 12``, ``map office``."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import InputError, ParameterError, unknown_name
from robocov_app.viewer.session.scenario import Law

if TYPE_CHECKING:
    from robocov_app.viewer.presenter import Desk

COMMAND_WORDS = (
    "robots",
    "seed",
    "start",
    "map",
    "speed",
    "controller",
    "time",
    "robot",
    "open",
    "save",
    "branch",
)
"""What can be typed besides gains and limits."""


def parted(text: str) -> tuple[str, str]:
    """Return the word and what follows it, after a blank or an equals sign.

    >>> parted("k_rep = 0.5"), parted("map a=b.json"), parted("robots")
    (('k_rep', '0.5'), ('map', 'a=b.json'), ('robots', ''))
    """
    word, *rest = re.split(r"\s*=\s*|\s+", text.strip(), maxsplit=1)
    return word, "".join(rest)


def command(desk: Desk, text: str) -> None:
    """Do what was typed: a gain or a limit with its value, or one of `COMMAND_WORDS` with what it takes.

    Raises
    ------
    RobocovError
        When that means nothing, or cannot be done.
    """
    word, rest = parted(text)
    parameters = {each.name: each for each in desk.parameters()}
    parameters |= {each.name.removeprefix("team."): each for each in parameters.values()}
    if word in parameters:
        parameter = parameters[word]
        desk.set_parameter(parameter.name, parameter.read(rest))
    elif word == "robots":
        desk.restart(robots=_whole(word, rest))
    elif word == "seed":
        desk.restart(seed=_whole(word, rest))
    elif word == "start":
        desk.restart(start=rest)
    elif word == "map":
        desk.open_map(rest)
    elif word == "speed":
        desk.set_speed(math.inf if rest in ("max", "inf") else _positive(word, rest))
    elif word == "controller":
        Law(rest).made()
        if rest not in desk.laws:
            desk.laws.append(rest)
        desk.set_law(desk.active, rest)
    elif word == "open":
        desk.open_session(Path(rest))
    elif word == "save":
        desk.say(
            f"session saved: {desk.workspace.save(desk.folder, desk.view, Path(rest) if rest else None)}"
        )
    elif word == "branch":
        desk.session.enter(desk.session.document.branch(rest).node)
    elif word == "time":
        desk.look_at(_positive(word, rest))
    elif word == "robot":
        number = _whole(word, rest)
        circumstances = desk.session.circumstances(desk.lane)
        if number not in {*circumstances.numbers, *circumstances.failed}:
            raise ParameterError(f"there is no robot {number}")
        desk.hand.selected = number
    else:
        known = [*parameters, *COMMAND_WORDS]
        raise InputError(unknown_name("command", word, known))


def _whole(word: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ParameterError(f"{word}: {text!r}, but a whole number was wanted") from None


def _positive(word: str, text: str) -> float:
    try:
        value = float(text.rstrip("×x"))
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0.0) or (word == "speed" and not 0.01 <= value <= 1000.0):
        raise ParameterError(f"{word}: {text!r}, but a positive number was wanted")
    return value
