"""Loading results from folders."""

import json
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_run import ROOMS, SQUARE
from reported_results import HOSTILE, build_record, save_comparison, save_run

from robocov.controllers import CONTROLLERS, get_gains
from robocov.errors import InputError
from robocov_app.report.results.loading import load_result
from robocov_app.report.results.result import METRIC_NAMES, ReportedRun, replace_unprintable
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

FAILING = """
from dataclasses import dataclass
import robocov as rc

@dataclass(frozen=True)
class Failing:
    "Fails in one half of the map."
    pull: float = rc.gain(1.0, "N/m", "how <i>strong</i>")

    def force(self, own):
        if own.position[0] > 4.0:
            raise ValueError("</script> too far")
        return self.pull * (own.centroid - own.position)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a small sweep, and return its folder."""
    root = tmp_path_factory.mktemp("study")
    (root / "failing.py").write_text(FAILING)
    study = Study(
        maps=(StudyMap("yard", SQUARE), StudyMap("flat", ROOMS)),
        controllers=("rapf", "failing.py:Failing"),
        gains={"rapf": {"attraction_limit": [2.0, None]}},
        robots=(3,),
        seeds=(0, 1),
        max_speed=(0.5, 1.0),
        duration=0.2,
        lattice=12,
        folder=root,
    )
    sweep(study, root / "out", workers=1, quiet=True)
    return root / "out"


def test_the_folder_of_a_run_is_a_result_with_one_run(tmp_path) -> None:
    saved_run = save_run(tmp_path / "one", build_record(SQUARE))
    result = load_result(tmp_path / "one")
    (run,) = result.runs
    assert (result.kind, result.expected_count, result.missing_count) == ("run", 1, 0)
    assert (run.map, run.controller, run.label) == ("square", "rapf", "RAPF")
    assert (run.robots, run.seed) == (4, 0)
    assert run.metrics.keys() == set(METRIC_NAMES)
    assert run.final_distance == saved_run.summary["mean_distance_m"]
    assert run.metrics["path_length_m"] == pytest.approx(np.mean(saved_run.summary["path_length_m"]))
    assert result.read_record(run).positions == pytest.approx(saved_run.record.positions)
    assert result.maps["square"] == SQUARE
    assert result.facts["duration_s"] == 6.0 and "numpy" in result.facts["versions"]


def test_the_duration_of_a_run_that_starts_later_is_counted_from_its_start(tmp_path) -> None:
    record = build_record(SQUARE)
    replace(record, time=record.time + 5.0).save(tmp_path / "late")
    assert load_result(tmp_path / "late").facts["duration_s"] == pytest.approx(6.0)


@pytest.mark.parametrize("lengths", [["long"], [None], [True], []])
def test_path_lengths_that_are_not_numbers_are_unknown(tmp_path, lengths) -> None:
    build_record(SQUARE).save(tmp_path / "run", {"path_length_m": lengths})
    (run,) = load_result(tmp_path / "run").runs
    assert run.metrics["path_length_m"] is None


def test_runs_of_a_comparison_have_the_same_case(tmp_path) -> None:
    save_comparison(tmp_path / "both")
    result = load_result(tmp_path / "both")
    assert result.kind == "comparison"
    assert [run.controller for run in result.runs] == ["rapf", "rpf"]
    assert len({run.case for run in result.runs}) == 1
    shutil.rmtree(tmp_path / "both" / "rpf")
    content = json.loads((tmp_path / "both" / "comparison.json").read_text()) | {"runs": []}
    (tmp_path / "both" / "comparison.json").write_text(json.dumps(content))
    unfinished = load_result(tmp_path / "both")
    assert (len(unfinished.runs), unfinished.expected_count, unfinished.missing_count) == (1, 2, 1)


def test_runs_of_a_sweep_are_the_rows_of_its_table(folder) -> None:
    result = load_result(folder)
    assert result.kind == "sweep"
    assert (len(result.runs), result.expected_count, result.missing_count) == (24, 24, 0)
    assert list(result.maps) == ["yard", "flat"]
    assert result.maps["flat"] == ROOMS
    rapf = [run for run in result.runs if run.controller == "rapf"]
    assert [name for name, _ in rapf[0].gains] == list(get_gains(CONTROLLERS["rapf"]))
    assert dict(rapf[0].gains)["target"] == "centroid"
    assert {dict(run.gains)["attraction_limit"] for run in rapf} == {2.0, None}
    assert {run.team for run in rapf} == {(("max_speed", 0.5),), (("max_speed", 1.0),)}
    own = next(run for run in result.runs if run.controller != "rapf")
    assert (own.label, own.gains) == ("Failing", (("pull", 1.0),))
    assert result.gain_units["k_rep"] == "N m³"
    assert result.gain_units["pull"] == "N/m"
    assert result.gain_meanings["pull"] == "how <i>strong</i>"
    assert "max_speed" not in result.facts["team"]
    assert result.facts["team"]["viscosity"] == 2.0


