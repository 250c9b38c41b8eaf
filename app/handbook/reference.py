"""The pages of the reference, which each build of the handbook generates from the program."""

from __future__ import annotations

import contextlib
import inspect
import io
import itertools
import json
import re
import sys
from collections.abc import Container, Iterable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.typing import stringify_annotation

import robocov as rc
from robocov.controllers import get_gains, get_information, list_controller_classes
from robocov.controllers.base import BaseController
from robocov.controllers.gains import Gain, Option, format_value
from robocov.mapfile import build_map_schema, load_map
from robocov.metrics.run_metrics import COLUMNS
from robocov.team import UNITS
from robocov_app import learning
from robocov_app.cli import COMMANDS, main
from robocov_app.docstrings import parse_attributes
from robocov_app.editor.ui.launch import EditorLauncher
from robocov_app.sweep.study.gains import NO_LIMIT
from robocov_app.sweep.study.study_file import list_study_keys
from robocov_app.sweep.table import RESULT_COLUMNS
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.window.input import format_key
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.session.files.models import build_session_schema
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario

if TYPE_CHECKING:
    from docutils import nodes
    from docutils.nodes import TextElement
    from sphinx.addnodes import pending_xref
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

ARRAY_TYPES = ("FloatArray", "IntArray", "BoolArray", "Float32Array", "Int32Array", "AnyArray")
"""Types of arrays in signatures; names of ``robocov.typing``."""
ARRAY_LIKE = stringify_annotation(ArrayLike, "smart")
"""Text by which Sphinx represents NumPy's type of everything that can be converted to an array."""

OTHER_NAMES = {
    "Figures": ("robocov_app.figures.files.save_figure", "robocov_app.figures.files.render_png"),
    "Maps": (
        "robocov.environment.Start",
        "robocov.mapfile.check.MapReport",
        "robocov.environment.Gap",
        "robocov.environment.find_narrowest_gap",
        "robocov.errors.Issue",
    ),
    "Controllers": (
        "robocov.controllers.get_gains",
        "robocov.controllers.get_information",
        "robocov.observation.Scanning",
        "robocov.observation.Scans",
        "robocov.observation.Cells",
    ),
    "Results": ("robocov.metrics.CostHistory", "robocov.conditions.JoinedRobot"),
    "Learning": (
        "robocov_app.learning.environment.EpisodeEnv",
        "robocov_app.learning.environment.draw_episode",
        "robocov_app.learning.rewards.share_reward",
    ),
}
"""Names outside the top level, by heading, that the handbook imports or that public functions return."""


def setup(app: Sphinx) -> dict[str, Any]:
    """Register this module as a Sphinx extension, which writes the pages before sources are read."""
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-signature", replace_signature)
    app.connect("missing-reference", find_public_name)
    return {"parallel_read_safe": True}


def write_pages(app: Sphinx) -> None:
    """Write all pages of the reference to the folder `reference` of the sources."""
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    builders = {
        "commands.md": build_commands_page,
        "keys.md": build_keys_page,
        "gains.md": build_gains_page,
        "formats.md": build_formats_page,
        "metrics.md": build_metrics_page,
        "names.rst": build_names_page,
        "other-names.rst": build_other_names_page,
        "learning.rst": build_learning_page,
    }
    for name, build_page in builders.items():
        (folder / name).write_text(build_page(), encoding="utf-8")


def replace_signature(
    _app: Sphinx,
    kind: str,
    _name: str,
    value: Any,
    _options: object,
    parameters: str | None,
    result: str | None,
) -> tuple[str, str | None] | None:
    """Return the parameters and the type of the result to show, or None if Sphinx shows them well.

    A controller has its gains instead of the parameters of ``__new__``.
    """
    if kind == "class" and issubclass(value, BaseController):
        return str(inspect.signature(value, eval_str=True)).removesuffix(" -> None"), None
    if parameters is None:
        return None
    # Sphinx parses signatures as Python, in which the default of a field with a factory is no expression.
    text = parameters.replace("<factory>", "...").replace(ARRAY_LIKE, "ArrayLike")
    return None if text == parameters else (text, result)


