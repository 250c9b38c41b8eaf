from __future__ import annotations

import json
from pathlib import Path

import pytest

from robocov.errors import InputError, OutputError
from robocov_app.output import cleared, finite, prepared, results, write_csv, write_json


def test_a_new_folder_is_made_with_its_parents(tmp_path: Path) -> None:
    assert prepared(tmp_path / "a" / "b", overwrite=False).is_dir()
    assert prepared(tmp_path / "a" / "b", overwrite=False).is_dir(), "an empty one may be used"


def test_a_folder_in_use_needs_overwrite(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(InputError, match="not empty; another --out, or --overwrite, was wanted"):
        prepared(tmp_path, overwrite=False)


def a_run(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "run.json").write_text('{"format": "robocov-run"}')
    (folder / "record.npz").touch()
    (folder / "frames").mkdir()
    (folder / "frames" / "000000.png").touch()
    return folder


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_nothing_is_removed_before_there_is_something_new(tmp_path: Path) -> None:
    folder = a_run(tmp_path / "one")
    with pytest.raises(RuntimeError), results(folder, overwrite=True):
        raise RuntimeError
    assert names(folder) == ["frames", "record.npz", "run.json"]
    cleared(folder)
    assert names(folder) == []


def test_a_comparison_is_replaced_with_its_runs_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "comparison"
    a_run(folder / "rapf")
    a_run(folder / "kept")
    (folder / "linked").symlink_to(a_run(tmp_path / "elsewhere"))
    (folder / "comparison.json").write_text(
        '{"format": "robocov-comparison", "folders": ["rapf", "linked", "../elsewhere"]}'
    )
    for name in (".run.77.part.mp4", "comparison.csv", "mine.txt"):
        (folder / name).touch()
    cleared(prepared(folder, overwrite=True))
    assert names(folder) == ["kept", "linked", "mine.txt"]
    assert names(folder / "kept") == ["frames", "record.npz", "run.json"]
    assert names(tmp_path / "elsewhere") == ["frames", "record.npz", "run.json"]


@pytest.mark.parametrize("file", ["cost.csv", "run.json", "notes.txt"])
def test_what_is_no_result_is_left_alone(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_text("{}")
    a_run(tmp_path / "project" / "run")
    for folder in (tmp_path, tmp_path / "project"):
        with pytest.raises(InputError, match="no result of robocov, so --overwrite leaves it alone"):
            prepared(folder, overwrite=True)
        cleared(folder)
    assert (tmp_path / file).read_text() == "{}"
    assert names(tmp_path / "project" / "run") == ["frames", "record.npz", "run.json"]


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(OutputError, match="cannot be used for results"):
        prepared(tmp_path / "x", overwrite=True)


def test_numbers_keep_all_their_digits(tmp_path: Path) -> None:
    write_csv(tmp_path / "t.csv", "a,b", [[0.1 + 0.2, 1], [1e-300, None]])
    assert (tmp_path / "t.csv").read_text() == "a,b\n0.30000000000000004,1\n1e-300,None\n"
    write_json(tmp_path / "t.json", {"a": [0.1 + 0.2]})
    assert json.loads((tmp_path / "t.json").read_text()) == {"a": [0.1 + 0.2]}


def test_json_has_no_word_for_infinity() -> None:
    content = {"a": float("nan"), "b": [1.0, float("inf")], "c": {"d": -float("inf")}, "e": "nan"}
    assert finite(content) == {"a": None, "b": [1.0, None], "c": {"d": None}, "e": "nan"}
