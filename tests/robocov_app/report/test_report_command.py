"""`robocov report` writes a page about the results in folders."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from command_calls import read_error, read_json
from drawn_run import SQUARE
from reported_results import build_record, save_comparison, save_run

from robocov.files.result_folder import create_result, is_report
from robocov_app.cli import main


@pytest.fixture
def run(tmp_path: Path) -> Path:
    save_run(tmp_path / "one", build_record(SQUARE, robots=2, seconds=1.0))
    return tmp_path / "one"


def test_the_page_is_saved_in_the_folder_of_the_run(run, capsys) -> None:
    assert main(["report", str(run)]) == 0
    output = capsys.readouterr()
    assert output.out.splitlines()[0] == f"{run}: run"
    assert is_report(run / "report.html")
    assert "replacing" not in output.out
    before = (run / "report.html").read_bytes()
    assert main(["report", str(run)]) == 0
    assert capsys.readouterr().out.rstrip().endswith("MB), replacing an earlier report")
    assert (run / "report.html").read_bytes() == before


def test_the_page_about_several_folders_is_saved_next_to_them(run, tmp_path, monkeypatch, capsys) -> None:
    save_run(tmp_path / "two", build_record(SQUARE, robots=2, seconds=1.0))
    save_run(tmp_path / "more" / "three", build_record(SQUARE, robots=2, seconds=1.0))
    monkeypatch.chdir(tmp_path / "more")
    folders = [str(run), str(tmp_path / "two")]
    assert read_json(capsys, "report", *folders)["path"] == str(tmp_path / "report.html")
    assert read_json(capsys, "report", *folders, "three")["path"] == "report.html"
    assert sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.html")) == [
        "more/report.html",
        "report.html",
    ]
    (tmp_path / "report.html").write_text("mine")
    assert "is not a report of robocov" in read_error(capsys, "report", *folders)


def test_a_summary_is_printed_as_json(run, tmp_path, capsys) -> None:
    save_comparison(tmp_path / "both")
    out = tmp_path / "page.html"
    options = ("--out", str(out), "--title", "<Two>")
    summary = read_json(capsys, "report", str(run), str(tmp_path / "both"), *options)
    assert summary["path"] == str(out)
    assert summary["bytes"] == out.stat().st_size
    assert [(each["kind"], each["runs"], each["shown"]) for each in summary["results"]] == [
        ("run", 1, 1),
        ("comparison", 2, 2),
    ]
    assert {each["failed"] + each["missing"] for each in summary["results"]} == {0}
    assert "<title>&lt;Two&gt; – robocov</title>" in out.read_text()


def test_foreign_files_are_not_replaced(run, capsys) -> None:
    (run / "report.html").write_text("mine")
    message = read_error(capsys, "report", str(run))
    assert message.startswith(f"{run / 'report.html'}: the file is not a report of robocov")
    assert (run / "report.html").read_text() == "mine"
    assert main(["report", str(run), "--overwrite", "--theme", "dark"]) == 0
    assert is_report(run / "report.html")


def test_overwriting_results_removes_reports_but_no_foreign_files(run) -> None:
    assert main(["report", str(run)]) == 0
    save_run(run / "again", build_record(SQUARE, robots=2, seconds=1.0))
    (run / "again" / "report.html").write_text("mine")
    for folder, remaining in ((run, ["again", "run.json"]), (run / "again", ["report.html", "run.json"])):
        with create_result(folder, overwrite=True) as result:
            (result.staging / "run.json").write_text("{}")
        assert sorted(path.name for path in folder.glob("[!.]*")) == remaining


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["nothing"],
            "nothing: expected the folder of a run, comparison or sweep, got a path that",
        ),
        (["."], ".: expected the folder of a run, comparison or sweep, got a folder without run.json, "),
        (["one", "--out", "no/page.html"], "no/page.html: cannot be written: there is no folder no"),
        (["one", "--out", "one"], "one: expected a file, got a folder"),
        ([], "DIR"),
    ],
)
def test_invalid_arguments_are_rejected(run, tmp_path, monkeypatch, capsys, arguments, message) -> None:
    monkeypatch.chdir(tmp_path)
    if arguments:
        assert message in read_error(capsys, "report", *arguments)
    else:
        assert main(["report"]) == 2
        assert message in capsys.readouterr().err
    assert list(tmp_path.rglob("*.html")) == []


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root may write to every folder")
def test_a_folder_without_write_permission_is_reported(run, capsys) -> None:
    run.chmod(0o500)
    try:
        assert "cannot be written" in read_error(capsys, "report", str(run))
    finally:
        run.chmod(0o700)


def test_the_page_contains_no_paths_of_the_machine(run) -> None:
    assert main(["report", str(run)]) == 0
    assert str(run.parent) not in (run / "report.html").read_text()


def test_the_help_imports_no_large_packages() -> None:
    script = (
        "import sys\nfrom robocov_app.cli import main\nmain(['report', '--help'])\n"
        "print('LOADED', ' '.join(sys.modules))"
    )
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    help_text, _, loaded = process.stdout.partition("LOADED")
    assert "Example: robocov report" in help_text
    assert re.search(r"--theme \{auto,light,dark\}", help_text)
    assert not set(loaded.split()) & {"matplotlib", "jinja2", "pyarrow", "pygame", "scipy"}


@pytest.mark.slow
def test_an_unfinished_comparison_is_reported(tmp_path, capsys) -> None:
    save_comparison(tmp_path / "both")
    content = json.loads((tmp_path / "both/comparison.json").read_text())
    content |= {"folders": ["rapf", "rpf", "lloyd"], "runs": []}
    (tmp_path / "both/comparison.json").write_text(json.dumps(content))
    summary = read_json(capsys, "report", str(tmp_path / "both"))
    assert summary["results"][0]["missing"] == 1
    assert "Not finished: 1 of 3 runs is missing." in (tmp_path / "both/report.html").read_text()


@pytest.mark.slow
def test_damaged_runs_are_skipped_and_reported(run, tmp_path, capsys) -> None:
    save_comparison(tmp_path / "both")
    (tmp_path / "both/rpf/record.npz").write_bytes(b"PK")
    assert main(["report", str(tmp_path / "both")]) == 0
    errors = capsys.readouterr().err
    assert f"robocov: warning: {tmp_path / 'both'}: rpf is skipped: " in errors
    page = (tmp_path / "both/report.html").read_text()
    assert "1 run cannot be read and is left out: rpf (" in page
    assert "Runs that failed or cannot be read" in page
    summary = read_json(capsys, "report", str(tmp_path / "both"))["results"][0]
    assert (summary["runs"], summary["missing"]) == (1, 0)
    assert summary["damaged"][0]["folder"] == "rpf"
    # A damaged run next to another result is skipped as well.
    (run / "record.npz").write_bytes(b"PK")
    assert main(["report", str(tmp_path / "both"), str(run)]) == 0
    assert "one is skipped: " in capsys.readouterr().err


def test_without_readable_runs_nothing_is_written(run, capsys) -> None:
    (run / "record.npz").write_bytes(b"PK")
    message = read_error(capsys, "report", str(run))
    assert "no runs remain to report" in message
    assert not (run / "report.html").exists()


@pytest.mark.slow
def test_the_best_placement_is_cached(run, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("robocov_app.report.results.references.RESTARTS", 2)
    page = run / "report.html"
    assert main(["report", str(run)]) == 0
    assert "best known placement" not in page.read_text()
    assert main(["report", str(run), "--optimum"]) == 0
    (above,) = re.findall(r"average, a gap of ([\d.]+)% to the best known placement", page.read_text())
    assert float(above) > 0.0
    before = page.read_bytes()
    # From now on, a search would fail.
    monkeypatch.setattr("robocov_app.report.results.references.find_optimum", None)
    assert main(["report", str(run)]) == 0
    assert page.read_bytes() == before
    monkeypatch.setenv("ROBOCOV_CACHE", "")
    assert main(["report", str(run)]) == 0
    assert "best known placement" not in page.read_text()
    assert "searching" not in capsys.readouterr().err.replace("searching: 1 of 1", "")


def test_a_dimensionless_gain_has_no_unit(run) -> None:
    save_run(
        run / "atlas",
        replace(
            build_record(SQUARE, robots=2, seconds=1.0),
            controller="atlas",
            gains={"threshold": 0.01, "stake": 0.004},
        ),
    )
    assert main(["report", str(run / "atlas")]) == 0
    assert "threshold 0.01, stake 0.004<" in (run / "atlas/report.html").read_text()
