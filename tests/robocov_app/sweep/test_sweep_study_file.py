"""Study files: keys, patterns of map files, and rejected values."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from small_studies import HALL, write_controller

from robocov.errors import InputError
from robocov.mapfile import list_bundled_maps, save_map
from robocov_app.sweep.study.parameters import (
    CONDITIONS,
    KINEMATIC_DEFAULTS,
    TEAM_PARAMETERS,
    build_swept_team,
)
from robocov_app.sweep.study.study_file import list_study_keys, read_study

STUDY = """
maps = ["rooms", "plans/hall.json"]
controllers = ["rapf", "rpf", "mine.py:Mine"]
robots = [3, 6]
starts = "*"
seeds = 4
duration = 5.0
dt = 0.02
lattice = 32
cost_hz = 1
record_hz = 0

[team]
radius = 0.15
max_speed = [0.5, 1]
communication_range = [4.0, inf]
sensing_range = "null"

[gains.rapf]
k_rep = {low = 0.1, high = 10.0, scale = "log"}
rho_0 = {low = 1, high = 3}
attraction_limit = [2.0, "null"]
k_att = 3

[gains."mine.py:Mine"]
pull = [1, 2]

[sampling]
method = "halton"
samples = 5
seed = 9
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "plans").mkdir()
    save_map(HALL, tmp_path / "plans" / "hall.json")
    write_controller(tmp_path, "")
    return tmp_path


