import json
from pathlib import Path

from robocov_app.terminal.output import finite, write_csv, write_json


def test_numbers_keep_all_their_digits(tmp_path: Path) -> None:
    write_csv(tmp_path / "t.csv", "a,b", [[0.1 + 0.2, 1], [1e-300, None]])
    assert (tmp_path / "t.csv").read_text() == "a,b\n0.30000000000000004,1\n1e-300,None\n"
    write_json(tmp_path / "t.json", {"a": [0.1 + 0.2]})
    assert json.loads((tmp_path / "t.json").read_text()) == {"a": [0.1 + 0.2]}


def test_json_has_no_word_for_infinity() -> None:
    content = {"a": float("nan"), "b": [1.0, float("inf")], "c": {"d": -float("inf")}, "e": "nan"}
    assert finite(content) == {"a": None, "b": [1.0, None], "c": {"d": None}, "e": "nan"}
