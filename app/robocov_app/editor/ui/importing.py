"""Options of an import, and the worker that imports beside the window."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args, get_origin, get_type_hints

from robocov.environment import Environment
from robocov.errors import ParameterError, quote, to_one_line
from robocov_app.editor.ui.import_sheet import Sheet, make_sheet
from robocov_app.formats import (
    ForeignMap,
    Importer,
    ImportReport,
    ReadOptions,
    Shaping,
    build_environment,
    read_map,
)
from robocov_app.formats.geometry.comparison import ImportComparison, compare_maps
from robocov_app.jobs.messages import Line

Kind = Literal["number", "place", "words", "colours", "width", "text", "choice"]
ON = "yes"  # a switch that is on
Wanted: TypeAlias = tuple[Path, str, ReadOptions, Shaping]  # a file, its format, and how to import it


@dataclass(frozen=True)
class Option:
    """An option of an import."""

    name: str  # as of the field of `ReadOptions` or `Shaping`
    kind: Kind  # numbers; words or colours between commas; a width in m or px; any text; or a choice
    choices: tuple[str, ...]  # the first is the default
    default: str  # what stands where nothing was given
    help: str

    def value(self, text: str) -> Any:
        if self.kind == "choice":
            return True if text == ON else text
        if self.kind in ("words", "colours"):
            return tuple(word.strip() for word in text.split(",") if word.strip())
        if self.kind in ("text", "width"):
            return text.strip()
        try:
            numbers = tuple(float(word) for word in text.split())
        except ValueError:
            numbers = ()
        if len(numbers) != (2 if self.kind == "place" else 1):
            wanted = "x and y" if self.kind == "place" else "a number"
            raise ParameterError(f"{self.name}: expected {wanted}, got {quote(text)}")
        return numbers if self.kind == "place" else numbers[0]


def options_of(importer: Importer) -> tuple[Option, ...]:
    reading = [option for option in _options(ReadOptions) if option.name in importer.options]
    return (*reading, *_options(Shaping))


def _options(settings: type[ReadOptions] | type[Shaping]) -> Iterator[Option]:
    hints = get_type_hints(settings)
    docstrings = re.findall(r'^    (\w+): [^\n]*\n    """(.*?)"""', inspect.getsource(settings), re.M | re.S)
    helps = {name: " ".join(words.split()) for name, words in docstrings}
    for field in fields(settings):
        hint = hints[field.name]
        plain = next((each for each in get_args(hint) if each is not type(None)), hint)
        hint = hint if get_origin(hint) in (Literal, tuple) else plain
        name, words = field.name, helps.get(field.name, "")
        default = "" if field.default is None else str(field.default)
        if hint is bool:
            yield Option(name, "choice", ("no", ON), "no", words)
        elif get_origin(hint) is Literal:
            choices = sorted(get_args(hint), key=lambda each: bool(default) and each != default)
            yield Option(name, "choice", tuple(choices), default, words)
        elif get_origin(hint) is tuple:
            kind: Kind = "place"
            if ... in get_args(hint):
                kind = "colours" if name.endswith("_colour") else "words"
            yield Option(name, kind, (), default, words)
        elif name == "min_stroke":
            yield Option(name, "width", (), default, words)
        else:
            yield Option(name, "number" if hint is float else "text", (), default, words)


@dataclass(frozen=True, eq=False)
class Imported:
    """Answer: the imported map, with its report, what walls changed sides, and the file in its colours."""

    environment: Environment
    report: ImportReport
    comparison: ImportComparison
    sheet: Sheet | None = None


class Importing:
    """Importer that keeps the file it read last: shaping it anew takes less."""

    failing = "the map could not be imported"

    def __init__(self) -> None:
        self._read: tuple[tuple[Path, str, ReadOptions], ForeignMap] | None = None
        self._sheet: tuple[tuple[Path, str, ReadOptions], Sheet | None] | None = None

    def __call__(self, questions: list[Wanted], line: Line) -> Imported:
        path, name, options, shaping = questions[-1]
        key = path, name, options
        if self._read is None or self._read[0] != key:
            self._read = None
            self._read = key, read_map(path, format=name, options=options)
        foreign = self._read[1]
        sheet = self._make_sheet(path, name, options, foreign)
        environment, report = build_environment(foreign, shaping, to_one_line(path.name))
        return Imported(environment, report, compare_maps(foreign, environment, report), sheet)

    def _make_sheet(self, path: Path, name: str, options: ReadOptions, foreign: ForeignMap) -> Sheet | None:
        """Return the file in its own colours, those included that its options leave out."""
        plain = replace(
            options,
            free_colour=None,
            solid_colour=None,
            ignore_colour=None,
            colour_tolerance=None,
            min_stroke=None,
        )
        key = path, name, plain
        if self._sheet is None or self._sheet[0] != key:
            source = foreign if plain == options else read_map(path, format=name, options=plain)
            self._sheet = key, make_sheet(source)
        return self._sheet[1]
