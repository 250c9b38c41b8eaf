"""The errors that robocov raises, and helpers for their messages.

    RobocovError
    ├── InputError            an input cannot be used (exit status 2)
    │   ├── MapError          a map file, with line, column and JSON path of the first issue
    │   ├── StartError        a start without space for the team
    │   └── ParameterError    a gain, a limit, the name of a controller
    │       └── NoLayoutError no random map meets the requirements
    ├── ControllerEndedError  a user's controller tried to end Python (exit status 1)
    └── OutputError           a result cannot be written (exit status 2)

Every message is one line that names the source (a file or an argument), the location in it, the expected
value and the actual value.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from decimal import Decimal
from difflib import get_close_matches
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeGuard

from robocov.text import escape_controls

if TYPE_CHECKING:
    from robocov.typing import FloatArray

MAX_SEED = 2**63 - 1
"""Maximum seed of a run, which fits in a signed integer of 64 bits."""
JsonPath: TypeAlias = tuple[str | int, ...]
"""Keys and indices that lead to a value, from the outermost object inwards."""
_MIN_WHOLE_AREA_M2 = 1000.0
"""Areas from this one on are written without decimals."""
_MAX_QUOTED_CHARACTERS = 60
"""Longer values and names are cut in messages."""
_MAX_LISTED_NAMES = 3
"""Maximum number of names in a summary; further ones are only counted."""
_MIN_SIMILARITY = 0.5
"""Minimum similarity, as measured by `difflib`, of a known name that is suggested."""
_MAX_SUGGESTIONS = 3
"""Maximum number of known names that are suggested."""


class RobocovError(Exception):
    """Base class of all errors that robocov raises.

    See Also
    --------
    InputError : An input cannot be used.
    OutputError : A result cannot be written.

    Examples
    --------
    >>> import robocov as rc
    >>> try:
    ...     rc.Rapf(k_rep=-1.0)
    ... except rc.RobocovError as error:
    ...     print(error)
    rapf.k_rep: expected a number from 0 to 1000000 N m³, got -1.0
    """


class InputError(RobocovError):
    """An input cannot be used.

    See Also
    --------
    MapError : A map cannot be used.
    StartError : A start has no space for the team.
    ParameterError : A parameter is out of range or unknown.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.read_results("no-such-folder")
    Traceback (most recent call last):
    robocov.errors.InputError: no-such-folder: expected the folder of a sweep, got a path that does not exist
    """


class Issue(NamedTuple):
    """An issue in a JSON document.

    Attributes
    ----------
    path : tuple of str and int
        Path of the value that is wrong or missing.
    text : str
        The position in the document, the expected value and the actual value.
    at_key : bool
        Whether the last key of the path is wrong, rather than its value.
    line, column : int or None
        Position of the issue in the file, in lines and characters from 1; None if there is no file.

    See Also
    --------
    MapError : The error that contains the issues of a map.
    """

    path: JsonPath
    text: str
    at_key: bool = False
    line: int | None = None
    column: int | None = None

    @classmethod
    def at_path(cls, path: JsonPath, message: str, *, at_key: bool = False) -> Issue:
        """Build an issue whose text begins with its path.

        Parameters
        ----------
        path : tuple of str and int
            Path of the value that is wrong or missing.
        message : str
            Description of the issue.
        at_key : bool
            Whether the last key of the path is wrong, rather than its value.

        Returns
        -------
        Issue
        """
        text = f"{format_path(path)}: {message}" if path else message
        return cls(path, text, at_key)

    def format_message(self, source_name: str) -> str:
        """Format the issue as compilers do, ``mine.json:14:9: ...``, so that terminals link to the line.

        Parameters
        ----------
        source_name : str
            Name of the document.

        Returns
        -------
        str
        """
        if self.line is None:
            return f"{source_name}: {self.text}"
        return f"{source_name}:{self.line}:{self.column}: {self.text}"


class MapError(InputError):
    """A map or another document cannot be used.

    Attributes
    ----------
    issues : tuple of Issue
        At most `MAX_LISTED`, in the order of the document.
    unlisted : int
        Number of further issues.
    source_name : str
        Name of the document.
    line, column : int or None
        Position of the first issue, as in `Issue`.

    See Also
    --------
    load_map : Raises this error.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import robocov as rc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "hall.json"
    ...     _ = file.write_text('{"format": "robocov-map", "version": 1, "name": 7}')
    ...     try:
    ...         rc.load_map(file)
    ...     except rc.MapError as error:
    ...         print(error.line, error.issues[0].path)
    1 ('name',)
    """

    MAX_LISTED = 20  # Finding the line of an issue takes as long as reading the file.
    issues: tuple[Issue, ...] = ()
    unlisted: int = 0
    source_name: str = ""
    line: int | None = None
    column: int | None = None

    @classmethod
    def from_issues(cls, source_name: str, issues: Sequence[Issue], unlisted: int = 0) -> MapError:
        """Build the error for the issues of a document.

        Parameters
        ----------
        source_name : str
            Name of the document.
        issues : sequence of Issue
            At least one.
        unlisted : int
            Number of additional issues that are not in `issues`.

        Returns
        -------
        MapError
        """
        first = issues[0]
        message = first.format_message(source_name)
        total_count = len(issues) + unlisted
        if total_count > 1:
            message += f" (and {format_count(total_count - 1, 'more issue')})"
        error = cls(message)
        error.issues = tuple(issues[: cls.MAX_LISTED])
        error.unlisted = total_count - len(error.issues)
        error.source_name = source_name
        error.line = first.line
        error.column = first.column
        return error


class StartError(InputError):
    """A start has no space for the team, or lies inside an obstacle.

    See Also
    --------
    Environment.start : Raises this error if there is no such start.

    Examples
    --------
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    >>> try:
    ...     room.start().sample(50)
    ... except rc.StartError as error:
    ...     print(str(error).split(",")[0])
    start 'uniform': space for about 20 robots of radius 0.1 m
    """


class ParameterError(InputError):
    """A gain, a limit of the team, or a name is out of range or unknown.

    See Also
    --------
    InputError : Base class of the errors of unusable inputs.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.Team.homogeneous(3, max_speed=-1.0)
    Traceback (most recent call last):
    robocov.errors.ParameterError: team.max_speed: expected a number from 0.000001 to 1000, got -1.0 m/s
    """


class NoLayoutError(ParameterError):
    """No layout of a random map meets the requirements; another seed may have one."""


class ControllerEndedError(RobocovError):
    """A user's controller terminated Python, tried to do so, or closed its output."""


