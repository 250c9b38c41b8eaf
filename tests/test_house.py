"""The rules of the house: layout, types, style, imports."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted([*(ROOT / "coverage").rglob("*.py"), *(ROOT / "app").rglob("*.py")])


def passes(*command: str, cwd: Path = ROOT) -> None:
    done = subprocess.run([sys.executable, *command], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"


def test_ruff_finds_nothing() -> None:
    passes("-m", "ruff", "check", ".")


def test_the_format_is_ruffs() -> None:
    passes("-m", "ruff", "format", "--check", ".")


def test_types_are_strict() -> None:
    passes("-m", "mypy")


def test_imports_go_down_only() -> None:
    call = "from importlinter.cli import lint_imports_command as lint; lint([])"
    passes("-c", call)


@pytest.mark.parametrize("root", ["coverage", "app"])
def test_a_source_root_is_not_a_package(root: str) -> None:
    """An import package called `coverage` would overwrite coverage.py in the user's environment."""
    assert not (ROOT / root / "__init__.py").exists()


def test_top_level() -> None:
    for name in (
        "pyproject.toml",
        "app",
        "coverage",
        "maps",
        "tests",
        "README.md",
        "LICENSE",
        "CHANGELOG.md",
    ):
        assert (ROOT / name).exists()


def test_files_do_one_thing() -> None:
    long = {path.name: n for path in SOURCES if (n := len(path.read_text().splitlines())) > 420}
    assert not long


