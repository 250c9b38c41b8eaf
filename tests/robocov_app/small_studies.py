"""Small studies, controllers and results for the tests of sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocov.environment import CircleObstacle, DiscStart, Environment, UniformStart
from robocov_app.sweep.executor import Executor, Result
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import perform

ROOM = Environment(
    "A room",
    ((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)),
    (CircleObstacle((3.0, 2.0), 0.6),),
    {"corner": DiscStart((1.0, 1.0), 0.7), "spread": UniformStart()},
)
HALL = Environment(
    "A hall", ((0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (0.0, 3.0)), (), {"door": DiscStart((1, 1), 0.6)}
)

HEAD = """
import os, signal, time
from dataclasses import dataclass
from pathlib import Path

@dataclass(frozen=True)
class Mine:
    pull: float = 1.0

    def force(self, own):
"""
PULL = "        return self.pull * (own.centroid - own.position)\n"


def build_small_study(**changes: Any) -> Study:
    """Build a study whose runs take some hundredths of a second."""
    options: dict[str, Any] = {
        "maps": (StudyMap("room", ROOM),),
        "controllers": ("rapf", "rpf"),
        "seeds": range(2),
        "robots": (2,),
        "duration": 0.5,
        "dt": 0.05,
        "lattice": 8,
        "record_hz": 4.0,
    }
    return Study(**options | changes)


def write_controller(folder: Path, code: str, name: str = "mine.py") -> str:
    """Write a controller whose method starts with some code, and return its name."""
    (folder / name).write_text(HEAD + code + PULL)
    return f"{folder / name}:Mine"


def read_tables(folder: Path) -> list[bytes]:
    """Return the content of the tables of a sweep."""
    return [path.read_bytes() for path in sorted(folder.glob("results.*"))]


def list_run_folders(folder: Path) -> list[str]:
    """Return the names of the folders of runs."""
    runs = folder / "runs"
    return sorted(path.name for path in runs.iterdir()) if runs.is_dir() else []


class DirectExecutor(Executor):
    """Executes tasks in this process, instead of a `LocalPool`."""

    capacity = 2

    def __init__(self, workers: int) -> None:
        super().__init__()
        self._tasks: list[Task] = []

    def __exit__(self, *exception: object) -> None: ...

    def _start(self, task: Task) -> None:
        self._tasks.append(task)

    def _wait_for_result(self, timeout: float) -> Result | None:
        if not self._tasks:
            return None
        task = self._tasks.pop(0)
        return task, perform(task)
