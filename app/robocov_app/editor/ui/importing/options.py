"""Options of an import: their kinds, defaults and help texts, and parsing of the typed values."""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import Field, dataclass, fields
from itertools import pairwise
from typing import Any, Literal, TypeAlias, get_args, get_origin, get_type_hints

from robocov.errors import ParameterError, quote
from robocov_app.formats import Importer, ReadOptions, Shaping

OptionKind = Literal["number", "position", "words", "colors", "width", "text", "choice"]
ImportSettings: TypeAlias = type[ReadOptions] | type[Shaping]

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
