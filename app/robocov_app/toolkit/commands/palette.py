"""The palette: a dialog that finds commands by typing, and runs them."""

from collections.abc import Callable
from functools import partial

from robocov.errors import InputError
from robocov_app.toolkit.commands.command import Argument, Command, CommandTable, split_command
from robocov_app.toolkit.dialogs import Choice, Option
from robocov_app.toolkit.window.input import format_key

MAX_OPTIONS = 9
_MAX_KEYS = 2
_HINT = "↑ ↓ choose · Tab completes · Enter runs · Esc closes"


def create_palette(table: CommandTable, placeholder: str, show_message: Callable[[str], object]) -> Choice:
    """Create the dialog that finds and runs commands.

    Parameters
    ----------
    table : CommandTable
    placeholder : str
        Faint text in the empty field.
    show_message : callable
        Called with the message that the command returns; empty if it returns none.

    Returns
    -------
    Choice
    """

    def accept(text: str, option: Option | None) -> object:
        """Run the chosen command or the typed text; return text to type instead if an argument is missing."""
        if option is not None and option.value is None:
            return option.completion
        if option is not None and option.disabled_reason:
            raise InputError(option.disabled_reason)
        if option is not None and callable(option.value):
            message = option.value()
        else:
            message = table.run_text(text)
        show_message(message if isinstance(message, str) else "")
        return None

    return Choice("", partial(list_options, table), accept, placeholder, _HINT)


def list_options(table: CommandTable, text: str) -> list[Option]:
    """List the palette entries for the typed text.

    Parameters
    ----------
    table : CommandTable
    text : str

    Returns
    -------
    list of Option
        The value of an option is the function that runs the command; None if its argument is still missing.
    """
    name, argument_text = split_command(text)
    command = table.find_with_argument(name)
    # A space after the name of a command asks for its argument.
    is_name_complete = argument_text != "" or text[-1:].isspace()
    if command is not None and command.argument is not None and is_name_complete:
        return _list_completions(table, command, command.argument, argument_text, text)[:MAX_OPTIONS]
    return [_build_option(table, match) for match in table.search(text)[:MAX_OPTIONS]]


def _list_completions(
    table: CommandTable, command: Command, argument: Argument, argument_text: str, text: str
) -> list[Option]:
    """List the values of an argument that match its typed text, and the typed text itself."""
    values = list(argument.list_values())
    reason = command.get_disabled_reason()
    start = argument_text.lower()
    # Values that start with the typed text come before those that only contain it.
    matches = [value for value in values if value.lower().startswith(start)]
    matches += [value for value in values if start in value.lower() and value not in matches]
    options = []
    if argument_text in values or not matches:
        run = partial(table.run_text, text)
        options.append(Option(text.strip(), argument.description, text, reason, run))
    for value in matches:
        if value != argument_text:
            line = f"{command.name} {value}"
            options.append(Option(line, "", line, reason, partial(table.run_text, line)))
    return options


def _build_option(table: CommandTable, command: Command) -> Option:
    reason = command.get_disabled_reason()
    if command.argument is not None:
        return Option(command.current_title, f"{command.name} …", f"{command.name} ", reason)
    keys = " or ".join(format_key(key) for key in command.keys[:_MAX_KEYS])
    title = command.current_title
    return Option(title, keys, title, reason, partial(table.attempt, command))
