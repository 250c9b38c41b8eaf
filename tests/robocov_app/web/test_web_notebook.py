"""`robocov.show` in a notebook's cell that is executed for real, and in a browser that shows the cell."""

import functools
import http.server
import threading
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


def test_a_cell_shows_the_window(tmp_path, monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.chdir(tmp_path)
    code = "import robocov as rc\nrooms = rc.load_map('rooms')\nwindow = "
    code += "rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0)).show()\nwindow"
    fetch = "import urllib.request\nprint(urllib.request.urlopen(window.link).status)\nwindow.close()"
    cells = [nbformat.v4.new_code_cell(each) for each in (code, fetch)]
    notebook = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(notebook, timeout=120).execute()
    frame = notebook.cells[0].outputs[-1]["data"]["text/html"]
    assert 'src="http://127.0.0.1:' in frame
    assert notebook.cells[1].outputs[0]["text"] == "200\n"


@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver")
def test_the_cell_is_live_also_in_a_page_of_another_site(tmp_path, monkeypatch):
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
        pictures = "const seen = canvas.toDataURL(); return seen"
        before = browser.run_script(pictures)
        browser.wait_until(lambda: browser.run_script(pictures) != before)
    finally:
        browser.driver.quit()
        site.shutdown()
        site.server_close()
        window.close()


def test_a_simulation_goes_on_in_the_window(monkeypatch):
    def open_called_session(call, height):
        return Session.open(load_session(Path(call[1]))).timeline.panes[0].simulation

    monkeypatch.setattr("robocov_app.notebook.LiveWindow", open_called_session)
    rooms = robocov.load_map("rooms")
    simulation = robocov.Simulation(rooms, robocov.Rapf(k_rep=0.4), rooms.start().sample(3, seed=1))
    simulation.run(1.0)
    found = simulation.show()
    assert np.array_equal(found.positions, simulation.positions)
    assert np.array_equal(found.velocities, simulation.velocities)
    assert found.controller.k_rep == 0.4
    monkeypatch.setattr("robocov_app.notebook.find_spec", lambda _: None)
    assert simulation.show().time[-1] == pytest.approx(61.0)


def test_what_is_wrong_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(robocov.RobocovError, match="nowhere"):
        robocov.show("nowhere")


def test_without_the_extra_it_is_a_replay(monkeypatch):
    monkeypatch.setattr("robocov_app.notebook.find_spec", lambda _: None)
    record = show("square", robots=2)
    assert record.time[-1] == pytest.approx(60.0)


def test_behind_a_hub_the_cell_asks_the_hub(monkeypatch):
    window = notebook_window.LiveWindow.__new__(notebook_window.LiveWindow)
    window.link = "http://127.0.0.1:4567/?token=abc"
    window.height = 500
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/ada/")
    assert 'src="/user/ada/proxy/4567/?token=abc"' in window._repr_html_()
