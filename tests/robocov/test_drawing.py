"""The library's side of drawing: it finds a backend, hands on what it was given, and needs none."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoint
from types import ModuleType
from typing import Any

import pytest

from robocov import drawing
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.drawing import load_drawing_backend
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError
from robocov.metrics import compute_cost_history
from robocov.record import Record
from robocov.scenario import Comparison
from robocov.simulation import Simulation


class Sketches(ModuleType):
    """A backend that notes what it was asked."""

    def __init__(self) -> None:
        super().__init__("sketches")
        self.asked: list[tuple[Any, ...]] = []

    def __getattr__(self, name: str) -> Any:
        if not name.startswith(("plot_", "render_")):
            raise AttributeError(name)

        def noted(*given: Any, **options: Any) -> Any:
            self.asked.append((name, *given, options))
            return f"{name} of sketches"

        return noted


@pytest.fixture
def sketches(monkeypatch: pytest.MonkeyPatch) -> Sketches:
    made = Sketches()
    monkeypatch.setitem(sys.modules, "sketches", made)
    return made


def offering(monkeypatch: pytest.MonkeyPatch, **offered: str) -> None:
    """Let these be the entry points that installed packages have."""
    entries = [EntryPoint(name, value, drawing.ENTRY_POINT_GROUP) for name, value in offered.items()]

    def found(*, group: str) -> list[EntryPoint]:
        return [entry for entry in entries if entry.group == group]

    monkeypatch.setattr(drawing, "entry_points", found)


@pytest.fixture(scope="module")
def record(empty: Environment) -> Record:
    return Simulation(empty, Rapf(), empty.start().sample(3)).run(0.5)


def test_the_application_is_installed_as_the_backend() -> None:
    assert load_drawing_backend().__name__ == "robocov_app.notebook"  # type: ignore[attr-defined]
    assert load_drawing_backend("matplotlib") is load_drawing_backend()
    wanted = list(drawing.DrawingBackend.__annotations__)
    assert len(wanted) == 12
    assert all(callable(getattr(load_drawing_backend(), name)) for name in wanted)


def test_another_backend_is_asked_for_by_name(
    monkeypatch: pytest.MonkeyPatch, sketches: Sketches, record: Record, empty: Environment
) -> None:
    offering(monkeypatch, matplotlib="robocov_app.notebook", sketches="sketches")
    cost = CoverageCost(empty, 8)
    result = cost(record.positions[-1])
    history = compute_cost_history(record, cost, 2.0)
    comparison = Comparison(records={"RAPF": record}, histories={"RAPF": history})
    for thing, name in (
        (empty, "plot_environment"),
        (record, "plot_record"),
        (result, "plot_result"),
        (history, "plot_history"),
        (comparison, "plot_comparison"),
    ):
        axes = object()
        assert thing.plot(axes, backend="sketches", theme="dark") == f"{name} of sketches"
        assert sketches.asked[-1] == (name, thing, axes, {"theme": "dark"})
        thing.plot(backend="sketches")
        assert sketches.asked[-1] == (name, thing, None, {})


def test_without_matplotlib_the_first_by_name_draws(
    monkeypatch: pytest.MonkeyPatch, sketches: Sketches, record: Record, empty: Environment
) -> None:
    offering(monkeypatch, zeichnungen="nowhere", sketches="sketches")
    assert load_drawing_backend() is sketches
    assert record._repr_html_() == "render_record_html of sketches"
    assert record._repr_png_() == "render_record_png of sketches"
    assert empty._repr_html_() == "render_environment_html of sketches"
    assert empty._repr_png_() == "render_environment_png of sketches"


def test_a_name_that_is_none_is_refused_with_the_nearest(record: Record) -> None:
    with pytest.raises(ParameterError, match="unknown drawing backend 'matplot': did you mean 'matplotlib'"):
        record.plot(backend="matplot")


@pytest.mark.parametrize("offered", [{}, {"broken": "no_such_module"}, {"broken": "json:no_such_name"}])
def test_where_nobody_draws_plots_say_so_and_notebooks_show_the_text(
    monkeypatch: pytest.MonkeyPatch, offered: dict[str, str], record: Record, empty: Environment
) -> None:
    offering(monkeypatch, **offered)
    message = (
        r"drawing backend 'broken' of entry point .* cannot be loaded" if offered else "no drawing backend"
    )
    with pytest.raises(RobocovError, match=message):
        empty.plot()
    for thing in (record, empty):
        assert thing._repr_html_() is None
        assert thing._repr_png_() is None


_LIGHT = """
import sys
import robocov as rc
room = rc.load_map("rooms")
simulation = rc.Simulation(room, rc.Rapf(), room.start().sample(2))
record = simulation.run(0.2).thin(10.0)
print(room, record, simulation, rc.CoverageCost(room, 16)(record.positions[-1]))
heavy = {"matplotlib", "pandas", "pyarrow", "pygame", "jinja2", "robocov_app"} & set(sys.modules)
assert not heavy, heavy
axes = room.plot()
assert "matplotlib" in sys.modules
heavy = {"matplotlib.pyplot", "pygame", "pandas"} & set(sys.modules)
assert not heavy, heavy
"""


@pytest.mark.slow
def test_nothing_heavy_is_loaded_before_something_is_drawn() -> None:
    done = subprocess.run([sys.executable, "-c", _LIGHT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
