"""Commands: one table for each window. Keys, menus, buttons, help, tooltips and palette come from it."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import pygame

from robocov.errors import InputError, describe_unknown_name
from robocov_app.toolkit.window.input import format_key, get_key_name

Action = Callable[..., object]
SHIFT_SYMBOL = "⇧"
"""Stands for the Shift key where space is short."""


@dataclass(frozen=True)
class Argument:
    """Argument that is typed after the name of a command.

    Attributes
    ----------
    description : str
        For the palette, such as "number of robots".
    parse : callable
        Converts the typed text; raises InputError if it is not valid.
    list_values : callable
        Lists the valid inputs, if there are only a few.
    """

    description: str
    parse: Callable[[str], object] = str
    list_values: Callable[[], Iterable[str]] = tuple


def abbreviate_shift(key_text: str) -> str:
    """Return the text of a key combination with a symbol for the Shift key.

    >>> abbreviate_shift("Alt+Shift+S")
    'Alt+⇧S'
    """
    return key_text.replace("Shift+", SHIFT_SYMBOL)


@dataclass(frozen=True)
class Command:
    """An action of a window that can be run by its name or key.

    Attributes
    ----------
    name : str
        Unique name: the word that is typed for a command with an argument, otherwise as in "save:run".
    title : str
        Text in menus, tooltips and help.
    group : str
        Heading in the help.
    run : callable
        Called with the argument, if there is one. If it returns a string, that string is shown as a message.
    keys : tuple of str
        Key combinations that run it, such as "ctrl+shift+z"; the last part is pygame's name of the key.
    get_disabled_reason : callable
        Returns why the command cannot be run now; an empty string if it can.
    argument : Argument or None
    repeats : bool
        Whether it repeats while its key is held down.
    hidden : bool
        Whether it is left out of the palette and the help page.
    build_current_title : callable or None
        Returns what the command does in the present state, for the palette; None: always `title`.
    """

    name: str
    title: str
    group: str
    run: Action
    keys: tuple[str, ...] = ()
    get_disabled_reason: Callable[[], str] = str  # returns ""
    argument: Argument | None = None
    repeats: bool = False
    hidden: bool = False
    build_current_title: Callable[[], str] | None = None

    @property
    def current_title(self) -> str:
        """Title of the command in the current state."""
        if self.build_current_title is None:
            return self.title
        return self.build_current_title()

    @property
    def key_text(self) -> str:
        """The first key combination, formatted for users; empty if there is none."""
        return format_key(self.keys[0]) if self.keys else ""

    @property
    def tip(self) -> str:
        """Title and keys, for a tooltip."""
        keys = " or ".join(format_key(key) for key in self.keys)
        if not keys:
            return self.title
        return f"{self.title} ({keys})"

    def execute(self, argument: str | None = None) -> object:
        """Run the command, unless it is disabled.

        Parameters
        ----------
        argument : str, optional
            The typed argument, if the command takes one.

        Raises
        ------
        InputError
            If the command cannot be run now, or if the argument is not valid.
        """
        reason = self.get_disabled_reason()
        if reason:
            raise InputError(reason)
        if self.argument is None or argument is None:
            return self.run()
        return self.run(self.argument.parse(argument))


class CommandGroup:
    """Builds commands with the same heading.

    Parameters
    ----------
    heading : str
        Heading in the help.

    Attributes
    ----------
    commands : list of Command
        The commands that were added.
    """

    def __init__(self, heading: str) -> None:
        self.heading = heading
        self.commands: list[Command] = []

    def add(
        self,
        name: str,
        title: str,
        action: Action,
        *keys: str,
        repeats: bool = False,
        argument: Argument | None = None,
        hidden: bool = False,
        build_current_title: Callable[[], str] | None = None,
    ) -> None:
        """Add a command.

        Parameters
        ----------
        name : str
            Unique name.
        title : str
            Text for users; if empty, the command is left out of the palette and the help page.
        action : callable
            Runs the command. If it returns a string, that string is shown as a message.
        *keys : str
            Keys, such as ``ctrl+z``.
        repeats : bool
            Whether it is repeated while the key is held down.
        argument : Argument, optional
            Argument that is typed after the name.
        hidden : bool
            Whether it is left out of the palette and the help page.
        build_current_title : callable, optional
            Returns what the command does in the present state, for the palette.
        """
        is_hidden = hidden or not title
        command = Command(
            name=name,
            title=title,
            group=self.heading,
            run=action,
            keys=keys,
            argument=argument,
            repeats=repeats,
            hidden=is_hidden,
            build_current_title=build_current_title,
        )
        self.commands.append(command)


class CommandTable:
    """The commands of a window.

    Parameters
    ----------
    commands : iterable of Command
    attempt : callable
        Calls a function, and shows the string that it returns or the message of the error that it raises.
    list_temporary : callable, optional
        Lists commands that exist only for a while, such as those for the gains of the current controller.

    Attributes
    ----------
    commands : list of Command
        The commands that always exist.
    """

    def __init__(
        self,
        commands: Iterable[Command],
        attempt: Callable[[Callable[[], object]], object],
        list_temporary: Callable[[], Iterable[Command]] = tuple,
    ) -> None:
        """Index the commands by name and by key."""
        self.commands = list(commands)
        self._attempt = attempt
        self._list_temporary = list_temporary
        self._by_name = {command.name: command for command in self.commands}
        self._by_key = {key: command for command in self.commands for key in command.keys}
        self._held_keys: set[int] = set()

    def __getitem__(self, name: str) -> Command:
        return self._by_name[name]

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def run(self, name: str) -> None:
        """Run a command, and show its message or error."""
        self.attempt(self._by_name[name])

    def attempt(self, command: Command) -> object:
        """Run a command, which may be temporary, and show its message or error."""
        return self._attempt(command.execute)

    def take_command(self, event: pygame.event.Event) -> Command | None:
        """Record a pressed key, and return its command.

        None is returned if the key has no command, or is already held and its command does not repeat.
        """
        command = self._by_key.get(get_key_name(event))
        is_held = event.key in self._held_keys
        self._held_keys.add(event.key)
        if command is None or (is_held and not command.repeats):
            return None
        return command

    def release_key(self, event: pygame.event.Event) -> None:
        """Record that a key was released."""
        self._held_keys.discard(event.key)

    def reset_keys(self, *held: int) -> None:
        """Forget the keys that are held down, except for the given ones."""
        self._held_keys = set(held)

    def list_all(self) -> list[Command]:
        """List the temporary commands and those that always exist."""
        return [*self._list_temporary(), *self.commands]

    def find_with_argument(self, name: str) -> Command | None:
        """Return the command that takes an argument and has this name; None if there is none."""
        return self._list_with_argument().get(name)

    def _list_with_argument(self) -> dict[str, Command]:
        return {command.name: command for command in self.list_all() if command.argument is not None}

    def run_text(self, text: str) -> object:
        """Run a command that the user typed together with its argument.

        Parameters
        ----------
        text : str
            Name and argument, such as "robots 8".

        Returns
        -------
        object
            Return value of the command.

        Raises
        ------
        InputError
            If there is no such command, if it cannot be run now, or if the argument is not valid.
        """
        name, argument = split_command(text)
        commands = self._list_with_argument()
        if name not in commands:
            raise InputError(describe_unknown_name("command", name, list(commands)))
        return commands[name].execute(argument)

    def search(self, text: str) -> list[Command]:
        """Return the commands, except for hidden ones, that match the typed text."""
        commands = list(self.commands)
        if text.strip():
            commands += self._list_temporary()
        return find_commands([command for command in commands if not command.hidden], text)


def split_command(text: str) -> tuple[str, str]:
    """Split typed input into the name of a command and its argument, at a space or an equals sign.

    >>> split_command("k_rep = 0.5")
    ('k_rep', '0.5')
    """
    name, *argument = re.split(r"\s*=\s*|\s+", text.strip(), maxsplit=1)
    return name, "".join(argument)


def find_commands(commands: Sequence[Command], text: str) -> list[Command]:
    """Return the commands whose title or name contains all typed words, best matches first."""
    words = text.lower().split()
    start = text.lower().strip()

    def is_match(command: Command) -> bool:
        line = f"{command.title} {command.current_title} {command.name}".lower()
        return all(word in line for word in words)

    def is_worse(command: Command) -> bool:
        return command.name != start and not command.current_title.lower().startswith(start)

    return sorted(filter(is_match, commands), key=is_worse)
