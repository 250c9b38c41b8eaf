from __future__ import annotations

import json
from pathlib import Path

import pytest

from robocov.errors import InputError, OutputError
from robocov_app.output import finite, prepared, write_csv, write_json


def test_a_new_folder_is_made_with_its_parents(tmp_path: Path) -> None:
    assert prepared(tmp_path / "a" / "b", overwrite=False).is_dir()
    assert prepared(tmp_path / "a" / "b", overwrite=False).is_dir(), "an empty one may be used"


def test_a_folder_in_use_needs_overwrite(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(InputError, match="not empty; another --out, or --overwrite, was wanted"):
        prepared(tmp_path, overwrite=False)


def test_overwrite_removes_results_of_a_comparison_too(tmp_path: Path) -> None:
    part = tmp_path / "rapf"
    part.mkdir()
    for path in (
        tmp_path / "comparison.json",
        tmp_path / ".run.77.part.mp4",
        part / "run.json",
        part / "record.npz",
        tmp_path / "mine.txt",
    ):
        path.touch()
    kept = tmp_path / "photos"
    kept.mkdir()
    (kept / "000000.png").touch()
    prepared(tmp_path, overwrite=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.txt", "photos"]
    assert (kept / "000000.png").exists()


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
