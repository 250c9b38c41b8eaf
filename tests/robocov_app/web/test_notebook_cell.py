"""Windows in the cells of notebooks: executed cells, and cells in a browser."""

import functools
import http.server
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_browser import CHROMIUM, DRIVER, Browser

import robocov
from robocov_app.notebook import show
from robocov_app.viewer.session.files.session_file import load_session
from robocov_app.viewer.session.session import Session
from robocov_app.web import notebook_window

pytest.importorskip("websockets")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("web"),
    pytest.mark.filterwarnings("ignore:Proactor event loop does not implement:RuntimeWarning"),
]


SHOW_WINDOW = """\
import robocov as rc
rooms = rc.load_map('rooms')
window = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0)).show()
window"""
FETCH_WINDOW = """\
import urllib.request
print(urllib.request.urlopen(window.link).status)
window.close()"""


def test_a_cell_shows_the_window(tmp_path, monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.chdir(tmp_path)
    cells = [nbformat.v4.new_code_cell(code) for code in (SHOW_WINDOW, FETCH_WINDOW)]
    notebook = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(notebook, timeout=120).execute()
    frame = notebook.cells[0].outputs[-1]["data"]["text/html"]
    assert 'src="http://127.0.0.1:' in frame
    assert notebook.cells[1].outputs[0]["text"] == "200\n"


@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver")
def test_the_cell_works_in_a_page_of_another_site(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    window = robocov.show(robocov.load_map("trap"), robots=3)
    (tmp_path / "cell.html").write_text(window._repr_html_())
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(tmp_path))
    monkeypatch.setattr(handler.func, "log_message", lambda *_: None)
    site = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=site.serve_forever, daemon=True).start()
    browser = Browser(tmp_path / "browser")
    try:
        browser.driver.get(f"http://localhost:{site.server_address[1]}/cell.html")
        browser.driver.switch_to.frame(0)
        browser.wait_until(lambda: browser.run_script("return canvas.width") > 500)
        read_picture = "return canvas.toDataURL()"
        first_picture = browser.run_script(read_picture)
        browser.wait_until(lambda: browser.run_script(read_picture) != first_picture)
    finally:
        browser.driver.quit()
        site.shutdown()
        site.server_close()
        window.close()


@pytest.fixture
def shown_simulations(monkeypatch):
    """Simulations of all shown windows, whose sessions are opened in this process."""
    simulations = []

    def open_session(arguments, height):
        session = Session.open(load_session(Path(arguments[1])))
        simulations.append(session.timeline.panes[0].simulation)

    monkeypatch.setattr("robocov_app.notebook.LiveWindow", open_session)
    return simulations


def build_simulation(controller=None, robots=3, **options):
    rooms = robocov.load_map("rooms")
    starts = rooms.start().sample(robots, seed=1)
    return robocov.Simulation(rooms, controller or robocov.Rapf(), starts, **options)


def test_the_window_continues_a_simulation(shown_simulations):
    simulation = build_simulation(robocov.Rapf(k_rep=0.4))
    simulation.run(1.0)
    simulation.show()
    (shown,) = shown_simulations
    assert np.array_equal(shown.positions, simulation.positions)
    assert np.array_equal(shown.velocities, simulation.velocities)
    assert shown.controller.k_rep == 0.4


def test_robots_fail_and_join_in_the_window_as_in_the_simulation(shown_simulations):
    conditions = robocov.Conditions(
        failures=(robocov.Failure(2, 0.2), robocov.Failure(4, 1.0)),
        joins=(robocov.Join(3, 0.3), robocov.Join(5, 1.2)),
    )
    simulation = build_simulation(robots=6, conditions=conditions)
    simulation.run(0.67)
    simulation.show()
    (shown,) = shown_simulations
    assert shown.is_working.tolist() == [True, False, True, True, False, True]
    for _ in range(60):
        shown.step()
        simulation.step()
    assert shown.is_working.tolist() == [True, False, True, False, True, True]
    assert np.array_equal(shown.positions, simulation.positions)


