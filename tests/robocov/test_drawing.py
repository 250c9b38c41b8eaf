"""Drawing in the library: it finds a backend, passes all arguments on, and works without one."""

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
    """A backend that records the calls of its functions."""

    def __init__(self) -> None:
        super().__init__("sketches")
        self.calls: list[tuple[Any, ...]] = []

    def __getattr__(self, name: str) -> Any:
        if not name.startswith(("plot_", "render_")):
            raise AttributeError(name)

        def record_call(*arguments: Any, **options: Any) -> Any:
            self.calls.append((name, *arguments, options))
            return f"{name} of sketches"

        return record_call


@pytest.fixture
def sketches(monkeypatch: pytest.MonkeyPatch) -> Sketches:
    backend = Sketches()
    monkeypatch.setitem(sys.modules, "sketches", backend)
    return backend


def install_backends(monkeypatch: pytest.MonkeyPatch, **backends: str) -> None:
    """Replace the entry points of installed packages by these, as names and values."""
    entries = [EntryPoint(name, value, drawing.ENTRY_POINT_GROUP) for name, value in backends.items()]

    def select_entries(*, group: str) -> list[EntryPoint]:
        return [entry for entry in entries if entry.group == group]

    monkeypatch.setattr(drawing, "entry_points", select_entries)


@pytest.fixture(scope="module")
def record(empty: Environment) -> Record:
    return Simulation(empty, Rapf(), empty.start().sample(3)).run(0.5)


def test_the_application_is_installed_as_the_backend() -> None:
    assert load_drawing_backend().__name__ == "robocov_app.notebook"  # type: ignore[attr-defined]
    assert load_drawing_backend("matplotlib") is load_drawing_backend()
    names = list(drawing.DrawingBackend.__annotations__)
    assert len(names) == 12
    assert all(callable(getattr(load_drawing_backend(), name)) for name in names)


def test_backends_are_selected_by_name(
    monkeypatch: pytest.MonkeyPatch, sketches: Sketches, record: Record, empty: Environment
) -> None:
    install_backends(monkeypatch, matplotlib="robocov_app.notebook", sketches="sketches")
    cost = CoverageCost(empty, 8)
    result = cost(record.positions[-1])
    history = compute_cost_history(record, cost, 2.0)
    comparison = Comparison(records={"RAPF": record}, histories={"RAPF": history})
    for item, name in (
        (empty, "plot_environment"),
        (record, "plot_record"),
        (result, "plot_result"),
        (history, "plot_history"),
        (comparison, "plot_comparison"),
    ):
        axes = object()
        assert item.plot(axes, backend="sketches", theme="dark") == f"{name} of sketches"
        assert sketches.calls[-1] == (name, item, axes, {"theme": "dark"})
        item.plot(backend="sketches")
        assert sketches.calls[-1] == (name, item, None, {})


def test_without_matplotlib_the_first_backend_by_name_is_used(
    monkeypatch: pytest.MonkeyPatch, sketches: Sketches, record: Record, empty: Environment
) -> None:
    install_backends(monkeypatch, zeichnungen="nowhere", sketches="sketches")
    assert load_drawing_backend() is sketches
    assert record._repr_html_() == "render_record_html of sketches"
    assert record._repr_png_() == "render_record_png of sketches"
    assert empty._repr_html_() == "render_environment_html of sketches"
    assert empty._repr_png_() == "render_environment_png of sketches"


def test_unknown_backends_get_a_suggestion(record: Record) -> None:
    with pytest.raises(ParameterError, match="unknown drawing backend 'matplot': did you mean 'matplotlib'"):
        record.plot(backend="matplot")


@pytest.mark.parametrize("backends", [{}, {"broken": "no_such_module"}, {"broken": "json:no_such_name"}])
def test_without_a_backend_plots_fail_and_notebooks_show_the_repr(
    monkeypatch: pytest.MonkeyPatch, backends: dict[str, str], record: Record, empty: Environment
) -> None:
    install_backends(monkeypatch, **backends)
    message = (
        r"drawing backend 'broken' of entry point .* cannot be loaded" if backends else "no drawing backend"
    )
    with pytest.raises(RobocovError, match=message):
        empty.plot()
    for item in (record, empty):
        assert item._repr_html_() is None
        assert item._repr_png_() is None


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
