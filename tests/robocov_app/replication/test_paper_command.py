"""`robocov paper`: the command with a tiny study; the quick one is run by `tests/bench/quick_paper.py`."""

import json

import pytest
from called import complaint
from tiny_paper import TINY

from robocov_app.cli import main
from robocov_app.replication import plan as planned


@pytest.mark.slow
@pytest.mark.xdist_group("tiny-paper")
def test_figures_only(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(planned, "QUICK", TINY)
    out = tmp_path / "out"
    assert main(["paper", "--quick", "--figures-only", "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["runs"], answer["claims"]) == (8, [])
    assert not (out / "claims.json").exists()
    assert len(list((out / "figures").glob("*.pdf"))) == 8
    content = (out / "index.html").read_text(encoding="utf-8")
    assert content.count("<img") == 8
    assert "Verdicts" not in content and "Only the figures were asked for" in content


def test_bad_input(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    assert "is no study of the paper" in complaint(capsys, "paper", "--out", str(tmp_path))
    assert "--workers: 0" in complaint(capsys, "paper", "--out", "x", "--workers", "0")
    assert "--out" in complaint(capsys, "paper")
    said = complaint(capsys, "paper", "--out", "x", "--beyond-only", "--figures-only")
    assert "--figures-only and --beyond-only: one of them was wanted" in said
    assert (tmp_path / "notes.txt").read_text() == "mine"
