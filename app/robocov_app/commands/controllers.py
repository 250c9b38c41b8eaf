"""`robocov controllers`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from robocov.controllers import FLAGSHIP, controller_kinds, gains_of, information_of
from robocov.controllers.gains import Gain, Option, value_text
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.tables import console


@dataclass
class Arguments(JsonOption):
    """List the controllers: one line each, and their gains with units, defaults and ranges.

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
    from rich.table import Table
    from rich.text import Text

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
            table.add_row("   ", gain.name, f"{default} {gain.unit}", _span(gain), gain.meaning)
        out.print(table)
    out.print(
        Text("A law of your own: robocov run rooms --controller mine.py:MyController (see the README).")
    )


def _told(gain: Gain | Option) -> dict[str, Any]:
    """Return what is known of a gain as it is printed in JSON."""
    values = (
        {"words": list(gain.words)}
        if isinstance(gain, Option)
        else {"low": gain.low, "high": gain.high, "nullable": gain.optional}
    )
    return {"name": gain.name, "default": gain.default, "unit": gain.unit, **values, "meaning": gain.meaning}


def _span(gain: Gain | Option) -> str:
    """Return what values a gain may have."""
    if isinstance(gain, Option):
        return " | ".join(gain.words)
    return f"{gain.low:g} to {gain.high:g}{', or null' if gain.optional else ''}"
