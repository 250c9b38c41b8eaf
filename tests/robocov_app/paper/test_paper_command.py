"""`robocov paper`: the command with a tiny study, interrupted and killed; and once as people call it."""

from __future__ import annotations

import json

import pytest
from called import complaint
from tiny_paper import TINY

from robocov_app.cli import main
from robocov_app.paper import plan as planned


@pytest.mark.xdist_group("tiny-paper")
class TestTiny:
    def test_figures_only(self, tmp_path, monkeypatch, capsys):
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

    def test_bad_input(self, tmp_path, capsys):
        (tmp_path / "notes.txt").write_text("mine")
        assert "is no study of the paper" in complaint(capsys, "paper", "--out", str(tmp_path))
        assert "--workers: 0" in complaint(capsys, "paper", "--out", "x", "--workers", "0")
        assert "--out" in complaint(capsys, "paper")
        said = complaint(capsys, "paper", "--out", "x", "--beyond-only", "--figures-only")
        assert "--figures-only and --beyond-only: one of them was wanted" in said
        assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.xdist_group("paper")
def test_the_quick_study_finds_what_is_plain(tmp_path):
    """The one test that takes a minute or two: the quick study as people call it.

    Its maps are few: what is close is for the full study. The part beyond the paper has a test of its own.
    """
    out = tmp_path / "out"
    assert main(["paper", "--quick", "--without-beyond", "--out", str(out)]) == 0
    assert not (out / "beyond.html").exists()
    claims = {claim["key"]: claim for claim in json.loads((out / "claims.json").read_text())}
    assert len(claims) == 15
    assert claims["nonconvex-final-shared"]["verdict"] == "holds"
    assert claims["nonconvex-motion-shared"]["verdict"] == "holds"
    assert claims["gap-rpf"]["verdict"] == "holds"
    assert claims["convex-spreading"]["verdict"] == "does not hold"
    assert claims["convex-final"]["estimate"] == pytest.approx(1.0, abs=0.03)
    assert claims["nonconvex-final-shared"]["estimate"] == pytest.approx(0.7, abs=0.2)
    for claim in claims.values():
        low, high = claim["interval"]
        assert low <= claim["estimate"] <= high
        assert claim["maps"] >= 5 and claim["runs"] >= 15
    for number in range(1, 9):
        for suffix in ("png", "svg", "pdf"):
            assert (out / "figures" / f"figure-{number}.{suffix}").is_file()
    assert len((out / "index.html").read_bytes()) < 1_500_000
    assert (out / "studies" / "claims" / "results.parquet").is_file()
