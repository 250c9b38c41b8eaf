"""The process that imports for an `ImportQuestion`: ``python -m robocov_app.editor.ui.import_process``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from robocov.environment import Environment
from robocov.errors import one_line
from robocov_app.importers import ForeignMap, ImportReport, ReadOptions, Shaping, read_map, shaped
from robocov_app.importers.comparison import Comparison, compare
from robocov_app.live.latest import Service


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

    def __init__(self) -> None:
        self._read: tuple[tuple[Path, str, ReadOptions], ForeignMap] | None = None

    def __call__(self, wanted: Sequence[Wanted]) -> Imported:
        """Import what was wanted last."""
        last = wanted[-1]
        key = last.path, last.format, last.options
        if self._read is None or self._read[0] != key:
            self._read = None
            self._read = key, read_map(last.path, format=last.format, options=last.options)
        foreign = self._read[1]
        environment, report = shaped(foreign, last.shaping, one_line(last.path.name))
        return Imported(environment, report, compare(foreign, environment, report))


SERVICE = Service(Importing(), "the map could not be imported")

if __name__ == "__main__":
    # by its own name: what is answered is pickled by reference
    from robocov_app.editor.ui import import_process

    import_process.SERVICE.serve()
