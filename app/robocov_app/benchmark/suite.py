"""The frozen suite, version 1: its maps by families, its tracks, and the references of its file.

The file ``suite-v1.json`` holds the SHA-256 of every map, so that a changed generator is noticed, and the
best placements that were found for it. Robots begin at the first start of a map, drawn by seed.
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
from robocov.errors import InputError, ParameterError, describe_unknown_name
from robocov.generator import GENERATORS, generate_map
from robocov.mapfile import load_map, to_json
from robocov_app.benchmark.drawn import KINDS, drawn_map
from robocov_app.replication.studies import with_hot_spots
from robocov_app.sweep.study import Study, StudyMap

VERSION = "v1"
FILE = Path(__file__).parent / f"suite-{VERSION}.json"
LATTICE = 128  # sites along a side for all costs and references
RADIUS = 0.1  # m, of the robots
TEAM = 6
_FIRST = 7001  # seed of the first map of a kind; those of tuning begin at 1
_BUNDLED = (
    *("blocks-a", "blocks-b", "cave", "corridor", "courtyard", "gaps", "l-shape", "museum", "office"),
    *("rooms", "trap", "warehouse"),
)
_LARGE: dict[str, Any] = {"obstacles": 24, "side": 20.0}  # of the maps for large teams
_LARGE_KINDS = ("polygons", "blocks", "rooms", "caves")


def _numbered(kind: str, count: int, first: int = _FIRST) -> tuple[str, ...]:
    return tuple(f"{kind}-{seed}" for seed in range(first, first + count))


FAMILIES: Mapping[str, tuple[str, ...]] = {  # maps of the ideal track
    "bundled": _BUNDLED,
    **{kind: _numbered(kind, 7) for kind in GENERATORS},
    **{kind: _numbered(kind, 6) for kind in KINDS if kind != "traffic"},
}
_DRAWN = [kind for kind in FAMILIES if kind != "bundled"]
_OTHERS: Mapping[str, tuple[str, ...]] = {  # of other tracks; those of tuning are for choosing gains alone
    "density": tuple(f"dense-{each}" for kind in _DRAWN for each in _numbered(kind, 1)),
    "moving": ("forklifts", *_numbered("traffic", 5)),
    "large": tuple(f"large-{each}" for kind in _LARGE_KINDS for each in _numbered(kind, 2)),
    "tuning": tuple(name for kind in _DRAWN for name in _numbered(kind, 2, first=1)),
}
FAMILY_OF = {name: family for family, names in {**FAMILIES, **_OTHERS}.items() for name in names}
_CORE = tuple(name for names in FAMILIES.values() for name in names[:3])


@dataclass(frozen=True)
class Track:
    """Differences from the ideal track, where six robots hear each other everywhere."""

    summary: str
    maps: tuple[str, ...] = _CORE
    seeds: tuple[int, ...] = (0,)
    robots: int = TEAM
    duration: float = DEFAULT_DURATION_S
    changes: Mapping[str, Any] = field(default_factory=dict)  # of the study
    failures: tuple[tuple[int, float], ...] = ()  # robot, and when it fails, s

    @property
    def survivors(self) -> int:
        return self.robots - len(self.failures)


_FAILURES = ((0, 15.0), (3, 30.0))  # indices, and seconds
_LOSSY = {"loss": 0.3, "delay": 0.5, "message_rate": 2.0}
TRACKS: Mapping[str, Track] = {  # `RATED` are those that count
    "ideal": Track("nothing goes wrong", sum(FAMILIES.values(), ()), (0, 1)),
    "short-range": Track("robots hear each other up to 3 m", changes={"communication_range": 3.0}),
    "lossy": Track("2 messages a second, 0.5 s late, 30 % lost", changes={"conditions": _LOSSY}),
    "noisy": Track("positions with noise of 0.1 m", changes={"conditions": {"position_noise": 0.1}}),
    "unicycle": Track("robots on two wheels turn before they drive", changes={"kinematics": "unicycle"}),
    "failures": Track("two of six robots fail, after 15 and 30 s", failures=_FAILURES),
    "density": Track("two hot spots count 20 times as much", _OTHERS["density"]),
    "moving": Track("obstacles move", _OTHERS["moving"]),
    "large-team": Track("24 robots on 20 x 20 m", _OTHERS["large"], robots=24, duration=90.0),
    "one-robot": Track("one robot", robots=1),
    "tuning": Track("as ideal, for choosing gains: no result", _OTHERS["tuning"]),
}
RATED = tuple(name for name in TRACKS if name != "tuning")
QUICK = ("ideal", "short-range")  # of ``--quick``: the first map of each family, with the first seed


def heading(track: str) -> str:
    return track.capitalize().replace("-", " ")


@cache
def made_map(name: str) -> Environment:
    """Return the map of a name as it is made here and now; raises ParameterError for an unknown one."""
    if name not in FAMILY_OF:
        raise ParameterError(f"--maps: {describe_unknown_name('map of the benchmark', name, FAMILY_OF)}")
    kind, _, seed = name.removeprefix("dense-").removeprefix("large-").rpartition("-")
    if name.startswith("dense-"):
        return with_hot_spots(StudyMap(name, made_map(f"{kind}-{seed}")), int(seed)).environment
    if name.startswith("large-"):
        return generate_map(int(seed), kind=kind, **_LARGE)
    if kind in GENERATORS and name not in _BUNDLED:
        return generate_map(int(seed), kind=kind)
    return drawn_map(kind, int(seed)) if kind in KINDS else load_map(name)


def hash_of(environment: Environment) -> str:
    document = {**to_json(environment), "$schema": None}
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


@cache
def frozen() -> Mapping[str, Mapping[str, Any]]:
    """Return what the suite's file says of each map: its ``sha256``, and its ``references`` by team sizes."""
    return dict(json.loads(FILE.read_text(encoding="utf-8"))["maps"])