def write_study(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_study_file_is_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_study(folder, STUDY)
    monkeypatch.chdir(folder.parent)  # paths begin at the file, not here
    study = read_study(path)
    assert [each.name for each in study.maps] == ["rooms", "hall"]
    assert study.maps[1].environment == HALL
    assert study.seeds == (0, 1, 2, 3)
    assert study.robots == (3, 6)
    assert (study.duration, study.dt, study.lattice, study.cost_hz, study.record_hz) == (
        5.0,
        0.02,
        32,
        1.0,
        0.0,
    )
    assert len(study.teams) == 4
    assert [team["communication_range"] for team in study.teams] == [4.0, None, 4.0, None]
    assert all(team["sensing_range"] is None and team["radius"] == 0.15 for team in study.teams)
    tried = study.get_gains("rapf").choices
    assert len(tried) == 2 * 5
    assert {choice["attraction_limit"] for choice in tried} == {2.0, None}
    assert {choice["k_att"] for choice in tried} == {3.0}
    assert len(study.get_gains("rpf").choices) == 1
    assert [choice["pull"] for choice in study.get_gains("mine.py:Mine").choices] == [1.0, 2.0]
    starts = sum(len(study.list_starts(each)) for each in study.maps)
    assert len(study) == starts * 2 * 4 * 4 * (10 + 1 + 2)


def test_missing_keys_have_defaults(folder: Path) -> None:
    study = read_study(write_study(folder, 'maps = "square"\ncontrollers = "rapf"\n'))
    assert len(study) == 1
    assert (study.robots, study.seeds, study.duration, study.lattice) == ((6,), (0,), 60.0, 64)
    assert study.maps[0].environment.name == "Square"


def test_all_bundled_maps(folder: Path) -> None:
    study = read_study(write_study(folder, 'maps = "*"\ncontrollers = ["rapf"]\nseeds = [3]\n'))
    assert [each.name for each in study.maps] == list(list_bundled_maps())
    assert study.seeds == (3,)


KNOWN = (
    "conditions, controllers, cost_hz, dt, duration, gains, lattice, maps, max_runs, metrics, "
    "record_hz, robots, sampling, seeds, starts, team"
)
WRONG = [
    # Text in the file, its replacement, and the expected message.
    ("robots = [3, 6]", "robot = [3]", f"unknown key 'robot': did you mean 'robots'? (known: {KNOWN})"),
    (
        "robots = [3, 6]",
        "robots = [3, 3]",
        "robots[1]: duplicate value 3, already given at robots[0]",
    ),
    ("robots = [3, 6]", "robots = [0]", "robots[0]: expected a whole number from 1 to 10000, got 0"),
    ("robots = [3, 6]", "robots = [1.5]", "robots[0]: expected a whole number, got 1.5"),
    (
        "robots = [3, 6]",
        "robots = true",
        "robots: expected a whole number, or a list of whole numbers, got True",
    ),
    (
        "robots = [3, 6]",
        'robots = "6"',
        "robots: expected a whole number, or a list of whole numbers, got '6'",
    ),
    ("robots = [3, 6]", "robots = []", "robots: expected at least one, got none"),
    ("robots = [3, 6]", "robots = 6\ngains = 3", "Cannot overwrite"),
    (
        'starts = "*"',
        'starts = ["corridor"]',
        "starts[0]: map 'A hall': unknown start 'corridor': did you mean 'door'?",
    ),
    (
        'starts = "*"',
        'starts = ["*", "door"]',
        "starts[0]: '*' selects all starts. Remove the other starts.",
    ),
    ('starts = "*"', "starts = 3", "starts: expected a string, or a list of strings, got 3"),
    ("seeds = 4", "seeds = [1, 2, 1]", "seeds[2]: duplicate value 1, already given at seeds[0]"),
    ("seeds = 4", "seeds = 0", "seeds: expected a whole number from 1, got 0"),
    ("seeds = 4", "seeds = [-1]", "seeds[0]: expected a whole number from 0 to "),
    ("seeds = 4", "seeds = 1e3", "seeds: expected a number of seeds, or a list of seeds, got 1000.0"),
    ("duration = 5.0", "duration = nan", "duration: expected a number from 0 to 1000000, got nan"),
    ("duration = 5.0", "duration = [5]", "duration: expected a number, got [5]"),
    (
        "duration = 5.0",
        "duration = 1979-05-27",
        "duration: expected a number, got datetime.date(1979, 5, 27)",
    ),
    ("dt = 0.02", "dt = 2", "dt: expected a number from 0 to 1, got 2.0"),
    ("lattice = 32", "lattice = 1", "lattice: expected a whole number from 2 to 2048, got 1"),
    ("lattice = 32", "lattice = 32.0", "lattice: expected a whole number, got 32.0"),
    ("record_hz = 0", "record_hz = -1", "record_hz: expected a number from 0 to 10000, got -1.0"),
    (
        "max_speed = [0.5, 1]",
        "max_sped = 1",
        "team: unknown key 'max_sped': did you mean 'max_speed'? (known: ",
    ),
    (
        "max_speed = [0.5, 1]",
        'max_speed = "fast"',
        "team.max_speed: expected a number, or a list of numbers, ",
    ),
    (
        "max_speed = [0.5, 1]",
        "max_speed = [0.5, -1]",
        "team.max_speed[1]: expected a number from 0.000001 to 1000, got -1.0 m/s",
    ),
    ("max_speed = [0.5, 1]", 'max_speed = "null"', "team.max_speed: expected a number, got 'null'"),
    (
        "max_speed = [0.5, 1]",
        "max_speed = [1, 1.0]",
        "team.max_speed[1]: duplicate value 1.0, already given at team.max_speed[0]",
    ),
    (
        "low = 0.1",
        "lo = 0.1",
        "gains.rapf.k_rep: unknown key 'lo': did you mean 'low'? (known: high, low, scale)",
    ),
    ("low = 0.1, ", "", "gains.rapf.k_rep.low: missing, expected a number"),
    ("low = 0.1", "low = true", "gains.rapf.k_rep.low: expected a number, got True"),
    (
        "low = 0.1",
        "low = 0",
        "gains.rapf.k_rep.low: expected a number above 0 for a logarithmic scale, ",
    ),
    ("low = 0.1", "low = 10", "gains.rapf.k_rep.high: expected a number above 10, got 10"),
    (
        "high = 10.0",
        "high = 1e9",
        "gains.rapf.k_rep.high: expected a number from 0 to 1000000 N m³, got 1000000000.0",
    ),
    ('"log"', '"lag"', 'gains.rapf.k_rep.scale: expected "linear" or "log", got \'lag\''),
    ("k_rep =", "krep =", "gains.rapf: unknown gain 'krep': did you mean 'k_rep'? (known: "),
    ("k_att = 3", "k_att = []", "gains.rapf.k_att: expected at least one value, got none"),
    (
        "k_att = 3",
        "k_att = [[3]]",
        'gains.rapf.k_att[0]: expected a number, "null" for no limit, or a word, got [3]',
    ),
    (
        "k_att = 3",
        "k_att = [3, 3.0]",
        "gains.rapf.k_att[1]: duplicate value 3.0, already given at gains.rapf.k_att[0]",
    ),
    ("k_att = 3", 'k_att = "null"', "gains.rapf.k_att: expected a number from "),
    ("k_att = 3", "k_att = inf", "gains.rapf.k_att: expected a number from "),
    (
        '"null"]\nk_att',
        '"nul"]\nk_att',
        "gains.rapf.attraction_limit[1]: expected a number from 0.000001 to 1000000 N, or null for no limit",
    ),
    (
        "[gains.rapf]",
        "[gains.raf]",
        "gains.raf: unknown controller of the study 'raf': did you mean 'rapf' or 'rpf'?",
    ),
    ("[gains.rapf]", "[gain.rapf]", "unknown key 'gain': did you mean 'gains'? (known: "),
    ("pull = [1, 2]", "pull = [1, {}]", 'gains["mine.py:Mine"].pull[1]: expected a number, "null" for'),
    ("pull = [1, 2]", "push = 1", "gains[\"mine.py:Mine\"]: unknown gain 'push': did you mean 'pull'?"),
    ("samples = 5", "samples = 0", "sampling.samples: expected a whole number from 1 to 100000, got 0"),
    ("samples = 5", "", "sampling.samples: missing, expected a whole number"),
    (
        '"halton"',
        '"halten"',
        'sampling.method: expected "sobol", "latin-hypercube" or "halton", got \'halten\'',
    ),
    (
        "seed = 9",
        "seeds = 9",
        "sampling: unknown key 'seeds': did you mean 'seed'? (known: method, samples, seed)",
    ),
    (
        '["rooms", "plans/hall.json"]',
        '["roms"]',
        "maps[0]: unknown map 'roms': did you mean 'rooms'? (known: ",
    ),
    (
        '["rooms", "plans/hall.json"]',
        '["rooms", "rooms"]',
        "maps[1]: duplicate value 'rooms', already given at maps[0]",
    ),
    ('["rooms", "plans/hall.json"]', "[3]", "maps[0]: expected a string, got 3"),
    ('["rooms", "plans/hall.json"]', "[]", "maps: expected at least one, got none"),
    (
        'maps = ["rooms", "plans/hall.json"]',
        "",
        "maps: missing, expected a list of names of maps, or of paths relative to ",
    ),
    (
        '"mine.py:Mine"]',
        '"mine.py:Yours"]',
        "controllers[2]: controller mine.py: unknown class 'Yours' (known: Mine)",
    ),
    ('"mine.py:Mine"]', '"yours.py:Mine"]', "controllers[2]: 'yours.py:Mine': "),
    ('"rpf", ', '"rfp", ', "controllers[1]: unknown controller 'rfp': did you mean 'rpf'?"),
    ("seeds = 4", "seeds = " + "9" * 5000, "not TOML: exceeds the limit"),
    ("[sampling]", "[sampling", "not TOML: expected ']' at the end of a table declaration (at line "),
]


@pytest.mark.parametrize(("part", "instead", "message"), WRONG)
def test_invalid_values_are_reported_with_file_and_key(
    folder: Path, part: str, instead: str, message: str
) -> None:
    assert part in STUDY
    path = write_study(folder, STUDY.replace(part, instead))
    with pytest.raises(InputError) as caught:
        read_study(path)
    message_text = str(caught.value)
    assert "\n" not in message_text
    if message == "Cannot overwrite":
        assert message_text.startswith(f"{path}: not TOML: cannot overwrite a value")
    else:
        assert message_text.startswith(f"{path}: {message}"), message_text


def test_the_first_issue_is_reported_with_the_number_of_others(folder: Path) -> None:
    text = STUDY.replace("seeds = 4", "seeds = 4.5").replace("robots = [3, 6]", 'robot = "six"')
    with pytest.raises(InputError, match=r"unknown key 'robot'.*\(and 1 more issue\)$"):
        read_study(write_study(folder, text))


def test_a_pattern_selects_map_files_in_alphabetical_order(folder: Path) -> None:
    (folder / "maps").mkdir()
    for name in ("b", "c", "a"):
        save_map(HALL, folder / f"maps/{name}.json")
    (folder / "maps/readme.txt").write_text("no map")
    study = read_study(write_study(folder, 'maps = ["maps/*.json", "rooms"]\ncontrollers = ["rapf"]\n'))
    assert [each.name for each in study.maps] == ["a", "b", "c", "rooms"]


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        ("maps/*.json", r"maps\[0\]: expected a pattern that matches at least one file, got 'maps/\*.json'"),
        ("/maps/*.json", r"maps\[0\]: expected a pattern relative to the study file, got '/maps/\*.json'"),
        ("maps/**.json", r'maps\[0\]: expected "\*\*" only in place of folders, .* got \'maps/\*\*.json\''),
        (300 * "a" + "*.json", r"maps\[0\]: expected a pattern that matches at least one file, got 'aaa"),
    ],
)
def test_a_pattern_without_files_is_rejected(folder: Path, pattern: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        read_study(write_study(folder, f'maps = ["{pattern}"]\ncontrollers = ["rapf"]\n'))


def test_maps_with_equal_names_are_rejected(folder: Path) -> None:
    save_map(HALL, folder / "rooms.json")
    text = 'maps = ["rooms", "rooms.json"]\ncontrollers = ["rapf"]\n'
    with pytest.raises(InputError, match=r"maps\[1\]: expected maps with different names, got a second "):
        read_study(write_study(folder, text))


def test_invalid_maps_are_reported_with_their_file(folder: Path) -> None:
    (folder / "bad.json").write_text('{"format": "robocov-map", "version": 1, "name": "bad"}')
    with pytest.raises(
        InputError, match=r"study.toml: maps\[0\]: .*bad.json:1:1: boundary: missing, expected "
    ):
        read_study(write_study(folder, 'maps = ["bad.json"]\ncontrollers = ["rapf"]\n'))


def test_other_files_are_rejected(folder: Path) -> None:
    with pytest.raises(InputError, match=r"none.toml: no such file"):
        read_study(folder / "none.toml")
    with pytest.raises(InputError, match=r": expected a file, got a folder"):
        read_study(folder)
    path = folder / "bytes.toml"
    path.write_bytes(b"maps = '\xff'")
    with pytest.raises(InputError, match=r"bytes.toml: byte at offset 8: not UTF-8"):
        read_study(path)
    path.write_text("a = " + "[" * 100_000)
    with pytest.raises(InputError, match=r"bytes.toml: "):
        read_study(path)


def test_the_study_of_these_tests_is_toml() -> None:
    assert tomllib.loads(STUDY)["gains"]["mine.py:Mine"] == {"pull": [1, 2]}


GROUPS = """
maps = ["rooms"]
controllers = ["rapf"]
metrics = true

[team]
sensing_range = 4.0

[[team.group]]
count = 2
max_speed = 1.0

[[team.group]]
count = 1
max_speed = 0.3
sensing_range = "null"
"""


def test_a_team_of_groups(folder: Path) -> None:
    study = read_study(write_study(folder, GROUPS))
    assert study.robots == (3,)
    assert study.metrics
    team = build_swept_team(3, study.teams[0])
    assert team.max_speed.tolist() == [1.0, 1.0, 0.3]
    assert team.sensing_range.tolist() == [4.0, 4.0, math.inf]


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("max_speed = 0.3", "max_sped = 0.3", "team.group[1]: unknown key 'max_sped': did you mean"),
        ("count = 1\n", "", "team.group[1].count: expected a whole number from 1 to 10000, got nothing"),
        ("metrics = true", "metrics = 1", "metrics: expected true or false, got 1"),
        ("metrics = true", "robots = [4]", "robots: expected 3 as in the groups of the team, got [4]"),
        (
            "max_speed = 1.0",
            "max_speed = 0",
            "team.group[0].max_speed: expected a number from 0.000001 to 1000, got 0.0 m/s",
        ),
    ],
)
def test_invalid_groups_are_rejected(folder: Path, before: str, after: str, message: str) -> None:
    path = write_study(folder, GROUPS.replace(before, after))
    with pytest.raises(InputError) as caught:
        read_study(path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_group_that_is_not_a_table_is_rejected(folder: Path) -> None:
    path = write_study(folder, 'maps = ["rooms"]\ncontrollers = ["rapf"]\n[team]\ngroup = 3\n')
    with pytest.raises(InputError, match=r"team.group: expected tables \[\[team.group\]\], got 3"):
        read_study(path)


# Files that stand for more runs than anybody can do, or than a parser can take


def format_axes(names: list[str], values: int) -> str:
    listed = ", ".join(f"{1 + k / 1000:.3f}" for k in range(values))
    return "".join(f"{name} = [{listed}]\n" for name in names)


HEAD = 'maps = ["square"]\ncontrollers = ["rapf"]\n'
TEAM_AXES = ["radius", "max_speed", "max_acceleration", "viscosity", "sensing_range", "communication_range"]


@pytest.mark.parametrize(
    ("text", "runs"),
    [
        (f"{HEAD}[team]\n{format_axes(TEAM_AXES, 100)}", "1e+12 (100 radius x 100 max_speed x "),
        (f"{HEAD}[gains.rapf]\n{format_axes(['k_rep', 'k_att'], 1000)}", "1000000 (1000000 sets of gains)"),
        (
            f"{HEAD}[conditions]\n{format_axes(['delay', 'forget_after'], 700)}",
            "490000 (700 delay x 700 forget_after)",
        ),
        (
            f"{HEAD}[gains.rapf]\n{format_axes(['k_rep'], 50)}k_att = {{low = 1, high = 2}}\n"
            "[sampling]\nmethod = 'sobol'\nsamples = 100000\n",
            "5000000 (5000000 sets of gains)",
        ),
        (f"{HEAD}seeds = 1{'0' * 30}\n", "1e+30 (1e+30 seeds)"),
        (f"{HEAD}seeds = 1{'0' * 4000}\n", "more than 1e300 (more than 1e300 seeds)"),
    ],
    ids=["team", "gains", "conditions", "samples", "seeds", "digits"],
)
def test_huge_studies_are_rejected_before_they_are_built(tmp_path: Path, text: str, runs: str) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_study(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: runs: expected at most 100000, got {runs}")
    assert message.endswith(" max_runs in the study allows more, up to 10000000.") and message.isprintable()
    assert len(message) < len(str(path)) + 400


def test_max_runs_limits_the_number_of_runs(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f"{HEAD}seeds = 11\nmax_runs = 10\n")
    with pytest.raises(InputError, match=r"runs: expected at most 10, got 11 \(11 seeds\)"):
        read_study(path)
    path.write_text(f"{HEAD}seeds = 100001\nmax_runs = 200000\n")
    assert len(read_study(path)) == 100_001
    path.write_text(f"{HEAD}max_runs = 10000001\n")
    with pytest.raises(InputError, match=r"max_runs: expected a whole number from .* got 10000001"):
        read_study(path)


@pytest.mark.parametrize(
    "text",
    [
        f"maps.{'a.' * 3000}b = 1\n",
        f"{HEAD}[[team.group]]\ncount.{'a.' * 3000}b = 1\n",
        f"{HEAD}[{'a.' * 20_000}b]\n",
        f"maps = {'[' * 60}{']' * 60}\n",
        f"maps = {'[' * 9000}{']' * 9000}\n",
        f"{HEAD}[team]\nradius = {'{a=' * 60}1{'}' * 60}\n",
    ],
    ids=["keys", "group", "table", "lists", "many", "inline"],
)
def test_deeply_nested_files_are_rejected(tmp_path: Path, text: str) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError, match="nested too deeply, expected at most 32 levels"):
        read_study(path)


def test_a_large_file_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text("#" * 4_000_001)
    with pytest.raises(InputError, match="expected at most 4 MB of TOML, got more"):
        read_study(path)


def test_the_schema_has_every_parameter_that_a_study_may_vary() -> None:
    names = [key.name for key in list_study_keys()]
    for name in (*TEAM_PARAMETERS, *KINEMATIC_DEFAULTS):
        assert f"team.{name}" in names
    for name in CONDITIONS:
        assert f"conditions.{name}" in names
