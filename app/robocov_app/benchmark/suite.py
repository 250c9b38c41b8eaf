"""The frozen suite, version 1: its maps by family, its tracks, and the reference placements in its file.

The file ``suite-v1.json`` contains the SHA-256 of every map, so that changes of a generator are noticed, and
the best known placements on the map. Robots start from the first start of a map, at positions drawn by seed.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from robocov.defaults import DEFAULT_DURATION_S
from robocov.environment import Environment
from robocov.errors import InputError, ParameterError, describe_unknown_name, find_similar_names, quote
from robocov.generator import GENERATORS, generate_map
from robocov.mapfile import load_map, to_json
from robocov_app.benchmark.maps.large_plans import LARGE_PLANS, build_large_plan
from robocov_app.benchmark.maps.realistic_maps import FLOOR_PLANS, build_floor_plan
from robocov_app.benchmark.maps.worlds import ROBOTS as WORLD_ROBOTS
from robocov_app.benchmark.maps.worlds import build_world
from robocov_app.evaluation.hot_spots import add_hot_spots
from robocov_app.sweep.study.study import Study, StudyMap

VERSION = "v1"
"""Version of the suite."""
SUITE_FILE = Path(__file__).parent / f"suite-{VERSION}.json"
"""File with the hashes of the maps and the reference placements."""
LATTICE = 128
"""Number of sites along a side of the lattice for all costs and reference placements."""
ROBOT_RADIUS_M = 0.1
"""Radius of a robot on most tracks."""
TEAM_SIZE = 6
"""Number of robots on most tracks."""
_FIRST_SEED = 7001
"""Seed of the first map of each kind; the seeds of tuning maps start at 1."""
MIN_NEW_SEED = 1_000_000
"""Minimum seed of maps that are not part of the suite."""
_COST_RATE_HZ = 2.0
"""Rate at which the cost is evaluated."""
_BUNDLED = (
    "blocks-a",
    "blocks-b",
    "cave",
    "corridor",
    "courtyard",
    "gaps",
    "l-shape",
    "museum",
    "office",
    "rooms",
    "trap",
    "warehouse",
)
_FROZEN_START_NAMES = {"center": "centre"}
"""Names of starts in the hashed maps that differ from those of the generators."""
_LARGE_OBSTACLES = 24
"""Number of obstacles of maps for large teams."""
_LARGE_SIDE_M = 20.0
"""Side of maps for large teams."""
_LARGE_KINDS = ("polygons", "blocks", "rooms", "caves")
"""Generators of maps for large teams."""
WORLDS = "worlds"
"""Family of maps with the default parameters of the simulator CoverageControl."""


def _list_names(kind: str, count: int, first_seed: int = _FIRST_SEED) -> tuple[str, ...]:
    return tuple(f"{kind}-{seed}" for seed in range(first_seed, first_seed + count))


FAMILIES: Mapping[str, tuple[str, ...]] = {
    "bundled": _BUNDLED,
    **{kind: _list_names(kind, 7) for kind in GENERATORS},
    **{kind: _list_names(kind, 6) for kind in FLOOR_PLANS if kind != "traffic"},
}
"""Maps of the ideal track by family."""
_GENERATED_FAMILIES = [kind for kind in FAMILIES if kind != "bundled"]
OTHER_FAMILIES: Mapping[str, tuple[str, ...]] = {
    "density": tuple(f"dense-{name}" for kind in _GENERATED_FAMILIES for name in _list_names(kind, 1)),
    "moving": ("forklifts", *_list_names("traffic", 5)),
    "large": tuple(f"large-{name}" for kind in _LARGE_KINDS for name in _list_names(kind, 2)),
    **{kind: _list_names(kind, 4) for kind in LARGE_PLANS},
    WORLDS: _list_names(WORLDS, 4),
    "tuning": tuple(name for kind in _GENERATED_FAMILIES for name in _list_names(kind, 2, first_seed=1)),
}
"""Maps of the other tracks by family; the tuning maps are for choosing gains and do not count."""
FAMILY_OF = {name: family for family, names in {**FAMILIES, **OTHER_FAMILIES}.items() for name in names}
"""The family of each map of the suite."""
_PLANS = tuple(tuple(f"{kind}-{_FIRST_SEED + k}" for kind in LARGE_PLANS) for k in range(4))
"""Maps of the tracks on large plans: on each track one of every kind."""
_CORE_MAPS = tuple(name for names in FAMILIES.values() for name in names[:3])


@dataclass(frozen=True)
class Track:
    """A set of runs, defined by its differences from the ideal track.

    On the ideal track six robots communicate without limits and without disturbances.

    Parameters
    ----------
    summary : str
        Short description of the difference.
    maps : tuple of str
        Names of the maps.
    seeds : tuple of int
        Seeds of the starting positions. Each seed gives one run on each map.
    robots : int
        Number of robots at the start.
    duration : float, s
        Simulated time of a run.
    radius : float, m
        Radius of a robot.
    changes : Mapping
        Options of the study that differ from those of the ideal track.
    failures : tuple of (int, float)
        Index of each robot that fails, and the time of its failure, s.
    ranking : str
        The ranking in which the track counts: a key of `RANKINGS`, or empty.
    """

    summary: str
    maps: tuple[str, ...] = _CORE_MAPS
    seeds: tuple[int, ...] = (0,)
    robots: int = TEAM_SIZE
    duration: float = DEFAULT_DURATION_S
    radius: float = ROBOT_RADIUS_M
    changes: Mapping[str, Any] = field(default_factory=dict)
    failures: tuple[tuple[int, float], ...] = ()
    ranking: str = "core"

    @property
    def survivors(self) -> int:
        """Number of robots that are still working at the end."""
        return self.robots - len(self.failures)


_FAILURES = ((0, 15.0), (3, 30.0))
_LOSSY = {"loss": 0.3, "delay": 0.5, "message_rate": 2.0}
TRACKS: Mapping[str, Track] = {
    "ideal": Track(
        "no disturbances",
        maps=tuple(name for names in FAMILIES.values() for name in names),
        seeds=(0, 1),
    ),
    "short-range": Track("communication range of 3 m", changes={"communication_range": 3.0}),
    "lossy": Track(
        "positions and messages sent twice per second, delayed by 0.5 s, 30% lost",
        changes={"conditions": _LOSSY},
    ),
    "noisy": Track("positions with noise of 0.1 m", changes={"conditions": {"position_noise": 0.1}}),
    "unicycle": Track("robots on two wheels, which turn before driving", changes={"kinematics": "unicycle"}),
    "failures": Track("two of six robots fail, after 15 and 30 s", failures=_FAILURES),
    "density": Track("two hot spots count 20 times as much", OTHER_FAMILIES["density"]),
    "unknown-density": Track(
        "the same hot spots, which robots have to find: the density can only be measured",
        OTHER_FAMILIES["density"],
        seeds=(0, 1),
        changes={"conditions": {"density": "sensed"}},
        ranking="",
    ),
    "open-square": Track(
        "square of 1024 x 1024 m without walls, whose density has 32 peaks and can only be measured; "
        "communication range of 128 m, sensing range of 32 m",
        OTHER_FAMILIES[WORLDS],
        robots=WORLD_ROBOTS,
        duration=120.0,
        radius=1.0,
        changes={
            "max_speed": 5.0,
            "max_acceleration": 10.0,
            "sensing_range": 32.0,
            "communication_range": 128.0,
            "conditions": {"density": "sensed"},
        },
        ranking="",
    ),
    "moving": Track("obstacles move", OTHER_FAMILIES["moving"]),
    "large-team": Track("24 robots on 20 x 20 m", OTHER_FAMILIES["large"], robots=24, duration=90.0),
    "one-robot": Track("one robot", robots=1),
    "plans-one-robot": Track(
        "large plans, the same maps as plans-small", _PLANS[0], robots=1, duration=240.0, ranking="plans"
    ),
    "plans-small": Track(
        "large plans, unlimited communication", _PLANS[0], robots=3, duration=240.0, ranking="plans"
    ),
    "plans-medium": Track(
        "large plans, communication range of 12 m",
        _PLANS[1],
        robots=12,
        duration=180.0,
        changes={"communication_range": 12.0},
        ranking="plans",
    ),
    "plans-large": Track(
        "large plans, communication range of 6 m",
        _PLANS[2],
        robots=24,
        duration=150.0,
        changes={"communication_range": 6.0},
        ranking="plans",
    ),
    "plans-crowd": Track(
        "large plans, communication range of 3 m",
        _PLANS[3],
        robots=50,
        duration=120.0,
        changes={"communication_range": 3.0},
        ranking="plans",
    ),
    "tuning": Track("like ideal, for choosing gains; in no ranking", OTHER_FAMILIES["tuning"], ranking=""),
}
"""All tracks by name."""
RANKINGS: Mapping[str, str] = {"core": "Overview", "plans": "Overview of large plans"}
"""Headings of the rankings by name. Each ranks the controllers that have all runs of its tracks."""
RANKED_TRACKS: Mapping[str, tuple[str, ...]] = {
    ranking: tuple(name for name, track in TRACKS.items() if track.ranking == ranking) for ranking in RANKINGS
}
"""Names of the tracks of each ranking."""
QUICK_TRACKS = ("ideal", "short-range")
"""Tracks of ``--quick``, with the first map of each family and the first seed."""


def format_heading(track: str) -> str:
    """Return the name of a track as a heading, for example "Large team"."""
    return track.capitalize().replace("-", " ")


@cache
def build_map(name: str) -> Environment:
    """Build a map of the suite with the generators of this installation.

    Parameters
    ----------
    name : str
        Name of the map, as in `FAMILY_OF`.

    Returns
    -------
    Environment
        The map, which may differ from the frozen one; see `load_suite_map`.

    Raises
    ------
    ParameterError
        If the suite has no such map.
    """
    if name not in FAMILY_OF:
        similar_names = find_similar_names(name.lower(), FAMILY_OF)
        hint = f"did you mean {' or '.join(map(quote, similar_names))}? " if similar_names else ""
        raise ParameterError(
            f"--maps: unknown map of the benchmark {quote(name)}: {hint}`robocov benchmark suite` lists them"
        )
    kind, _, seed = name.removeprefix("dense-").removeprefix("large-").rpartition("-")
    if name.startswith("dense-"):
        plain = build_map(f"{kind}-{seed}")
        return add_hot_spots(plain, int(seed))
    if name.startswith("large-"):
        return generate_map(int(seed), kind=kind, obstacles=_LARGE_OBSTACLES, side=_LARGE_SIDE_M)
    if kind in LARGE_PLANS:
        return build_large_plan(kind, int(seed))
    if kind == WORLDS:
        return build_world(int(seed))
    # Bundled maps such as blocks-a are named like generated ones.
    if has_generator(kind) and name not in _BUNDLED:
        return build_family_map(kind, int(seed))
    return load_map(name)


def has_generator(family: str) -> bool:
    """Return whether a family has random maps that `build_family_map` builds."""
    return family in GENERATORS or family in FLOOR_PLANS


def build_family_map(family: str, seed: int) -> Environment:
    """Build a random map of a family, which need not be part of the suite.

    Parameters
    ----------
    family : str
        Name of a family that `has_generator`.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    Environment

    Raises
    ------
    NoLayoutError
        If no map with this seed is suitable.
    """
    if family in FLOOR_PLANS:
        return build_floor_plan(family, seed)
    return generate_map(seed, kind=family)


def compute_map_hash(environment: Environment) -> str:
    """Return the SHA-256 of the content of a map, apart from its description and the schema of its file.

    Starts are hashed under the names that they had when the suite was frozen.
    """
    # Set to None rather than removed: removing the keys would change the frozen hashes.
    document = {**to_json(environment), "$schema": None, "description": None}
    starts = document.get("starts", {})
    document["starts"] = {_FROZEN_START_NAMES.get(name, name): start for name, start in starts.items()}
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


@cache
def load_frozen_maps() -> Mapping[str, Mapping[str, Any]]:
    """Return the entry of each map in the suite's file: ``sha256``, and ``references`` by team size."""
    return dict(json.loads(SUITE_FILE.read_text(encoding="utf-8"))["maps"])


