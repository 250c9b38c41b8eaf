"""The dated record of the claims and thresholds that were registered before the study was run."""

import tomllib
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from robocov_app.replication.assets import ASSETS


class RegistrationChange(NamedTuple):
    """Change of the rules after the registration."""

    date: str
    description: str
    """Sentences on the change, and on the results that were known on that date."""
    changed_claims: tuple[str, ...]
    """Keys of the claims whose verdicts changed."""


class Registration(NamedTuple):
    """Record of a registration."""

    date: str
    """Date as in 2026-11-27."""
    known: str
    """Sentences on the results that were known on that date."""
    claims: tuple[str, ...]
    """Keys of the claims that are tested together."""
    thresholds: Mapping[str, float]
    """Thresholds by their names in `robocov_app.replication.claims.thresholds`."""
    changes: tuple[RegistrationChange, ...]
    """Later changes of the rules, in the order of time."""


@cache
def load_registration() -> Registration:
    """Load the record of the registration."""
    content = tomllib.loads((ASSETS / "registration.toml").read_text(encoding="utf-8"))
    changes = []
    for change in content["changes"]:
        changed_claims = tuple(change["changed_claims"])
        changes.append(RegistrationChange(change["date"], change["description"], changed_claims))
    return Registration(
        date=content["date"],
        known=content["known"],
        claims=tuple(content["claims"]),
        thresholds=content["thresholds"],
        changes=tuple(changes),
    )