TESTED_THROUGH = {
    "arrays_types": "everywhere",
    "mouse": "test_demo_window",
    "aims": "test_aim_marks",
    "atomic": "test_record",
    "corner_views": "test_cost",
    "robot_views": "test_cost",
    **dict.fromkeys("bounded_cells cell_edges clipped_cells".split(), "test_voronoi"),
    "bisectors": "test_weighted_cells",
    "controllers_cells": "test_controllers",
    **dict.fromkeys("mapfile_models mapfile_rules strictjson".split(), "test_map_errors"),
    "observations": "test_controllers",
    "decisions": "test_simulation",
    **dict.fromkeys("recorder run_record".split(), "test_record"),
    "region": "test_environment",
    **dict.fromkeys(
        "density_base density_kinds density_moments density_raster".split(),
        "test_density",
    ),
    **dict.fromkeys("gaussian_moments polygon_moments raster_moments".split(), "test_density"),
    **dict.fromkeys("density_models mapfile_fields".split(), "test_mapfile_density"),
    "conditions_parameters": "test_conditions",
    "cost_coverage": "test_cost",
    "environment_geometry": "test_environment",
    "geodesic_distances": "test_geodesic",
    "locational_cost": "test_locational",
    "mapfile_conversion": "test_mapfile",
    "metrics_summary": "test_metrics",
    "optimum_search": "test_optimum",
    "robots_team": "test_robots",
    "world_bodies": "test_world",
    "editor_weighing": "test_editor_densities",
    "leading": "test_editor_paths",
    "density_picture": "test_weighing",
    **dict.fromkeys("base gains individual lloyd rapf repulsion rpf".split(), "test_controllers"),
    "disc_cells": "test_range_limited",
    "projection": "test_barrier",
    "returns": "test_howard",
    "driving": "test_dispersion",
    **dict.fromkeys("bug tangents".split(), "test_tangentbug"),
    **dict.fromkeys("run check controllers cost import_map maps schema console".split(), "test_cli"),
    "report": "test_houseexpo",
    **dict.fromkeys("measure plot render start step".split(), "test_bench"),
    "coverage": "test_coverage_layers",
    **dict.fromkeys("messages cost_process evaluation".split(), "test_cost_worker"),
    **dict.fromkeys("page plots_arena plots_curves plots_runs".split(), "test_plots"),
    **dict.fromkeys("canvas clipping fonts scene sprites".split(), "test_layers"),
    **dict.fromkeys(
        "arena asked film keyboard look pages panel pointer report_page sections typed widgets".split(),
        "test_demo_window",
    ),
    **dict.fromkeys("drawing tool".split(), "test_demo_tools"),
    **dict.fromkeys("paged screen".split(), "test_demo_window"),
    **dict.fromkeys(
        (f"editor_{name}" for name in "actions deeds fields menus settings toolbox typed".split()),
        "test_editor_desk",
    ),
    **dict.fromkeys((f"editor_{name}" for name in "stretching underlay".split()), "test_editor_drawing"),
    **dict.fromkeys((f"editor_{name}" for name in "drags grips".split()), "test_editor_selecting"),
    **dict.fromkeys((f"editor_{name}" for name in "drawn_rings picture".split()), "test_editor_sheet"),
    **dict.fromkeys((f"editor_{name}" for name in "arena handles strips".split()), "test_editor_findings"),
    **dict.fromkeys(
        (f"editor_{name}" for name in "dialogs keyboard lists pages panel pasteboard pointer status".split()),
        "test_editor_window",
    ),
    **dict.fromkeys("editor_opening edit".split(), "test_editor_documents"),
    **dict.fromkeys((f"editor_{name}" for name in "annotations reading".split()), "test_editor_document"),
    **dict.fromkeys(
        (f"editor_{name}" for name in "adding affine placing plane".split()),
        "test_editor_edits",
    ),
    **dict.fromkeys((f"editor_{name}" for name in "corners walls".split()), "test_editor_vertices"),
    **dict.fromkeys(
        (f"editor_readout_{name}" for name in "messages process".split()),
        "test_editor_readout_worker",
    ),
    "editor_outlines": "test_editor_booleans",
    "editor_faults": "test_editor_problems",
    "editor_targets": "test_editor_snapping",
    **dict.fromkeys("kept keep_process".split(), "test_demo_keeping"),
    "learning_expert": "test_learning_policy",
    "learning_driving": "test_learning_driving",
    "coverage_v0": "test_learning_parallel",
    "own_process": "test_cost_worker",
    "talk": "test_cost_worker",
    **dict.fromkeys("replay saved".split(), "test_cli_replay"),
    "demo": "test_demo_opening",
    "bench_window": "test_bench",
    "commands_optimum": "test_cli_optimum",
    **dict.fromkeys("generator_request generator_polygons generator_rooms".split(), "test_generator"),
    **dict.fromkeys("crew worker".split(), "test_sweep_pool"),
    "facts": "test_report_tables",
    **dict.fromkeys("dependence_plots result_plots".split(), "test_report_document"),
    "lock": "test_sweep_ledger",
    "sweep": "test_cli_sweep",
    "generate": "test_cli_generate",
    **dict.fromkeys("asking claims gain_claims outcomes placements verdicts".split(), "test_paper_claims"),
    **dict.fromkeys("contenders plan".split(), "test_paper_plan"),
    **dict.fromkeys("figures claim_plots".split(), "test_paper_figures"),
    **dict.fromkeys("references reference_worker".split(), "test_paper_references"),
    **dict.fromkeys("studying writing words".split(), "test_paper_studying"),
    **dict.fromkeys("bars told".split(), "test_paper_telling"),
    "reading": "test_paper_reading",
    "paper_tables": "test_paper_studying",
    **dict.fromkeys("doing beyond_writing beyond_plots evidence paper_pages".split(), "test_paper_beyond"),
    **dict.fromkeys("beyond_plan beyond_studies accounts".split(), "test_paper_beyond_plan"),
    "extensions": "test_paper_goals",
    "paper": "test_paper_command",
    **dict.fromkeys("foreign bounding importers_report".split(), "test_shaping"),
    **dict.fromkeys("outline passing".split(), "test_simplifying"),
    "importers_reading": "test_importing",
    "raster": "test_ros",
    "exporters_writing": "test_exporting",
    "importers_corners": "test_houseexpo",
    "shapes": "test_enclosing",
    "json_file": "test_geojson",
    **dict.fromkeys("text_file wkt_text".split(), "test_wkt"),
    **dict.fromkeys("svg_drawing svg_tree".split(), "test_svg"),
    "svg_numbers": "test_svg_path",
    **dict.fromkeys("dxf_curves dxf_drawing".split(), "test_dxf"),
    **dict.fromkeys(
        "coordinates exporters_wkt exporters_geojson exporters_svg".split(), "test_vector_round_trips"
    ),
}
"""Modules without a test file of their own, and the one that tests them."""