@pytest.mark.slow
def test_failed_runs_have_their_error_and_no_metrics(folder) -> None:
    result = load_result(folder)
    assert result.failed_runs
    assert len(result.completed_runs) + len(result.failed_runs) == 24
    for run in result.failed_runs:
        assert "</script> too far" in (run.error or "")
        assert run.metrics == {}
        assert np.isnan(run.final_distance)
    first = result.completed_runs[0]
    record = result.read_record(first)
    history = result.read_history(first)
    assert record.seed == first.seed
    assert record.environment.name == SQUARE.name
    assert history is not None
    assert history.mean_distance[-1] == pytest.approx(first.final_distance)


def test_missing_runs_of_an_unfinished_sweep_are_counted(folder, tmp_path) -> None:
    copy = tmp_path / "part"
    shutil.copytree(folder, copy)
    lines = (copy / "results.csv").read_text().splitlines()
    (copy / "results.csv").write_text("\n".join(lines[:8]) + "\n")
    result = load_result(copy)
    assert (len(result.runs), result.missing_count) == (7, 17)
    assert result.runs == tuple(move_runs(load_result(folder).runs[:7], copy))
    (copy / "results.csv").write_text(lines[0] + "\n")
    with pytest.raises(InputError, match="none of the 24 runs has finished"):
        load_result(copy)


def move_runs(runs: Sequence[ReportedRun], folder: Path) -> list[ReportedRun]:
    """Return the runs as if their sweep were in another folder."""
    return [replace(run, folder=folder / "runs" / run.folder.name) for run in runs]


def write_file(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda copy: copy / "nothing", "got a path that does not exist"),
        (lambda copy: copy / "runs", "got a folder without run.json, comparison.json or study.json"),
        (lambda copy: write_file(copy, "study.json", "{"), "study.json: cannot be read"),
        (
            lambda copy: write_file(copy, "study.json", '{"runs": 3}'),
            "study.json: the study cannot be read: KeyError",
        ),
        (
            lambda copy: write_file(copy, "results.csv", "PAR"),
            "results.csv: line 1: expected the header of a table",
        ),
    ],
)
def test_unreadable_files_are_reported_by_name(folder, tmp_path, damage, message) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("study.json", "results.csv"):
        shutil.copy(folder / name, copy)
    (copy / "runs").mkdir()
    with pytest.raises(InputError) as caught:
        load_result(damage(copy))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (shutil.rmtree, "got a path that does not exist"),
        (lambda run: (run / "run.json").unlink(), "got a folder without run.json"),
        (lambda run: (run / "run.json").write_text('{"format": "robocov-run", "version": 99}'), ""),
        (lambda run: (run / "record.npz").write_bytes(b"PK" * 9), ""),
        (lambda run: (run / "record.npz").unlink(), ""),
        (lambda run: (run / "cost.csv").write_text("time_s\n"), "cost.csv: line 1: "),
    ],
)
def test_a_damaged_run_of_a_sweep_is_dropped_and_reported(folder, tmp_path, damage, reason) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    complete = load_result(copy)
    first = complete.completed_runs[0]
    damage(first.folder)
    counts: list[int] = []
    result = complete.drop_unreadable(counts.append)
    assert result.runs == tuple(run for run in complete.runs if run is not first)
    ((name, reason_text),) = result.damaged_runs
    assert name == first.folder.name
    assert reason in reason_text
    assert str(tmp_path) not in reason_text
    assert counts == list(range(1, len(complete.completed_runs) + 1))
    assert result.missing_count == 0


def test_damaged_runs_of_a_comparison_are_dropped_and_reported(tmp_path) -> None:
    save_comparison(tmp_path / "three", ("rapf", "rpf", "lloyd"))
    (tmp_path / "three/rpf/record.npz").write_bytes(b"")
    other = replace(SQUARE, boundary=((0, 0), (9, 0), (9, 8), (0, 8)))
    save_run(tmp_path / "other", build_record(other))
    shutil.rmtree(tmp_path / "three/lloyd")
    shutil.copytree(tmp_path / "other", tmp_path / "three/lloyd")
    result = load_result(tmp_path / "three")
    assert [run.controller for run in result.runs] == ["rapf"]
    assert [name for name, _ in result.damaged_runs] == ["rpf", "lloyd"]
    assert "expected the same map as in rapf" in result.damaged_runs[1].reason
    assert result.missing_count == 0


def test_labels_of_controllers_with_the_same_name_are_numbered(tmp_path) -> None:
    save_comparison(tmp_path / "both", ("a.py:Mine", "b.py:Mine"))
    assert [run.label for run in load_result(tmp_path / "both").runs] == ["Mine", "Mine #2"]


def test_characters_that_cannot_be_displayed_are_replaced() -> None:
    assert replace_unprintable("Größe 東京 m²") == "Größe 東京 m²"
    assert replace_unprintable("a\x00\n\ud800b") == "a\ufffd\ufffd\ufffdb"
    assert "<" in replace_unprintable(HOSTILE)  # The template escapes it.
