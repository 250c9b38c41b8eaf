"""The record of a run: its arrays, saved in a folder and loaded from it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocov.conditions import Conditions, JoinedRobot
from robocov.controllers import get_controller_label
from robocov.controllers.gains import Value
from robocov.controllers.registry import update_gain_names
from robocov.drawing import Drawable
from robocov.environment import Environment
from robocov.errors import (
    InputError,
    OutputError,
    ParameterError,
    describe_error,
    format_count,
    is_number,
    quote,
)
from robocov.files.documents import read_document
from robocov.files.result_folder import complete_commit, require_result
from robocov.files.result_names import RECORD_FILE, RUN_FILE
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, to_json
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.optional_imports import import_optional
from robocov.record.package_versions import list_versions
from robocov.record.record_arrays import ARRAYS, COLUMNS, SENT_BYTES, STEERING, read_record_arrays
from robocov.record.run_document import JoinEvent, RunDocument
from robocov.record.sampling import TIME_ROUNDING_S, select_nearest_steps
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time

FORMAT = "robocov-run"
"""Name of the format of ``run.json``."""
FORMAT_VERSION = 1
"""Current version of the format."""


@dataclass(frozen=True, eq=False)
class Record(Drawable):
    """The record of a run: the state, forces and goals of all robots at each of T time steps.

    Attributes
    ----------
    environment : Environment
        The map of the run.
    team : Team
        The robots.
    controller, label : str
        Name of the controller, as `make_controller` accepts it, and its label in figures.
    gains : mapping of str to float, str or None
        Gains of the controller by name.
    start : str or None
        Name of the start from which the initial positions were sampled.
    seed : int or None
        Seed from which the initial positions were sampled.
    dt : float, s
        Control period; also the time between time steps, unless the record was thinned.
    time : (T,) s
        Simulation time of each time step.
    positions, velocities : (T, n, 2) m, m/s
        True positions and velocities of the robots.
    forces : (T, n, 2) N
        The controller's force, before any limit and without viscosity.
    goals : (T, n, 2) m
        The goal of each robot; nan if it has none.
    obstacle_points : (T, n, 2) m
        The nearest obstacle point that each robot sensed; nan if there was none.
    steering : (T, n, 2) rad, rad/s
        Heading, from +x, and turning rate of unicycles; None in a team of point robots.
    session : mapping
        Origin of the run in a session of the application, as in ``run.json``; empty for any other run.
    conditions : Conditions or None
        Noise, limits of communication, and robots that fail or join. None if the conditions are ideal.
    joined : tuple of JoinedRobot
        The robots that joined during the run, and the positions at which they joined.
    sent_bytes : (T,) bytes, or None
        Total size of the controller messages that all robots have sent before each time step, received or
        not. None if there are none. Messages with positions are not included.

    See Also
    --------
    run : Simulate a run and return its record.
    compute_cost_history : The coverage cost over a run.
    compute_run_metrics : Areas, energy, path lengths and clearances over a run.
    summarize : The results of a run.

    Examples
    --------
    >>> import tempfile
    >>> import robocov as rc
    >>> record = rc.run("rooms", "rapf", robots=4, duration=1.0)
    >>> record.time.shape, record.positions.shape
    ((61,), (61, 4, 2))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     record.save(f"{folder}/first-run")
    ...     rc.Record.load(f"{folder}/first-run")
    <Record rapf on Rooms, 4 robots, 1.0 s>
    """

    _drawing_name = "record"

    environment: Environment
    team: Team
    controller: str
    label: str
    gains: Mapping[str, Value]
    start: str | None
    seed: int | None
    dt: float
    time: FloatArray
    positions: FloatArray
    velocities: FloatArray
    forces: FloatArray
    goals: FloatArray
    obstacle_points: FloatArray
    session: Mapping[str, Any] = field(default_factory=dict)
    conditions: Conditions | None = None
    steering: FloatArray | None = None
    joined: tuple[JoinedRobot, ...] = ()
    sent_bytes: FloatArray | None = None

    @cached_property
    def is_working(self) -> BoolArray:
        """Mask of the robots that are present and have not failed, (T, n) bool; read-only."""
        if self.conditions is None:
            return self.is_present
        return _make_read_only(self.conditions.find_working_robots(self.time, len(self.team)))

    @cached_property
    def is_present(self) -> BoolArray:
        """Mask of the robots that have joined the team, including failed ones, (T, n) bool; read-only."""
        if self.conditions is None:
            return _make_read_only(np.ones(self.positions.shape[:2], dtype=bool))
        return _make_read_only(self.conditions.find_present_robots(self.time, len(self.team)))

    @cached_property
    def traveled(self) -> BoolArray:
        """Mask of the displacements that count as motion of a robot, (T - 1, n) bool; read-only.

        The displacement between two time steps does not count if the robot has not joined yet, or if the user
        placed it at another position in between.
        """
        mask = self.is_present[:-1].copy()
        row_of_number = {number: row for row, number in enumerate(self.robot_numbers)}
        for placement in self.session.get("placements", ()):
            step = int(np.searchsorted(self.time, placement["time_s"] - TIME_ROUNDING_S))
            rows = [row_of_number[number] for number in placement["robots"] if number in row_of_number]
            if 0 < step < len(self.time):
                mask[step - 1, rows] = False
        return _make_read_only(mask)

    @property
    def robot_numbers(self) -> tuple[int, ...]:
        """Numbers of the robots, from 1; in a session, robots keep their numbers when others leave."""
        numbers = self.session.get("robots") or range(1, len(self.team) + 1)
        return tuple(numbers)

    @property
    def arrays(self) -> tuple[str, ...]:
        """Names of the arrays of this record."""
        names: tuple[str, ...] = ARRAYS
        if self.steering is not None:
            names = (*names, STEERING)
        if self.sent_bytes is not None:
            names = (*names, SENT_BYTES)
        return names

    @property
    def has_travel_time_cells(self) -> bool:
        """Whether the controller used cells by travel time that differ from cells by distance."""
        return self.gains.get("cells") == "time" and self.team.has_mixed_speeds

    def __len__(self) -> int:
        """Return the number of time steps."""
        return len(self.time)

    def __repr__(self) -> str:
        robots = format_count(len(self.team), "robot")
        return f"<Record {self.controller} on {self.environment.name}, {robots}, {self.time[-1]:.1f} s>"

    def compute_cells(self, step: int = -1) -> VoronoiPartition | WeightedCells:
        """Compute the cells of the working robots at a time step.

        Limits of communication are ignored: each cell is that of a robot that knows all others.

        Parameters
        ----------
        step : int
            Index of the time step; by default the last one.

        Returns
        -------
        VoronoiPartition or WeightedCells
            One cell for each working robot. `WeightedCells` if `has_travel_time_cells` and not all working
            robots are equally fast.
        """
        is_working = self.is_working[step]
        positions = self.positions[step][is_working]
        region = self.environment.region
        density = self.environment.density
        if self.has_travel_time_cells:
            speeds = self.team.max_speed[is_working]
            return partition_by_travel_time(positions, speeds, region, density=density)
        return partition(positions, region, density=density)

    def snapshot(self, k: int) -> Snapshot:
        """Return the state and the decision at a time step.

        Parameters
        ----------
        k : int
            Index of the time step.

        Returns
        -------
        Snapshot

        Notes
        -----
        The observations contain only what is recorded: true positions instead of noisy ones, the density even
        if the robots had to measure it, and no scans or messages. The decision has no force terms, and its
        cells, if any, are those of the working robots only.
        """
        neighbors = Neighbors.from_ranges(self.positions[k], self.team.communication_range)
        is_working = None
        if self.conditions is not None:
            is_working = self.is_working[k]
            neighbors = neighbors.restrict_to_working(is_working)
        steering = None if self.steering is None else self.steering[k]
        observations = Observations(
            positions=self.positions[k],
            velocities=self.velocities[k],
            neighbors=neighbors,
            obstacle_points=self.obstacle_points[k],
            region=self.environment.region,
            time=float(self.time[k]),
            max_speeds=self.team.max_speed,
            density=self.environment.density,
            steering=steering,
        )
        goals = None if np.isnan(self.goals[k]).all() else self.goals[k]
        # Figures compute cells by distance themselves if a decision has none.
        cells = self.compute_cells(k) if self.has_travel_time_cells else None
        decision = Decision(forces=self.forces[k], goals=goals, cells=cells)
        return Snapshot(observations, decision, is_working=is_working)

    def at(self, time: float) -> Snapshot:
        """Return the state and the decision at the time step nearest to a time.

        Parameters
        ----------
        time : float, s
            Simulation time.

        Returns
        -------
        Snapshot

        Raises
        ------
        ParameterError
            If the time is not a number, or is outside the run by more than a control period.
        """
        first = float(self.time[0])
        last = float(self.time[-1])
        if not is_number(time) or not first - self.dt <= time <= last + self.dt:
            raise ParameterError(f"time: expected a number from {first:g} to {last:g} s, got {quote(time)}")
        return self.snapshot(int(np.abs(self.time - time).argmin()))

    def until(self, time: float) -> Record:
        """Return the record up to a time, inclusive.

        Parameters
        ----------
        time : float, s
            Simulation time.

        Returns
        -------
        Record

        Raises
        ------
        ParameterError
            If the time is not a number, or is before the start of the run.
        """
        if not is_number(time) or not time >= self.time[0] - TIME_ROUNDING_S:
            raise ParameterError(f"time: expected a number of at least {self.time[0]:g} s, got {quote(time)}")
        step_count = int(np.searchsorted(self.time, time + TIME_ROUNDING_S, side="right"))
        return self._select_steps(slice(step_count))

    def thin(self, rate: float) -> Record:
        """Return the record with fewer time steps.

        Parameters
        ----------
        rate : float, Hz
            Number of time steps to keep per simulated second; 0 keeps only the first and the last one.

        Returns
        -------
        Record

        Raises
        ------
        ParameterError
            If the rate is negative or not finite.
        """
        return self._select_steps(select_nearest_steps(self.time, rate))

    def _select_steps(self, steps: slice | IntArray) -> Record:
        """Return a record of the selected time steps, with copies of the arrays."""
        arrays = {name: getattr(self, name)[steps].copy() for name in self.arrays}
        end_time = arrays["time"][-1] + TIME_ROUNDING_S
        joined = tuple(robot for robot in self.joined if robot.time <= end_time)
        return replace(self, joined=joined, **arrays)

    def to_pandas(self) -> Any:
        """Return the run as a tidy data frame, one row for each time step and robot, by time, then robot.

        Requires ``robocov[pandas]``.

        Returns
        -------
        pandas.DataFrame
            With the columns time_s, robot (from 0; figures number robots from 1), x_m, y_m, vx_m_s, vy_m_s,
            fx_N, fy_N, goal_x_m, goal_y_m, obstacle_x_m and obstacle_y_m; for unicycles also heading_rad and
            turning_rate_rad_s.
        """
        pandas = import_optional("pandas", "pandas")
        step_count, robot_count = self.positions.shape[:2]
        columns: dict[str, FloatArray | IntArray] = {
            "time_s": np.repeat(self.time, robot_count),
            "robot": np.tile(np.arange(robot_count), step_count),
        }
        for array in self.arrays:
            if array not in COLUMNS:
                continue
            values = getattr(self, array)
            for component, column in enumerate(COLUMNS[array]):
                columns[column] = values[:, :, component].ravel()
        return pandas.DataFrame(columns)

    def to_json(
        self, summary: Mapping[str, Any] | None = None, *, lattice: int | None = None
    ) -> dict[str, Any]:
        """Return the content of ``run.json``.

        Parameters
        ----------
        summary : mapping or None
            The summary of the run; see `summarize`. JSON has no nan, which `summarize` returns if no robot
            works at the end, so that `save` fails unless such numbers are replaced by None.
        lattice : int or None
            Number of lattice sites along each side of the map with which the cost was computed, from 2 to
            2048. A record that was saved with another number cannot be loaded.

        Returns
        -------
        dict
        """
        document: dict[str, Any] = {
            "format": FORMAT,
            "version": FORMAT_VERSION,
            "map": to_json(self.environment),
            "controller": {"name": self.controller, "gains": dict(self.gains)},
            "team": self.team.to_dict(),
            "start": self.start,
            "starts_m": self.positions[0].tolist(),
            "seed": self.seed,
            "dt_s": self.dt,
            "duration_s": float(self.time[-1] - self.time[0]),
            # The JSON encoder rejects NumPy integers.
            "lattice": None if lattice is None else int(lattice),
        }
        if self.conditions is not None:
            document["conditions"] = self.conditions.to_dict()
        if self.joined:
            document["events"] = [_to_event(joined) for joined in self.joined]
        if self.session:
            document["session"] = dict(self.session)
        document["versions"] = dict(list_versions())
        document["summary"] = dict(summary or {})
        return document

    def save(
        self, folder: Path | str, summary: Mapping[str, Any] | None = None, *, lattice: int | None = None
    ) -> None:
        """Write ``record.npz`` and ``run.json`` to a folder. Each file is written completely or not at all.

        Parameters
        ----------
        folder : Path or str
            Folder of the run, which is created if it does not exist.
        summary, lattice
            See `to_json`.

        Raises
        ------
        OutputError
            If the folder or a file cannot be written.
        InputError
            If the replacement of an earlier result in the folder was interrupted, and cannot be completed.
        ValueError
            If the summary contains a number that JSON cannot represent. Nothing is written then.
        """
        folder = Path(folder)
        # A summary that JSON cannot represent raises an error here, before any file is replaced.
        text = json.dumps(self.to_json(summary, lattice=lattice), indent=1, allow_nan=False)
        complete_commit(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be created: {describe_error(error)}") from error
        arrays = {name: getattr(self, name) for name in self.arrays}
        with replace_file(folder / RECORD_FILE) as temporary, temporary.open("wb") as file:
            # Compression would make the file 10% smaller and take 20 times as long.
            np.savez(file, **arrays)
        with replace_file(folder / RUN_FILE) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def load(cls, folder: Path | str) -> Record:
        """Load a record that was written by `save`.

        Only the controller's name and gains are loaded. No code is executed.

        Parameters
        ----------
        folder : Path or str
            Folder of the run.

        Returns
        -------
        Record

        Raises
        ------
        InputError
            If this is not the folder of a run, or if a file in it cannot be used.
        """
        folder = Path(folder)
        # If the replacement of the result in the folder was interrupted, it is completed first.
        complete_commit(folder)
        for file in (RUN_FILE, RECORD_FILE):
            require_result(folder, "the folder of a run", (file,))
        path = folder / RUN_FILE
        document = read_document(path, RunDocument, FORMAT, FORMAT_VERSION)
        environment = from_json(document.map, f"{path}: map")
        conditions = None
        try:
            team = Team.from_dict(document.team)
            if document.conditions is not None:
                conditions = Conditions.from_dict(document.conditions.model_dump())
                conditions.check_team(len(team))
        except ParameterError as error:
            raise InputError(f"{path}: {error}") from error
        numbers = document.session.robots
        if numbers and (len(numbers) != len(team) or len(set(numbers)) != len(team)):
            expected = f"expected {len(team)} different numbers, one for each robot"
            raise InputError(f"{path}: session.robots: {expected}, got {quote(numbers)}")
        arrays: dict[str, Any] = dict(read_record_arrays(folder / RECORD_FILE, team))
        return cls(
            environment=environment,
            team=team,
            controller=document.controller.name,
            label=get_controller_label(document.controller.name),
            gains=update_gain_names(document.controller.name, document.controller.gains),
            start=document.start,
            seed=document.seed,
            dt=document.dt_s,
            session=document.session.model_dump(exclude_unset=True),
            conditions=conditions,
            joined=tuple(_from_event(event) for event in document.events),
            **arrays,
        )


def _make_read_only(mask: BoolArray) -> BoolArray:
    """Make a mask read-only, and return it."""
    mask.setflags(write=False)
    return mask


def _to_event(joined: JoinedRobot) -> dict[str, Any]:
    """Return a robot that joined as an event of ``run.json``."""
    return {
        "kind": "join",
        "robot": joined.robot,
        "time_s": joined.time,
        "position_m": list(joined.position),
        "requested_position_m": list(joined.requested_position),
    }


def _from_event(event: JoinEvent) -> JoinedRobot:
    """Return the robot that joined, from an event of ``run.json``."""
    return JoinedRobot(
        robot=event.robot,
        time=event.time_s,
        position=(event.position_m[0], event.position_m[1]),
        requested_position=(event.requested_position_m[0], event.requested_position_m[1]),
    )
