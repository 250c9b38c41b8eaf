"""Compared controllers with their gains: the paper's, other authors', and our own."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TypeAlias

from robocov.controllers import CONTROLLERS, get_gain_values, make_controller
from robocov.controllers.gains import Value, format_value

ASSETS = Path(__file__).parent / "assets"

PAPER = ("rapf", "rpf", "lloyd")  # controllers of the paper's claims
OURS = ("atlas", "atlas-shared")  # the project's own controllers; the goals are for the first

BestGains: TypeAlias = Mapping[str, Mapping[str, Value]]  # of controllers that were tuned

# Potential parameters of both RAPF and RPF, as in the paper, which does not print its own: the repulsion then
# holds a robot that is pulled with 1 N about 0.83 m off a wall.
SHARED: Mapping[str, Value] = {"k_rep": 1.0, "rho_0": 2.0}
# RAPF's k_att beside them: a metre from its goal a robot is pulled with 3 N, enough for full speed
SHARED_ATTRACTION = 3.0

# labels of the contenders of the paper's claims, in the order of tables
LABELS = {
    "rapf-shared": "RAPF, shared gains",
    "rapf-best": "RAPF, its best gains",
    "rapf-default": "RAPF, robocov's default",
    "lloyd": "LA",
    "rpf-shared": "RPF, shared gains",
    "rpf-best": "RPF, its best gains",
}


@dataclass(frozen=True)
class Contender:
    """A controller with the gains that differ from its defaults; `key` names it in files."""

    key: str
    label: str
    controller: str
    gains: Mapping[str, Value]

    @property
    def all_gains(self) -> dict[str, Value]:
        return dict(get_gain_values(make_controller(self.controller, self.gains)))

    @property
    def gains_text(self) -> str:
        """All gains of the potential: "(k_rep 1, rho_0 2, no limit)"."""
        return potential_text(self.all_gains, "no limit")


def of_paper(key: str, gains: Mapping[str, Value]) -> Contender:
    return Contender(key, LABELS[key], key.partition("-")[0], dict(gains))


def with_gains(name: str, gains: Mapping[str, Value]) -> Contender:
    return Contender(name, CONTROLLERS[name].label, name, dict(gains))


RAPF_SHARED = of_paper("rapf-shared", {**SHARED, "k_att": SHARED_ATTRACTION, "attraction_limit": None})
RPF_SHARED = of_paper("rpf-shared", SHARED)
LLOYD = of_paper("lloyd", {})
RAPF_DEFAULT = of_paper("rapf-default", {})
UNTUNED = (RAPF_SHARED, RAPF_DEFAULT, RPF_SHARED, LLOYD)  # the paper's whose gains no grid chooses

# RAPF with each target in its cell
TARGETS = (
    Contender("centroid", "the centroid", "rapf", {}),
    Contender("median", "the geometric median", "rapf", {"target": "median"}),
    Contender("sensing", "a sensor's best place, h = 1 m", "rapf", {"target": "sensing"}),
)

# controllers of teams with mixed speeds, with each kind of cells
TEAMS = tuple(
    Contender(f"{name}-{cells}", f"{CONTROLLERS[name].label}, cells by {cells}", name, {"cells": cells})
    for name in ("rapf", "lloyd")
    for cells in ("distance", "time")
)

OWN = tuple(with_gains(name, {}) for name in OURS)


def grid(**values: Sequence[Value]) -> tuple[dict[str, Value], ...]:
    return tuple(dict(zip(values, each, strict=True)) for each in product(*values.values()))


# sets of gains that are tried of each baseline
GRIDS: Mapping[str, tuple[dict[str, Value], ...]] = {
    name: tuple(each for part in parts for each in grid(**part))
    for name, parts in tomllib.loads((ASSETS / "grids.toml").read_text(encoding="utf-8")).items()
}


def baselines(best: BestGains) -> tuple[Contender, ...]:
    others = [name for name in CONTROLLERS if name not in (*PAPER, *OURS)]
    return tuple(with_gains(name, best.get(name, {})) for name in others)


def paper_contenders(best: BestGains) -> tuple[Contender, ...]:
    if not best:
        return UNTUNED
    rapf, rpf = (of_paper(f"{name}-best", best[name]) for name in ("rapf", "rpf"))
    return (RAPF_SHARED, rapf, RAPF_DEFAULT, RPF_SHARED, rpf, LLOYD)


def strongest(contenders: Sequence[Contender]) -> list[Contender]:
    """Return RAPF at its best gains, or where those are not known with its default ones, and LA."""
    by_key = {each.key: each for each in contenders}
    rapf = by_key.get("rapf-best") or by_key.get("rapf-default")
    return [each for each in (rapf, by_key.get("lloyd")) if each is not None]


def distinct_gains(contenders: Sequence[Contender]) -> dict[str, list[dict[str, Value]]]:
    """Return all sets of gains by controller, each once: a controller's best gains may be the shared ones."""
    found: dict[str, list[dict[str, Value]]] = {}
    for each in contenders:
        sets = found.setdefault(each.controller, [])
        sets += [each.all_gains] * (each.all_gains not in sets)
    return found


def potential_text(gains: Mapping[str, Value], no_limit: str = "") -> str:
    """Return gains of the potential, numbers all: "(k_rep 1, rho_0 2)"; `no_limit`: unlimited attraction."""
    known = {name: each for name, each in gains.items() if not isinstance(each, str) and name != "height"}
    parts = [
        no_limit if each is None and name == "attraction_limit" else f"{name} {format_value(each)}"
        for name, each in known.items()
        if each is not None or no_limit
    ]
    return f"({', '.join(parts)})"
