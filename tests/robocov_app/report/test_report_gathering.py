"""Results from the disk in one form."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_run import ROOMS, SQUARE
from reported_results import HOSTILE, saved_comparison, saved_run, walk

from robocov.controllers import CONTROLLERS, get_gains
from robocov.errors import InputError
from robocov_app.report.results import FIGURES, gathered, printable
from robocov_app.sweep.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

FAILING = """
from dataclasses import dataclass
import robocov as rc

@dataclass(frozen=True)
class Failing:
    "Gives up in one half of the map."
    pull: float = rc.gain(1.0, "N/m", "how <i>strong</i>")

    def force(self, own):
        if own.position[0] > 4.0:
            raise ValueError("</script> too far")
        return self.pull * (own.centroid - own.position)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep that is really run."""
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


def test_a_run_is_a_result_of_one(tmp_path) -> None:
    run = saved_run(tmp_path / "one", walk(SQUARE))
    result = gathered(tmp_path / "one")
    (only,) = result.entries
    assert (result.kind, result.wanted, result.missing) == ("run", 1, 0)
    assert (only.map, only.controller, only.label, only.robots, only.seed) == ("square", "rapf", "RAPF", 4, 0)
    assert only.figures.keys() == set(FIGURES)
    assert only.final == run.summary["mean_distance_m"]
    assert only.figures["path_length_m"] == pytest.approx(np.mean(run.summary["path_length_m"]))
    assert result.record(only).positions == pytest.approx(run.record.positions)
    assert result.maps["square"] == SQUARE
    assert result.facts["duration_s"] == 6.0 and "numpy" in result.facts["versions"]


def test_a_comparison_is_its_runs_on_one_case(tmp_path) -> None:
    saved_comparison(tmp_path / "both")
    result = gathered(tmp_path / "both")
    assert result.kind == "comparison"
    assert [each.controller for each in result.entries] == ["rapf", "rpf"]
    assert len({each.case for each in result.entries}) == 1
    shutil.rmtree(tmp_path / "both" / "rpf")
    content = json.loads((tmp_path / "both" / "comparison.json").read_text()) | {"runs": []}
    (tmp_path / "both" / "comparison.json").write_text(json.dumps(content))
    part = gathered(tmp_path / "both")
    assert (len(part.entries), part.wanted, part.missing) == (1, 2, 1)


def test_a_sweep_is_its_table(folder) -> None:
    result = gathered(folder)
    assert (result.kind, len(result.entries), result.wanted, result.missing) == ("sweep", 24, 24, 0)
    assert list(result.maps) == ["yard", "flat"] and result.maps["flat"] == ROOMS
    rapf = [each for each in result.entries if each.controller == "rapf"]
    assert [name for name, _ in rapf[0].gains] == list(get_gains(CONTROLLERS["rapf"]))
    assert dict(rapf[0].gains)["target"] == "centroid"
    assert {dict(each.gains)["attraction_limit"] for each in rapf} == {2.0, None}
    assert {each.team for each in rapf} == {(("max_speed", 0.5),), (("max_speed", 1.0),)}
    own = next(each for each in result.entries if each.controller != "rapf")
    assert (own.label, own.gains) == ("Failing", (("pull", 1.0),))
    assert result.units["k_rep"] == "N m³" and result.units["pull"] == "N/m"
    assert result.meanings["pull"] == "how <i>strong</i>"
    assert "max_speed" not in result.facts["team"] and result.facts["team"]["viscosity"] == 2.0


@pytest.mark.slow
def test_failed_runs_have_their_error_and_no_figures(folder) -> None:
    result = gathered(folder)
    assert result.failed and len(result.fine) + len(result.failed) == 24
    for each in result.failed:
        assert "</script> too far" in (each.error or "")
        assert each.figures == {} and np.isnan(each.final)
    first = result.fine[0]
    record, history = result.record(first), result.history(first)
    assert record.seed == first.seed and record.environment.name == SQUARE.name
    assert history is not None and history.mean_distance[-1] == pytest.approx(first.final)


def test_an_unfinished_sweep_says_what_is_missing(folder, tmp_path) -> None:
    copy = tmp_path / "part"
    shutil.copytree(folder, copy)
    lines = (copy / "results.csv").read_text().splitlines()
    (copy / "results.csv").write_text("\n".join(lines[:8]) + "\n")
    result = gathered(copy)
    assert (len(result.entries), result.missing) == (7, 17)
    assert result.entries == tuple(
        each for each, _ in zip(moved(gathered(folder).entries, copy), range(7), strict=False)
    )
    (copy / "results.csv").write_text(lines[0] + "\n")
    with pytest.raises(InputError, match="not one of the 24 runs of the sweep is done"):
        gathered(copy)


def moved(entries, folder):
    return [replace(each, folder=folder / "runs" / each.folder.name) for each in entries]


def broken(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda copy: copy / "nothing", "folder not found"),
        (lambda copy: copy / "runs", "not the folder of a run, a comparison or a sweep"),
        (lambda copy: broken(copy, "study.json", "{"), "study.json: cannot be read"),
        (
            lambda copy: broken(copy, "study.json", '{"runs": 3}'),
            "study.json: the study cannot be read: KeyError",
        ),
        (
            lambda copy: broken(copy, "results.csv", "PAR"),
            "results.csv: line 1: expected the header of a table",
        ),
    ],
)
def test_what_cannot_be_read_is_named(folder, tmp_path, spoil, message) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("study.json", "results.csv"):
        shutil.copy(folder / name, copy)
    (copy / "runs").mkdir()
    with pytest.raises(InputError) as caught:
        gathered(spoil(copy))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (shutil.rmtree, "there is no run.json"),
        (lambda run: (run / "run.json").unlink(), "there is no run.json"),
        (lambda run: (run / "run.json").write_text('{"format": "robocov-run", "version": 99}'), ""),
        (lambda run: (run / "record.npz").write_bytes(b"PK" * 9), ""),
        (lambda run: (run / "record.npz").unlink(), ""),
        (lambda run: (run / "cost.csv").write_text("time_s\n"), "cost.csv: line 1: "),
    ],
)
def test_a_damaged_run_of_a_sweep_is_left_out_and_named(folder, tmp_path, spoil, reason) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    whole = gathered(copy)
    first = whole.fine[0]
    spoil(first.folder)
    told: list[int] = []
    result = whole.readable(told.append)
    assert result.entries == tuple(each for each in whole.entries if each is not first)
    ((name, words),) = result.damaged
    assert name == first.folder.name and reason in words and str(tmp_path) not in words
    assert told == list(range(1, len(whole.fine) + 1)) and result.missing == 0


def test_damaged_runs_of_a_comparison_are_left_out_and_named(tmp_path) -> None:
    saved_comparison(tmp_path / "three", ("rapf", "rpf", "lloyd"))
    (tmp_path / "three/rpf/record.npz").write_bytes(b"")
    other = replace(SQUARE, boundary=((0, 0), (9, 0), (9, 8), (0, 8)))
    saved_run(tmp_path / "other", walk(other))
    shutil.rmtree(tmp_path / "three/lloyd")
    shutil.copytree(tmp_path / "other", tmp_path / "three/lloyd")
    result = gathered(tmp_path / "three")
    assert [each.controller for each in result.entries] == ["rapf"]
    assert [name for name, _ in result.damaged] == ["rpf", "lloyd"]
    assert "another map than in rapf" in result.damaged[1].reason and result.missing == 0


def test_controllers_of_one_name_are_told_apart(tmp_path) -> None:
    saved_comparison(tmp_path / "both", ("a.py:Mine", "b.py:Mine"))
    assert [each.label for each in gathered(tmp_path / "both").entries] == ["Mine", "Mine #2"]


def test_words_are_what_a_page_can_hold() -> None:
    assert printable("Größe 東京 m²") == "Größe 東京 m²"
    assert printable("a\x00\n\ud800b") == "a\ufffd\ufffd\ufffdb"
    assert "<" in printable(HOSTILE)  # escaping is the page's work
