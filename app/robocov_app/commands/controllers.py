"""`robocov controllers`."""

import json
from dataclasses import dataclass
from typing import Any

from rich.table import Table
from rich.text import Text

from robocov.controllers import FLAGSHIP, controller_kinds, gains_of, information_of
from robocov.controllers.gains import Gain, Option, value_text
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.output import console


@dataclass
class Arguments(JsonOption):
    """List the controllers: one line each, and their gains with units, defaults and ranges.

    In JSON the recommended controller has "flagship": true.

    Example: robocov controllers --json
    """


def command(options: Arguments) -> None:
    """Print the list."""
    kinds = controller_kinds()
    if options.json:
        rows = [
            {
                "name": name,
                "label": getattr(kind, "label", name),
                "summary": getattr(kind, "summary", ""),
                "flagship": name == FLAGSHIP,
                "information": information_of(kind),
                "gains": [_told(gain) for gain in gains_of(kind).values()],
            }
            for name, kind in kinds.items()
        ]
        print(json.dumps({"controllers": rows}, indent=1))
        return
    out = console()
    for name, kind in kinds.items():
        mark = "   (recommended)" if name == FLAGSHIP else ""
        information = information_of(kind)
        if information != "own":
            mark += f"   (informed: {information})"
        out.print(Text.assemble((name, "bold"), f"   {getattr(kind, 'label', name)}{mark}"))
        out.print(Text(f"  {getattr(kind, 'summary', '')}"))
        table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
        for gain in gains_of(kind).values():
            default = value_text(gain.default, none="null")
            if isinstance(gain, Option):
                span = " | ".join(gain.words)
            else:
                span = f"{gain.low:g} to {gain.high:g}{', or null' if gain.optional else ''}"
            table.add_row("   ", gain.name, f"{default} {gain.unit}", span, gain.meaning)
        out.print(table)
    out.print(
        "A law of your own: robocov run rooms --controller mine.py:MyController (see robocov handbook)."
    )


def _told(gain: Gain | Option) -> dict[str, Any]:
    told: dict[str, Any] = {"name": gain.name, "default": gain.default, "unit": gain.unit}
    if isinstance(gain, Option):
        told["words"] = list(gain.words)
    else:
        told |= {"low": gain.low, "high": gain.high, "nullable": gain.optional}
    return {**told, "meaning": gain.meaning}
