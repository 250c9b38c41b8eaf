"""Reference placements for the maps of the replication."""

import json
import threading
from dataclasses import replace

import pytest
from drawn_run import SQUARE

from robocov.cost import CoverageCost
from robocov.environment import Environment, UniformStart
from robocov.errors import OutputError
from robocov.mapfile import to_json
from robocov_app.evaluation.reference_search import ReferencePlacement, ReferenceQuery
from robocov_app.replication.design.plan import QUICK
from robocov_app.replication.results import references
from robocov_app.replication.results.references import find_references
from robocov_app.sweep.study.study import StudyMap
from robocov_app.terminal.interruption import Interruption

HALL = Environment("hall", ((0, 0), (9, 0), (9, 3), (0, 3)), (), {"spread": UniformStart()})
MAPS = (StudyMap("square", SQUARE), StudyMap("hall", HALL))


def search(folder, maps=MAPS, *, restarts=2, lattice=16, robots=3, radius=0.1, stop=None):
    """Find the references of maps in two processes, with a team smaller than the study's."""
    plan = replace(QUICK, lattice=lattice, restarts=restarts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(references, "ROBOTS", robots)
        patch.setattr(references, "TEAM", {"radius": radius})
        return find_references(maps, folder, plan, 2, stop or Interruption(), quiet=True)


@pytest.mark.slow
def test_each_map_has_its_reference_and_its_file(tmp_path):
    placements = search(tmp_path / "references")
    assert set(placements) == {"square", "hall"}
    for study_map in MAPS:
        placement = placements[study_map.name]
        cost = CoverageCost(study_map.environment, 16)(list(placement.positions))
        assert cost.mean_distance == pytest.approx(placement.mean_distance)
        content = json.loads((tmp_path / "references" / f"{study_map.name}.json").read_text())
        assert content["mean_distance_m"] == placement.mean_distance
        assert (content["restarts"], content["robots"], len(content["positions_m"])) == (2, 3, 3)
    # There is about one robot in each third of the hall.
    assert sorted(x for x, _ in placements["hall"].positions) == pytest.approx([1.5, 4.5, 7.5], abs=0.4)


@pytest.mark.slow
def test_stored_references_are_reused(tmp_path):
    first = search(tmp_path)
    path = tmp_path / "hall.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"mean_distance_m": 0.125}))
    assert search(tmp_path)["hall"].mean_distance == 0.125
    # Placements of other searches and unreadable files are replaced.
    assert search(tmp_path, restarts=3)["hall"].mean_distance == pytest.approx(first["hall"].mean_distance)
    path.write_text("{")
    assert search(tmp_path)["hall"] == first["hall"]


def test_the_reference_does_not_depend_on_the_starts():
    def compute_hash(starts):
        environment = Environment(HALL.name, HALL.boundary, (), starts)
        return ReferenceQuery(to_json(environment), 3, 0.1, 16, 2).input_hash

    assert compute_hash({"spread": UniformStart()}) == compute_hash({})
    assert compute_hash({}) != ReferenceQuery(to_json(SQUARE), 3, 0.1, 16, 2).input_hash


@pytest.mark.slow
def test_the_error_names_a_map_without_space(tmp_path):
    closet = Environment("closet", ((0, 0), (1, 0), (1, 1), (0, 1)), ())
    with pytest.raises(OutputError, match=r"reference of map 'closet': radius: no space for a robot"):
        search(tmp_path, maps=(StudyMap("closet", closet),), radius=0.6)


def test_an_interruption_ends_the_search_at_once(tmp_path):
    stop = Interruption()
    timer = threading.Timer(0.5, lambda: setattr(stop, "requested", True))
    timer.start()
    placements = search(tmp_path, maps=MAPS[:1], restarts=5000, robots=40, lattice=64, stop=stop)
    timer.join()
    assert placements == {}
    assert not list(tmp_path.iterdir())


def test_equal_placements_compare_equal():
    assert ReferencePlacement(1.0, ((0.0, 1.0),), 0.5) == ReferencePlacement(1.0, ((0.0, 1.0),), 0.5)
