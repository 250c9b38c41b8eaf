"""Tasks of a sweep; each contains everything that one run needs."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

from robocov.controllers.gains import Value
from robocov.controllers.user_modules import ControllerSource
from robocov.environment import Environment
from robocov.mapfile import from_json, to_json
from robocov.scenario import Scenario
from robocov_app.sweep.study.parameters import ParameterValue, build_conditions, build_swept_team
from robocov_app.sweep.study.study import Study

MAX_CACHED_MAPS = 4
"""Maximum number of maps that a process keeps in memory; a few are enough, as tasks are sorted by map."""
_HASH_FORMAT = "robocov-task 1"
"""Beginning of the hashed text. The version of robocov is not hashed, but it is part of an outcome."""
_MAX_NAME_CHARS = 24
"""Maximum length of each part of the name of a folder, apart from the hash."""
_NAME_HASH_CHARS = 10


@dataclass(frozen=True, slots=True)
class Task:
    """One run, which any machine can execute, because the task contains everything that it needs.

    Attributes
    ----------
    map : str
        Name of the map in the table.
    document : str
        The map as JSON.
    controller : str
        Name of the controller, or ``file.py:Class``.
    source : ControllerSource or None
        Source text of the controller, if it is in a file of the user.
    gains : mapping of str to float, str or None
        A value for each gain.
    robots : int
        Number of robots.
    team : mapping of str to float, str or None
        Parameters of the robots, and conditions.
    start : str
        Name of a start of the map.
    seed : int
        Seed of the starting positions and of the conditions.
    duration, dt : float, s
        Simulated time and control period.
    lattice : int
        Number of sites along each side of the map at which the cost is computed.
    cost_hz, record_hz : float, Hz
        Rates at which the cost is evaluated and the trajectories are saved.
    metrics : bool
        Whether the metrics of `robocov.metrics.run_metrics` are computed as well.
    input_hash : str
        SHA-256 of all inputs. Tasks with the same hash give the same result.
    """

    map: str
    document: str
    controller: str
    source: ControllerSource | None
    gains: Mapping[str, Value]
    robots: int
    team: Mapping[str, ParameterValue]
    start: str
    seed: int
    duration: float
    dt: float
    lattice: int
    cost_hz: float
    record_hz: float
    metrics: bool = False
    input_hash: str = ""

    @property
    def name(self) -> str:
        """Name of the folder of the run, valid on any system."""
        controller = self.controller.rpartition(":")[2]
        parts = [_to_file_name(part) for part in (self.map, controller, self.robots, self.start, self.seed)]
        return "-".join([*parts, self.input_hash[:_NAME_HASH_CHARS]])

    def hide_unknown_density(self) -> Task:
        """Return the task without the density of its map, if robots do not know it."""
        if self.team.get("density") != "sensed":
            return self
        document = json.loads(self.document)
        document.pop("density", None)
        return replace(self, document=json.dumps(document, ensure_ascii=False, allow_nan=False))

    def build_environment(self) -> Environment:
        """Build the map; the latest maps are kept in memory."""
        return parse_map(self.document, self.map)

    def build_scenario(self) -> Scenario:
        """Build the scenario of the run.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            If the scenario is impossible, for example because the robots do not fit into the free space.
        """
        return Scenario(
            self.build_environment(),
            self.controller,
            self.gains,
            source=self.source,
            team=build_swept_team(self.robots, self.team),
            start=self.start,
            seed=self.seed,
            duration=self.duration,
            dt=self.dt,
            conditions=build_conditions(self.team, self.seed, self.robots),
        )


@lru_cache(MAX_CACHED_MAPS)
def parse_map(document: str, name: str) -> Environment:
    """Parse the map of a task; the latest maps are kept in memory.

    Parameters
    ----------
    document : str
        The map as JSON.
    name : str
        Name of the map, for messages.

    Returns
    -------
    Environment
    """
    return from_json(json.loads(document), name)


def _to_file_name(part: object) -> str:
    """Return a part of a file name; characters other than A-Z, a-z, 0-9, `_` and `.` become hyphens."""
    name = re.sub(r"[^A-Za-z0-9_.]+", "-", str(part)).strip(".-")
    return name[:_MAX_NAME_CHARS] or "x"


class _TaskController(NamedTuple):
    """A controller with one set of gains.

    Attributes
    ----------
    name : str
        Name of the controller, or ``file.py:Class``.
    source : ControllerSource or None
        Source text of the controller, if it is in a file of the user.
    gains : dict of str to float, str or None
        A value for each gain.
    hashed_inputs : dict
        The inputs of a task that depend on the controller, in the form in which they are hashed.
    """

    name: str
    source: ControllerSource | None
    gains: Mapping[str, Value]
    hashed_inputs: Mapping[str, Any]


def generate_tasks(study: Study) -> Iterator[Task]:
    """Generate the runs of a study.

    Parameters
    ----------
    study : Study
        Definition of the runs.

    Yields
    ------
    Task
        The tasks in the order of the table: maps vary slowest, controllers and their gains fastest.
    """
    settings: dict[str, Any] = {
        "duration": study.duration,
        "dt": study.dt,
        "lattice": study.lattice,
        "cost_hz": study.cost_hz,
        "record_hz": study.record_hz,
    }
    if study.metrics:
        # Without metrics the entry is omitted, so that tasks keep the hashes of versions without this option.
        settings["metrics"] = True
    controllers = _list_controllers(study)
    for study_map in study.maps:
        document = json.dumps(to_json(study_map.environment), ensure_ascii=False, allow_nan=False)
        document_hash = _hash_text(document)
        starts = study.list_starts(study_map)
        combinations = product(study.robots, study.teams, starts, study.seeds, controllers)
        for robots, team, start, seed, controller in combinations:
            inputs: dict[str, Any] = {
                **settings,
                "map": study_map.name,
                "robots": robots,
                "team": dict(team),
                "start": start,
                "seed": seed,
            }
            hashed_inputs = {**inputs, **controller.hashed_inputs, "document": document_hash}
            yield Task(
                **inputs,
                controller=controller.name,
                source=controller.source,
                gains=controller.gains,
                document=document,
                input_hash=_hash_text(_HASH_FORMAT + json.dumps(hashed_inputs, sort_keys=True)),
            )


def _list_controllers(study: Study) -> list[_TaskController]:
    """List the controllers of a study with each set of their gains."""
    controllers = []
    for name in study.controllers:
        source = study.sources.get(name)
        # The hash depends on the source text of a controller, but not on the path of its file.
        hashed_source: dict[str, Any] = {"source": None, "path": None}
        if source is not None:
            hashed_source["source"] = _hash_text(source.text)
            if source.modules:
                hashed_source["modules"] = {
                    module_name: _hash_text(module.text) for module_name, module in source.modules.items()
                }
        for choice in study.get_gains(name).choices:
            gains = dict(choice)
            hashed_inputs = {"controller": name, "gains": gains, **hashed_source}
            controllers.append(_TaskController(name, source, gains, hashed_inputs))
    return controllers


def _hash_text(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
