"""The reference, written from the program itself at each build: commands, gains, formats, metrics, names."""

from __future__ import annotations

import contextlib
import inspect
import io
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphinx.pycode import ModuleAnalyzer

import robocov as rc
from robocov.controllers import get_gains, get_information, list_controller_classes
from robocov.controllers.base import BaseController
from robocov.controllers.gains import Option, format_value
from robocov.mapfile import build_map_schema
from robocov.metrics.run_metrics import COLUMNS
from robocov_app.cli import COMMANDS, main
from robocov_app.sweep.study_file import list_study_keys
from robocov_app.sweep.table import RESULT_COLUMNS
from robocov_app.viewer.session.files.models import build_session_schema

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for sources."""
    app.connect("builder-inited", write)
    app.connect("autodoc-process-signature", gains_as_signature)
    return {"parallel_read_safe": True}


def write(app: Sphinx) -> None:
    """Write every page of the reference into `reference/` beside the sources."""
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    for page in (commands, gains, formats, metrics):
        (folder / f"{page.__name__}.md").write_text(page(), encoding="utf-8")
    (folder / "names.rst").write_text(names(), encoding="utf-8")


def gains_as_signature(*event: Any) -> tuple[str, None] | None:
    """Return the gains of a control law in the place of what its ``__new__`` takes."""
    _, what, _, value = event[:4]
    if what != "class" or not issubclass(value, BaseController):
        return None
    return str(inspect.signature(value, eval_str=True)).removesuffix(" -> None"), None


def commands() -> str:
    """Return the help of every command."""
    text = "# Commands\n\nWhat `robocov COMMAND -h` prints.\n"
    for name, command in COMMANDS.items():
        told = io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.suppress(SystemExit):
            main([name, "-h"])
        text += f"\n## robocov {name}\n\n{command.summary[0].upper()}{command.summary[1:]}.\n\n"
        text += f"```text\n{told.getvalue().strip()}\n```\n"
    return text


def gains() -> str:
    """Return a table of gains for every controller."""
    text = "# Controllers and their gains\n\n`--set GAIN=VALUE` sets a gain in every command, "
    text += (
        "`rc.Rapf(k_rep=1.0)` in Python. [Control laws](../controllers.md) says where each law comes from.\n"
    )
    for name, kind in list_controller_classes().items():
        summary = f"{kind.summary[0].upper()}{kind.summary[1:].rstrip('.')}."
        text += f"\n## {name}\n\n{summary} Information that it uses: {get_information(kind)}.\n"
        rows = get_gains(kind).values()
        text += "\n| gain | meaning | default | unit | range |\n|---|---|---|---|---|\n" if rows else ""
        for gain in rows:
            if isinstance(gain, Option):
                span = ", ".join(gain.choices)
            else:
                span = f"{gain.low:g} to {gain.high:g}{', or null' * gain.optional}"
            default = format_value(gain.default, none="null")
            text += f"| `{gain.name}` | {_cell(gain.meaning)} | {default} | {gain.unit} | {span} |\n"
    return text


def formats() -> str:
    """Return the fields of map and session files by their schemas, and the keys of study files."""
    text = (
        "# File formats\n\nMaps and sessions are JSON, studies TOML; [the folder of a run](../results.md) is "
    )
    text += "described by itself. `robocov schema map` and `robocov schema session` print the schemas.\n"
    for title, schema in (("Maps", build_map_schema()), ("Sessions", build_session_schema())):
        text += f"\n## {title}\n"
        parts = {str(schema.get("title", title)): schema, **schema.get("$defs", {})}
        for name, part in parts.items():
            if not part.get("properties"):
                continue
            text += f"\n### {name}\n\n{_prose(part.get('description', ''))}\n\n"
            text += "| field | meaning | type | default |\n|---|---|---|---|\n"
            needed = part.get("required", [])
            for field, of in part["properties"].items():
                default = "required" if field in needed else f"`{_cell(json.dumps(of.get('default')))}`"
                said = _cell(of.get("description", ""))
                text += f"| `{field}` | {said} | {_cell(_type(of))} | {default} |\n"
    text += "\n## Studies\n\n[A sweep](../sweeps.md) reads these keys.\n\n| key | value |\n|---|---|\n"
    return text + "".join(f"| `{key}` | {_cell(value)} |\n" for key, value in list_study_keys().items())


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
    """Return the columns of ``metrics.csv`` and of the table of a sweep."""
    told = ModuleAnalyzer.for_module("robocov.metrics.run_metrics").find_attr_docs()
    text = "# Metrics\n\n## Along a run\n\nThe columns of `metrics.csv`, which `robocov metrics` writes; in "
    text += "Python the attributes of [RunMetrics](names.rst).\n\n| column | meaning | attribute |\n"
    text += "|---|---|---|\n"
    for name, column in COLUMNS.items():
        text += f"| `{column}` | {_cell(' '.join(told['RunMetrics', name]))} | `{name}` |\n"
    text += "\n## Of a whole run\n\nThe columns of a sweep's `results.csv`, after what was run; most stand "
    text += "in `summary` of each `run.json`, too.\n\n| column | unit | meaning |\n|---|---|---|\n"
    for column in RESULT_COLUMNS:
        text += f"| `{column.name}` | {column.unit} | {_cell(column.meaning)} |\n"
    return text


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
        else:
            text += f".. autodata:: {_find_documenting_module(name)}.{name}\n   :no-value:\n"
    return text


def _find_documenting_module(name: str) -> str:
    """Return the module of the library in which a comment beside a constant documents it."""
    for module in sorted(sys.modules):
        is_candidate = module.startswith("robocov.") and hasattr(sys.modules[module], name)
        if is_candidate and ("", name) in ModuleAnalyzer.for_module(module).find_attr_docs():
            return module
    raise LookupError(f"{name}: expected a comment beside it, got none")


def _cell(text: str) -> str:
    return _prose(text).replace("|", "\\|")


def _prose(text: str) -> str:
    return " ".join(text.split()).replace("<", "&lt;")