class OutputError(RobocovError):
    """A result cannot be written: no permission, no space, or the folder is in use.

    See Also
    --------
    RobocovError : Base class of all errors.

    Examples
    --------
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    >>> rc.save_map(room, "no-such-folder/room.json")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    robocov.errors.OutputError: no-such-folder/room.json: cannot be written: No such file or directory
    """


def quote(value: object) -> str:
    """Format a value for a message: its `repr` on one line, cut if it is long.

    Parameters
    ----------
    value : object
        The value to show; a failing `repr` is replaced by the name of its type.

    Returns
    -------
    str

    Examples
    --------
    >>> quote("rapf"), quote([1, 2])
    ("'rapf'", '[1, 2]')
    """
    try:
        text = repr(value)
    except Exception:  # The `__repr__` of a user's class may fail.
        text = f"<{type(value).__name__}>"
    # The `repr` of a string is on one line already, and its spaces belong to the value.
    return _shorten(text if type(value) is str else " ".join(text.split()))


def quote_json(value: object) -> str:
    """Format a value as JSON for a message, cut if it is long.

    Parameters
    ----------
    value : object
        The value to show. Parts that JSON cannot represent are formatted by `quote`. If a key cannot be
        represented, or the value contains itself, the whole value is formatted by `quote`.

    Returns
    -------
    str

    Examples
    --------
    >>> quote_json({"radius": None})
    '{"radius": null}'
    """
    try:
        return _shorten(_format_json(value))
    except (TypeError, ValueError, RecursionError):
        return quote(value)


def to_one_line(text: object) -> str:
    """Return a string as one line, with escapes for line breaks and other control characters.

    Parameters
    ----------
    text : object
        Converted by `str`.

    Returns
    -------
    str
    """
    return escape_controls(str(text), single_line=True)


