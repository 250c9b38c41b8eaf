"""Commands: one list a window, read by its keys, menus, buttons, help, tool tips and palette.

How a window writes its list::

    commands = Commands([
        Command("pause", "Play or pause", "Run", editor.pause, keys=("space",)),
        Command("remove", "Remove the robot", "Edit", viewer.remove, ("delete",), when=viewer.why_not),
        Command("map", "Open a map", "Run", viewer.open_map, takes=Takes("name", options=viewer.maps)),
        Command("speed", "Speed", "Run", viewer.set_speed, takes=Takes("factor", read=float)),
    ], attempt=viewer.attempt)
    commands.press(event)                       # a key of the keyboard
    commands.do("pause")                        # a button or a menu
    commands.typed("map office")                # raises InputError where it means nothing
    commands.offered("map of")                  # what the palette lists, with completion
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import pygame

from robocov.errors import InputError, unknown_name
from robocov_app.toolkit.input import key_of, key_words


@dataclass(frozen=True)
class Takes:
    """What is typed after a command's name."""

    name: str  # for the palette: "number of robots"
    read: Callable[[str], object] = str  # makes a value of what was typed; InputError
    options: Callable[[], Iterable[str]] = tuple  # the words that can be typed, if they can be listed


@dataclass(frozen=True)
class Command:
    """Something that can be done in a window."""

    name: str  # unique; what is typed where it takes something, "kind:what" otherwise
    title: str
    group: str  # the heading under which people read of it
    run: Callable[..., object]  # called with what was typed where it takes something; returned words are told
    keys: tuple[str, ...] = ()  # as "ctrl+shift+z"; the last part is what pygame calls the key
    when: Callable[[], str] = str  # returns why it cannot be done now, an empty text where it can
    takes: Takes | None = None
    repeats: bool = False  # whether it is done again and again while its key is held down
    hidden: bool = False  # left out of palette and help

    @property
    def tip(self) -> str:
        """Title and keys, as a tool tip says them."""
        keys = " or ".join(key_words(key) for key in self.keys)
        return f"{self.title} ({keys})" if keys else self.title


@dataclass(frozen=True)
class Offer:
    """A line of the palette."""

    text: str
    aside: str  # its keys, or what it takes
    fills: str  # what completion makes of what was typed
    call: Callable[[], object] | None  # does it; None where more is to be typed first
    why: str = ""  # it cannot be done now


class Commands:
    """The list of a window's commands.

    `attempt` calls what it is given, and tells returned words or the error; `more` returns commands that come
    and go, such as the gains of the controller in use.
    """

    def __init__(
        self,
        listed: Iterable[Command],
        attempt: Callable[[Callable[[], object]], object],
        more: Callable[[], Iterable[Command]] = tuple,
    ) -> None:
        self.listed = list(listed)
        self._attempt, self._more = attempt, more
        self._named = {each.name: each for each in self.listed}
        self._keyed = {key: each for each in self.listed for key in each.keys}
        self._down: set[int] = set()

    def __getitem__(self, name: str) -> Command:
        return self._named[name]

    def __contains__(self, name: object) -> bool:
        return name in self._named

    def do(self, name: str) -> None:
        """Do a command, or tell why it cannot be done."""
        self._do(self._named[name])

    def _do(self, command: Command) -> None:
        self._attempt(lambda: _done(command))

    # keys

    def of_key(self, event: pygame.event.Event) -> Command | None:
        """Return the command of a key that goes down; None while it is held and does not repeat."""
        command = self._keyed.get(key_of(event))
        held = event.key in self._down
        self._down.add(event.key)
        return None if command is None or (held and not command.repeats) else command

    def press(self, event: pygame.event.Event) -> bool:
        """Do the command of a key that goes down; return whether there is one."""
        command = self.of_key(event)
        if command is not None:
            self._do(command)
        return command is not None

    def release(self, event: pygame.event.Event) -> None:
        """Take note of a key that comes up."""
        self._down.discard(event.key)

    def hold(self, key: int) -> None:
        """Take note of a key that is held down already."""
        self._down.add(key)

    def forget_keys(self) -> None:
        """Take note that the window has lost the keyboard, or that something else has got its keys."""
        self._down.clear()

    # what is typed

    def _typable(self) -> dict[str, Command]:
        return {each.name: each for each in [*self._more(), *self.listed] if each.takes is not None}

    def typed(self, text: str) -> object:
        """Do what was typed: a command's name and what it takes; RobocovError where that cannot be done."""
        word, rest = parted(text)
        known = self._typable()
        if word not in known:
            raise InputError(unknown_name("command", word, list(known)))
        return _done(known[word], rest)

    def offered(self, text: str, most: int = 9) -> list[Offer]:
        """Return what the palette lists for a text: commands, or completions of what one takes."""
        word, rest = parted(text)
        command = self._typable().get(word)
        if command is not None and command.takes is not None and (rest or text.rstrip() != text):
            return self._completions(command, command.takes, rest, text)[:most]
        commands = [*self.listed, *(self._more() if text.strip() else ())]
        found = matching([each for each in commands if not each.hidden], text)
        return [self._offer(each) for each in found[:most]]

    def _completions(self, command: Command, takes: Takes, rest: str, text: str) -> list[Offer]:
        options, low, why = list(takes.options()), rest.lower(), command.when()
        begun = [each for each in options if each.lower().startswith(low)]
        begun += [each for each in options if low in each.lower() and each not in begun]
        found = []
        if rest in options or not begun:
            found.append(Offer(text.strip(), takes.name, text, lambda: self.typed(text), why))
        for option in begun:
            if option != rest:
                whole = f"{command.name} {option}"
                found.append(Offer(whole, "", whole, partial(self.typed, whole), why))
        return found

    def _offer(self, command: Command) -> Offer:
        if command.takes is not None:
            return Offer(command.title, f"{command.name} …", f"{command.name} ", None, command.when())
        keys = " or ".join(key_words(key) for key in command.keys[:2])
        return Offer(command.title, keys, command.title, lambda: self._do(command), command.when())


def _done(command: Command, *typed: str) -> object:
    if why := command.when():
        raise InputError(why)
    return command.run(*(command.takes.read(text) for text in typed if command.takes is not None))


def parted(text: str) -> tuple[str, str]:
    """Return the word and what follows it, after a blank or an equals sign.

    >>> parted("k_rep = 0.5"), parted("map a=b.json"), parted("robots")
    (('k_rep', '0.5'), ('map', 'a=b.json'), ('robots', ''))
    """
    word, *rest = re.split(r"\s*=\s*|\s+", text.strip(), maxsplit=1)
    return word, "".join(rest)


def matching(commands: Sequence[Command], typed: str) -> list[Command]:
    """Return the commands whose titles or names hold all words typed, those that begin with them first."""
    words, begun = typed.lower().split(), typed.lower().strip()
    found = [each for each in commands if all(word in f"{each.title} {each.name}".lower() for word in words)]
    return sorted(found, key=lambda each: not (each.name == begun or each.title.lower().startswith(begun)))
