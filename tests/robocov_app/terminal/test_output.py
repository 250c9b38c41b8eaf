"""Printed JSON and CSV: digits, infinity and formulas."""

import csv
import io
import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from robocov.files.csv_cells import unquote_cell
from robocov_app.terminal.output import format_csv_line, replace_non_finite, write_csv, write_json


def test_numbers_keep_all_their_digits(tmp_path: Path) -> None:
    write_csv(tmp_path / "t.csv", "a,b", [[0.1 + 0.2, 1], [1e-300, None]])
    assert (tmp_path / "t.csv").read_text() == "a,b\n0.30000000000000004,1\n1e-300,\n"
    write_json(tmp_path / "t.json", {"a": [0.1 + 0.2]})
    assert json.loads((tmp_path / "t.json").read_text()) == {"a": [0.1 + 0.2]}


def test_json_has_no_word_for_infinity() -> None:
    content = {"a": float("nan"), "b": [1.0, float("inf")], "c": {"d": -float("inf")}, "e": "nan"}
    assert replace_non_finite(content) == {"a": None, "b": [1.0, None], "c": {"d": None}, "e": "nan"}


FORMULAS = ("=1+1", "+1", "-1.json", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "＝1", "'=1", "''-")


@given(st.lists(st.one_of(st.text(), st.sampled_from(FORMULAS)), min_size=1))
def test_texts_are_not_formulas_and_come_back(texts: list[str]) -> None:
    texts = [text.replace("\0", "") for text in texts]
    (cells,) = csv.reader(io.StringIO(format_csv_line(texts), newline=""))
    assert [unquote_cell(cell) for cell in cells] == texts
    assert not any(cell.lstrip("'")[:1] in "=+-@\t\r\n" and cell[0] != "'" for cell in cells if cell)


def test_numbers_are_never_quoted() -> None:
    assert format_csv_line([-1, -0.5, None, "=1+1", "a,b"]) == '-1,-0.5,,\'=1+1,"a,b"\n'
