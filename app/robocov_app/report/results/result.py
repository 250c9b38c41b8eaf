"""A result: the runs in one folder, with everything that a report shows about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.controllers.gains import Value
from robocov.environment import Environment
from robocov.errors import InputError
from robocov.files.result_names import COST_FILE, RECORD_FILE
from robocov.metrics import CostHistory
from robocov.metrics.results import read_history
from robocov.record import Record
from robocov_app.runs.cost import AREA_TOLERANCE_M2
from robocov_app.runs.saved_runs import SavedRun

ResultKind: TypeAlias = Literal["run", "comparison", "sweep"]
Gains: TypeAlias = tuple[tuple[str, Value], ...]
"""Names and values of gains."""
TeamParameters: TypeAlias = tuple[tuple[str, float | None], ...]
"""Names and values of the parameters of a team. The value None means no limit."""
Setting: TypeAlias = tuple[str, int, TeamParameters]
"""Map, number of robots and team. Only the costs of runs with the same setting can be compared directly."""

METRIC_NAMES = (
    "mean_distance_m",
    "mean_distance_over_run_m",
    "cost_m3",
    "uncovered_area_m2",
    "settled_at_s",
    "contacts",
    "min_clearance_m",
    "path_length_m",
    "stuck_robots",
    "mean_time_s",
    "sent_bytes_per_s",
)
"""Metrics that a report shows for a run. The names are those of columns in the table of a sweep."""


@dataclass(frozen=True)
class ReportedRun:
    """One run of a result.

    Attributes
    ----------
    map : str
    controller : str
    label : str
        Displayed name of the controller.
    robots : int
    team : tuple of (str, float or None)
        Parameters of the team that have several values in the result.
    start : str or None
        Name of the start; None for given positions.
    seed : int or None
    gains : tuple of (str, value)
    metrics : mapping of str to float or None
        Values keyed by `METRIC_NAMES`; empty if the run failed.
    error : str or None
        Reason why the run failed; None if it did not.
    folder : Path
    """

    map: str
    controller: str
    label: str
    robots: int
    team: TeamParameters
    start: str | None
    seed: int | None
    gains: Gains
    metrics: Mapping[str, float | None] = field(compare=False)
    error: str | None
    folder: Path

    @property
    def final_distance(self) -> float:
        """Mean distance to the nearest robot at the end, m; nan if it is unknown."""
        value = self.metrics.get("mean_distance_m")
        if value is None:
            return float("nan")
        return float(value)

    def has_metric(self, name: str) -> bool:
        """Return whether a metric of the run is known and finite."""
        value = self.metrics.get(name)
        return value is not None and bool(np.isfinite(value))

    @property
    def setting(self) -> Setting:
        """Map, number of robots and team."""
        return self.map, self.robots, self.team

    @property
    def case(self) -> tuple[object, ...]:
        """Setting, start and seed. Two runs of different controllers with the same case form a pair."""
        return *self.setting, self.start, self.seed


class Reference(NamedTuple):
    """The best known placement of a team that knows the whole map.

    Attributes
    ----------
    mean_distance : float, m
        Mean distance of the placement, J_ref.
    uncovered_area : float, m²
    """

    mean_distance: float
    uncovered_area: float


class DamagedRun(NamedTuple):
    """A run that cannot be read.

    Attributes
    ----------
    folder : str
        Name of its folder.
    reason : str
        Reason why it cannot be read.
    """

    folder: str
    reason: str


@dataclass(frozen=True, eq=False)
class ReportedResult:
    """The result in one folder.

    Attributes
    ----------
    kind : {"run", "comparison", "sweep"}
    folder : Path
    runs : tuple of ReportedRun
        Runs that completed or failed.
    maps : mapping of str to Environment
    expected_count : int
        Number of runs of the complete result.
    gain_units, gain_meanings : mapping of str to str
    facts : mapping
        Values that all runs have in common: ``duration_s``, ``dt_s``, ``lattice``, ``record_hz``, ``team``
        and ``versions``, if known.
    loaded : mapping of Path to SavedRun
        Runs that have been read already, keyed by folder.
    damaged_runs : tuple of DamagedRun
        Runs that cannot be read. They are not in `runs`.
    references : mapping of Setting to Reference
    description : str
        Text that distinguishes the result from others of the same session; empty if there are no others.
    """

    kind: ResultKind
    folder: Path
    runs: tuple[ReportedRun, ...]
    maps: Mapping[str, Environment]
    expected_count: int
    gain_units: Mapping[str, str]
    gain_meanings: Mapping[str, str]
    facts: Mapping[str, Any]
    loaded: Mapping[Path, SavedRun]
    damaged_runs: tuple[DamagedRun, ...] = ()
    references: Mapping[Setting, Reference] = field(default_factory=dict)
    description: str = ""

    @cached_property
    def completed_runs(self) -> tuple[ReportedRun, ...]:
        """Runs that did not fail."""
        return tuple(run for run in self.runs if run.error is None)

    @property
    def failed_runs(self) -> tuple[ReportedRun, ...]:
        """Runs that failed."""
        return tuple(run for run in self.runs if run.error is not None)

    @property
    def missing_count(self) -> int:
        """Number of runs that have not been executed."""
        return max(self.expected_count - len(self.runs) - len(self.damaged_runs), 0)

    def drop_unreadable(self, report_progress: Callable[[int], None] = lambda count: None) -> ReportedResult:
        """Read all completed runs, and list those that cannot be read as damaged.

        Parameters
        ----------
        report_progress : callable
            Called with the number of runs read so far.

        Returns
        -------
        ReportedResult
        """
        readable_runs = []
        damaged_runs = list(self.damaged_runs)
        count = 0
        for run in self.runs:
            if run.error is not None:
                readable_runs.append(run)
                continue
            count += 1
            try:
                self.read_record(run)
                self.read_history(run)
                readable_runs.append(run)
            except InputError as error:
                damaged_runs.append(describe_damage(run.folder, error))
            report_progress(count)
        return replace(self, runs=tuple(readable_runs), damaged_runs=tuple(damaged_runs))

    def compute_gap(self, run: ReportedRun) -> float:
        """Return the gap at the end of a run, J / J_ref - 1.

        It is nan without a reference, or if the reference does not leave the same area uncovered.
        """
        reference = self.references.get(run.setting)
        if reference is None:
            return float("nan")
        uncovered_area = run.metrics.get("uncovered_area_m2") or 0.0
        if abs(uncovered_area - reference.uncovered_area) > AREA_TOLERANCE_M2:
            return float("nan")
        return run.final_distance / reference.mean_distance - 1.0

    def read_record(self, run: ReportedRun) -> Record:
        """Read the record of a run.

        Raises
        ------
        InputError
            If it cannot be read, or its positions are not finite.
        """
        if run.folder in self.loaded:
            return self.loaded[run.folder].record
        record = Record.load(run.folder)
        if not len(record) or not len(record.team) or not np.isfinite(record.positions).all():
            raise InputError(f"{run.folder / RECORD_FILE}: expected finite positions of robots")
        return record

    def read_history(self, run: ReportedRun) -> CostHistory | None:
        """Read the cost of a run over time; return None if it was not saved."""
        if run.folder in self.loaded:
            return self.loaded[run.folder].history
        path = run.folder / COST_FILE
        if not path.exists():
            return None
        return read_history(path)


def replace_unprintable(text: str) -> str:
    """Replace each unprintable character by U+FFFD, the replacement character."""
    return "".join(character if character.isprintable() else "\ufffd" for character in text)


def describe_damage(folder: Path, error: InputError) -> DamagedRun:
    """Describe a run that cannot be read, with paths relative to its folder."""
    reason = str(error).removeprefix(f"{folder}: ").replace(f"{folder}/", "")
    return DamagedRun(replace_unprintable(folder.name), replace_unprintable(reason))