def load_suite_map(name: str) -> Environment:
    """Build a map of the suite, and check that it is identical to the frozen one.

    Parameters
    ----------
    name : str
        Name of the map, as in `FAMILY_OF`.

    Returns
    -------
    Environment

    Raises
    ------
    ParameterError
        If the suite has no such map.
    InputError
        If the hash of the map differs from the frozen one.
    """
    environment = build_map(name)
    frozen_maps = load_frozen_maps()
    if name not in frozen_maps or compute_map_hash(environment) != frozen_maps[name]["sha256"]:
        raise InputError(
            f"map {name}: expected the map of suite {VERSION}, whose hash is in {SUITE_FILE.name}, "
            "got a different one. Its file or its generator has changed."
        )
    return environment


def select_maps(tracks: Sequence[str], maps: Sequence[str], *, quick: bool) -> dict[str, tuple[str, ...]]:
    """Select the maps to run on each track.

    Parameters
    ----------
    tracks : sequence of str
        Names of tracks, or of rankings for all of their tracks. If empty, the tracks of the ranking ``core``
        or, with `quick`, `QUICK_TRACKS`.
    maps : sequence of str
        Names of maps. If empty, all maps of each track.
    quick : bool
        If no maps are given, whether to use only the first map of each family.

    Returns
    -------
    dict
        Maps by track; tracks without maps are left out.

    Raises
    ------
    ParameterError
        If a track or map is unknown, or if none of the maps is on any of the tracks.
    """
    track_names = list(QUICK_TRACKS if quick else RANKED_TRACKS["core"])
    if tracks:
        track_names = _expand_rankings(tracks)
    for name in maps:
        build_map(name)
    selection = {}
    for name in track_names:
        track_maps = TRACKS[name].maps
        if maps:
            track_maps = tuple(map_name for map_name in track_maps if map_name in maps)
        elif quick:
            track_maps = _select_one_per_family(track_maps)
        if track_maps:
            selection[name] = track_maps
    if not selection:
        expected = ", ".join(track_names)
        raise ParameterError(f"--maps: expected a map of {expected}, got {', '.join(maps)}")
    return selection


