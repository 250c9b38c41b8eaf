"""Records of sessions, for the tests of saved runs."""

import numpy as np

from robocov.record import ARRAYS, Record
from robocov_app.viewer.headless import parts_of, records_of_part
from robocov_app.viewer.session.session import Session

COUNTING = """
from dataclasses import dataclass
import numpy as np
import robocov as rc

@dataclass(frozen=True)
class Counting:
    strength: float = 1.0
    def begin(self, region, team):
        return 0
    def decide(self, seen, memory):
        direction = np.array([np.cos(0.05 * memory), np.sin(0.05 * memory)])
        forces = self.strength * np.tile(direction, (len(seen.positions), 1))
        return rc.Decision(forces=forces, memory=memory + 1)
"""
"""A controller with memory."""


def build_records(session: Session) -> list[Record]:
    """Build the records of the time since the last edit, one for each pane."""
    parts = parts_of(session.timeline.document, session.timeline.head, session.timeline.step)
    return records_of_part(parts[-1], session.timeline.document.get_path(session.timeline.head)[0])


def build_record(session: Session) -> Record:
    (record,) = build_records(session)
    return record


def have_same_arrays(one: Record, other: Record) -> bool:
    """Whether two records are the same, bit for bit."""
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in ARRAYS)
