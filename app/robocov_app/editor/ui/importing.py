"""Options of an import, and the job that imports in another process."""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import Field, dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias, get_args, get_origin, get_type_hints

from robocov.environment import Environment
from robocov.errors import ParameterError, quote, to_one_line
from robocov_app.editor.ui.import_sheet import ColorSheet, build_color_sheet
from robocov_app.formats import (
    ForeignMap,
    Importer,
    ImportReport,
    ReadOptions,
    Shaping,
    build_environment,
    read_map,
)
from robocov_app.formats.geometry.conversion.comparison import ImportComparison, compare_maps
from robocov_app.jobs.messages import Channel

OptionKind = Literal["number", "position", "words", "colors", "width", "text", "choice"]
ImportSettings: TypeAlias = type[ReadOptions] | type[Shaping]
ImportRequest: TypeAlias = tuple[Path, str, ReadOptions, Shaping]
"""A file, its format, and how it is to be read and shaped."""

ON = "yes"  # value of a switch that is on
OFF = "no"


@dataclass(frozen=True)
class ImportOption:
    """An option of an import.

    Attributes
    ----------
    name : str
        Name of the field of `ReadOptions` or `Shaping`.
    kind : str
        A number; a position; words or colors between commas; a width in m or px; a text; or a choice.
    choices : tuple of str
        Possible values of a choice, the default first.
    default : str
        Text that is shown where nothing was typed.
    help : str
        Its effect.
    """

    name: str
    kind: OptionKind
    choices: tuple[str, ...]
    default: str
    help: str

    def parse(self, text: str) -> Any:
        """Return the value of a typed or chosen text; raise ParameterError if it means nothing."""
        if self.kind == "choice":
            if text == ON:
                return True
            return text
        if self.kind in ("words", "colors"):
            return tuple(word.strip() for word in text.split(",") if word.strip())
        if self.kind in ("text", "width"):
            return text.strip()
        numbers = _parse_numbers(text)
        if self.kind == "position":
            if len(numbers) != 2:
                raise ParameterError(f"{self.name}: expected x and y, got {quote(text)}")
            return numbers
        if len(numbers) != 1:
            raise ParameterError(f"{self.name}: expected a number, got {quote(text)}")
        return numbers[0]


def _parse_numbers(text: str) -> tuple[float, ...]:
    """Return the numbers between blanks; none if any word is not a number."""
    try:
        return tuple(float(word) for word in text.split())
    except ValueError:
        return ()


def list_options(importer: Importer) -> tuple[ImportOption, ...]:
    """Return the options of an importer, those of reading first."""
    reading = [option for option in _list_fields(ReadOptions) if option.name in importer.options]
    return (*reading, *_list_fields(Shaping))


def _list_fields(settings: ImportSettings) -> Iterator[ImportOption]:
    hints = get_type_hints(settings)
    docstrings = _read_field_docstrings(settings)
    for field in fields(settings):
        text = " ".join(docstrings.get(field.name, "").split())
        yield _build_option(field, hints[field.name], text)


def _read_field_docstrings(settings: ImportSettings) -> dict[str, str]:
    """Return the texts below the fields of a dataclass in its source, by the names of the fields."""
    texts: dict[str, str] = {}
    (definition,) = ast.parse(inspect.getsource(settings)).body
    assert isinstance(definition, ast.ClassDef)
    for statement, following in pairwise(definition.body):
        if not isinstance(statement, ast.AnnAssign) or not isinstance(statement.target, ast.Name):
            continue
        if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
            texts[statement.target.id] = str(following.value.value)
    return texts


def _build_option(field: Field[Any], hint: Any, help_text: str) -> ImportOption:
    """Return the option for a field, by the type of its values."""
    name = field.name
    default = ""
    if field.default is not None:
        default = str(field.default)
    if get_origin(hint) not in (Literal, tuple):
        # An optional type becomes the type that is not None.
        members = [member for member in get_args(hint) if member is not type(None)]
        hint = next(iter(members), hint)
    if hint is bool:
        return ImportOption(name, "choice", (OFF, ON), OFF, help_text)
    if get_origin(hint) is Literal:
        choices = tuple(sorted(get_args(hint), key=lambda choice: bool(default) and choice != default))
        return ImportOption(name, "choice", choices, default, help_text)
    return ImportOption(name, _choose_kind(name, hint), (), default, help_text)


def _choose_kind(name: str, hint: Any) -> OptionKind:
    if get_origin(hint) is tuple:
        if ... not in get_args(hint):
            return "position"
        if name.endswith("_color"):
            return "colors"
        return "words"
    if name == "min_stroke":
        return "width"
    if hint is float:
        return "number"
    return "text"


@dataclass(frozen=True, eq=False)
class Imported:
    """An imported map.

    Attributes
    ----------
    environment : Environment
        The map.
    report : ImportReport
        Objects that were read, changed and left out.
    comparison : ImportComparison
        The free space before and after.
    sheet : ColorSheet or None
        The file in its own colors.
    """

    environment: Environment
    report: ImportReport
    comparison: ImportComparison
    sheet: ColorSheet | None = None


class _ReadKey(NamedTuple):
    """Everything on which reading a file depends."""

    path: Path
    format: str
    options: ReadOptions


class ImportJob:
    """Imports maps; keeps the latest file, because shaping it again takes less time than reading it."""

    failure_message = "the map could not be imported"

    def __init__(self) -> None:
        self._read: tuple[_ReadKey, ForeignMap] | None = None
        self._sheet: tuple[_ReadKey, ColorSheet | None] | None = None

    def __call__(self, questions: list[ImportRequest], channel: Channel) -> Imported:
        """Import the newest request."""
        path, format_name, options, shaping = questions[-1]
        key = _ReadKey(path, format_name, options)
        foreign = self._read_map(key)
        sheet = self._build_sheet(key, foreign)
        environment, report = build_environment(foreign, shaping, to_one_line(path.name))
        return Imported(environment, report, compare_maps(foreign, environment, report), sheet)

    def _read_map(self, key: _ReadKey) -> ForeignMap:
        if self._read is None or self._read[0] != key:
            # Frees the memory of the previous file first.
            self._read = None
            self._read = (key, read_map(key.path, format=key.format, options=key.options))
        return self._read[1]

    def _build_sheet(self, key: _ReadKey, foreign: ForeignMap) -> ColorSheet | None:
        """Return the file in its own colors, including those that its options leave out."""
        options = replace(
            key.options,
            free_color=None,
            solid_color=None,
            ignore_color=None,
            color_tolerance=None,
            min_stroke=None,
        )
        plain_key = key._replace(options=options)
        if self._sheet is None or self._sheet[0] != plain_key:
            source = foreign
            if plain_key != key:
                source = read_map(key.path, format=key.format, options=options)
            self._sheet = (plain_key, build_color_sheet(source))
        return self._sheet[1]
