"""Commands: one list a window, read by its keys, menus, buttons, help, tool tips and palette."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import pygame
from pygame import Rect, Surface

from robocov.errors import InputError, describe_unknown_name
from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.toolkit.dialogs import Choice, Dialog, Option
from robocov_app.toolkit.input import key_of, key_words
from robocov_app.toolkit.overlay import card, dim
from robocov_app.toolkit.ui import SMALL, TEXT, Ui


@dataclass(frozen=True)
class Takes:
    """Argument that is typed after a command's name."""

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
        keys = " or ".join(key_words(key) for key in self.keys)
        return f"{self.title} ({keys})" if keys else self.title


class Commands:
    """The list of a window's commands."""

    def __init__(
        self,
        listed: Iterable[Command],
        attempt: Callable[[Callable[[], object]], object],  # calls it, and tells returned words or the error
        more: Callable[[], Iterable[Command]] = tuple,  # that come and go, as gains of the controller in use
    ) -> None:
        self.listed = list(listed)
        self._attempt, self._more = attempt, more
        self._named = {each.name: each for each in self.listed}
        self._keyed = {key: each for each in self.listed for key in each.keys}
        self._down: set[int] = set()

    def __getitem__(self, name: str) -> Command:
        return self._named[name]

    def do(self, name: str) -> None:
        self._attempt(partial(_done, self._named[name]))

    def of_key(self, event: pygame.event.Event) -> Command | None:
        """Return the command of a key that goes down; None while it is held and does not repeat."""
        command, held = self._keyed.get(key_of(event)), event.key in self._down
        self._down.add(event.key)
        return None if command is None or (held and not command.repeats) else command

    def release(self, event: pygame.event.Event) -> None:
        self._down.discard(event.key)

    def forget_keys(self, *held: int) -> None:
        self._down = set(held)

    def _typable(self) -> dict[str, Command]:
        return {each.name: each for each in [*self._more(), *self.listed] if each.takes is not None}

    def typed(self, text: str) -> object:
        word, rest = parted(text)
        known = self._typable()
        if word not in known:
            raise InputError(describe_unknown_name("command", word, list(known)))
        return _done(known[word], rest)

    def offered(self, text: str, most: int = 9) -> list[Option]:
        """Return the palette's lines for a text, with what does them as value; None: more is to be typed."""
        word, rest = parted(text)
        command = self._typable().get(word)
        if command is not None and command.takes is not None and (rest or text.rstrip() != text):
            return self._completions(command, command.takes, rest, text)[:most]
        commands = [*self.listed, *(self._more() if text.strip() else ())]
        found = matching([each for each in commands if not each.hidden], text)
        return [self._offer(each) for each in found[:most]]

    def _completions(self, command: Command, takes: Takes, rest: str, text: str) -> list[Option]:
        options, low, why = list(takes.options()), rest.lower(), command.when()
        begun = [each for each in options if each.lower().startswith(low)]
        begun += [each for each in options if low in each.lower() and each not in begun]
        found = []
        if rest in options or not begun:
            found.append(Option(text.strip(), takes.name, text, why, lambda: self.typed(text)))
        for option in begun:
            if option != rest:
                whole = f"{command.name} {option}"
                found.append(Option(whole, "", whole, why, partial(self.typed, whole)))
        return found

    def _offer(self, command: Command) -> Option:
        if command.takes is not None:
            return Option(command.title, f"{command.name} …", f"{command.name} ", command.when())
        keys = " or ".join(key_words(key) for key in command.keys[:2])
        do = partial(self._attempt, partial(_done, command))
        return Option(command.title, keys, command.title, command.when(), do)


def _done(command: Command, *typed: str) -> object:
    if why := command.when():
        raise InputError(why)
    return command.run(*(command.takes.read(text) for text in typed if command.takes is not None))


def parted(text: str) -> tuple[str, str]:
    """Return the word and what follows it, after a blank or an equals sign: ``k_rep = 0.5``."""
    word, *rest = re.split(r"\s*=\s*|\s+", text.strip(), maxsplit=1)
    return word, "".join(rest)


def matching(commands: Sequence[Command], typed: str) -> list[Command]:
    """Return the commands whose titles or names hold all words typed, those that begin with them first."""
    words, begun = typed.lower().split(), typed.lower().strip()
    found = [each for each in commands if all(word in f"{each.title} {each.name}".lower() for word in words)]
    return sorted(found, key=lambda each: not (each.name == begun or each.title.lower().startswith(begun)))