def suite_map(name: str) -> Environment:
    """Return a map of the suite; raises InputError where it is not the one that was frozen."""
    environment = made_map(name)
    if name not in frozen() or hash_of(environment) != frozen()[name]["sha256"]:
        changed = f"it is not the one of suite {VERSION}: its file or its generator has changed"
        raise InputError(f"map {name}: {changed}; expected the map whose hash is in {FILE.name}")
    return environment


def chosen(tracks: Sequence[str], maps: Sequence[str], *, quick: bool) -> dict[str, tuple[str, ...]]:
    """Return the maps of each track that are wanted, by default all; raises ParameterError."""
    if unknown := [name for name in tracks if name not in TRACKS]:
        raise ParameterError(f"--track: {describe_unknown_name('track', unknown[0], TRACKS)}")
    for name in maps:
        made_map(name)
    found = {}
    for name in tracks or (QUICK if quick else RATED):
        own = TRACKS[name].maps
        if quick and not maps:  # the first of each family
            own = tuple({FAMILY_OF[each]: each for each in reversed(own)}.values())[::-1]
        found[name] = tuple(each for each in own if not maps or each in maps)
    if not any(found.values()):
        raise ParameterError(f"--maps: expected a map of {', '.join(found)}, got {', '.join(maps)}")
    return {name: own for name, own in found.items() if own}


def study_of(
    name: str, maps: Sequence[StudyMap], controller: str, seeds: Sequence[int], folder: Path, **more: Any
) -> Study:
    track = TRACKS[name]
    changes: dict[str, Any] = {"robots": (track.robots,), "duration": track.duration, "radius": RADIUS}
    changes |= {"lattice": LATTICE, "cost_hz": 2.0, "record_hz": 0.0, "metrics": True, **track.changes}
    if track.failures:
        changes["conditions"] = {"fail": " ".join(f"{robot + 1}@{time:g}" for robot, time in track.failures)}
    return Study(tuple(maps), (controller,), seeds=seeds, folder=folder, **changes, **more)
