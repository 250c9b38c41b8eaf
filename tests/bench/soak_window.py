"""Measure how the memory of a window grows during an hour of use.

    python tests/bench/soak_window.py --minutes 60 --robots 6

Frames follow each other as fast as possible, but each advances the window by its usual time. Now and then the
script edits the session as a user would. It prints the resident memory every five minutes of window time.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np

from robocov.errors import RobocovError
from robocov.mapfile import load_map
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.window.display import open_display
from robocov_app.toolkit.window.window import FPS
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.window import ViewerWindow

MAP_NAME = "rooms"
LATTICE = 16
WINDOW_SIZE_PX = (1280, 720)
WARM_UP_MINUTES = 10
"""Time until all buffers and caches have their final size."""
REPORT_INTERVAL_MINUTES = 5
FRAMES_PER_MINUTE = 60 * FPS
MEAN_EDIT_INTERVAL_S = 20.0
EDITS = ("drag", "release", "fail", "revive", "set parameter")
MIN_WORKING_ROBOTS = 3
DRAG_AREA_M = ((1.0, 1.0), (11.0, 8.0))
"""Lower left and upper right corner of the positions to which robots are dragged."""
BYTES_PER_MB = 1e6


def read_resident_memory() -> float:
    """Return the resident memory of this process, MB. Works on Linux only."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / BYTES_PER_MB


def build_presenter(robots: int, folder: Path) -> Presenter:
    """Build the presenter of a session on the map, with the layers that are shown by default."""
    scenario = SessionScenario(load_map(MAP_NAME), (ControllerChoice("rapf"),), robots, "uniform")
    layers = {layer.name for layer in build_standard_layers() if layer.is_default}
    # Costs are computed in this process. Their usual process would have memory of its own.
    costs = Costs(LATTICE, direct=True)
    return Presenter(Session(scenario), costs, layers, folder, MAP_NAME)


def edit_session(presenter: Presenter, rng: np.random.Generator) -> None:
    """Edit the session at random, by edits that do not shorten its history."""
    session = presenter.session
    numbers = session.displayed.numbers
    number = int(rng.choice(numbers))
    edit = EDITS[rng.integers(len(EDITS))]
    try:
        if edit == "drag":
            x, y = rng.uniform(*DRAG_AREA_M)
            session.drag_robot(number, (float(x), float(y)))
        elif edit == "release":
            session.release()
        elif edit == "fail" and len(numbers) > MIN_WORKING_ROBOTS:
            session.fail_robot(number)
        elif edit == "revive":
            for failed_number in list(session.timeline.panes[0].setup.failed):
                session.revive_robot(failed_number)
        else:
            presenter.comparison.set_parameter("k_rep", float(rng.uniform(0.1, 2.0)))
    except RobocovError as error:
        print(f"rejected: {error}")


def run_minute(window: ViewerWindow, presenter: Presenter, rng: np.random.Generator) -> None:
    """Run the frames of a minute, with some edits between them."""
    edit_probability = 1.0 / (MEAN_EDIT_INTERVAL_S * FPS)
    for _ in range(FRAMES_PER_MINUTE):
        if rng.random() < edit_probability:
            edit_session(presenter, rng)
        window.run_frame(1.0 / FPS)


def main() -> None:
    """Use a window, and print how its memory grows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=int, default=60, help="window time, min (default: %(default)s)")
    parser.add_argument("--robots", type=int, default=6, help="number of robots (default: %(default)s)")
    arguments = parser.parse_args()
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder, open_display(headless=True):
        presenter = build_presenter(arguments.robots, Path(folder))
        window = ViewerWindow(presenter, WINDOW_SIZE_PX, 1.0)
        initial_memory = read_resident_memory()
        for minute in range(1, arguments.minutes + 1):
            run_minute(window, presenter, rng)
            if minute == WARM_UP_MINUTES:
                initial_memory = read_resident_memory()
            if minute % REPORT_INTERVAL_MINUTES == 0:
                history = presenter.session.timeline.history
                print(
                    f"{minute:3d} min  {read_resident_memory():7.1f} MB  "
                    f"{len(history)} steps, {history.thinned} thinned",
                    flush=True,
                )
        growth = read_resident_memory() - initial_memory
        since = "after the warm-up" if arguments.minutes > WARM_UP_MINUTES else "since the start"
        print(f"memory grew by {growth:.1f} MB {since}")


if __name__ == "__main__":
    main()
