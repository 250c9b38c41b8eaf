"""Tasks of a sweep: order, names, and hashes of their inputs."""

from __future__ import annotations

import pickle
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_studies import HALL, ROOM, build_small_study, write_controller

from robocov.mapfile import load_map
from robocov_app.sweep.study.study import StudyMap
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import simulate

MAPS = (StudyMap("room", ROOM), StudyMap("hall", HALL))


@given(
    maps=st.integers(1, 2),
    robots=st.lists(st.integers(1, 9), min_size=1, max_size=3, unique=True),
    speeds=st.lists(st.floats(0.1, 2.0), min_size=1, max_size=2, unique=True),
    starts=st.sampled_from([(), ("*",), ("uniform",)]),
    seeds=st.lists(st.integers(0, 99), min_size=1, max_size=3, unique=True),
    k_rep=st.lists(st.floats(0.0, 5.0), min_size=1, max_size=3, unique=True),
    controllers=st.permutations(["rapf", "rpf", "lloyd"]),
)
def test_tasks_are_in_the_order_of_the_table(
    maps: int,
    robots: list[int],
    speeds: list[float],
    starts: tuple[str, ...],
    seeds: list[int],
    k_rep: list[float],
    controllers: list[str],
) -> None:
    study = build_small_study(
        maps=MAPS[:maps],
        robots=robots,
        max_speed=speeds,
        starts=starts,
        seeds=seeds,
        controllers=controllers,
        gains={"rpf": {"k_rep": k_rep}},
    )
    variants = [(name, k) for name in controllers for k in (k_rep if name == "rpf" else [None])]
    expected = [
        (each.name, n, speed, start, seed, *variant)
        for each in MAPS[:maps]
        for n, speed, start, seed, variant in product(
            robots, speeds, study.list_starts(each), seeds, variants
        )
    ]
    found = [
        (
            task.map,
            task.robots,
            task.team["max_speed"],
            task.start,
            task.seed,
            task.controller,
            task.gains["k_rep"] if task.controller == "rpf" else None,
        )
        for task in generate_tasks(study)
    ]
    assert found == expected
    assert len(study) == len(found)
    assert len({task.name for task in generate_tasks(study)}) == len(found)


def test_all_controllers_start_at_the_same_positions() -> None:
    study = build_small_study(
        controllers=("rapf", "rpf", "lloyd"), gains={"rapf": {"k_rep": [0.1, 1.0]}}, duration=0.0
    )
    starts: dict[int, set[bytes]] = {}
    for task in generate_tasks(study):
        record = simulate(task)
        starts.setdefault(task.seed, set()).add(record.positions[0].tobytes())
        assert np.array_equal(record.positions[0], ROOM.start("corner").sample(2, seed=task.seed))
    assert [len(places) for places in starts.values()] == [1, 1]
    assert starts[0] != starts[1]


def test_a_task_is_self_contained(tmp_path: Path) -> None:
    study = build_small_study(controllers=(write_controller(tmp_path, ""),))
    (tmp_path / "mine.py").unlink()
    task = next(generate_tasks(study))
    assert pickle.loads(pickle.dumps(task)) == task
    assert task.source is not None and "class Mine" in task.source.text
    assert len(simulate(task)) == 11


def test_equal_inputs_have_equal_hashes_and_others_do_not(tmp_path: Path) -> None:
    tasks = {task.name: task for task in generate_tasks(build_small_study())}
    assert set(tasks) == {task.name for task in generate_tasks(build_small_study())}
    for changes in (
        {"maps": (StudyMap("room", replace(ROOM, description="another")),)},
        {"duration": 0.6},
        {"dt": 0.04},
        {"lattice": 9},
        {"cost_hz": 3},
        {"record_hz": 3},
        {"viscosity": 3},
        {"communication_range": 3},
        {"seeds": (7, 8)},
        {"robots": (1,)},
        {"starts": ("spread",)},
        {"gains": {"rapf": {"k_rep": 1.5}, "rpf": {"k_rep": 1.5}}},
    ):
        others = {task.name for task in generate_tasks(build_small_study(**changes))}
        assert not others & set(tasks), changes


def test_the_hash_depends_on_the_source_of_a_controller_but_not_on_its_path(tmp_path: Path) -> None:
    names = []
    for folder, code in (("a", ""), ("b", ""), ("c", "        # another one\n")):
        (tmp_path / folder).mkdir()
        write_controller(tmp_path / folder, code)
        study = build_small_study(controllers=("mine.py:Mine",), folder=tmp_path / folder)
        names.append([task.name for task in generate_tasks(study)])
    assert names[0] == names[1]
    assert not set(names[0]) & set(names[2])


def test_the_hash_depends_on_imported_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "part_of_mine.py").write_text("import rest_of_mine\n")
    name = write_controller(tmp_path, "        import part_of_mine\n")
    names = []
    for text in ("PULL = 1.0\n", "PULL = 1.0\n", "PULL = 2.0\n"):
        (tmp_path / "rest_of_mine.py").write_text(text)
        study = build_small_study(controllers=(name,))
        names.append([task.name for task in generate_tasks(study)])
    assert names[0] == names[1]
    assert not set(names[0]) & set(names[2])
    (controller,) = study.to_json()["controllers"]
    assert controller["modules"] == {"part_of_mine": "import rest_of_mine\n", "rest_of_mine": "PULL = 2.0\n"}


def test_explicit_defaults_do_not_change_a_task() -> None:
    study = build_small_study(gains={"rapf": {"k_rep": 0.3}})
    assert [task.name for task in generate_tasks(study)] == [
        task.name for task in generate_tasks(build_small_study())
    ]


def test_names_of_tasks_are_portable_folder_names() -> None:
    unusual_map = StudyMap("Büro/2: *?<>|" + "x" * 60, ROOM)
    for task in generate_tasks(build_small_study(maps=(unusual_map,))):
        assert task.name.isascii()
        assert not set(task.name) & set('/\\:*?"<>| ')
        assert len(task.name) < 120
        assert task.name.endswith(task.input_hash[:10])


def test_a_task_contains_its_bundled_map() -> None:
    rooms = load_map("rooms")
    (task, *_) = generate_tasks(build_small_study(maps=(StudyMap("rooms", rooms),)))
    assert '"corridor"' in task.document