def find_public_name(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, content: TextElement
) -> nodes.reference | None:
    """Return a link to a name that a docstring mentions without its package, as in ``make_controller``.

    Attributes that have no entry of their own link to their class, as in ``Decision.memory``.
    """
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"].partition("(")[0]
    owner = target.rpartition(".")[0]
    for name in filter(None, (target, owner)):
        for documented_name in list_documented_names(name):
            link = env.domains.python_domain.resolve_xref(
                env, node["refdoc"], app.builder, node["reftype"], documented_name, node, content
            )
            if link is not None:
                return link
    return None


def list_documented_names(name: str) -> list[str]:
    """Return the full names under which a name may be documented in the reference."""
    names = [f"{package}.{name}" for package in ("robocov", "robocov_app.learning")]
    for others in OTHER_NAMES.values():
        names += [other for other in others if other.rpartition(".")[2] == name]
    if name in rc.__all__ and not callable(getattr(rc, name)):
        names.append(f"{find_documenting_module(name)}.{name}")
    return names


# Commands and keys


def build_commands_page() -> str:
    """Build the page with the help of every command."""
    text = (
        "# Help of every command\n\n`robocov COMMAND -h` prints these texts. "
        "[Commands](../commands.md) lists commands by task.\n"
    )
    for name, command in COMMANDS.items():
        output = io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.suppress(SystemExit):
            main([name, "-h"])
        text += f"\n## robocov {name}\n\n{capitalize(command.summary)}.\n\n"
        # Without a terminal, lines of hyphens stand for the boxes around groups of options.
        help_text = re.sub(r"^ *-{20,} *\n| +$", "", output.getvalue(), flags=re.M)
        text += f"```text\n{help_text.strip()}\n```\n"
    return text


def build_keys_page() -> str:
    """Build the page with the keys of the window and of the editor, from their tables of commands."""
    text = (
        "# Keys\n\nThe keys of [the window](../window.md) and of [the editor](../draw-a-map.md). F1 shows "
        "them there. Ctrl+K finds every command by its title or name, also those without a key. If a command "
        "needs a value, type it after the name: `robots 12`.\n"
    )
    with TemporaryDirectory() as folder:
        session = Session(SessionScenario(load_map("square")))
        viewer_launcher = ViewerLauncher(session, "square", Path(folder), headless=True)
        with viewer_launcher.window() as viewer:
            text += "\n## The window\n" + build_key_tables(viewer.groups, viewer.commands.commands)
        editor_launcher = EditorLauncher(None, Path(folder), headless=True)
        with editor_launcher.window() as editor:
            text += "\n## The editor\n" + build_key_tables(editor.groups, editor.commands.commands)
    return text


def build_key_tables(groups: Sequence[str], commands: Sequence[Command]) -> str:
    """Build a table of keys for each group of commands, without hidden commands."""
    text = ""
    for group in groups:
        listed = [command for command in commands if command.group == group and not command.hidden]
        rows = [(format_keys(command), escape_cell(command.title)) for command in listed]
        text += f"\n### {group}\n\n" + build_table(("key", "command"), rows)
    return text


def format_keys(command: Command) -> str:
    """Format the keys of a command; commands without keys are started with Ctrl+K."""
    if command.argument is not None:
        return f"Ctrl+K `{command.name}` *{command.argument.description}*"
    if not command.keys:
        return "Ctrl+K"
    keys = [format_key(name) for name in command.keys]
    # There are two keys named Enter, which are listed once.
    return escape_cell(" or ".join(dict.fromkeys(keys))).replace("`", "\\`")


# Controllers, files and metrics


def build_gains_page() -> str:
    """Build the page with a table of gains for every controller."""
    text = (
        "# Controllers and their gains\n\n`--set GAIN=VALUE` sets a gain in every command, "
        "`rc.Rapf(k_rep=1.0)` in Python. [Controllers](../controllers.md) gives the source of each "
        "controller, and explains the information that robots use: their *own*, *shared maps*, or the "
        "*whole map*. Equation numbers refer to [the paper](../rapf.md).\n"
    )
    for name, controller in list_controller_classes().items():
        summary = capitalize(controller.summary.rstrip("."))
        text += f"\n## {name}\n\n{summary}. Information that it uses: {get_information(controller)}.\n"
        rows = [
            (
                f"`{gain.name}`",
                escape_cell(gain.meaning),
                format_value(gain.default, none="null"),
                gain.unit,
                format_range(gain),
            )
            for gain in get_gains(controller).values()
        ]
        if rows:
            text += "\n" + build_table(("gain", "meaning", "default", "unit", "range"), rows)
    return text


def format_range(gain: Gain | Option) -> str:
    """Format the values that a gain may have."""
    if isinstance(gain, Option):
        return ", ".join(gain.choices)
    text = f"{format_limit(gain.low)} to {format_limit(gain.high)}"
    return f"{text}, or null" if gain.optional else text


def format_limit(value: float) -> str:
    """Format the end of a range, with exponents as in 1e6 and 1e-6."""
    return f"{value:g}".replace("e+0", "e").replace("e-0", "e-")


def build_formats_page() -> str:
    """Build the page with the fields of map and session files, and the keys of study files."""
    text = (
        "# File formats\n\nMaps and sessions are JSON files, studies are TOML files; "
        "[the folder of a run](../results.md) has a page of its own. `robocov schema map` and "
        "`robocov schema session` print the schemas.\n"
    )
    map_schema = build_map_schema()
    text += "\n## Maps\n\n[Draw a map](../draw-a-map.md) and [maps](../maps.md) have examples.\n"
    text += build_schema_tables("map", map_schema)
    text += "\n## Sessions\n\n[The window](../window.md#save) saves sessions. "
    text += "[A lesson](../lesson.md) is one, too. Obstacles, densities and paths are as in [maps](#maps).\n"
    text += build_schema_tables("session", build_session_schema(), described=map_schema["$defs"])
    text += (
        "\n## Studies\n\n[A sweep](../sweeps.md) reads these keys. A list means that each value is tried. "
    )
    text += f'"{NO_LIMIT}" means no limit. '
    text += "More about [groups of robots](../teams.md#robots-with-different-properties), "
    text += "[conditions](../teams.md#message-loss-and-noise) and [metrics](metrics.md).\n\n"
    rows = [
        (f"`{key.name}`", escape_cell(key.meaning), escape_cell(key.expected)) for key in list_study_keys()
    ]
    return text + build_table(("key", "meaning", "value"), rows)


def describe_robot_property(name: str) -> str:
    """Return the meaning of a property of all robots, with its unit."""
    label = name.replace("max_", "maximum_").replace("_", " ").capitalize()
    return f"{label} of the robots, {UNITS[name]}"


def build_schema_tables(title: str, schema: Mapping[str, Any], described: Container[str] = ()) -> str:
    """Build a table of fields for each type of a JSON schema, except for types that are described already."""
    text = ""
    definitions = schema.get("$defs", {})
    types = {str(schema.get("title", title)): schema, **definitions}
    linked = {name for name, definition in definitions.items() if definition.get("properties")}
    for name, definition in types.items():
        if not definition.get("properties") or name in described:
            continue
        required = definition.get("required", [])
        rows = []
        for field, field_schema in definition["properties"].items():
            default = "required"
            if field not in required:
                default = format_default(field_schema)
            meaning = field_schema.get("description", "")
            if name == RobotProperties.__name__ and field in UNITS:
                meaning = f"{describe_robot_property(field)}; null for no limit"
            field_type = link_types(escape_cell(format_type(field_schema)), linked)
            rows.append((f"`{field}`", escape_cell(meaning), field_type, default))
        text += f"\n### {name}\n\n{escape_text(definition.get('description', ''))}\n\n"
        text += build_table(("field", "meaning", "type", "default"), rows)
    return text


def format_default(schema: Mapping[str, Any]) -> str:
    """Format the default of an optional value in a JSON schema."""
    if "default" not in schema:
        return "optional"
    if "minimum" in schema and schema["default"] < schema["minimum"]:
        # A placeholder until the value is known; files always contain the value.
        return "required"
    return f"`{escape_cell(json.dumps(schema['default']))}`"


def format_type(schema: Mapping[str, Any]) -> str:
    """Format the type of a value in a JSON schema."""
    if "$ref" in schema:
        return str(schema["$ref"].rpartition("/")[2])
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(format_type(alternative) for alternative in schema[key])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if schema.get("type") == "array" and "prefixItems" in schema:
        return f"[{', '.join(format_type(item) for item in schema['prefixItems'])}]"
    if schema.get("type") == "array" and isinstance(schema.get("items"), dict):
        return f"list of {format_plural(format_type(schema['items']))}"
    return str(schema.get("type", "anything"))


def format_plural(name: str) -> str:
    """Format the plural of a type; the names of types with a table of their own do not change."""
    if name.startswith("list of "):
        return name.replace("list", "lists", 1)
    return f"{name}s" if name in ("number", "integer", "string", "object") else name


def link_types(text: str, names: Iterable[str]) -> str:
    """Link the names of types in a text to their tables on the same page."""
    for name in names:
        text = re.sub(rf"\b{name}\b", f"[{name}](#{name.lower()})", text)
    return text


def build_metrics_page() -> str:
    """Build the page with the columns of ``metrics.csv`` and of the table of a sweep."""
    text = "# Metrics\n\n## During a run\n\nThe columns of `metrics.csv`, which `robocov metrics` writes; in "
    text += "Python the attributes of [RunMetrics](names.rst).\n\n"
    meanings = parse_attributes(inspect.getdoc(rc.RunMetrics) or "")
    rows = [(f"`{column}`", escape_cell(meanings[name]), f"`{name}`") for name, column in COLUMNS.items()]
    text += build_table(("column", "meaning", "attribute"), rows)
    text += "\n## For a whole run\n\nThe columns of a sweep's `results.csv`, after those of the parameters. "
    text += "Most are also in `summary` of each `run.json`.\n\n"
    rows = [(f"`{column.name}`", column.unit, escape_cell(column.meaning)) for column in RESULT_COLUMNS]
    return text + build_table(("column", "unit", "meaning"), rows)


# Python names


def build_names_page() -> str:
    """Build the page that documents every public name of the library."""
    text = build_heading("Python: every public name", "=")
    text += "\nAll public names of ``robocov`` in alphabetical order, after ``import robocov as rc``. "
    text += ":doc:`/names-in-use` shows them by topic; :ref:`the index <genindex>` also lists methods and "
    text += "attributes. Classes for learning are on :doc:`learning`, keys of results on :doc:`metrics`.\n"
    names = sorted(rc.__all__, key=str.lower)
    text += build_letter_index(names)
    text += "\n.. py:currentmodule:: robocov\n"
    for name in names:
        text += "\n" + build_heading(name, "-") + "\n"
        value = getattr(rc, name)
        if callable(value):
            text += build_directive(f"robocov.{name}", value)
        else:
            text += f".. autodata:: {find_documenting_module(name)}.{name}\n   :no-value:\n"
    return text


def build_letter_index(names: Iterable[str]) -> str:
    """Build a line of links to the sections of a page for each first letter of sorted names."""
    text = ""
    for letter, group in itertools.groupby(names, key=lambda name: name[0].upper()):
        links = " · ".join(f"`{name}`_" for name in group)
        text += f"\n| **{letter}** {links}"
    return f"{text}\n"


def build_other_names_page() -> str:
    """Build the page that documents further names, which are not at the top level of the library."""
    text = build_heading("Python: further names", "=")
    text += "\nWhat public functions return and expect, and what the pages of the handbook import.\n"
    text += build_array_types()
    for heading, names in OTHER_NAMES.items():
        text += "\n" + build_heading(heading, "-")
        for name in names:
            module, _, attribute = name.rpartition(".")
            text += "\n" + build_directive(name, getattr(import_module(module), attribute))
    return text


def build_array_types() -> str:
    """Build the section with the types of arrays, which are described by the strings below them."""
    text = "\n" + build_heading("Arrays", "-")
    text += (
        "\nThe types of arrays in signatures. Descriptions of parameters contain the shape and the unit.\n"
    )
    descriptions = ModuleAnalyzer.for_module("robocov.typing").find_attr_docs()
    for name in ARRAY_TYPES:
        description = " ".join(descriptions["", name])
        text += f"\n.. py:type:: robocov.typing.{name}\n\n   {description}\n"
    return text


def build_learning_page() -> str:
    """Build the page that documents the learning environments."""
    text = build_heading("Python: learning environments", "=")
    text += "\nNames of ``robocov_app.learning``, for gymnasium and PettingZoo: "
    text += '``pip install "robocov[rl]"``.\n\n'
    text += ".. py:currentmodule:: robocov_app.learning\n"
    has_packages = all(find_spec(name) for name in ("gymnasium", "pettingzoo"))
    for name in learning.__all__:
        text += "\n" + build_heading(name, "-") + "\n"
        if has_packages or not name.endswith("Env"):
            text += build_directive(f"robocov_app.learning.{name}", getattr(learning, name))
        else:
            text += "Not documented here: this handbook was built without gymnasium and PettingZoo.\n"
    return text


def build_directive(name: str, value: object) -> str:
    """Build the directive that documents a class or a function."""
    if not isinstance(value, type):
        return f".. autofunction:: {name}\n"
    if issubclass(value, Exception):
        return f".. autoclass:: {name}\n"
    return f".. autoclass:: {name}\n   :members:\n"


def build_heading(title: str, underline: str) -> str:
    """Build a heading in reStructuredText."""
    return f"{title}\n{underline * len(title)}\n"


def find_documenting_module(name: str) -> str:
    """Return the module of the library in which a constant is documented by the string below it."""
    for module in sorted(sys.modules):
        is_candidate = module.startswith("robocov.") and hasattr(sys.modules[module], name)
        if is_candidate and ("", name) in ModuleAnalyzer.for_module(module).find_attr_docs():
            return module
    raise LookupError(f"{name}: expected a string below the constant that documents it, got none")


# Markdown


def build_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Build a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def escape_cell(text: str) -> str:
    """Escape a text for a cell of a Markdown table."""
    return escape_text(text).replace("|", "\\|")


def escape_text(text: str) -> str:
    """Join a text to one line, and escape it such that it contains no HTML."""
    return " ".join(text.split()).replace("<", "&lt;")


def capitalize(text: str) -> str:
    """Capitalize the first letter of a text, and leave the rest unchanged."""
    return text[:1].upper() + text[1:]
