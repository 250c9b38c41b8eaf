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

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import pygame

from robocov.errors import InputError, unknown_name
from robocov_app.toolkit.input import key_of, key_words


def _always() -> str:
    return ""


def _nothing() -> Iterable[str]:
    return ()


def _as_typed(text: str) -> object:
    return text


@dataclass(frozen=True)
class Takes:
    """What is typed after a command's name.

    `name`: what it is, for the palette: ``number of robots``. `read`: makes a value of what was typed, or
    raises an InputError. `options`: returns the words that can be typed, if they can be listed.
    """

    name: str
    read: Callable[[str], object] = _as_typed
    options: Callable[[], Iterable[str]] = _nothing


@dataclass(frozen=True)
class Command:
    """Something that can be done in a window.

    `name`: unique; what is typed where it takes something, ``kind:what`` otherwise. `title`, `group`: what
    people read, and under which heading. `run`: does it; called with what was typed where it takes something.
    Returned words are told. `keys`: as ``ctrl+shift+z``; the last part is what pygame calls the key. `when`:
    returns why it cannot be done now, an empty text where it can. `repeats`: whether it is done again and
    again while its key is held down. `hidden`: left out of palette and help.
    """

    name: str
    title: str
    group: str
    run: Callable[..., object]
    keys: tuple[str, ...] = ()
    when: Callable[[], str] = _always
    takes: Takes | None = None
    repeats: bool = False
    hidden: bool = False

    @property
    def tip(self) -> str:
        """Title and keys, as a tool tip says them."""
        keys = " or ".join(key_words(key) for key in self.keys)
        return f"{self.title} ({keys})" if keys else self.title


@dataclass(frozen=True)
class Offer:
    """A line of the palette.

    `text`, `aside`: what it says, and its keys or what it takes. `fills`: what completion makes of what was
    typed. `call`: does it; None where more is to be typed first. `why`: why it cannot be done now.
    """

    text: str
    aside: str
    fills: str
    call: Callable[[], object] | None
    why: str = ""


class Commands:
    """The list of a window's commands.

    `attempt`: calls what it is given, and tells returned words or the error. `more`: returns commands that
    come and go, such as the gains of the controller in use.
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

    def _do(self, command: Command, *given: object) -> None:
        def done() -> object:
            if why := command.when():
                raise InputError(why)
            return command.run(*given)

        self._attempt(done)

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
        """Do what was typed: the name of a command and what it takes.

        Raises RobocovError when that means nothing, or cannot be done.
        """
        word, rest = parted(text)
        known = self._typable()
        if word not in known:
            raise InputError(unknown_name("command", word, list(known)))
        command = known[word]
        if why := command.when():
            raise InputError(why)
        assert command.takes is not None
        return command.run(command.takes.read(rest))

    def offered(self, text: str, most: int = 9) -> list[Offer]:
        """Return what the palette lists for a text: commands, or completions of what one takes."""
        word, rest = parted(text)
        command = self._typable().get(word)
        if command is not None and (rest or text.rstrip() != text):
            return self._completions(command, rest, text)[:most]
        commands = [
            each for each in [*self.listed, *(self._more() if text.strip() else ())] if not each.hidden
        ]
        return [self._offer(each) for each in matching(commands, text)[:most]]

    def _completions(self, command: Command, rest: str, text: str) -> list[Offer]:
        assert command.takes is not None
        options = list(command.takes.options())
        begun = [each for each in options if each.lower().startswith(rest.lower())]
        begun += [each for each in options if rest.lower() in each.lower() and each not in begun]
        if rest in options or not begun:
            whole = Offer(text.strip(), command.takes.name, text, lambda: self.typed(text), command.when())
            return [whole, *(self._completed(command, each) for each in begun if each != rest)]
        return [self._completed(command, each) for each in begun]

    def _completed(self, command: Command, option: str) -> Offer:
        whole = f"{command.name} {option}"
        return Offer(whole, "", whole, lambda: self.typed(whole), command.when())

    def _offer(self, command: Command) -> Offer:
        if command.takes is not None:
            return Offer(command.title, f"{command.name} …", f"{command.name} ", None, command.when())
        keys = " or ".join(key_words(key) for key in command.keys[:2])
        return Offer(command.title, keys, command.title, lambda: self._do(command), command.when())


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
