"""Gains with a few named values, in commands, studies, tables, reports and the window."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from driven_window import open_viewer
from reported_results import build_result, build_run
from small_studies import ROOM, DirectExecutor, build_small_study

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
def test_a_run_uses_and_records_the_chosen_value(tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ["--duration", "0.2", "--lattice", "8", "--set", "target=median", "k_rep=1", "--out", str(out)]
    assert main(["run", "square", *options]) == 0
    run = json.loads((out / "run.json").read_text())
    assert run["controller"]["gains"]["target"] == "median"
    assert Record.load(out).gains["target"] == "median"


def test_the_list_of_controllers_contains_the_choices(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["controllers", "--json"]) == 0
    controllers = json.loads(capsys.readouterr().out)["controllers"]
    rapf = next(controller for controller in controllers if controller["name"] == "rapf")
    target = next(gain for gain in rapf["gains"] if gain["name"] == "target")
    assert target["words"] == ["centroid", "sensing", "median"]
    assert target["default"] == "centroid"
    assert "low" not in target
    assert main(["controllers"]) == 0
    assert "centroid | sensing | median" in capsys.readouterr().out


def test_a_study_tries_all_listed_choices(study: Path) -> None:
    loaded = read_study(study)
    rapf = [(choice["target"], choice["k_rep"]) for choice in loaded.get_gains("rapf").choices]
    assert rapf == [("centroid", 0.3), ("centroid", 1.0), ("median", 0.3), ("median", 1.0)]
    (lloyd,) = loaded.get_gains("lloyd").choices
    assert (lloyd["target"], lloyd["height"]) == ("sensing", 0.5)


@pytest.mark.parametrize(
    ("line", "message"),
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
def test_an_invalid_choice_in_a_study_is_located(study: Path, line: str, message: str) -> None:
    study.write_text(STUDY.replace('target = ["centroid", "median"]', line))
    with pytest.raises(InputError, match=message):
        read_study(study)


def test_each_choice_is_combined_with_all_samples_of_ranges() -> None:
    from robocov.controllers import Rapf

    values = {"target": ["centroid", "median"], "k_rep": Range(0.1, 1.0)}
    gains = build_gains(Rapf, values, Sampling(samples=4))
    assert [choice["target"] for choice in gains.choices] == ["centroid"] * 4 + ["median"] * 4


@pytest.fixture(scope="module")
def swept_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sweep two values of a choice; return the folder of the results."""
    folder = tmp_path_factory.mktemp("choices") / "out"
    gains = {"rapf": {"target": ["centroid", "median"]}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)
        sweep(build_small_study(gains=gains), folder, quiet=True)
    return folder


@pytest.mark.slow
def test_tables_of_results_contain_the_choices(swept_folder: Path, tmp_path: Path) -> None:
    rows = list(read_results(swept_folder).rows())
    assert {row["target"] for row in rows} == {"centroid", "median", None}
    assert {type(row["k_rep"]) for row in rows} == {float}
    # A table without its study has no types of columns.
    (tmp_path / "results.csv").write_bytes((swept_folder / "results.csv").read_bytes())
    assert list(read_results(tmp_path).rows()) == rows


def test_a_report_compares_the_choices(swept_folder: Path) -> None:
    result = load_result(swept_folder)
    assert find_varying_gains(result) == {"target": ["rapf"]}
    plots = build_parameter_plots(result, "k")
    assert [plot.title for plot in plots] == ["target of RAPF"]
    assert "medians at centroid:" in plots[0].svg
    assert "median:" in plots[0].svg


def test_axes_of_parameters_without_a_unit_have_no_parentheses() -> None:
    runs = [build_run(team=(("loss", loss),)) for loss in (0.0, 0.2)]
    (plot,) = build_parameter_plots(build_result(runs), "k")
    assert "against loss. " in plot.svg


def test_choices_are_formatted_without_a_unit() -> None:
    gains = [("target", "median"), ("height", 0.5)]
    assert format_gains(gains, {"height": "m"}) == "target median, height 0.5 m"