def _expand_rankings(names: Sequence[str]) -> list[str]:
    """Return the names of tracks; the name of a ranking is replaced by those of its tracks."""
    tracks: list[str] = []
    for name in names:
        if name not in TRACKS and name not in RANKED_TRACKS:
            known_names = [*TRACKS, *RANKED_TRACKS]
            raise ParameterError(f"--track: {describe_unknown_name('track', name, known_names)}")
        tracks += RANKED_TRACKS.get(name, (name,))
    return list(dict.fromkeys(tracks))


def _select_one_per_family(maps: Sequence[str]) -> tuple[str, ...]:
    first: dict[str, str] = {}
    for name in maps:
        first.setdefault(FAMILY_OF[name], name)
    return tuple(first.values())


def build_study(
    track_name: str,
    maps: Sequence[StudyMap],
    controller: str,
    *,
    gains: Mapping[str, Mapping[str, Any]],
    seeds: Sequence[int],
    folder: Path,
) -> Study:
    """Build the sweep of a controller on maps, under the conditions of a track.

    Parameters
    ----------
    track_name : str
        Name of the track.
    maps : sequence of StudyMap
        The maps, which need not be part of the suite.
    controller : str
        Name of a controller, or ``FILE.py:CLASS``.
    gains : Mapping
        Gains that differ from the defaults, by controller.
    seeds : sequence of int
        Seeds of the starting positions.
    folder : Path
        Folder to which a relative path of the controller's file refers.

    Returns
    -------
    Study
    """
    track = TRACKS[track_name]
    options: dict[str, Any] = {
        "robots": (track.robots,),
        "duration": track.duration,
        "radius": track.radius,
        "lattice": LATTICE,
        "cost_hz": _COST_RATE_HZ,
        "record_hz": 0.0,
        "metrics": True,
        **track.changes,
    }
    if track.failures:
        # The conditions of a study count robots from 1.
        failures = [f"{robot + 1}@{time:g}" for robot, time in track.failures]
        options["conditions"] = {"fail": " ".join(failures)}
    return Study(tuple(maps), (controller,), gains, seeds=seeds, folder=folder, **options)
