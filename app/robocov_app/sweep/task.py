"""Tasks: the runs of a study one by one, each with all that it needs."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robocov.mapfile import to_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from robocov.controllers.gains import Value
    from robocov.controllers.user_modules import Source
    from robocov_app.sweep.circumstances import TeamValue
    from robocov_app.sweep.study import Study

_FORMAT = "robocov-task 1"
"""Version of the digest; that the same inputs give other results is told by `made_with`."""

_SHORT = 24
"""Characters of each name in the name of a folder."""

_DIGITS = 10
"""Hexadecimal digits of the digest in the name of a folder."""


@dataclass(frozen=True, slots=True)
class Task:
    """One run; nothing but this is needed to do it, on whatever machine.

    `map`: what the study calls the map. `document`: the whole map as JSON. `source`: of a controller of one's
    own: its file, and its author's modules that it imports. `gains`: all of them. `team`: as
    `Team.homogeneous` takes them, None for a range without limit; and the conditions that the study gives.
    `duration`, `dt` in s. `cost_hz`, `record_hz` in Hz. `metrics`: whether the table is to hold the metrics
    of the end. `digest`: of all of this but where files are: tasks of one digest have one result.
    """

    map: str
    document: str
    controller: str
    source: Source | None
    gains: Mapping[str, Value]
    robots: int
    team: Mapping[str, TeamValue]
    start: str
    seed: int
    duration: float
    dt: float
    lattice: int
    cost_hz: float
    record_hz: float
    metrics: bool = False
    digest: str = ""

    @property
    def name(self) -> str:
        """The name of the run's folder."""
        words = (self.map, self.controller.rpartition(":")[2], self.robots, self.start, self.seed)
        return "-".join([*(_fit(str(word)) for word in words), self.digest[:_DIGITS]])


def tasks_of(study: Study) -> Iterator[Task]:
    """Yield the runs of a study in their fixed order, that of the rows of its table.

    Maps are outermost; then robots, the rest of the team, starts and seeds; controllers and their gains
    are innermost.
    """
    once = {"duration": study.duration, "dt": study.dt, "lattice": study.lattice}
    once |= {"cost_hz": study.cost_hz, "record_hz": study.record_hz}
    if study.metrics:
        once["metrics"] = True
    laws: list[tuple[dict[str, Any], dict[str, Any]]] = []  # what tasks hold of them, what their digests say
    for name in study.controllers:
        source = study.sources.get(name)
        said: dict[str, Any] = {"source": None, "path": None}
        if source is not None:
            said["source"] = _digest(source.text)
            if source.modules:
                said["modules"] = {key: _digest(module.text) for key, module in source.modules.items()}
        for choice in study.gains_of(name).choices:
            own = {"controller": name, "gains": dict(choice)}
            laws.append(({**own, "source": source}, {**own, **said}))
    for each in study.maps:
        document = json.dumps(to_json(each.environment), ensure_ascii=False, allow_nan=False)
        short = {"document": _digest(document)}
        for robots in study.robots:
            for team in study.teams:
                for start in study.starts_on(each):
                    for seed in study.seeds:
                        place = {"map": each.name, "robots": robots, "start": start, "seed": seed}
                        for law, words in laws:
                            inputs: dict[str, Any] = {**once, **place, "team": dict(team)}
                            digest = _digest(_FORMAT + json.dumps(inputs | words | short, sort_keys=True))
                            yield Task(**inputs, **law, document=document, digest=digest)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _fit(word: str) -> str:
    """Return a word as it can be a part of a folder's name on any system.

    >>> _fit("Two rooms: a/b")
    'Two-rooms-a-b'
    """
    return re.sub(r"[^A-Za-z0-9_.]+", "-", word).strip(".-")[:_SHORT] or "x"
