"""A gain that is a word, through all that knows gains: commands, studies, tables, reports, the window."""

import json
from pathlib import Path

import numpy as np
import pytest
from driven_window import open_viewer
from reported_results import build_result, build_run
from swept import ROOM, DirectExecutor, build_small_study

from robocov.errors import InputError, ParameterError
from robocov.mapfile import save_map
from robocov.metrics.results import read_results
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.figures.gains import GainGrid, GainResults, plot_gain_grid, plot_gains
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.report.analysis.groups import find_varying_gains, format_gains
from robocov_app.report.plots.parameter_plots import build_parameter_plots
from robocov_app.report.results.loading import load_result
from robocov_app.report.tables.controllers import build_controllers_table
from robocov_app.sweep.study.gains import build_gains
from robocov_app.sweep.study.sampling import Range, Sampling
from robocov_app.sweep.study.study_file import read_study
from robocov_app.sweep.sweeping import sweep
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

STUDY = """
maps = ["room.json"]
controllers = ["rapf", "lloyd"]
seeds = 1
robots = 2
duration = 0.5
[gains.rapf]
target = ["centroid", "median"]
k_rep = [0.3, 1.0]
[gains.lloyd]
target = "sensing"
height = 0.5
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    save_map(ROOM, tmp_path / "room.json")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


@pytest.mark.slow
def test_the_command_line_takes_words_and_the_record_keeps_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["--duration", "0.2", "--lattice", "8", "--set", "target=median", "k_rep=1", "--out", str(out)]
    assert main(["run", "square", *words]) == 0
    run = json.loads((out / "run.json").read_text())
    assert run["controller"]["gains"]["target"] == "median"
    assert Record.load(out).gains["target"] == "median"
    capsys.readouterr()
    assert main(["controllers", "--json"]) == 0
    rapf = next(row for row in json.loads(capsys.readouterr().out)["controllers"] if row["name"] == "rapf")
    told = next(gain for gain in rapf["gains"] if gain["name"] == "target")
    assert told["words"] == ["centroid", "sensing", "median"] and told["default"] == "centroid"
    assert "low" not in told
    assert main(["controllers"]) == 0
    assert "centroid | sensing | median" in capsys.readouterr().out


def test_a_study_takes_lists_of_words(study: Path) -> None:
    read = read_study(study)
    tried = [(choice["target"], choice["k_rep"]) for choice in read.get_gains("rapf").choices]
    assert tried == [("centroid", 0.3), ("centroid", 1.0), ("median", 0.3), ("median", 1.0)]
    (lloyd,) = read.get_gains("lloyd").choices
    assert (lloyd["target"], lloyd["height"]) == ("sensing", 0.5)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            'target = ["centroid", "mediam"]',
            r"gains\.rapf\.target\[1\]: unknown choice 'mediam': did you mean",
        ),
        ("target = 3", r"gains\.rapf\.target: expected one of centroid, sensing, median, got 3\.0"),
        (
            'target = ["median", "median"]',
            r"gains\.rapf\.target\[1\]: duplicate value 'median', already given at",
        ),
        (
            "target = {low = 0, high = 1}",
            r"gains\.rapf\.target: expected one of centroid, sensing, median",
        ),
        ('target = "null"', r"gains\.rapf\.target: unknown choice 'null'"),
    ],
)
def test_a_study_with_a_wrong_word_is_told_where(study: Path, wrong: str, message: str) -> None:
    study.write_text(STUDY.replace('target = ["centroid", "median"]', wrong))
    with pytest.raises(InputError, match=message):
        read_study(study)


def test_words_go_with_samples_of_ranges() -> None:
    from robocov.controllers import Rapf

    wanted = {"target": ["centroid", "median"], "k_rep": Range(0.1, 1.0)}
    gains = build_gains(Rapf, wanted, Sampling(samples=4))
    assert [choice["target"] for choice in gains.choices] == ["centroid"] * 4 + ["median"] * 4


@pytest.fixture(scope="module")
def swept_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("words") / "out"
    gains = {"rapf": {"target": ["centroid", "median"]}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)
        sweep(build_small_study(gains=gains), folder, quiet=True)
    return folder


@pytest.mark.slow
def test_tables_hold_words(swept_folder: Path, tmp_path: Path) -> None:
    rows = list(read_results(swept_folder).rows())
    assert {row["target"] for row in rows} == {"centroid", "median", None}
    assert {type(row["k_rep"]) for row in rows} == {float}
    # a table without its study does not say what its columns hold
    (tmp_path / "results.csv").write_bytes((swept_folder / "results.csv").read_bytes())
    assert list(read_results(tmp_path).rows()) == rows


def test_a_report_tells_words(swept_folder: Path) -> None:
    result = load_result(swept_folder)
    assert find_varying_gains(result) == {"target": ["rapf"]}
    plots = build_parameter_plots(result, "k")
    assert [plot.title for plot in plots] == ["target"]
    assert "medians at centroid:" in plots[0].svg and "median:" in plots[0].svg
    assert (
        format_gains([("target", "median"), ("height", 0.5)], {"height": "m"})
        == "target median, height 0.5 m"
    )


def test_values_of_words_are_told_where_they_are_many() -> None:
    runs = [
        build_run(gains=(("target", word), ("k", 0.1 * k)))
        for k in range(1, 8)
        for word in ("centroid", "median")
    ]
    result = build_result(runs)
    (row,) = build_controllers_table(result).rows
    assert row[2] == "target centroid or median, k 0.1 to 0.7"


def test_words_have_even_places_and_no_line_between_them() -> None:
    places = np.repeat([0.0, 1.0, 2.0], 4)
    values = np.arange(12.0)
    words = ("centroid", "sensing", "median")
    row = GainResults("RAPF", choose_controller_styles(["rapf"])["rapf"], places, values)
    axes = plot_gains([row], "target", (420, 290), "cost", words).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == list(words)
    _, medians = axes.lines
    assert medians.get_linestyle() == "None"
    assert medians.get_ydata().tolist() == [1.5, 5.5, 9.5]
    values = np.arange(4.0).reshape(2, 2)
    gain_grid = GainGrid("target", "k", ["centroid", "median"], [0.3, None], values)
    grid = plot_gain_grid(gain_grid, (420, 290))
    assert [tick.get_text() for tick in grid.axes[0].get_xticklabels()] == ["centroid", "median"]
    assert [tick.get_text() for tick in grid.axes[0].get_yticklabels()] == ["0.3", "none"]


def test_laws_of_the_window_say_words() -> None:
    before = ControllerChoice("rapf")
    after = ControllerChoice("rapf", {"target": "median", "attraction_limit": None})
    assert after.describe_changes(before) == "attraction_limit = no limit, target = median"
    assert after.description == "RAPF, target median, attraction_limit no limit"
    with pytest.raises(ParameterError, match="unknown choice 'mediam'"):
        before.with_gain("target", "mediam")


def test_in_the_window_words_are_buttons_lists_and_commands(tmp_path: Path) -> None:
    with open_viewer(tmp_path, ControllerChoice("rapf"), size=(1000, 1000)) as driver:
        get_value = lambda name: driver.session.timeline.panes[0].controller.get_value(name)  # noqa: E731
        assert get_value("cells") == "distance" and driver.get_widget("button", "cells:distance").value
        driver.push_button("cells:time")
        assert get_value("cells") == "time"
        assert driver.session.timeline.events[-1].text.endswith("cells = time")
        assert driver.get_widget("button", "cells:time").value
        assert not driver.get_widget("button", "cells:distance").value
        driver.choose_option("target", "median")
        assert get_value("target") == "median"
        driver.viewer.attempt(lambda: driver.window.commands.run_text("target sens"))
        driver.settle()
        assert get_value("target") == "sensing"
        driver.viewer.attempt(lambda: driver.window.commands.run_text("target 3"))
        assert driver.viewer.has_error_message and "one of centroid, sensing, median" in driver.viewer.message
        driver.push_button("reset:target")
        assert get_value("target") == "centroid"


def test_words_that_do_not_fit_side_by_side_are_a_list(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from dataclasses import dataclass\n"
        "import robocov as rc\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    way: str = rc.choice('clockwise', ('clockwise', 'anticlockwise', 'whichever is near'), 'how')\n"
        "    def force(self, own):\n"
        "        return own.centroid - own.position\n"
    )
    with open_viewer(tmp_path, ControllerChoice(f"{tmp_path / 'mine.py'}:Mine"), size=(1000, 800)) as driver:
        for word in ("anticlockwise", "whichever is near", "clockwise"):
            driver.choose_option("way", word)
            assert driver.session.timeline.panes[0].controller.get_value("way") == word
            assert driver.get_widget("menu", "way").text == word


def test_a_session_shows_the_value_of_a_gain_with_a_former_spelling() -> None:
    assert ControllerChoice("poduri", {"neighbours": 5.0}).get_value("neighbors") == 5.0
