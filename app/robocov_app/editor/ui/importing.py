"""An import that is being decided about: its options, and what would come of them. Knows no pygame."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, one_line, shown
from robocov_app.importers import ForeignMap, ImportReport, ReadOptions, Shaping, read_map, shaped
from robocov_app.importers.comparison import Comparison, compare
from robocov_app.toolkit.worker import Line, Worker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from robocov_app.importers import Importer

Kind = Literal["number", "place", "words", "text", "choice"]

ON = "yes"
"""A switch that is on."""


@dataclass(frozen=True)
class Option:
    """An option of an import.

    Attributes
    ----------
    name : str
        As of the field of `ReadOptions` or `Shaping`.
    kind : str
        What is typed: a number, two for a place, words between commas, any text; or one of the choices.
    choices : tuple of str
        The first is the default.
    default : str
        What stands where nothing was given.
    help : str
    """

    name: str
    kind: Kind
    choices: tuple[str, ...]
    default: str
    help: str

    def value(self, text: str) -> Any:
        """Return what a text means."""
        if self.kind == "choice":
            return True if text == ON else text
        if self.kind == "words":
            return tuple(word.strip() for word in text.split(",") if word.strip())
        if self.kind == "text":
            return text.strip()
        try:
            numbers = tuple(float(word) for word in text.split())
        except ValueError:
            numbers = ()
        if len(numbers) != (2 if self.kind == "place" else 1):
            wanted = "x and y" if self.kind == "place" else "a number"
            raise ParameterError(f"{self.name}: {shown(text)}, but {wanted} was wanted")
        return numbers if self.kind == "place" else numbers[0]


def options_of(importer: Importer) -> tuple[Option, ...]:
    """Return the options that mean something for a format, those of reading first."""
    return tuple(
        option
        for settings in (ReadOptions, Shaping)
        for option in _options(settings)
        if settings is Shaping or option.name in importer.options
    )


def _options(settings: type[ReadOptions] | type[Shaping]) -> Iterator[Option]:
    hints, helps = get_type_hints(settings), _helps(settings)
    for field in fields(settings):
        hint = hints[field.name]
        plain = next((each for each in get_args(hint) if each is not type(None)), hint)
        hint = hint if get_origin(hint) in (Literal, tuple) else plain
        default = "" if field.default is None else str(field.default)
        kind: Kind = "number" if hint is float else "text"
        choices: tuple[str, ...] = ()
        if hint is bool:
            kind, choices, default = "choice", ("no", ON), "no"
        elif get_origin(hint) is Literal:
            kind, choices = "choice", get_args(hint)
            if default:
                choices = tuple(sorted(choices, key=lambda each: each != default))
        elif get_origin(hint) is tuple:
            kind = "words" if ... in get_args(hint) else "place"
        yield Option(field.name, kind, choices, default, helps.get(field.name, ""))


def _helps(settings: type) -> dict[str, str]:
    """Return what the docstring of a class says of its attributes, a line each."""
    entries = re.findall(r"^(\w+(?:, \w+)*) : .*\n((?:    .+\n?)+)", inspect.getdoc(settings) or "", re.M)
    return {
        name: " ".join(words.replace("`", "").replace("None:", "By default").split())
        for names, words in entries
        for name in names.split(", ")
    }


@dataclass(frozen=True, eq=False)
class Wanted:
    """Request: a file and the options to import it with."""

    path: Path
    format: str
    options: ReadOptions
    shaping: Shaping


@dataclass(frozen=True, eq=False)
class Imported:
    """Answer: the imported map, with its report and what walls changed sides."""

    environment: Environment
    report: ImportReport
    comparison: Comparison


class Importing:
    """Importer that keeps the file it read last: shaping it anew takes less."""

    failing = "the map could not be imported"

    def __init__(self) -> None:
        self._read: tuple[tuple[Path, str, ReadOptions], ForeignMap] | None = None

    def __call__(self, questions: list[Wanted], line: Line) -> Imported:
        """Import what was wanted last."""
        last = questions[-1]
        key = last.path, last.format, last.options
        if self._read is None or self._read[0] != key:
            self._read = None
            self._read = key, read_map(last.path, format=last.format, options=last.options)
        foreign = self._read[1]
        environment, report = shaped(foreign, last.shaping, one_line(last.path.name))
        return Imported(environment, report, compare(foreign, environment, report))


class ImportQuestion:
    """Model of the import dialogue: the options of a file's format, and a live preview of the result.

    Attributes
    ----------
    options : tuple of Option
    given : dict of str to str
        What was typed or chosen, by the names of options.
    chosen : int
        The option that takes letters.
    imported : Imported or None
        Of the newest settings that could be imported.
    accepted : bool
        Whether it is wanted as it is set, as soon as it is there.
    """

    def __init__(
        self, path: Path, importer: Importer, worker: Worker[Imported], call: Callable[[Imported], object]
    ) -> None:
        self.path, self.importer, self.call = path, importer, call
        self.options = options_of(importer)
        self.given: dict[str, str] = {}
        self.chosen = 0
        self.imported: Imported | None = None
        self.accepted = False
        self._worker = worker
        self._mistake = ""
        self._ask()

    # what is set

    @property
    def option(self) -> Option:
        """The option that is chosen."""
        return self.options[self.chosen]

    def text(self, option: Option) -> str:
        """Return what stands in an option's row."""
        return self.given.get(option.name, option.default)

    def move(self, by: int) -> None:
        """Choose another option."""
        self.chosen = (self.chosen + by) % len(self.options)

    def turn(self, by: int) -> None:
        """Take the next of the choices; where there is no default, none is one of them."""
        choices = self.option.choices
        if choices:
            choices = choices if self.option.default else ("", *choices)
            place = choices.index(self.text(self.option)) + by
            self._set(self.option, choices[place % len(choices)])

    def type(self, letters: str) -> None:
        """Take letters; a space takes the next of the choices."""
        letters = "".join(char for char in letters if char.isprintable())
        if not self.option.choices:
            self._set(self.option, (self.given.get(self.option.name, "") + letters)[:200])
        elif letters == " ":
            self.turn(1)

    def erase(self, *, all_of_it: bool = False) -> None:
        """Take the last letter back, or all."""
        before = self.given.get(self.option.name, "")
        self._set(self.option, "" if all_of_it or self.option.choices else before[:-1])

    def keep_inside(self, place: tuple[float, float]) -> None:
        """Keep the part of the free space that holds a place, m."""
        self.given.pop("keep", None)
        self._set(
            next(option for option in self.options if option.name == "inside"),
            f"{place[0]:.10g} {place[1]:.10g}",
        )

    def _set(self, option: Option, text: str) -> None:
        if not text or text == option.default:
            self.given.pop(option.name, None)
        else:
            self.given[option.name] = text
        self._ask()

    def settings(self) -> tuple[ReadOptions, Shaping]:
        """Return what is set."""
        values = {
            option.name: option.value(self.given[option.name])
            for option in self.options
            if option.name in self.given
        }
        of_reading = {field.name for field in fields(ReadOptions)}
        read = {name: value for name, value in values.items() if name in of_reading}
        shape = {name: value for name, value in values.items() if name not in of_reading}
        return ReadOptions(**read), Shaping(**shape)

    # what comes of it

    def _ask(self) -> None:
        self.accepted = False
        try:
            options, shaping = self.settings()
        except RobocovError as error:
            self._mistake = str(error)
        else:
            self._mistake = ""
            self._worker.put(Wanted(self.path, self.importer.name, options, shaping))

    def poll(self) -> Imported | None:
        """Take what was imported, if it is there; return it if it is accepted."""
        answer = self._worker.poll()
        if answer is not None and not self._worker.busy:
            self.imported = answer
        if self.trouble:
            self.accepted = False
        return self.imported if self.accepted and self.ready else None

    @property
    def busy(self) -> bool:
        """Whether it is being imported."""
        return not self._mistake and self._worker.busy

    @property
    def trouble(self) -> str:
        """Why it cannot be imported as it is set."""
        return self._mistake or ("" if self._worker.busy else self._worker.trouble)

    @property
    def ready(self) -> bool:
        """Whether what was imported is what is set."""
        return self.imported is not None and not self.busy and not self.trouble

    def close(self) -> None:
        """End what works on it."""
        self._worker.close()