def test_every_module_has_its_tests() -> None:
    tests = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    for path in SOURCES:
        if not path.stem.startswith("__"):
            homely = f"{path.parent.name}_{path.stem}"
            own = f"test_{homely}" if f"test_{homely}" in tests else f"test_{path.stem}"
            elsewhere = None if own == f"test_{homely}" else TESTED_THROUGH.get(path.stem)
            where = TESTED_THROUGH.get(homely) or elsewhere or own
            assert where in tests or where == "everywhere", f"{path.name} has no tests"


def test_the_tests_of_the_library_stand_in_the_folders_of_its_packages() -> None:
    tested = {path.parent.name for path in (ROOT / "tests/robocov").glob("*/test_*.py")}
    packages = {path.parent.name for path in (ROOT / "coverage/robocov").glob("*/__init__.py")}
    assert tested == packages
    flat = {path.stem for path in (ROOT / "coverage/robocov").glob("*.py")}
    loose = {path.stem.removeprefix("test_") for path in (ROOT / "tests/robocov").glob("test_*.py")}
    assert loose - flat == {"errata"}, "tests beside the packages that belong into them"


def test_the_version_is_said_once_in_each_place() -> None:
    import robocov

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == robocov.__version__
    assert f"## {robocov.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_public_names_are_what_the_package_says() -> None:
    import robocov

    assert sorted(robocov._HOME) == sorted(robocov.__all__)
    for name in robocov.__all__:
        assert getattr(robocov, name) is not None
    modules = {path.stem for path in (ROOT / "coverage/robocov").iterdir()}
    assert not modules & set(robocov.__all__), "once imported, a module would hide the name"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        robocov.nothing
    tree = ast.parse((ROOT / "coverage/robocov/__init__.py").read_text())
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    declared = {alias.name for node in imports for alias in node.names}
    assert set(robocov.__all__) <= declared, "a name that type checkers do not see"


def loaded_by(statement: str) -> set[str]:
    script = f"import sys\n{statement}\nprint(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_loads_neither_pygame_nor_matplotlib() -> None:
    loaded = loaded_by("import robocov")
    assert not loaded & {"pygame", "matplotlib", "scipy", "shapely", "pydantic"}
    everything = loaded_by("import robocov\nfor name in robocov.__all__: getattr(robocov, name)")
    assert not everything & {"pygame", "matplotlib", "rich", "tyro"}


def test_asking_for_help_loads_nothing_heavy() -> None:
    loaded = loaded_by("from robocov_app.cli import main\nmain(['--help'])")
    heavy = {"numpy", "scipy", "shapely", "pydantic", "pygame", "matplotlib", "pymunk", "tyro", "rich"}
    assert not loaded & heavy


def test_ci_runs_the_readmes_test_command_and_nothing_else() -> None:
    readme = (ROOT / "README.md").read_text()
    script = (ROOT / ".ci/run").read_text().splitlines()
    command = script[-1]
    assert command in readme.splitlines()
    others = [line for line in script[:-1] if line and not line.startswith("#")]
    assert others[:2] == ["set -eu", 'cd "$(dirname "$0")/.."']
    # what is beside it brings a screen and hands for the tests that can do without, and may fail
    assert all(line.endswith("|| true") for line in others[2:])
