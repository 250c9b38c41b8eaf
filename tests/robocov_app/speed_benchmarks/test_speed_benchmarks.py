"""Timings of `robocov bench`: how they are measured, compared, printed and drawn."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import matplotlib.text
import numpy as np
import pytest
from command_calls import read_error
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov_app.cli import main
from robocov_app.commands import bench
from robocov_app.speed_benchmarks import cost, learning, plot, processes, render, step, window
from robocov_app.speed_benchmarks.measure import Row, measure_interleaved

KEYS = [
    "part",
    "name",
    "parameters",
    "seconds",
    "baseline",
    "baseline_seconds",
    "goal",
    "goal_seconds",
    "note",
    "before",
    "ratio",
    "met",
]


class ManualClock:
    """A clock whose time is set by the functions that it times."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def build_task(self, *durations: float) -> Callable[[], None]:
        """Return a function that takes the next of these durations, s, each time it is called."""
        remaining = iter(durations)

        def work() -> None:
            self.now += next(remaining)

        return work


def test_functions_take_turns_and_have_median_times() -> None:
    clock = ManualClock()
    calls: list[tuple[str, bool]] = []

    def log_calls(name: str, task: Callable[[], None]) -> Callable[[], None]:
        def call() -> None:
            calls.append((name, gc.isenabled()))
            task()

        return call

    times = measure_interleaved(
        {
            "slow": log_calls("slow", clock.build_task(9.0, 3.0, 1.0, 2.0)),
            "fast": log_calls("fast", clock.build_task(9.0, 0.5, 0.25, 1.5)),
        },
        3,
        clock=clock,
        before_round=log_calls("before", clock.build_task(100.0, 100.0, 100.0)),
    )
    # The first round only warms up.
    assert times == {"slow": 2.0, "fast": 0.5}
    # Garbage is collected between rounds, but not while functions are timed.
    timed_calls = [("slow", False), ("fast", False)]
    assert calls == [*timed_calls, *[("before", False), *timed_calls] * 3]
    assert gc.isenabled()


@pytest.mark.parametrize(("min_rounds", "min_seconds", "rounds"), [(2, 6.5, 7), (5, 2.0, 5)])
def test_rounds_continue_until_the_minimum_time(min_rounds: int, min_seconds: float, rounds: int) -> None:
    clock = ManualClock()
    work = clock.build_task(*[1.0] * 20)
    measure_interleaved({"one": work}, min_rounds, min_seconds, clock=clock)
    warm_up_rounds = 1
    assert clock.now == warm_up_rounds + rounds


@pytest.mark.parametrize(
    ("goal", "goal_seconds", "is_met"),
    [
        (None, None, None),
        (2.0, None, True),
        (1.9, None, False),
        (None, 0.5, True),
        (None, 0.3, False),
        (2.0, 0.3, False),
        (2.0, 0.5, True),
    ],
)
def test_a_goal_is_met_or_missed(goal: float | None, goal_seconds: float | None, is_met: bool | None) -> None:
    row = Row("step", "one step", {"robots": 6}, 0.4, "baseline", 0.2, goal, goal_seconds)
    assert row.ratio == 2.0
    assert row.meets_goals is is_met
    assert ("missed" in bench.format_goals(row)) == (is_met is False)
    assert list(row.to_dict()) == KEYS


def test_without_a_baseline_there_is_no_ratio() -> None:
    row = Row("cost", "evaluated", {"lattice": 128, "robots": 6}, 0.4, max_ratio=1.0)
    assert row.ratio is None
    assert row.meets_goals is None
    assert bench.format_goals(row) == ""
    assert row.case == "128 x 128, 6 robots"


def test_threads_are_limited_before_numpy_is_loaded() -> None:
    # Numpy reads the variables that limit its threads when it is loaded.
    script = """
import sys
from robocov_app.cli import main
from robocov_app.commands import bench
bench.command = lambda options: print("numpy" in sys.modules)
main(["bench", "start"])
"""
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert process.stdout == "False\n"


def build_small_map(
    vertices: int, build_random_map: Callable[[int], Environment] = cost.build_random_map
) -> Environment:
    """Build a random map with few vertices in place of one with many."""
    return build_random_map(min(vertices, 20))


