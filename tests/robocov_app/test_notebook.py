"""The notebook in tests/notebooks runs from the top, and shows what it should."""

import ast
import base64
import io
import json
import os
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "tests/notebooks/coverage.ipynb"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("notebook"),  # executed once, by one worker
    # what pyzmq says on Windows, where it helps itself
    pytest.mark.filterwarnings("ignore:Proactor event loop does not implement:RuntimeWarning"),
]


def find_cell(notebook, name):
    return next(each for each in notebook.cells if each["id"] == name)


def list_shown(notebook, name):
    """Return the MIME bundles that a cell shows."""
    return [output["data"] for output in find_cell(notebook, name).outputs if "data" in output]


def read_printed(notebook, name):
    return "".join(
        output["text"] for output in find_cell(notebook, name).outputs if output.output_type == "stream"
    )


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """The notebook as it is after execution, in a kernel of its own and with nobody's settings."""
    from jupyter_client.kernelspec import KernelSpecManager
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient

    folder = tmp_path_factory.mktemp("notebook")
    spec = folder / "kernels/robocov"
    spec.mkdir(parents=True)
    command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    (spec / "kernel.json").write_text(
        json.dumps({"argv": command, "display_name": "robocov", "language": "python"})
    )
    homes = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory() as short_folder:
        for name in homes:
            patch.setenv(name, str(folder / name.lower()))
        patch.setenv("JUPYTER_PLATFORM_DIRS", "1")
        patch.delenv("MPLBACKEND", raising=False)
        specs = KernelSpecManager(kernel_dirs=[str(spec.parent)], ensure_native_kernel=False)
        manager = AsyncKernelManager(kernel_name="robocov", kernel_spec_manager=specs)
        if os.name == "posix":  # no ports, and paths short enough for sockets
            manager.transport = "ipc"
            manager.ip = str(Path(short_folder) / "kernel")
        notebook = nbformat.read(NOTEBOOK, as_version=4)
        # in its cells, too, warnings are errors; those of Jupyter's own start are not ours
        notebook.cells.insert(0, nbformat.v4.new_code_cell("import warnings\nwarnings.simplefilter('error')"))
        work = folder / "work"
        work.mkdir()
        client = NotebookClient(
            notebook, km=manager, timeout=600, resources={"metadata": {"path": str(work)}}
        )
        client.execute(cleanup_kc=True)
    if kept := os.environ.get("ROBOCOV_KEEP_NOTEBOOK"):
        nbformat.write(notebook, kept)
    return notebook


def test_it_is_committed_without_outputs():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    for each in notebook.cells:
        if each.cell_type == "code":
            assert each.outputs == [] and each.execution_count is None
    assert set(notebook.metadata) == {"kernelspec", "language_info"}


def test_it_has_every_statement_of_the_handbooks_example():
    page = (ROOT / "app/handbook/python.md").read_text()
    (example,) = re.findall(r"```python\n(environment = rc.load_map.*?)```", page, flags=re.DOTALL)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    code = "\n".join(each.source for each in notebook.cells if each.cell_type == "code")
    there = {ast.dump(statement) for statement in ast.parse(code).body}
    missing = [
        ast.unparse(statement) for statement in ast.parse(example).body if ast.dump(statement) not in there
    ]
    assert not missing


def test_nothing_is_said_on_the_side(executed):
    """No warnings, no progress: what is printed is what the cells print."""
    said = {
        each["id"]: output["text"]
        for each in executed.cells
        if each.cell_type == "code"
        for output in each.outputs
        if output.output_type == "stream"
    }
    assert set(said) == {"cost"}
    assert [float(word) for word in said["cost"].split()]


def test_a_map_is_shown(executed):
    (bundle,) = list_shown(executed, "map")
    assert set(bundle) == {"text/html", "image/png", "text/plain"}
    assert bundle["text/plain"].startswith("<Environment Rooms, ")
    assert 'class="robocov-map"' in bundle["text/html"] and 'role="img"' in bundle["text/html"]
    assert Image.open(io.BytesIO(base64.b64decode(bundle["image/png"]))).width > 800


def test_a_run_is_shown_and_can_be_played(executed):
    (bundle,) = list_shown(executed, "run")
    assert set(bundle) == {"text/html", "image/png", "text/plain"}
    assert bundle["text/plain"] == "<Record rapf on Rooms, 6 robots, 60.0 s>"
    html = bundle["text/html"]
    assert 'class="robocov-replay"' in html and "<script>" in html and '"cost":{' in html
    # outputs are stored in notebooks: what is shown is small
    assert len(html) < 200_000


def test_moments_are_said_in_short(executed):
    (bundle,) = list_shown(executed, "moment")
    assert set(bundle) == {"text/plain"}
    words = bundle["text/plain"]
    assert "<Snapshot at 12.00 s, 6 robots>" in words and "<Record rapf on Rooms, 6 robots, 20.0 s>" in words
    assert words.endswith("301)")


def test_a_plot_without_axes_is_shown_as_its_page(executed):
    (output,) = [output for output in find_cell(executed, "cost").outputs if "data" in output]
    picture = Image.open(io.BytesIO(base64.b64decode(output["data"]["image/png"])))
    assert picture.width > output["metadata"]["image/png"]["width"] > 600
    assert "mean distance" in output["metadata"]["image/png"]["alt"]


def test_plots_on_axes_of_ones_own_are_shown_once(executed):
    (bundle,) = list_shown(executed, "axes")
    assert "image/png" in bundle


def test_the_frame_is_shown(executed):
    (bundle,) = list_shown(executed, "frame")
    assert re.findall(r"<th>(\w+)</th>", bundle["text/html"])[:4] == ["time_s", "robot", "x_m", "y_m"]
    (bundle,) = list_shown(executed, "speeds")
    speeds = [float(line.split()[1]) for line in bundle["text/plain"].splitlines()[1:-1]]
    assert len(speeds) == 6 and 0.5 < max(speeds) <= 1.0 + 1e-9


def test_a_sweep_is_read(executed):
    (bundle,) = list_shown(executed, "sweep")
    assert "text/html" in bundle
    (bundle,) = list_shown(executed, "table")
    assert bundle["text/html"].count("<tr>") >= 3
    (bundle,) = list_shown(executed, "worst")
    assert 'class="robocov-replay"' in bundle["text/html"]
