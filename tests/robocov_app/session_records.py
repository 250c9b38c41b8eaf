"""Records of sessions, for the tests of saved runs."""

import numpy as np

from robocov.record import ARRAYS, Record
from robocov_app.viewer.branch_output.parts import SelectedBranch, build_part_records, split_branch
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


def select_present_branch(session: Session) -> SelectedBranch:
    """Return the branch that leads to the present."""
    timeline = session.timeline
    return SelectedBranch(timeline.document, timeline.head, timeline.step)


def build_records(session: Session) -> list[Record]:
    """Build the records of the time since the last edit, one for each pane."""
    branch = select_present_branch(session)
    return build_part_records(split_branch(branch)[-1], branch.root)


def build_record(session: Session) -> Record:
    (record,) = build_records(session)
    return record


def have_same_arrays(first: Record, second: Record) -> bool:
    """Return whether the arrays of two records are the same, bit for bit."""
    return all(np.array_equal(getattr(first, name), getattr(second, name), equal_nan=True) for name in ARRAYS)
