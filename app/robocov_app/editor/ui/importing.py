"""Options of an import, and the service that imports maps in a separate process."""

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
"""File, name of its format, and settings for reading and shaping."""

ON = "yes"  # value of a switch that is on
OFF = "no"
_KINDS_BY_METAVAR: dict[str, OptionKind] = {"X Y": "position", "COLOR ...": "colors", "NAME ...": "words"}
_STROKE_WIDTH_OPTION = "min_stroke"


@dataclass(frozen=True)
class ImportOption:
    """An option of an import.

    Attributes
    ----------
    name : str
        Name of the field of `ReadOptions` or `Shaping`.
    kind : str
        Kind of the value: a number, a position, words or colors separated by commas, a width in m or px, any
        text, or a choice.
    choices : tuple of str
        Possible values of a choice, the default first.
    default : str
        Text that is shown while the option has its default value.
    help : str
        Help text that describes the effect of the option.
    """

    name: str
    kind: OptionKind
    choices: tuple[str, ...]
    default: str
    help: str

    def parse(self, text: str) -> Any:
        """Parse text that the user typed or chose; raise ParameterError if it is invalid."""
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
    """Parse numbers separated by blanks; return an empty tuple if any of them is invalid."""
    try:
        return tuple(float(word) for word in text.split())
    except ValueError:
        return ()


def list_options(importer: Importer) -> tuple[ImportOption, ...]:
    """Return the options of an importer: those for reading first, then those for shaping."""
    reading = [option for option in _list_fields(ReadOptions) if option.name in importer.options]
    return (*reading, *_list_fields(Shaping))


def _list_fields(settings: ImportSettings) -> Iterator[ImportOption]:
    hints = get_type_hints(settings)
    docstrings = _read_field_docstrings(settings)
    for field in fields(settings):
        text = " ".join(docstrings.get(field.name, "").split())
        yield _build_option(field, hints[field.name], text)


def _read_field_docstrings(settings: ImportSettings) -> dict[str, str]:
    """Return the docstrings of the fields of a dataclass, by field name, from its source code."""
    texts: dict[str, str] = {}
    (definition,) = ast.parse(inspect.getsource(settings)).body
    assert isinstance(definition, ast.ClassDef)
    for field, docstring in pairwise(definition.body):
        if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
            continue
        if isinstance(docstring, ast.Expr) and isinstance(docstring.value, ast.Constant):
            texts[field.target.id] = str(docstring.value.value)
    return texts


def _build_option(field: Field[Any], hint: Any, help_text: str) -> ImportOption:
    """Build the option for a field of a dataclass, with a kind that follows from the type of the field."""
    name = field.name
    default = ""
    if field.default is not None:
        default = str(field.default)
    if get_origin(hint) not in (Literal, tuple):
        # Optional types: use the type other than None.
        members = [member for member in get_args(hint) if member is not type(None)]
        hint = next(iter(members), hint)
    if hint is bool:
        return ImportOption(name, "choice", (OFF, ON), OFF, help_text)
    if get_origin(hint) is Literal:
        # False sorts before True, so the default comes first.
        choices = tuple(sorted(get_args(hint), key=lambda choice: bool(default) and choice != default))
        return ImportOption(name, "choice", choices, default, help_text)
    return ImportOption(name, _choose_kind(field, hint), (), default, help_text)


def _choose_kind(field: Field[Any], hint: Any) -> OptionKind:
    """Return the kind of an option that is not a choice, by its metavar on the command line and its type."""
    if get_origin(hint) is tuple:
        return _KINDS_BY_METAVAR[field.metadata["metavar"]]
    if field.name == _STROKE_WIDTH_OPTION:
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
        Items that were read, changed and left out.
    comparison : ImportComparison
        The free space before and after the import.
    sheet : ColorSheet or None
        The file in its own colors; None if it has none.
    """

    environment: Environment
    report: ImportReport
    comparison: ImportComparison
    sheet: ColorSheet | None = None


class _ReadKey(NamedTuple):
    """Everything that determines the result of reading a file."""

    path: Path
    format: str
    options: ReadOptions


class ImportService:
    """Service that imports maps. The latest file is cached, because shaping is faster than reading."""

    failure_message = "the map could not be imported"

    def __init__(self) -> None:
        self._read: tuple[_ReadKey, ForeignMap] | None = None
        self._sheet: tuple[_ReadKey, ColorSheet | None] | None = None

    def __call__(self, questions: list[ImportRequest], channel: Channel) -> Imported:
        """Import the file of the newest request."""
        newest = questions[-1]
        path, format_name, options, shaping = newest
        key = _ReadKey(path, format_name, options)
        foreign = self._read_map(key)
        sheet = self._build_sheet(key, foreign)
        environment, report = build_environment(foreign, shaping, to_one_line(path.name))
        return Imported(environment, report, compare_maps(foreign, environment, report), sheet)

    def _read_map(self, key: _ReadKey) -> ForeignMap:
        if self._read is None or self._read[0] != key:
            # Free the memory of the previous file first.
            self._read = None
            self._read = (key, read_map(key.path, format=key.format, options=key.options))
        return self._read[1]

    def _build_sheet(self, key: _ReadKey, foreign: ForeignMap) -> ColorSheet | None:
        """Return the file in its own colors, including shapes that the options leave out; cached."""
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
