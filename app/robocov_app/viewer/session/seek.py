"""A seek: the move of a timeline to another state, computed in pieces that fit between frames."""

from collections.abc import Generator
from dataclasses import dataclass, field
from time import perf_counter

from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.present import Present

MIN_NOTICED_SEEK_S = 0.3
"""Duration of a seek after which its progress is shown."""


@dataclass(eq=False)
class Seek:
    """A seek in progress.

    Attributes
    ----------
    pieces : generator
        Generator that yields the fraction done after each piece, and returns the new present.
    node : Node
        Node to which the seek leads.
    step : int
        Step of that node.
    fraction : float
        Fraction done so far.
    """

    pieces: Generator[float, None, Present]
    node: Node
    step: int
    fraction: float = 0.0
    _start_s: float = field(default_factory=perf_counter)

    def advance(self, seconds: float) -> Present | None:
        """Continue the computation for about the given time, s.

        Returns
        -------
        Present or None
            The new present; None if it is not complete yet.
        """
        start_s = perf_counter()
        while True:
            try:
                self.fraction = next(self.pieces)
            except StopIteration as end:
                present: Present = end.value
                return present
            if perf_counter() - start_s > seconds:
                return None

    @property
    def progress(self) -> float | None:
        """Fraction done so far; None while the seek is too short to be noticed."""
        if perf_counter() - self._start_s < MIN_NOTICED_SEEK_S:
            return None
        return self.fraction