def test_robots_fail_at_random_in_the_window_as_in_the_simulation(shown_simulations):
    simulation = build_simulation(robots=6, conditions=robocov.Conditions(failure_rate=0.8, seed=1))
    simulation.run(1.0)
    simulation.show()
    (shown,) = shown_simulations
    assert 0 < len(shown.team) == simulation.is_working.sum() < 6
    assert np.array_equal(shown.positions, simulation.positions[simulation.is_working])
    assert len(shown.environment.obstacles) - len(simulation.environment.obstacles) == 6 - len(shown.team)


def test_unicycles_keep_their_headings_in_the_window(shown_simulations):
    simulation = build_simulation(team=robocov.Team.homogeneous(3, track_width=0.3))
    simulation.run(0.5)
    simulation.show()
    (shown,) = shown_simulations
    assert np.array_equal(shown.steering, simulation.steering)
    shown.run(0.5)
    simulation.run(0.5)
    assert np.array_equal(shown.positions, simulation.positions)


class Gentle(robocov.Rapf):
    """A controller with the name of the built-in one."""


class Homing:
    """A controller of a single robot."""

    def force(self, own):
        return own.centroid - own.position


@pytest.mark.parametrize("controller", [Gentle(), Homing()])
def test_a_simulation_with_a_controller_that_is_not_built_in_is_rejected(controller):
    expected = f"only simulations with built-in controllers, got {type(controller).__name__}$"
    with pytest.raises(robocov.ParameterError, match=expected):
        build_simulation(controller).show()


def test_a_simulation_whose_robots_have_all_failed_is_rejected():
    simulation = build_simulation(conditions=robocov.Conditions(failures=((1, 0.1), (2, 0.1), (3, 0.1))))
    simulation.run(0.2)
    with pytest.raises(robocov.ParameterError, match="expected at least one working robot, got none"):
        simulation.show()


def test_a_simulation_whose_obstacles_have_moved_is_rejected(shown_simulations):
    path = robocov.ObstaclePath(((4.0, 3.0), (6.0, 3.0)), speed=1.0)
    obstacle = robocov.CircleObstacle((4.0, 3.0), 0.5, path=path)
    square = replace(robocov.load_map("square"), obstacles=(obstacle,))
    simulation = robocov.Simulation(square, robocov.Rapf(), [[1.0, 1.0]])
    simulation.show()
    assert shown_simulations
    simulation.run(0.5)
    with pytest.raises(robocov.ParameterError, match=r"moving obstacles only at 0 s, got 0\.50 s"):
        simulation.show()


def test_without_the_web_extra_a_replay_continues_a_simulation(monkeypatch):
    monkeypatch.setattr("robocov_app.notebook.find_spec", lambda _: None)
    rooms = robocov.load_map("rooms")
    simulation = robocov.Simulation(rooms, robocov.Rapf(), rooms.start().sample(3, seed=1))
    simulation.run(1.0)
    assert simulation.show().time[-1] == pytest.approx(61.0)


@pytest.mark.parametrize("controllers", ["lloyd", ["lloyd"]])
def test_a_single_controller_may_be_a_string(controllers, monkeypatch):
    monkeypatch.setattr("robocov_app.notebook.LiveWindow", lambda arguments, _: arguments)
    arguments = show("square", controllers=controllers)
    assert arguments[arguments.index("--controllers") + 1 :] == ["lloyd"]


@pytest.mark.parametrize("controllers", ["", [], ()])
def test_a_window_without_controllers_is_rejected(controllers):
    with pytest.raises(robocov.ParameterError, match="controllers: expected at least one, got none"):
        show("square", controllers=controllers)


def test_an_unknown_map_is_rejected(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(robocov.RobocovError, match="nowhere"):
        robocov.show("nowhere")


def test_without_the_web_extra_a_map_is_shown_as_a_replay(monkeypatch):
    monkeypatch.setattr("robocov_app.notebook.find_spec", lambda _: None)
    record = show("square", robots=2)
    assert record.time[-1] == pytest.approx(60.0)


def test_the_link_in_a_cell_leads_through_a_jupyter_hub(monkeypatch):
    window = notebook_window.LiveWindow.__new__(notebook_window.LiveWindow)
    window.link = "http://127.0.0.1:4567/?token=abc"
    window.height = 500
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/ada/")
    assert 'src="/user/ada/proxy/4567/?token=abc"' in window._repr_html_()
