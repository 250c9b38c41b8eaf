"""Selection of shapes by their names, ids, classes and layers."""

from collections.abc import Iterable

from robocov.errors import ParameterError, describe_unknown_name
from robocov_app.formats.options import ReadOptions

_MAX_LISTED_NAMES = 20


class LabelFilter:
    """The options ``only`` and ``skip``, and the labels that a file contains.

    Attributes
    ----------
    only : set of str, or None
        Labels of the shapes to read, in lower case. None stands for all shapes.
    skip : set of str
        Labels of the shapes to leave out, in lower case.
    """

    def __init__(self, source_name: str, options: ReadOptions) -> None:
        self.only: set[str] | None = None
        if options.only is not None:
            self.only = set(map(str.casefold, options.only))
        self.skip = set(map(str.casefold, options.skip or ()))
        self._source_name = source_name
        self._options = options
        self._known: dict[str, str] = {}

    def register_and_fold(self, labels: Iterable[str]) -> set[str]:
        """Record the labels that occur in the file, and return them in lower case, as they are compared."""
        label_by_folded = {label.casefold(): label for label in labels}
        self._known |= label_by_folded
        return set(label_by_folded)

    def accepts(self, labels: Iterable[str]) -> bool:
        """Record the labels that occur in the file, and return whether to read a shape with these labels."""
        folded_labels = self.register_and_fold(labels)
        if self.only is not None and not self.only & folded_labels:
            return False
        return not self.skip & folded_labels

    def require_known_names(self) -> None:
        """Raise ParameterError if an option contains a name that does not occur in the file."""
        options = self._options
        boundary = () if options.boundary is None else (options.boundary,)
        given = {"boundary": boundary, "only": options.only or (), "skip": options.skip or ()}
        for option, names in given.items():
            for name in names:
                if name.casefold() not in self._known:
                    raise ParameterError(f"{self._source_name}: {option}: {self._describe_unknown(name)}")

    def _describe_unknown(self, name: str) -> str:
        known = list(self._known.values())[:_MAX_LISTED_NAMES]
        if not known:
            return "no shape has a name"
        return describe_unknown_name("name", name, known)
