"""A seek in progress: the way of a timeline to another state, in pieces that fit between frames."""

from collections.abc import Generator
from dataclasses import dataclass, field
from time import perf_counter

from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.present import Present

MIN_NOTICED_SEEK_S = 0.3
"""Time after which the progress of a seek is shown."""


@dataclass(eq=False)
class Seek:
    """A seek in progress.

    Attributes
    ----------
    pieces : generator
        Computes the next piece, yields the fraction that is done, and returns the new present at the end.
    node : Node
        Node to which it leads.
    step : int
        Step of that node.
    fraction : float
        Fraction that is done.
    """

    pieces: Generator[float, None, Present]
    node: Node
    step: int
    fraction: float = 0.0
    _start_s: float = field(default_factory=perf_counter)

    def advance(self, seconds: float) -> Present | None:
        """Compute for some time, s.

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
        """Fraction that is done, if the seek has been in progress for a noticeable time."""
        if perf_counter() - self._start_s < MIN_NOTICED_SEEK_S:
            return None
        return self.fraction