def palette(commands: Commands, ghost: str, told: Callable[[str], object]) -> Choice:
    """Return the dialog that finds and does commands; `told` gets the words of what was done, if any."""

    def accept(text: str, option: Option | None) -> object:
        if option is not None and option.value is None:
            return option.fills
        if option is not None and option.why:
            raise InputError(option.why)
        words = option.value() if option is not None and callable(option.value) else commands.typed(text)
        told(words if isinstance(words, str) else "")
        return None

    hint = "↑ ↓ choose · Tab completes · Enter does it · Esc closes"
    return Choice("", commands.offered, accept, ghost, hint)


class Menu(Dialog):
    """Commands to choose from at a place of the window, None for a line between groups."""

    margin = 5.0, 5.0
    veils, closes_beside = False, True

    def __init__(
        self, rows: Sequence[Command | None], at: tuple[int, int], do: Callable[[str], object]
    ) -> None:
        self.commands, self.at, self._do = rows, at, do
        self.chosen = -1

    def page(self, ui: Ui) -> None:
        for k, command in enumerate(self.commands):
            ui.row(height=7 if command is None else 24, below=0)
            if command is None:
                ui.cell()
                continue
            why, chosen = command.when(), k == self.chosen
            if ui.option(command.title, _keys(command), key=command.name, chosen=chosen, why=why):
                self._choose(command)

    def _choose(self, command: Command | None) -> None:
        self.done = True
        if command is not None:
            self._do(command.name)

    def key(self, name: str, ui: Ui) -> bool:
        usable = [k for k, each in enumerate(self.commands) if each is not None and not each.when()]
        by = {"up": -1, "down": 1}.get(name, 0)
        if by and usable:
            k = usable.index(self.chosen) + by if self.chosen in usable else (0 if by > 0 else -1)
            self.chosen = usable[k % len(usable)]
        elif name in ("return", "enter") and self.chosen in usable:
            self._choose(self.commands[self.chosen])
        return True

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        title, keys = round(TEXT * scale), round(SMALL * scale)
        listed = [each for each in self.commands if each is not None]
        widths = [text_width(each.title, title) + text_width(_keys(each), keys) for each in listed]
        box.update(self.at, (round(50 * scale) + max(widths), box.height))
        box.clamp_ip(screen)


def _keys(command: Command) -> str:
    return key_words(command.keys[0]) if command.keys else ""


def draw_keys(
    screen: Surface, theme: Theme, scale: float, commands: list[Command], groups: Sequence[str], words: str
) -> None:
    dim(screen, theme)
    lines: list[str | Command] = []
    for group in groups:
        lines.append(group)
        lines += [each for each in commands if each.group == group and each.keys and not each.hidden]
    width, height = screen.get_size()
    columns = 4 if width >= 1150 * scale else 3
    # small windows get smaller letters rather than a page that does not fit
    rows = -(-(len(lines) + len(groups)) // columns) + 1
    row = min(16.5 * scale, (height - 90 * scale) / rows)
    size = max(8, round(row * 0.66))
    box = Rect(0, 0, round(min(width - 24 * scale, 1240 * scale)), round(rows * row + 66 * scale))
    box.center = width // 2, height // 2
    card(screen, box, theme, scale)
    title = label("Keys", round(16 * scale), theme.ink, True)
    screen.blit(title, (box.left + round(20 * scale), box.top + round(12 * scale)))
    hint = label(words, round(11 * scale), theme.faint)
    screen.blit(hint, hint.get_rect(midright=(box.right - round(20 * scale), box.top + round(22 * scale))))
    wide = (box.width - 40 * scale) / columns
    x, y, limit = box.left + 20 * scale, box.top + 44 * scale, box.bottom - 14 * scale
    for line in lines:
        # a heading does not stand alone at the foot of a column
        if y + row * (2.6 if isinstance(line, str) else 1.0) > limit:
            x, y = x + wide, box.top + 44 * scale
        if isinstance(line, str):
            if y > box.top + 45 * scale:
                y += 0.5 * row
            heading = label(line.upper(), max(8, round(size * 0.92)), theme.final, True)
            screen.blit(heading, (round(x), round(y)))
        else:
            screen.blit(label(key_words(line.keys[0]), size, theme.ink, True), (round(x), round(y)))
            told = shortened(line.title.partition(":")[0], size, wide - 92 * scale)
            meaning = label(told, size, mix(theme.panel, theme.ink, 0.8))
            screen.blit(meaning, (round(x + 84 * scale), round(y)))
        y += row
