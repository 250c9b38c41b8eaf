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


def search(folder, maps=MAPS, restarts=2, stop=None, **other):
    plan = replace(QUICK, lattice=other.pop("lattice", 16), restarts=restarts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(references, "ROBOTS", other.get("robots", 3))
        patch.setattr(references, "TEAM", {"radius": other.get("radius", 0.1)})
        return find_references(maps, folder, plan, 2, stop or Interruption(), quiet=True)


@pytest.mark.slow
def test_each_map_has_its_reference_and_its_file(tmp_path):
    answers = search(tmp_path / "references")
    assert set(answers) == {"square", "hall"}
    for each in MAPS:
        answer = answers[each.name]
        cost = CoverageCost(each.environment, 16)(list(answer.positions))
        assert cost.mean_distance == pytest.approx(answer.mean_distance)
        content = json.loads((tmp_path / "references" / f"{each.name}.json").read_text())
        assert content["mean_distance_m"] == answer.mean_distance
        assert (content["restarts"], content["robots"], len(content["positions_m"])) == (2, 3, 3)
    # about one robot in each third of the hall
    assert sorted(x for x, _ in answers["hall"].positions) == pytest.approx([1.5, 4.5, 7.5], abs=0.4)


@pytest.mark.slow
def test_stored_references_are_reused(tmp_path):
    first = search(tmp_path)
    path = tmp_path / "hall.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"mean_distance_m": 0.125}))
    assert search(tmp_path)["hall"].mean_distance == 0.125
    # another search is another question, and so is a file that cannot be read
    assert search(tmp_path, restarts=3)["hall"].mean_distance == pytest.approx(first["hall"].mean_distance)
    path.write_text("{")
    assert search(tmp_path)["hall"] == first["hall"]


def test_starts_are_no_part_of_the_question():
    def compute_hash(starts):
        shape = Environment(HALL.name, HALL.boundary, (), starts)
        return ReferenceQuery(to_json(shape), 3, 0.1, 16, 2).input_hash

    assert compute_hash({"spread": UniformStart()}) == compute_hash({})
    assert compute_hash({}) != ReferenceQuery(to_json(SQUARE), 3, 0.1, 16, 2).input_hash


@pytest.mark.slow
def test_the_error_names_a_map_without_space(tmp_path):
    tight = Environment("closet", ((0, 0), (1, 0), (1, 1), (0, 1)), ())
    with pytest.raises(OutputError, match=r"reference of map 'closet': robots: expected at most about 0"):
        search(tmp_path, maps=(StudyMap("closet", tight),), radius=0.6)


def test_an_interruption_ends_the_search_at_once(tmp_path):
    stop = Interruption()
    timer = threading.Timer(0.5, lambda: setattr(stop, "requested", True))
    timer.start()
    answers = search(tmp_path, maps=MAPS[:1], restarts=5000, robots=40, lattice=64, stop=stop)
    timer.join()
    assert answers == {}
    assert not list(tmp_path.iterdir())


def test_answers_are_values():
    assert ReferencePlacement(1.0, ((0.0, 1.0),), 0.5) == ReferencePlacement(1.0, ((0.0, 1.0),), 0.5)