def test_the_table_of_controllers_lists_choices_and_ranges() -> None:
    gains = itertools.product(("centroid", "median"), 0.1 * np.arange(1, 8))
    runs = [build_run(gains=(("target", target), ("k", k))) for target, k in gains]
    result = build_result(runs)
    (row,) = build_controllers_table(result).rows
    assert row[2] == "target centroid or median, k 0.1 to 0.7"


def test_a_plot_of_choices_has_named_ticks_and_no_lines_between_medians() -> None:
    indices = np.repeat([0.0, 1.0, 2.0], 4)
    costs = np.arange(12.0)
    choices = ("centroid", "sensing", "median")
    results = GainResults("RAPF", choose_controller_styles(["rapf"])["rapf"], indices, costs)
    axes = plot_gains([results], "target", (420, 290), "cost", choices).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == list(choices)
    _, medians = axes.lines
    assert medians.get_linestyle() == "None"
    assert medians.get_ydata().tolist() == [1.5, 5.5, 9.5]


def test_a_grid_of_gains_has_named_ticks() -> None:
    costs = np.arange(4.0).reshape(2, 2)
    grid = GainGrid("target", "k", ["centroid", "median"], [0.3, None], costs)
    axes = plot_gain_grid(grid, (420, 290)).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["centroid", "median"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["0.3", "none"]


def test_controllers_of_the_window_are_described_with_their_choices() -> None:
    before = ControllerChoice("rapf")
    after = ControllerChoice("rapf", {"target": "median", "attraction_limit": None})
    assert after.describe_changes(before) == "attraction_limit = no limit, target = median"
    assert after.description == "RAPF, target median, attraction_limit no limit"
    with pytest.raises(ParameterError, match="unknown choice 'mediam'"):
        before.with_gain("target", "mediam")


def test_choices_are_made_by_buttons_menus_and_commands(tmp_path: Path) -> None:
    with open_viewer(tmp_path, ControllerChoice("rapf"), size=(1000, 1000)) as driver:

        def get_value(name: str) -> object:
            return driver.session.timeline.panes[0].controller.get_value(name)

        def run_command(text: str) -> None:
            driver.viewer.attempt(lambda: driver.window.commands.run_text(text))
            driver.settle()

        assert get_value("cells") == "distance"
        assert driver.get_widget("button", "cells:distance").value
        driver.push_button("cells:time")
        assert get_value("cells") == "time"
        assert driver.session.timeline.events[-1].text.endswith("cells = time")
        assert driver.get_widget("button", "cells:time").value
        assert not driver.get_widget("button", "cells:distance").value
        driver.choose_option("target", "median")
        assert get_value("target") == "median"
        run_command("target sens")
        assert get_value("target") == "sensing"
        run_command("target 3")
        assert driver.viewer.has_error_message
        assert "one of centroid, sensing, median" in driver.viewer.message
        driver.push_button("reset:target")
        assert get_value("target") == "centroid"


def test_choices_that_do_not_fit_side_by_side_are_a_menu(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from dataclasses import dataclass\n"
        "import robocov as rc\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    turn: str = rc.choice('clockwise', ('clockwise', 'anticlockwise', 'whichever is near'), 'how')\n"
        "    def force(self, own):\n"
        "        return own.centroid - own.position\n"
    )
    with open_viewer(tmp_path, ControllerChoice(f"{tmp_path / 'mine.py'}:Mine"), size=(1000, 800)) as driver:
        for choice in ("anticlockwise", "whichever is near", "clockwise"):
            driver.choose_option("turn", choice)
            assert driver.session.timeline.panes[0].controller.get_value("turn") == choice
            assert driver.get_widget("menu", "turn").text == choice


def test_the_former_spelling_of_a_gain_is_read() -> None:
    assert ControllerChoice("poduri", {"neighbours": 5.0}).get_value("neighbors") == 5.0
