from __future__ import annotations

import gc
import json
import re
import subprocess
import sys
from functools import partial

import matplotlib
import numpy as np
import pytest
from called import read_error
from matplotlib.figure import Figure

from robocov_app.cli import main
from robocov_app.commands import bench
from robocov_app.speed_benchmarks import cost, learning, plot, processes, render, step, window
from robocov_app.speed_benchmarks.measure import Row, measure_interleaved

KEYS = ["part", "name", "parameters", "seconds", "baseline", "baseline_seconds", "goal"]
KEYS += ["goal_seconds", "note", "before", "ratio", "met"]


class Clock:
    """A clock that goes on only when told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def work(self, *seconds: float):
        times = iter(seconds)

        def call() -> None:
            self.now += next(times)

        return call


def test_calls_alternate_and_have_median_times():
    clock = Clock()
    order = []
    slow = clock.work(9.0, 3.0, 1.0, 2.0)
    quick = clock.work(9.0, 0.5, 0.25, 1.5)

    def note(name, call):
        order.append((name, gc.isenabled()))
        call()

    calls = {"slow": partial(note, "slow", slow), "quick": partial(note, "quick", quick)}
    prepared = partial(note, "before", clock.work(*[100.0] * 3))
    assert measure_interleaved(calls, 3, clock=clock, before_round=prepared) == {"slow": 2.0, "quick": 0.5}
    # the first round does not count, and nothing is collected meanwhile
    round_ = [("slow", False), ("quick", False)]
    assert order == [*round_, *[("before", False), *round_] * 3]
    assert gc.isenabled()


@pytest.mark.slow
def test_rounds_continue_until_the_minimum_time():
    clock = Clock()
    for least, seconds, rounds in ((2, 6.5, 7), (5, 2.0, 5)):
        made = []
        work = clock.work(*[1.0] * 20)
        measure_interleaved({"one": lambda: made.append(work())}, least, seconds, clock=clock)  # noqa: B023 - at once
        assert len(made) == 1 + rounds


@pytest.mark.parametrize(
    ("goal", "goal_seconds", "met"),
    [(None, None, None), (2.0, None, True), (1.9, None, False), (None, 0.5, True), (None, 0.3, False)]
    + [(2.0, 0.3, False), (2.0, 0.5, True)],
)
def test_a_goal_is_met_or_missed(goal, goal_seconds, met):
    row = Row("step", "one step", {"robots": 6}, 0.4, "baseline", 0.2, goal, goal_seconds)
    assert row.ratio == 2.0
    assert row.meets_goals is met
    assert ("missed" in bench.format_goals(row)) == (met is False)
    assert list(row.to_dict()) == KEYS


def test_without_a_baseline_there_is_no_ratio():
    row = Row("cost", "evaluated", {"lattice": 128, "robots": 6}, 0.4, max_ratio=1.0)
    assert (row.ratio, row.meets_goals) == (None, None)
    assert bench.format_goals(row) == ""
    assert row.case == "128 x 128, 6 robots"


def test_threads_are_limited_before_numpy_is_loaded():
    """The variables that say how many are read when numpy is loaded."""
    script = "import sys\nfrom robocov_app.cli import main\nfrom robocov_app.commands import bench\n"
    script += "bench.command = lambda options: print('numpy' in sys.modules)\nmain(['bench', 'start'])"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert said.stdout == "False\n"


def shrink_parts(monkeypatch):
    """Make every part a matter of a second or two."""
    monkeypatch.setattr(step, "GOALS", {6: step.GOALS[6]})
    monkeypatch.setattr(step, "BATCH_RUNS", 2)
    monkeypatch.setattr(cost, "EARLIER_RATIOS", {("rooms", 64, 6): 4.5})
    monkeypatch.setattr(learning, "ENVIRONMENTS", 2)
    monkeypatch.setattr(processes, "MAPS", ("square",))
    monkeypatch.setattr(processes, "DURATION_S", 1.0)
    monkeypatch.setattr(step, "WARM_UP_STEPS", 2)
    monkeypatch.setattr(cost, "build_random_map", lambda vertices: build_small_map(vertices))
    monkeypatch.setattr(processes, "COMMANDS", {"import robocov": ("-c", "import robocov")})
    monkeypatch.setattr(
        render, "list_cases", lambda quick: [partial(render._measure_frames, "rooms", 6, quick)]
    )
    monkeypatch.setattr(window, "list_cases", lambda quick: [partial(window._measure_window, 6, 0.5)])


def build_small_map(vertices, real=cost.build_random_map):
    return real(min(vertices, 20))


@pytest.mark.slow
def test_everything_is_measured_once(monkeypatch, capsys, tmp_path):
    shrink_parts(monkeypatch)
    target = tmp_path / "ratios.png"
    assert main(["bench", "all", "--quick", "--json", "--plot", str(target)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {row["part"] for row in found["rows"]} == {*bench.PARTS}
    assert set(found["machine"]) == {"python", "system", "processor", "cores", "packages"}
    for row in found["rows"]:
        assert list(row) == KEYS
        assert row["seconds"] > 0.0
        if row["baseline_seconds"] is not None:
            assert row["ratio"] == pytest.approx(row["seconds"] / row["baseline_seconds"])
    assert target.stat().st_size > 10_000


def test_the_table_has_baselines_and_notes(monkeypatch, capsys):
    shrink_parts(monkeypatch)
    assert main(["bench", "step", "--quick"]) == 0
    said = capsys.readouterr()
    assert "Qhull's Delaunay" in said.out
    assert "x real time" in said.out
    assert "numpy" in said.out
    assert re.search(r"measuring: 2 of 2 in", said.err)


def test_the_cost_is_compared_with_its_baseline(monkeypatch):
    pytest.importorskip("skfmm", reason="the baseline is an extra")
    shrink_parts(monkeypatch)
    built, few, many = cost._measure_size(128, 200, quick=True)
    assert built.baseline is None
    assert (few.max_ratio, many.max_ratio) == (cost.GOALS[128, 200, 6], cost.GOALS[128, 200, 50])
    assert few.ratio is not None


def test_fast_marching_measures_the_same_distances():
    pytest.importorskip("skfmm", reason="the baseline is an extra")
    evaluated = cost.CoverageCost(build_small_map(20), 64)
    moving = cost.MovingRobots(evaluated, 6)
    exact = evaluated(moving.positions).mean_distance
    assert cost._measure_by_marching(evaluated, moving) == pytest.approx(exact, rel=0.1)


def test_robots_of_the_benchmark_move_a_little_and_stay_free():
    evaluated = cost.CoverageCost(build_small_map(200), 64)
    moving = cost.MovingRobots(evaluated, 20)
    former = moving.positions
    for _ in range(20):
        moving.move()
        assert 0.0 < np.abs(moving.positions - former).max() <= evaluated.spacing / 4.0
        evaluated(moving.positions)


@pytest.mark.slow
def test_without_the_baseline_the_message_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "skfmm", None)
    assert "pip install 'robocov[bench]'" in read_error(capsys, "bench", "cost")
    shrink_parts(monkeypatch)
    monkeypatch.setattr(processes, "list_start_cases", lambda quick: [])
    for other in (step, render, window, learning):
        monkeypatch.setattr(other, "list_cases", lambda quick: [])
    assert main(["bench", "all", "--quick", "--json"]) == 0
    said = capsys.readouterr()
    assert "pip install 'robocov[bench]'" in said.err
    rows = [
        row for row in json.loads(said.out)["rows"] if (row["part"], row["name"]) == ("cost", "evaluated")
    ]
    assert rows
    assert all(row["ratio"] is None and row["met"] is None for row in rows)


def test_an_interruption_leaves_the_measured_rows(monkeypatch, capsys):
    def interrupt():
        yield Row("step", "one step", {"robots": 7}, 1.0, "baseline", 0.5)

    def stop():
        raise KeyboardInterrupt

    monkeypatch.setattr(step, "list_cases", lambda quick: [interrupt, stop, stop])
    assert main(["bench", "step"]) == 130
    assert "7 robots" in capsys.readouterr().out


def test_an_invalid_plot_file_is_rejected_before_anything_is_measured(capsys, tmp_path):
    assert "'.gif'" in read_error(capsys, "bench", "step", "--plot", str(tmp_path / "ratios.gif"))
    assert "there is no folder" in read_error(
        capsys, "bench", "step", "--plot", str(tmp_path / "a" / "b.png")
    )


ROWS = [
    *(
        Row("cost", "evaluated", {"lattice": n, "vertices": k, "robots": r}, 1e-3, "fmm", 1e-3 * 64 / n, 0.5)
        for n in (64, 128, 256)
        for k in (20, 1000)
        for r in (6, 50)
    ),
    Row("cost", "built, once per map", {"lattice": 64, "vertices": 20}, 0.1),
    Row("step", "one step", {"robots": 1000}, 3e-3, "a baseline with a long name indeed", 1e-3, 1.2),
    Row("step", "one step", {"robots": 6}, 3e-4, "Qhull's Delaunay", 1e-3),
    Row("start", "robocov --help", {}, 0.2, "import numpy", 0.1, 2.0),
]


@pytest.mark.parametrize("rows", [ROWS, ROWS[-3:], ROWS[:12]], ids=["all", "no cost", "only cost"])
def test_no_text_of_the_plot_is_cut_off_or_overlaps(rows, tmp_path, monkeypatch):
    drawn: list[Figure] = []
    save = plot.save_figure

    def keep(figure, path):
        drawn.append(figure)
        save(figure, path)

    monkeypatch.setattr(plot, "save_figure", keep)
    plot.save_ratios(rows, tmp_path / "ratios.png")
    (figure,) = drawn
    width, height = figure.canvas.get_width_height()
    texts = [text for text in figure.findobj(matplotlib.text.Text) if text.get_text().strip()]
    boxes = [text.get_window_extent() for text in texts if text.get_visible()]
    assert len(boxes) > 10
    for box in boxes:
        assert box.x0 >= 0
        assert box.x1 <= width
        assert box.y0 >= 0
        assert box.y1 <= height
    said = {text.get_text() for text in texts}
    for row in rows:
        if row.ratio is not None:
            assert f"{row.ratio:.2f}" in said
    for k, one in enumerate(boxes):
        for other in boxes[:k]:
            apart = one.x1 <= other.x0 or other.x1 <= one.x0 or one.y1 <= other.y0 or other.y1 <= one.y0
            assert apart, (texts[k].get_text(), texts[boxes.index(other)].get_text())


def test_durations_have_a_suitable_unit():
    from robocov_app.commands.bench import format_duration

    assert [format_duration(seconds) for seconds in (0.00031, 0.012, 2.5, None)] == [
        "310 µs",
        "12.0 ms",
        "2.50 s",
        "",
    ]
