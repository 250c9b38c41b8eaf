"""`robocov controllers`."""

from dataclasses import dataclass
from typing import Any

from rich.table import Table
from rich.text import Text

from robocov.controllers import RECOMMENDED_CONTROLLER, get_gains, get_information, list_controller_classes
from robocov.controllers.gains import Gain, Option, format_value
from robocov.text import escape_controls
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.output import create_console, print_answer


@dataclass
class Arguments(JsonOption):
    """List the controllers: one line each, and their gains with units, defaults and ranges.

    In JSON the recommended controller has "flagship": true.

    Example: robocov controllers --json
    """


def command(options: Arguments) -> None:
    out, rows = create_console(), []
    for name, kind in list_controller_classes().items():
        label, summary = str(getattr(kind, "label", name)), str(getattr(kind, "summary", ""))
        information, gains = get_information(kind), get_gains(kind).values()
        row = {"name": name, "label": label, "summary": summary, "flagship": name == RECOMMENDED_CONTROLLER}
        rows.append(row | {"information": information, "gains": list(map(_told, gains))})
        if options.json:
            continue
        mark = "   (recommended)" * (name == RECOMMENDED_CONTROLLER)
        mark += f"   (informed: {information})" * (information != "own")
        out.print(Text.assemble((escape_controls(name), "bold"), escape_controls(f"   {label}{mark}")))
        out.print(Text(escape_controls(f"  {summary}")))
        table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
        for gain in gains:
            default = format_value(gain.default, none="null")
            if isinstance(gain, Option):
                span = " | ".join(gain.choices)
            else:
                span = f"{gain.low:g} to {gain.high:g}{', or null' if gain.optional else ''}"
            cells = ("   ", gain.name, f"{default} {gain.unit}", span, gain.meaning)
            table.add_row(*map(escape_controls, cells))
        out.print(table)
    own = "A law of your own: robocov run rooms --controller mine.py:MyController (see robocov handbook)."
    print_answer(options, {"controllers": rows}, own, indent=1)


def _told(gain: Gain | Option) -> dict[str, Any]:
    told: dict[str, Any] = {"name": gain.name, "default": gain.default, "unit": gain.unit}
    if isinstance(gain, Option):
        told["words"] = list(gain.choices)
    else:
        told |= {"low": gain.low, "high": gain.high, "nullable": gain.optional}
    return {**told, "meaning": gain.meaning}
