"""Memory of the window during an hour: ``python tests/bench/soak_window.py [minutes] [robots]``.

Frames follow each other as fast as they can, each as if a sixtieth of a second had passed; now and then
something is touched, as people do. Prints the resident memory every few minutes of that time.
"""

from __future__ import annotations

import sys
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
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window.window import ViewerWindow

WARM = 10
"""Minutes until all that is kept is there."""


def read_memory_mb() -> float:
    """Return the memory in use, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def main(minutes: int, robots: int) -> None:
    """Use the window for so long, and tell how its memory grows."""
    rng = np.random.default_rng(0)
    session = Session(SessionScenario(load_map("rooms"), (ControllerChoice("rapf"),), robots, "uniform"))
    layers = {layer.name for layer in build_standard_layers() if layer.is_default}
    with tempfile.TemporaryDirectory() as folder, open_display(headless=True):
        # the cost beside it takes no memory here; one a frame would take all of the time
        viewer = Presenter(session, Costs(16, direct=True), layers, Path(folder), "rooms")
        window = ViewerWindow(viewer, (1280, 720), 1.0)
        warm = read_memory_mb()
        for minute in range(1, minutes + 1):
            for _ in range(60 * FPS):
                if rng.random() < 1 / (20 * FPS):
                    touch(viewer, rng)
                window.run_frame(1.0 / FPS)
            if minute == WARM:
                warm = read_memory_mb()
            if minute % 5 == 0:
                past = f"{len(session.timeline.history)} moments, {session.timeline.history.thinned} thinned"
                print(f"{minute:3d} min  {read_memory_mb():7.1f} MB  {past}", flush=True)
        print(f"grown by {read_memory_mb() - warm:.1f} MB since minute {WARM}")


def touch(viewer: Presenter, rng: np.random.Generator) -> None:
    """Do something that people do, and which leaves the run as long as it is."""
    numbers = viewer.session.displayed.numbers
    number = int(rng.choice(numbers))
    try:
        match int(rng.integers(5)):
            case 0:
                viewer.session.drag_robot(number, (float(rng.uniform(1, 11)), float(rng.uniform(1, 8))))
            case 1:
                viewer.session.release()
            case 2 if len(numbers) > 3:
                viewer.session.fail_robot(number)
            case 3:
                for failed in list(viewer.session.timeline.panes[0].setup.failed):
                    viewer.session.revive_robot(failed)
            case _:
                viewer.comparison.set_parameter("k_rep", float(rng.uniform(0.1, 2.0)))
    except RobocovError as error:
        print(f"refused: {error}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60, int(sys.argv[2]) if len(sys.argv) > 2 else 6)
