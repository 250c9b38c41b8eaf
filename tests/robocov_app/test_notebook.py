"""The notebook in tests/notebooks: it runs without warnings, and its cells show maps, runs and plots."""

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
    pytest.mark.xdist_group("notebook"),  # One worker executes the notebook once.
    # pyzmq warns of this on Windows, although it has a remedy.
    pytest.mark.filterwarnings("ignore:Proactor event loop does not implement:RuntimeWarning"),
]


REPLACEMENTS = {
    "lattice=128": "lattice=32",
    "seed in range(10)": "seed in range(2)",
    "several).run(60.0)": "several).run(5.0)",
    "seeds=range(3)": "seeds=range(2)",
}
"""Long-running parts of the code, and their replacements in the test."""


def find_cell(notebook, name):
    return next(cell for cell in notebook.cells if cell["id"] == name)


def list_shown(notebook, name):
    """Return the MIME bundles that a cell shows."""
    return [output["data"] for output in find_cell(notebook, name).outputs if "data" in output]


def list_code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """Execute the notebook in a kernel of its own, without the settings of any user; return it."""
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
    folder_variables = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory() as short_folder:
        for name in folder_variables:
            patch.setenv(name, str(folder / name.lower()))
        patch.setenv("JUPYTER_PLATFORM_DIRS", "1")
        patch.delenv("MPLBACKEND", raising=False)
        specs = KernelSpecManager(kernel_dirs=[str(spec.parent)], ensure_native_kernel=False)
        manager = AsyncKernelManager(kernel_name="robocov", kernel_spec_manager=specs)
        if os.name == "posix":  # Sockets need no ports, but short paths.
            manager.transport = "ipc"
            manager.ip = str(Path(short_folder) / "kernel")
        notebook = nbformat.read(NOTEBOOK, as_version=4)
        cells = list_code_cells(notebook)
        assert all(any(long_part in cell.source for cell in cells) for long_part in REPLACEMENTS)
        for cell in cells:
            for long_part, short_part in REPLACEMENTS.items():
                cell.source = cell.source.replace(long_part, short_part)
        # Warnings are errors in the cells, but not while Jupyter starts.
        notebook.cells.insert(0, nbformat.v4.new_code_cell("import warnings\nwarnings.simplefilter('error')"))
        work = folder / "work"
        work.mkdir()
        client = NotebookClient(
            notebook, km=manager, timeout=600, resources={"metadata": {"path": str(work)}}
        )
        client.execute(cleanup_kc=True)
    saved_path = os.environ.get("ROBOCOV_KEEP_NOTEBOOK")
    if saved_path:
        nbformat.write(notebook, saved_path)
    return notebook


def test_the_notebook_is_committed_without_outputs():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    for cell in list_code_cells(notebook):
        assert cell.outputs == []
        assert cell.execution_count is None
    assert set(notebook.metadata) == {"kernelspec", "language_info"}


def test_the_notebook_contains_every_statement_of_the_handbooks_example():
    page = (ROOT / "app/handbook/python.md").read_text()
    (example,) = re.findall(r"```python\n(environment = rc.load_map.*?)```", page, flags=re.DOTALL)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    code = "\n".join(cell.source for cell in list_code_cells(notebook))
    statements = {ast.unparse(statement) for statement in ast.parse(code).body}
    expected = {ast.unparse(statement) for statement in ast.parse(example).body}
    assert expected <= statements


def test_only_the_cell_that_prints_costs_prints_text(executed):
    """There are neither warnings nor messages of progress."""
    printed = {}
    for cell in list_code_cells(executed):
        for output in cell.outputs:
            if output.output_type == "stream":
                printed[cell["id"]] = output["text"]
    assert set(printed) == {"cost"}
    assert [float(number) for number in printed["cost"].split()]


def test_a_map_is_shown_as_a_drawing(executed):
    (bundle,) = list_shown(executed, "map")
    assert set(bundle) == {"text/html", "image/png", "text/plain"}
    assert bundle["text/plain"].startswith("<Environment Rooms, ")
    assert 'class="robocov-map"' in bundle["text/html"]
    assert 'role="img"' in bundle["text/html"]
    assert Image.open(io.BytesIO(base64.b64decode(bundle["image/png"]))).width > 800


def test_a_run_is_shown_as_a_replay(executed):
    (bundle,) = list_shown(executed, "run")
    assert set(bundle) == {"text/html", "image/png", "text/plain"}
    assert bundle["text/plain"] == "<Record rapf on Rooms, 6 robots, 60.0 s>"
    html = bundle["text/html"]
    assert 'class="robocov-replay"' in html
    assert "<script>" in html
    assert '"cost":{' in html
    # Outputs are stored in the notebook, so they have to be small.
    assert len(html) < 200_000


def test_snapshots_and_shortened_records_are_described_in_one_line(executed):
    (bundle,) = list_shown(executed, "moment")
    assert set(bundle) == {"text/plain"}
    text = bundle["text/plain"]
    assert "<Snapshot at 12.00 s, 6 robots>" in text
    assert "<Record rapf on Rooms, 6 robots, 20.0 s>" in text
    assert text.endswith("301)")


def test_a_plot_without_given_axes_is_shown_as_a_page(executed):
    (output,) = [output for output in find_cell(executed, "cost").outputs if "data" in output]
    image = Image.open(io.BytesIO(base64.b64decode(output["data"]["image/png"])))
    assert image.width > output["metadata"]["image/png"]["width"] > 600
    assert "mean distance" in output["metadata"]["image/png"]["alt"]


def test_plots_on_given_axes_are_shown_once(executed):
    (bundle,) = list_shown(executed, "axes")
    assert "image/png" in bundle


def test_a_data_frame_is_shown(executed):
    (bundle,) = list_shown(executed, "frame")
    assert re.findall(r"<th>(\w+)</th>", bundle["text/html"])[:4] == ["time_s", "robot", "x_m", "y_m"]
    (bundle,) = list_shown(executed, "speeds")
    speeds = [float(line.split()[1]) for line in bundle["text/plain"].splitlines()[1:-1]]
    assert len(speeds) == 6
    assert 0.5 < max(speeds) <= 1.0 + 1e-9


def test_a_sweep_is_shown_with_its_table_and_worst_run(executed):
    (bundle,) = list_shown(executed, "sweep")
    assert "text/html" in bundle
    (bundle,) = list_shown(executed, "table")
    assert bundle["text/html"].count("<tr>") >= 3
    (bundle,) = list_shown(executed, "worst")
    assert 'class="robocov-replay"' in bundle["text/html"]