@pytest.fixture
def small_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each part of the benchmark takes less than a second, apart from the start of processes."""
    monkeypatch.setattr(step, "GOALS", {6: step.GOALS[6]})
    monkeypatch.setattr(step, "BATCH_RUNS", 2)
    monkeypatch.setattr(step, "WARM_UP_STEPS", 2)
    monkeypatch.setattr(step, "_QUICK_ROUNDS", 5)
    monkeypatch.setattr(cost, "EARLIER_RATIOS", {("rooms", 64, 6): 4.5})
    monkeypatch.setattr(cost, "QUICK_SIZES", ((64, 20),))
    monkeypatch.setattr(cost, "_QUICK_DURATION_S", 0.02)
    monkeypatch.setattr(cost, "build_random_map", lambda vertices: build_small_map(vertices))
    monkeypatch.setattr(learning, "ENVIRONMENTS", 2)
    monkeypatch.setattr(learning, "_QUICK_ROUNDS", 2)
    monkeypatch.setattr(processes, "MAPS", ("square",))
    monkeypatch.setattr(processes, "DURATION_S", 1.0)
    monkeypatch.setattr(processes, "WORKERS", 1)
    monkeypatch.setattr(processes, "_BASELINE_REPEATS", 1)
    monkeypatch.setattr(processes, "_QUICK_START_ROUNDS", 1)
    monkeypatch.setattr(processes, "COMMANDS", {"import robocov": ("-c", "import robocov")})
    monkeypatch.setattr(
        render, "list_cases", lambda quick: [partial(render._measure_frames, "rooms", 6, quick=quick)]
    )
    monkeypatch.setattr(window, "list_cases", lambda quick: [partial(window._measure_window, 6, 0.5)])


@pytest.mark.slow
@pytest.mark.usefixtures("small_cases")
def test_all_parts_are_measured(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    plot_file = tmp_path / "ratios.png"
    assert main(["bench", "all", "--quick", "--json", "--plot", str(plot_file)]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {row["part"] for row in result["rows"]} == set(bench.PARTS)
    assert set(result["machine"]) == {"python", "system", "processor", "cores", "packages"}
    for row in result["rows"]:
        assert list(row) == KEYS
        assert row["seconds"] > 0.0
        if row["baseline_seconds"] is not None:
            assert row["ratio"] == pytest.approx(row["seconds"] / row["baseline_seconds"])
    assert plot_file.stat().st_size > 10_000


@pytest.mark.usefixtures("small_cases")
def test_the_table_shows_baselines_and_notes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "step", "--quick"]) == 0
    output = capsys.readouterr()
    assert "Qhull's Delaunay" in output.out
    assert "x real time" in output.out
    assert "numpy" in output.out
    assert "measuring: 2 of 2 in" in output.err


@pytest.mark.usefixtures("small_cases")
def test_the_cost_is_compared_with_its_baseline() -> None:
    pytest.importorskip("skfmm", reason="the baseline is an extra")
    construction, few_robots, many_robots = cost._measure_size(128, 200, quick=True)
    assert construction.baseline is None
    assert few_robots.max_ratio == cost.GOALS[128, 200, 6]
    assert many_robots.max_ratio == cost.GOALS[128, 200, 50]
    assert few_robots.ratio is not None


def test_the_baseline_measures_the_same_distances() -> None:
    pytest.importorskip("skfmm", reason="the baseline is an extra")
    coverage_cost = cost.CoverageCost(build_small_map(20), 64)
    robots = cost.MovingRobots(coverage_cost, 6)
    exact = coverage_cost(robots.positions).mean_distance
    assert cost._measure_by_marching(coverage_cost, robots) == pytest.approx(exact, rel=0.1)


def test_robots_of_the_benchmark_move_a_little_and_stay_free() -> None:
    coverage_cost = cost.CoverageCost(build_small_map(200), 64)
    robots = cost.MovingRobots(coverage_cost, 20)
    previous_positions = robots.positions
    for _ in range(20):
        robots.move()
        largest_move = np.abs(robots.positions - previous_positions).max()
        assert 0.0 < largest_move <= coverage_cost.spacing / 4.0
        # This raises an error if a robot is inside an obstacle.
        coverage_cost(robots.positions)


@pytest.mark.slow
@pytest.mark.usefixtures("small_cases")
def test_without_the_baseline_the_message_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "skfmm", None)
    assert "pip install 'robocov[bench]'" in read_error(capsys, "bench", "cost")
    monkeypatch.setattr(processes, "list_start_cases", lambda quick: [])
    for part in (step, processes, render, window, learning):
        monkeypatch.setattr(part, "list_cases", lambda quick: [])
    # With all parts, the command continues without the ratios.
    assert main(["bench", "all", "--quick", "--json"]) == 0
    output = capsys.readouterr()
    assert "pip install 'robocov[bench]'" in output.err
    rows = json.loads(output.out)["rows"]
    cost_rows = [row for row in rows if (row["part"], row["name"]) == ("cost", "evaluated")]
    assert cost_rows
    assert all(row["ratio"] is None and row["met"] is None for row in cost_rows)


def test_an_interruption_leaves_the_measured_rows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def measure() -> Iterator[Row]:
        yield Row("step", "one step", {"robots": 7}, 1.0, "baseline", 0.5)

    def interrupt() -> Iterator[Row]:
        raise KeyboardInterrupt

    monkeypatch.setattr(step, "list_cases", lambda quick: [measure, interrupt, interrupt])
    assert main(["bench", "step"]) == 130
    assert "7 robots" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("file", "message"), [("ratios.gif", "'.gif'"), ("missing/ratios.png", "there is no folder")]
)
def test_an_invalid_plot_file_is_rejected_before_anything_is_measured(
    file: str, message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert message in read_error(capsys, "bench", "step", "--plot", str(tmp_path / file))


COST_ROWS = [
    Row(
        part="cost",
        name="evaluated",
        parameters={"lattice": lattice, "vertices": vertices, "robots": robots},
        seconds=1e-3,
        baseline="fmm",
        baseline_seconds=1e-3 * 64 / lattice,
        max_ratio=0.5,
    )
    for lattice in (64, 128, 256)
    for vertices in (20, 1000)
    for robots in (6, 50)
]
OTHER_ROWS = [
    Row("step", "one step", {"robots": 1000}, 3e-3, "a baseline with a very long name", 1e-3, 1.2),
    Row("step", "one step", {"robots": 6}, 3e-4, "Qhull's Delaunay", 1e-3),
    Row("start", "robocov --help", {}, 0.2, "import numpy", 0.1, 2.0),
]
ROW_WITHOUT_BASELINE = Row("cost", "built, once per map", {"lattice": 64, "vertices": 20}, 0.1)


@pytest.mark.parametrize(
    "rows",
    [[*COST_ROWS, ROW_WITHOUT_BASELINE, *OTHER_ROWS], OTHER_ROWS, COST_ROWS],
    ids=["all", "no cost", "only cost"],
)
def test_no_text_of_the_plot_is_cut_off_or_overlaps(
    rows: list[Row], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures: list[Figure] = []
    save_figure = plot.save_figure

    def save_and_collect(figure: Figure, path: Path) -> None:
        figures.append(figure)
        save_figure(figure, path)

    monkeypatch.setattr(plot, "save_figure", save_and_collect)
    plot.save_ratios(rows, tmp_path / "ratios.png")
    (figure,) = figures
    width, height = figure.canvas.get_width_height()
    texts = [text for text in figure.findobj(matplotlib.text.Text) if text.get_text().strip()]
    boxes = [text.get_window_extent() for text in texts if text.get_visible()]
    assert len(boxes) > 10
    for box in boxes:
        assert box.x0 >= 0
        assert box.x1 <= width
        assert box.y0 >= 0
        assert box.y1 <= height
    shown_texts = {text.get_text() for text in texts}
    for row in rows:
        if row.ratio is not None:
            assert f"{row.ratio:.2f}" in shown_texts
    for first in range(len(boxes)):
        for second in range(first):
            one = boxes[first]
            other = boxes[second]
            are_side_by_side = one.x1 <= other.x0 or other.x1 <= one.x0
            are_above_each_other = one.y1 <= other.y0 or other.y1 <= one.y0
            assert are_side_by_side or are_above_each_other, (texts[first], texts[second])


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.00031, "310 µs"),
        (0.0009999, "1.0 ms"),
        (0.012, "12.0 ms"),
        (0.99999, "1.00 s"),
        (2.5, "2.50 s"),
        (None, ""),
    ],
)
def test_durations_have_a_suitable_unit(seconds: float | None, text: str) -> None:
    assert bench.format_duration(seconds) == text
