"""Saving a session and repeating what was saved, for the tests of kept runs."""

import io
import json
import time
from pathlib import Path

import numpy as np

from robocov.controllers import make_controller
from robocov.mapfile import from_json
from robocov.record import ARRAYS, Record
from robocov.robots import Team
from robocov.simulation import Simulation
from robocov_app.toolkit.worker import receive
from robocov_app.viewer.session.keep_process import heard
from robocov_app.viewer.session.keeping import Keeper, Said, tell, wanted_of
from robocov_app.viewer.session.session import Session

PATIENCE = 60.0
"""Seconds after which nothing will come any more."""

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
        way = np.array([np.cos(0.05 * memory), np.sin(0.05 * memory)])
        forces = self.strength * np.tile(way, (len(seen.positions), 1))
        return rc.Decision(forces=forces, memory=memory + 1)
"""
"""A controller that remembers something."""


def records_of(session: Session) -> list[Record]:
    """Return what would be saved of a session, without the other process and the pictures."""
    stream = io.BytesIO()
    tell(stream, wanted_of(session, Path("unused"), 16))
    stream.seek(0)
    records = heard(receive(stream), stream)
    assert records is not None
    return records


def record_of(session: Session) -> Record:
    (record,) = records_of(session)
    return record


def said_by(keeper: Keeper) -> Said:
    """Wait for what is said next."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if said := keeper.poll():
            assert len(said) == 1
            return said[0]
        time.sleep(0.01)
    raise AssertionError("nothing was said")


def repeated(record: Record) -> Record:
    """Return the run that comes out when what ``run.json`` says of a record is done."""
    run = json.loads(json.dumps(record.to_json()))
    session = run.get("session", {})
    simulation = Simulation(
        from_json(run["map"]),
        make_controller(run["controller"]["name"], run["controller"]["gains"]),
        run["starts_m"],
        Team.from_dict(run["team"]),
        session.get("control_dt_s", run["dt_s"]),
        velocities=session.get("start_velocities_m_per_s"),
    )
    return simulation.run(run["duration_s"])


def same_arrays(one: Record, other: Record) -> bool:
    """Whether two records are the same, bit for bit."""
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in ARRAYS)
