"""The compared controllers with their gains: those of the paper, those of other authors, and our own."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

from robocov.controllers import CONTROLLERS, get_gain_values, make_controller
from robocov.controllers.gains import Value, format_value
from robocov_app.replication.assets import ASSETS

PAPER = ("rapf", "rpf", "lloyd")
"""Controllers of the paper's claims."""
OURS = ("atlas", "atlas-shared")
"""The project's own controllers."""
MAIN_CONTROLLER = OURS[0]
"""The controller that the project's goals are about."""

BestGains: TypeAlias = Mapping[str, Mapping[str, Value]]
"""The best gains of each tuned controller."""

SHARED: Mapping[str, Value] = {"k_rep": 1.0, "rho_0": 2.0}
"""Potential parameters that RAPF and RPF share, as in the paper, which does not state its values.

With these, the repulsion holds a robot that is pulled with 1 N about 0.84 m away from a wall.
"""
SHARED_ATTRACTION = 3.0
"""RAPF's k_att: at a distance of 1 m from its goal a robot is pulled with 3 N, enough for full speed."""

GainChoice: TypeAlias = Literal["shared", "best", "default"]
"""The gains with which a claim is tested."""
GAIN_CHOICES: Mapping[GainChoice, str] = {
    "shared": "shared gains",
    "best": "best gains of each",
    "default": "robocov's default gains",
}
"""The choices of gains with their names: the gains that RAPF and RPF share, the best ones, the defaults."""

LABELS = {
    "rapf-shared": "RAPF, shared gains",
    "rapf-best": "RAPF, its best gains",
    "rapf-default": "RAPF, robocov's default",
    "lloyd": "Lloyd",
    "rpf-shared": "RPF, shared gains",
    "rpf-best": "RPF, its best gains",
    "rpf-default": "RPF, robocov's default",
}
"""Labels of the contenders of the paper's claims, in the order of tables."""


@dataclass(frozen=True)
class Contender:
    """A controller with its gains.

    Parameters
    ----------
    key : str
        Name in files.
    label : str
        Name in figures and pages.
    controller : str
    gains : Mapping
        Gains that differ from the defaults.
    """

    key: str
    label: str
    controller: str
    gains: Mapping[str, Value]

    @property
    def all_gains(self) -> dict[str, Value]:
        """All gains, including those that have their default values."""
        return dict(get_gain_values(make_controller(self.controller, self.gains)))

    @property
    def gains_text(self) -> str:
        """All gains of the potential as text: "(k_rep 1, rho_0 2, no limit)"."""
        return format_potential(self.all_gains, "no limit")


def build_paper_contender(key: str, gains: Mapping[str, Value]) -> Contender:
    """Build a contender of the paper's claims from its key in `LABELS`."""
    return Contender(key, LABELS[key], controller=key.partition("-")[0], gains=dict(gains))


def build_contender(name: str, gains: Mapping[str, Value]) -> Contender:
    """Build a contender whose key is the name of its controller."""
    return Contender(name, CONTROLLERS[name].label, controller=name, gains=dict(gains))


RAPF_SHARED = build_paper_contender(
    "rapf-shared", {**SHARED, "k_att": SHARED_ATTRACTION, "attraction_limit": None}
)
RPF_SHARED = build_paper_contender("rpf-shared", SHARED)
LLOYD = build_paper_contender("lloyd", {})
RAPF_DEFAULT = build_paper_contender("rapf-default", {})
RPF_DEFAULT = build_paper_contender("rpf-default", {})
UNTUNED = (RAPF_SHARED, RAPF_DEFAULT, RPF_SHARED, RPF_DEFAULT, LLOYD)
"""Contenders of the paper's claims whose gains are not tuned."""

TARGETS = (
    Contender("centroid", "the centroid", "rapf", {}),
    Contender("median", "the geometric median", "rapf", {"target": "median"}),
    Contender("sensing", "a sensor's best place, h = 1 m", "rapf", {"target": "sensing"}),
)
"""RAPF with each kind of target in its cell."""

TEAMS = tuple(
    Contender(f"{name}-{cells}", f"{CONTROLLERS[name].label}, cells by {cells}", name, {"cells": cells})
    for name, cells in product(("rapf", "lloyd"), ("distance", "time"))
)
"""Controllers of teams with mixed speeds, with each kind of cells."""

