"""The reference, written from the program itself at each build: commands, gains, formats, metrics, names."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import robocov as rc
from robocov.controllers import controller_kinds, gains_of, information_of
from robocov.controllers.gains import Option, value_text
from robocov.mapfile import map_schema
from robocov.metrics.run_metrics import COLUMNS
from robocov_app.cli import COMMANDS, main
from robocov_app.viewer.session.file import session_schema

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for sources."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True}


def write(app: Sphinx) -> None:
    """Write every page of the reference into `reference/` beside the sources."""
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    for page in (commands, gains, formats, metrics):
        (folder / f"{page.__name__}.md").write_text(page(), encoding="utf-8")
    (folder / "names.rst").write_text(names(), encoding="utf-8")


def commands() -> str:
    """Return the help of every command."""
    text = "# Commands\n\nWhat `robocov COMMAND -h` prints.\n"
    for name, (_, line) in COMMANDS.items():
        told = io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.suppress(SystemExit):
            main([name, "-h"])
        text += f"\n## robocov {name}\n\n{line[0].upper()}{line[1:]}.\n\n"
        text += f"```text\n{told.getvalue().strip()}\n```\n"
    return text


def gains() -> str:
    """Return a table of gains for every controller."""
    text = "# Controllers and their gains\n"
    for name, kind in controller_kinds().items():
        text += f"\n## {name}\n\n{kind.summary}. Goes by: {information_of(kind)}.\n".replace("..", ".")
        rows = gains_of(kind).values()
        text += "\n| gain | default | unit | range | |\n|---|---|---|---|---|\n" if rows else ""
        for gain in rows:
            if isinstance(gain, Option):
                span = ", ".join(gain.words)
            else:
                span = f"{gain.low:g} to {gain.high:g}{', or null' * gain.optional}"
            default = value_text(gain.default, none="null")
            text += f"| `{gain.name}` | {default} | {gain.unit} | {span} | {_cell(gain.meaning)} |\n"
    return text


def formats() -> str:
    """Return the fields of map and session files by their schemas."""
    text = "# File formats\n\nAs `robocov schema map` and `robocov schema session` give them to editors.\n"
    for title, schema in (("Maps", map_schema()), ("Sessions", session_schema())):
        text += f"\n## {title}\n"
        parts = {str(schema.get("title", title)): schema, **schema.get("$defs", {})}
        for name, part in parts.items():
            if not part.get("properties"):
                continue
            text += f"\n### {title}: {name}\n\n{_prose(part.get('description', ''))}\n\n"
            text += "| field | type | default | |\n|---|---|---|---|\n"
            needed = part.get("required", [])
            for field, of in part["properties"].items():
                default = "required" if field in needed else f"`{_cell(json.dumps(of.get('default')))}`"
                said = _cell(of.get("description", ""))
                text += f"| `{field}` | {_cell(_type(of))} | {default} | {said} |\n"
    return text


def _type(of: dict[str, Any]) -> str:
    if "$ref" in of:
        return str(of["$ref"].rpartition("/")[2])
    for several in ("anyOf", "oneOf"):
        if several in of:
            return " or ".join(_type(each) for each in of[several])
    if "const" in of or "enum" in of:
        return " or ".join(f"`{json.dumps(each)}`" for each in of.get("enum", [of.get("const")]))
    if of.get("type") == "array" and isinstance(of.get("items"), dict):
        return f"list of {_type(of['items'])}"
    return str(of.get("type", "anything"))


def metrics() -> str:
    """Return the columns of ``metrics.csv`` and the attributes they come from."""
    text = "# Metrics\n\nThe columns of `metrics.csv`, written by `robocov metrics`; [RunMetrics](names.rst) "
    text += "explains each.\n\n| column | attribute of `rc.RunMetrics` |\n|---|---|\n"
    return text + "".join(f"| `{column}` | `{name}` |\n" for name, column in COLUMNS.items())


def names() -> str:
    """Return directives that document every public name of the package."""
    text = "Python: every public name\n=========================\n\nAll are names of ``robocov``: "
    text += "``import robocov as rc``.\n"
    for name in sorted(rc.__all__, key=str.lower):
        value = getattr(rc, name)
        text += f"\n{name}\n{'-' * len(name)}\n\n"
        if isinstance(value, type):
            members = "\n   :members:" if not issubclass(value, Exception) else ""
            text += f".. autoclass:: robocov.{name}{members}\n"
        elif callable(value):
            text += f".. autofunction:: robocov.{name}\n"
        else:  # what it is stands beside it in its own module
            text += f".. autodata:: robocov.{rc._HOME[name]}.{name}\n   :no-value:\n"
    return text


def _cell(text: str) -> str:
    return _prose(text).replace("|", "\\|")


def _prose(text: str) -> str:
    return " ".join(text.split()).replace("<", "&lt;")
