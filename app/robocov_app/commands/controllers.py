"""`robocov controllers`."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from robocov.controllers import (
    RECOMMENDED_CONTROLLERS,
    get_gains,
    get_information,
    list_controller_classes,
    load_controller_class,
)
from robocov.controllers.gains import Gain, Option, format_value
from robocov.defaults import DEFAULT_CONTROLLER
from robocov.errors import format_bound
from robocov.text import escape_controls
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.output import create_console, print_answer

_HINT = (
    "A controller of your own: robocov run rooms --controller mine.py:MyController (see robocov handbook)."
)
"""Last line of the list."""
_INFORMATION_NOTES = {
    "own": "",
    "shared map": "   (shares maps by messages)",
    "whole map": "   (informed: whole map)",
}
"""Text that is printed next to the name of a controller, by the information that it uses."""


@dataclass
class Arguments(JsonOption):
    """List controllers, with units, defaults and ranges of their gains.

    Controllers that share maps send messages, so --loss, --delay and --bandwidth of `robocov run` affect
    them.

    In JSON, the paper's controller has "flagship": true. Controllers with the best results on the benchmark,
    given what their robots may know, have "recommended": true.

    Example: robocov controllers rapf atlas
    """

    names: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[NAME ...]")] = ()
    """Controllers to list, by default all; also mine.py:MyController."""


def command(options: Arguments) -> None:
    """Run `robocov controllers`."""
    if options.names:
        controller_classes = {name: load_controller_class(name) for name in options.names}
    else:
        controller_classes = list_controller_classes()
    console = create_console()
    rows = []
    for name, controller_class in controller_classes.items():
        gains = get_gains(controller_class).values()
        row = {
            "name": name,
            "label": str(getattr(controller_class, "label", name)),
            "summary": str(getattr(controller_class, "summary", "")),
            "flagship": name == DEFAULT_CONTROLLER,
            "recommended": name in RECOMMENDED_CONTROLLERS.values(),
            "information": get_information(controller_class),
            "gains": [_build_gain_row(gain) for gain in gains],
        }
        rows.append(row)
        if not options.json:
            _print_controller(console, row, gains)
    print_answer(options, {"controllers": rows}, _HINT, indent=1)


def _print_controller(console: Console, row: dict[str, Any], gains: Iterable[Gain | Option]) -> None:
    """Print the name and summary of a controller, and the table of its gains."""
    notes = ""
    if row["flagship"]:
        notes += "   (the paper's controller)"
    if row["recommended"]:
        notes += "   (recommended)"
    notes += _INFORMATION_NOTES[row["information"]]
    name = (escape_controls(row["name"]), "bold")
    console.print(Text.assemble(name, escape_controls(f"   {row['label']}{notes}")))
    console.print(Text(escape_controls(f"  {row['summary']}")))
    table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
    for gain in gains:
        default = format_value(gain.default, none="null")
        cells = ("   ", gain.name, f"{default} {gain.unit}", _format_range(gain), gain.meaning)
        table.add_row(*map(escape_controls, cells))
    console.print(table)


def _format_range(gain: Gain | Option) -> str:
    """Format the values that a gain may have."""
    if isinstance(gain, Option):
        return " | ".join(gain.choices)
    text = f"{format_bound(gain.low)} to {format_bound(gain.high)}"
    if gain.optional:
        text += ", or null"
    return text


def _build_gain_row(gain: Gain | Option) -> dict[str, Any]:
    """Build the JSON content that describes a gain."""
    row: dict[str, Any] = {"name": gain.name, "default": gain.default, "unit": gain.unit}
    if isinstance(gain, Option):
        row["words"] = list(gain.choices)
    else:
        row["low"] = gain.low
        row["high"] = gain.high
        row["nullable"] = gain.optional
    row["meaning"] = gain.meaning
    return row