OWN = tuple(build_contender(name, {}) for name in OURS)
"""Contenders of our own controllers; the first one is that of `MAIN_CONTROLLER`."""


def combine_gains(**values: Sequence[Value]) -> tuple[dict[str, Value], ...]:
    """Return all combinations of gains.

    Examples
    --------
    >>> combine_gains(k_rep=(1.0, 3.0), rho_0=(2.0,))
    ({'k_rep': 1.0, 'rho_0': 2.0}, {'k_rep': 3.0, 'rho_0': 2.0})
    """
    return tuple(dict(zip(values, combination, strict=True)) for combination in product(*values.values()))


def _load_gain_grids() -> dict[str, tuple[dict[str, Value], ...]]:
    """Load the sets of gains of each baseline: all combinations within each part of its grid."""
    grids: dict[str, tuple[dict[str, Value], ...]] = {}
    document = tomllib.loads((ASSETS / "grids.toml").read_text(encoding="utf-8"))
    for name, parts in document.items():
        sets: list[dict[str, Value]] = []
        for part in parts:
            sets.extend(combine_gains(**part))
        grids[name] = tuple(sets)
    return grids


GAIN_GRIDS: Mapping[str, tuple[dict[str, Value], ...]] = _load_gain_grids()
"""Sets of gains that are tried for each baseline."""


def build_baselines(best: BestGains) -> tuple[Contender, ...]:
    """Build the contenders of all controllers of other authors that are not in the paper.

    Parameters
    ----------
    best : Mapping
        Their best gains; a controller without an entry keeps its defaults.

    Returns
    -------
    tuple of Contender
    """
    names = [name for name in CONTROLLERS if name not in (*PAPER, *OURS)]
    return tuple(build_contender(name, best.get(name, {})) for name in names)


def build_paper_contenders(best: BestGains) -> tuple[Contender, ...]:
    """Build the contenders of the paper's claims.

    Parameters
    ----------
    best : Mapping
        The best gains of RAPF and RPF. If it is empty, the contenders with the best gains are left out.

    Returns
    -------
    tuple of Contender
    """
    if not best:
        return UNTUNED
    rapf = build_paper_contender("rapf-best", best["rapf"])
    rpf = build_paper_contender("rpf-best", best["rpf"])
    return (RAPF_SHARED, rapf, RAPF_DEFAULT, RPF_SHARED, rpf, RPF_DEFAULT, LLOYD)


def select_strongest(contenders: Sequence[Contender]) -> list[Contender]:
    """Return the paper's strongest contenders: RAPF with its best gains, then Lloyd's algorithm.

    If the best gains are unknown, RAPF with its defaults takes their place. Missing contenders are left out.
    """
    by_key = {contender.key: contender for contender in contenders}
    rapf = by_key.get("rapf-best") or by_key.get("rapf-default")
    return [contender for contender in (rapf, by_key.get("lloyd")) if contender is not None]


def collect_gain_sets(contenders: Sequence[Contender]) -> dict[str, list[dict[str, Value]]]:
    """Return all sets of gains by controller, each set once.

    The best gains of a controller may be equal to the shared ones.
    """
    gain_sets: dict[str, list[dict[str, Value]]] = {}
    for contender in contenders:
        sets = gain_sets.setdefault(contender.controller, [])
        if contender.all_gains not in sets:
            sets.append(contender.all_gains)
    return gain_sets


def format_potential(gains: Mapping[str, Value], unlimited_text: str = "") -> str:
    """Format the numeric gains of a potential.

    Parameters
    ----------
    gains : Mapping
    unlimited_text : str
        Text for an unlimited attraction. If it is empty, gains without a value are left out.

    Examples
    --------
    >>> format_potential({"k_rep": 1.0, "rho_0": 2.0, "attraction_limit": None})
    '(k_rep 1, rho_0 2)'
    """
    texts = []
    for name, value in gains.items():
        # Texts and the height of the sensor select cells and targets; they are not part of the potential.
        if isinstance(value, str) or name == "height":
            continue
        if value is None and not unlimited_text:
            continue
        if value is None and name == "attraction_limit":
            texts.append(unlimited_text)
        else:
            texts.append(f"{name} {format_value(value)}")
    return f"({', '.join(texts)})"