def describe_error(error: Exception) -> str:
    """Return the message of an error on one line, without the file name that Python adds to an `OSError`.

    Parameters
    ----------
    error : Exception

    Returns
    -------
    str

    Examples
    --------
    >>> describe_error(FileNotFoundError(2, "No such file or directory", "map.json"))
    'No such file or directory'
    """
    if isinstance(error, OSError) and error.strerror:
        return to_one_line(error.strerror)
    return to_one_line(error)


def format_path(path: Sequence[str | int]) -> str:
    """Format the path of a value in a JSON document; very long keys are cut.

    Parameters
    ----------
    path : sequence of str and int

    Returns
    -------
    str

    Examples
    --------
    >>> format_path(("obstacles", 2, "the lobby", "radius"))
    'obstacles[2]["the lobby"].radius'
    """
    text = ""
    for step in path:
        name = step if isinstance(step, int) else _shorten(step)
        if isinstance(name, str) and _is_plain_key(name):
            text += f".{name}" if text else name
        else:
            text += f"[{_format_json(name)}]"
    return text


def _is_plain_key(name: str) -> bool:
    """Return whether a key needs no quotes in a path."""
    return name.replace("-", "_").replace("$", "_").isidentifier()


def _format_json(value: object) -> str:
    """Format a value as JSON on one line, with escapes only for characters that are not printable."""
    text = json.dumps(value, default=quote, ensure_ascii=False)
    if text.isprintable():
        return text
    return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in text)


def is_number(value: object, kind: type = Real) -> TypeGuard[Any]:
    """Return whether a value is a number of a given kind. NumPy scalars are numbers, a `bool` is not.

    Parameters
    ----------
    value : object
        The value to test.
    kind : type
        Kind of number, such as `numbers.Integral`.

    Returns
    -------
    bool

    Examples
    --------
    >>> is_number(2.5), is_number(2.5, Integral), is_number(True)
    (True, False, False)
    """
    return isinstance(value, kind) and not isinstance(value, bool)


def require_number(
    name: str,
    value: Any,
    minimum: float,
    maximum: float,
    unit: str = "",
    *,
    whole: bool = False,
    error_type: type[InputError] = ParameterError,
) -> float:
    """Return a value as a float, or raise an error unless it is a number in a range.

    Parameters
    ----------
    name : str
        Name of the parameter in the message.
    value : object
        The value to check.
    minimum, maximum : float
        Limits of the range, inclusive.
    unit : str
        Unit of the limits in the message.
    whole : bool
        Whether only whole numbers are accepted.
    error_type : type
        Class of the error to raise.

    Returns
    -------
    float

    Raises
    ------
    InputError
        Of type `error_type`, if the value is not a number in the range.

    Examples
    --------
    >>> require_number("radius", 0.2, 0.01, 1e6, "m")
    0.2
    """
    kind = Integral if whole else Real
    if not is_number(value, kind) or not minimum <= value <= maximum:
        description = "a whole number" if whole else "a number"
        expected = f"{description} from {format_bound(minimum)} to {format_bound(maximum)} {unit}".rstrip()
        raise error_type(_describe_mismatch(name, value, expected))
    return float(value)


def to_floats(
    name: str, values: Any, expected: str, error_type: type[InputError] = ParameterError
) -> FloatArray:
    """Convert numbers to a new array of floats.

    Parameters
    ----------
    name : str
        Name of the parameter in the message.
    values : array_like
        The real numbers to convert.
    expected : str
        Description of the numbers in the message.
    error_type : type
        Class of the error to raise.

    Returns
    -------
    array

    Raises
    ------
    InputError
        Of type `error_type`, if the values cannot be converted.

    Examples
    --------
    >>> to_floats("starts", [[1, 2]], "[x, y] of each robot")
    array([[1., 2.]])
    >>> to_floats("starts", "abc", "[x, y] of each robot")
    Traceback (most recent call last):
    robocov.errors.ParameterError: starts: expected [x, y] of each robot, got 'abc'
    """
    # Imported only now, because `robocov bench` limits the number of threads before numpy is loaded.
    import numpy as np

    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            # Without this check, NumPy would discard the imaginary parts, and only warn.
            raise TypeError("expected real numbers, got complex ones")
        return np.array(array, dtype=np.float64)
    except Exception:
        # The values may be of any class, such as a tensor of another library, and their conversion may fail
        # with any error.
        raise error_type(_describe_mismatch(name, values, expected)) from None


