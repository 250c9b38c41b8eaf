"""The centralised reference of every map, J_ref, each computed once and kept in a file."""

import hashlib
import json
import subprocess
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeAlias

from robocov.errors import OutputError
from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, to_json
from robocov_app.replication.plan import ROBOTS, TEAM, Plan
from robocov_app.sweep.study import StudyMap
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import show_progress
from robocov_app.toolkit import worker

_FORMAT = "robocov-reference 1"  # another one whenever the search gives other results
_PATIENCE = 0.2  # s between two looks whether somebody has pressed Ctrl-C


@dataclass(frozen=True)
class Question:
    """Inputs of a reference: the map as JSON, the team, and how well it is searched for."""

    document: Mapping[str, Any]
    robots: int
    radius: float
    lattice: int
    restarts: int
    seed: int = 0

    @property
    def digest(self) -> str:
        """Questions of one digest have one answer; starts are no part of a map here."""
        shape = {**asdict(self), "document": {**self.document, "starts": None}}
        return hashlib.sha256(f"{_FORMAT}{json.dumps(shape, sort_keys=True)}".encode()).hexdigest()


@dataclass(frozen=True)
class Reference:
    """The best placement that was found with the whole map known, m, and how surely."""

    mean_distance: float
    positions: tuple[tuple[float, float], ...]
    agreement: float  # share of the restarts that end within 0.5 % of it


References: TypeAlias = dict[str, Reference]  # by the map's name


class Searching:
    """Searches for references in a process of its own."""

    failing = "the search failed"

    def __call__(self, questions: list[Question], line: worker.Line) -> Reference:
        from robocov.optimum import find_optimum

        asked = asdict(questions[-1])
        best = find_optimum(from_json(asked.pop("document")), asked.pop("robots"), **asked)
        positions = tuple((x, y) for x, y in best.positions.tolist())
        return Reference(float(best.mean_distance), positions, float(best.compute_agreement()))


def find_references(
    maps: Sequence[StudyMap], folder: Path, plan: Plan, workers: int, stop: Interruption, *, quiet: bool
) -> References:
    """Return the reference of every map, kept in `folder` or searched for until `stop`."""
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    how = ROBOTS, TEAM["radius"], plan.lattice, plan.restarts
    wanted = {each.name: Question(to_json(each.environment), *how) for each in maps}
    kept = {name: _kept(folder / f"{name}.json", question) for name, question in wanted.items()}
    found = {name: each for name, each in kept.items() if each is not None}
    missing = {name: question for name, question in wanted.items() if name not in found}
    if missing:
        with show_progress("references", len(missing), quiet=quiet) as update:
            for number, (name, answer) in enumerate(searched(missing, workers, stop), start=1):
                _keep(folder / f"{name}.json", missing[name], answer)
                found[name] = answer
                update(number)
    return found


def _kept(path: Path, question: Question) -> Reference | None:
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        content = json.loads(path.read_bytes())
        if content["digest"] == question.digest:
            positions = tuple((float(x), float(y)) for x, y in content["positions_m"])
            return Reference(float(content["mean_distance_m"]), positions, float(content["agreement"]))
    return None


def _keep(path: Path, question: Question, answer: Reference) -> None:
    content = {"format": _FORMAT, "digest": question.digest, "map": question.document.get("name")}
    content |= {"robots": question.robots, "radius_m": question.radius, "lattice": question.lattice}
    content |= {"restarts": question.restarts, "seed": question.seed}
    content |= {"mean_distance_m": answer.mean_distance, "agreement": answer.agreement}
    content["positions_m"] = answer.positions
    with replace_file(path) as part:
        part.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def searched(
    questions: Mapping[str, Any],
    workers: int,
    stop: Interruption,
    service: str = "robocov_app.replication.references:Searching",
) -> Iterator[tuple[str, Any]]:
    """Yield a service's answers to questions by their names, as they are found, until `stop`."""
    processes: list[subprocess.Popen[bytes]] = []
    own = threading.local()

    def begin() -> None:
        own.process = worker.started(service)
        processes.append(own.process)

    def answer(name: str) -> tuple[str, Any]:
        reply = worker.asked(own.process, questions[name])
        if reply is None:
            raise OutputError(f"references: the process that searched for that of {name} has ended")
        if reply.answer is None:
            raise OutputError(f"reference of map {name!r}: {reply.trouble}")
        return name, reply.answer

    pool = ThreadPoolExecutor(min(workers, len(questions)), initializer=begin)
    try:
        waiting = {pool.submit(answer, name) for name in questions}
        while waiting and not stop.requested:
            done, waiting = wait(waiting, timeout=_PATIENCE, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
    finally:
        # a search takes seconds: whoever has stopped must not wait for it
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        pool.shutdown()
        for process in processes:
            worker.ended(process)
