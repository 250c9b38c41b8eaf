"""Who is compared: the laws with their gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robocov.controllers.gains import value_text

if TYPE_CHECKING:
    from robocov.controllers.gains import Value

SHARED = {"k_rep": 1.0, "rho_0": 2.0}
"""Potential parameters that RAPF and RPF share, as in the paper, which does not print its own.

The repulsion then holds a robot that is pulled with 1 N about 0.83 m off a wall."""

SHARED_ATTRACTION = 3.0
"""RAPF's k_att beside them: a metre from its goal a robot is pulled with 3 N, enough for full speed."""


@dataclass(frozen=True)
class Contender:
    """A law with its gains.

    Attributes
    ----------
    key : str
        What it is called in files: "rapf-shared".
    label : str
        What it is called on the page.
    controller : str
    gains : dict of name to value
        All that differ from the controller's defaults.
    """

    key: str
    label: str
    controller: str
    gains: Mapping[str, Value]


RAPF_SHARED = Contender(
    "rapf-shared",
    "RAPF, shared gains",
    "rapf",
    {**SHARED, "k_att": SHARED_ATTRACTION, "attraction_limit": None},
)
RPF_SHARED = Contender("rpf-shared", "RPF, shared gains", "rpf", SHARED)
LLOYD = Contender("lloyd", "LA", "lloyd", {})
RAPF_DEFAULT = Contender("rapf-default", "RAPF, robocov's default", "rapf", {})


LABELS = {each.key: each.label for each in (RAPF_SHARED, RPF_SHARED, LLOYD, RAPF_DEFAULT)} | {
    "rapf-best": "RAPF, its best gains",
    "rpf-best": "RPF, its best gains",
}
"""What every contender is called."""


def best(controller: str, gains: Mapping[str, Value]) -> Contender:
    """Return RAPF or RPF with the gains that were best on the maps of the tuning."""
    return Contender(f"{controller}-best", LABELS[f"{controller}-best"], controller, dict(gains))


def strongest(contenders: Sequence[Contender]) -> list[Contender]:
    """Return RAPF at its best gains, or where those are not known with its default ones, and LA."""
    by_key = {each.key: each for each in contenders}
    rapf = by_key.get("rapf-best") or by_key.get("rapf-default")
    return [each for each in (rapf, by_key.get("lloyd")) if each is not None]


def potential_text(gains: Mapping[str, Value], no_limit: str = "") -> str:
    """Return gains of the potential as they are read: "(k_rep 1, rho_0 2, no limit)".

    Words are left out, and what goes with them: in the whole study a law heads for the centroids of the
    nearest robots' cells.

    Parameters
    ----------
    gains : dict of name to value
    no_limit : str
        What stands for an attraction without limit; by default nothing does.
    """
    parts = []
    for name, value in gains.items():
        if isinstance(value, str) or name == "height":
            continue
        if value is not None:
            parts.append(f"{name} {value_text(value)}")
        elif no_limit:
            parts.append(no_limit if name == "attraction_limit" else f"{name} none")
    return "(" + ", ".join(parts) + ")"