def require_whole_number(
    name: str, value: object, minimum: int, error_type: type[InputError] = ParameterError
) -> None:
    """Raise an error unless a value is a whole number that is large enough.

    Parameters
    ----------
    name : str
        Name of the parameter in the message.
    value : object
        The value to check.
    minimum : int
        The smallest number that is accepted.
    error_type : type
        Class of the error to raise.

    Raises
    ------
    InputError
        Of type `error_type`, if the value is not a whole number of at least `minimum`.

    Examples
    --------
    >>> require_whole_number("robots", 0, 1)
    Traceback (most recent call last):
    robocov.errors.ParameterError: robots: expected a whole number of at least 1, got 0
    """
    if not is_number(value, Integral) or value < minimum:
        raise error_type(f"{name}: expected a whole number of at least {minimum}, got {quote(value)}")


def require_type(name: str, value: object, kind: type, expected: str) -> None:
    """Raise an error unless a value has a type.

    Parameters
    ----------
    name : str
        Name of the parameter in the message.
    value : object
        The value to check.
    kind : type
        The required type.
    expected : str
        Description of the type in the message.

    Raises
    ------
    ParameterError
        If the value has the wrong type.
    """
    if not isinstance(value, kind):
        raise ParameterError(_describe_mismatch(name, value, expected))


def _describe_mismatch(name: str, value: object, expected: str) -> str:
    """Return the message for an unexpected value."""
    return f"{name}: expected {expected}, got {quote(value)}"


def summarize_names(names: Sequence[str]) -> str:
    """Join the first three names, and add the number of the others.

    Parameters
    ----------
    names : sequence of str
        At least one name.

    Returns
    -------
    str

    Examples
    --------
    >>> summarize_names(["a", "b", "c", "d"])
    'a, b, c and 1 more'
    """
    text = ", ".join(names[:_MAX_LISTED_NAMES])
    other_count = len(names) - _MAX_LISTED_NAMES
    return f"{text} and {other_count} more" if other_count > 0 else text


def format_count(count: int, noun: str) -> str:
    """Format a number of items.

    Parameters
    ----------
    count : int
        Number of items.
    noun : str
        Singular noun, whose plural ends in s.

    Returns
    -------
    str

    Examples
    --------
    >>> format_count(1, "robot"), format_count(6, "robot")
    ('1 robot', '6 robots')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def format_area(area: float, digits: int = 4) -> str:
    """Format an area without an exponent.

    Parameters
    ----------
    area : float, m²
    digits : int
        Number of significant digits. Areas from 1000 m² on are whole numbers.

    Returns
    -------
    str

    Examples
    --------
    >>> format_area(12.3456), format_area(12345.6), format_area(999.6, 3)
    ('12.35 m²', '12346 m²', '1000 m²')
    """
    if area >= _MIN_WHOLE_AREA_M2:
        return f"{area:.0f} m²"
    return f"{Decimal(f'{area:.{digits}g}'):f} m²"


def format_position(x: float, y: float) -> str:
    """Format a position to the millimeter, however far it is from the origin.

    Parameters
    ----------
    x, y : float, m

    Returns
    -------
    str

    Examples
    --------
    >>> format_position(4.0, 3.0456), format_position(385123.25, -0.0001)
    ('[4, 3.046]', '[385123.25, 0]')
    """
    # Adding 0.0 turns -0.0 into 0.0.
    return f"[{round(x, 3) + 0.0:.10g}, {round(y, 3) + 0.0:.10g}]"


def describe_unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name, which suggests the most similar known names.

    Parameters
    ----------
    kind : str
        Kind of the item, such as "controller".
    name : str
        The unknown name.
    known : iterable of str
        The known names.

    Returns
    -------
    str

    Examples
    --------
    >>> describe_unknown_name("controller", "rapff", ["lloyd", "rapf", "rpf"])
    "unknown controller 'rapff': did you mean 'rapf'? (known: lloyd, rapf, rpf)"
    """
    names = sorted(known)
    message = f"unknown {kind} {quote(name)}"
    similar_names = find_similar_names(name.lower(), names)
    if similar_names:
        message += f": did you mean {' or '.join(map(quote, similar_names))}?"
    listing = ", ".join(_shorten(to_one_line(known_name)) for known_name in names)
    return f"{message} (known: {listing})"


def find_similar_names(name: str, known: Iterable[str], min_similarity: float = _MIN_SIMILARITY) -> list[str]:
    """Find the known names that need the fewest edits to become a misspelled name.

    Parameters
    ----------
    name : str
        The misspelled name.
    known : iterable of str
        The known names.
    min_similarity : float
        Minimum similarity, as measured by `difflib`, of a name that is returned.

    Returns
    -------
    list of str
        One name, several that are equally near, or none.

    Examples
    --------
    >>> find_similar_names("rpaf", ["lloyd", "rapf", "rpf"])
    ['rapf', 'rpf']
    """
    # `difflib` decides which names are similar at all. Its order ignores that transposing two letters is one
    # mistake, so the number of edits decides among them.
    names = list(known)
    similar_names = get_close_matches(name, names, n=max(len(names), 1), cutoff=min_similarity)
    edit_counts = {similar_name: _count_edits(name, similar_name) for similar_name in similar_names}
    fewest_edits = min(edit_counts.values(), default=0)
    nearest_names = [similar_name for similar_name in names if edit_counts.get(similar_name) == fewest_edits]
    return nearest_names[:_MAX_SUGGESTIONS]


def _count_edits(first: str, second: str) -> int:
    """Return the number of edits between two words (the optimal string alignment distance).

    An edit inserts, deletes or replaces one letter, or transposes two adjacent ones. Of long words, only the
    start is compared.
    """
    first = first[:_MAX_QUOTED_CHARACTERS]
    second = second[:_MAX_QUOTED_CHARACTERS]
    # counts[i][j] is the number of edits between the first i letters of `first` and the first j of `second`.
    counts = [[0] * (len(second) + 1) for _ in range(len(first) + 1)]
    for i in range(len(first) + 1):
        for j in range(len(second) + 1):
            if i == 0 or j == 0:
                counts[i][j] = i + j
                continue
            is_different = first[i - 1] != second[j - 1]
            counts[i][j] = min(
                counts[i - 1][j] + 1,
                counts[i][j - 1] + 1,
                counts[i - 1][j - 1] + is_different,
            )
            if i > 1 and j > 1 and first[i - 2 : i] == second[j - 1] + second[j - 2]:
                counts[i][j] = min(counts[i][j], counts[i - 2][j - 2] + 1)
    return counts[-1][-1]


def format_bound(bound: float) -> str:
    """Format a bound of a range without an exponent, unless it is tiny or huge.

    Bounds from 100,000 to 1e9 are rounded to ten significant digits, others to six.

    Parameters
    ----------
    bound : float

    Returns
    -------
    str

    Examples
    --------
    >>> format_bound(1e6), format_bound(0.5), format_bound(1e-6)
    ('1000000', '0.5', '0.000001')
    """
    digits = 10 if 1e5 <= abs(bound) <= 1e9 else 6
    text = f"{bound:.{digits}g}"
    if "e" not in text or not 1e-9 <= abs(bound) <= 1e9:
        return text
    return f"{Decimal(text):f}"


def format_exactly(value: float) -> str:
    """Format a number with as many digits as are needed to read the same number again.

    Parameters
    ----------
    value : float

    Returns
    -------
    str
        ``inf`` for infinity.

    Examples
    --------
    >>> format_exactly(2.0), format_exactly(0.30000000000000004)
    ('2', '0.30000000000000004')
    """
    text = f"{value:g}"
    return text if float(text) == value else repr(float(value))


def _shorten(text: str) -> str:
    """Cut a text that is longer than `_MAX_QUOTED_CHARACTERS`, and mark the cut by three dots."""
    if len(text) <= _MAX_QUOTED_CHARACTERS:
        return text
    return f"{text[: _MAX_QUOTED_CHARACTERS - 3]}..."
