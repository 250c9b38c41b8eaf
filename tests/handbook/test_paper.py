"""The table of verdicts on the page about the paper, and their counts, are those of the full study."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import Any

import pytest
from markdown_pages import read_handbook_page

from robocov_app.commands.handbook import find_page_sources
from robocov_app.figures.statistics import adjust_p_values
from robocov_app.replication.claims.claim import CriterionResult, derive_verdict
from robocov_app.replication.claims.registration import load_registration
from robocov_app.replication.claims.thresholds import ALPHA, MIN_MAPS

PAGE = read_handbook_page("paper")
CLAIMS: dict[str, dict[str, Any]] = {
    claim["key"]: claim
    for claim in json.loads((find_page_sources() / "static/paper-claims.json").read_text(encoding="utf-8"))
}
"""The file ``claims.json`` of the full study, by the keys of the claims."""
GAINS = ("shared", "best", "default")
ROWS = {
    "convex-final": "convex: RAPF ends at Lloyd's cost",
    "convex-spreading": "convex: RAPF spreads faster",
    "nonconvex-final": "non-convex: RAPF ends below RPF",
    "nonconvex-motion": "non-convex: RAPF is below RPF while it moves",
    "starts-cost": "RAPF's final cost barely depends on the starts, RPF's does",
    "starts-placement": "RAPF's final placement barely depends on the starts",
    "nonconvex-lloyd": "non-convex: RAPF outperforms Lloyd",
    "gap-rapf": "RAPF is nearly optimal",
    "gap-rpf": "RPF is far from the optimum",
    "limited-nonconvex-final": "limited ranges: RAPF ends below RPF",
    "limited-nonconvex-motion": "limited ranges: RAPF is below RPF while it moves",
    "limited-nonconvex-lloyd": "limited ranges: RAPF outperforms Lloyd",
    "limited-gap-rapf": "limited ranges: RAPF is nearly optimal",
}
"""Start of each row of the table of verdicts, by the keys of its claims without the suffix for the gains."""
SHORT_VERDICTS = {"holds partly": "partly"}
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def find_row(beginning: str) -> list[str]:
    """Return the cells of the table row that starts with `beginning` and a semicolon."""
    [line] = [line for line in PAGE.splitlines() if line.startswith(f"| {beginning};")]
    return [cell.strip() for cell in line.strip("| ").split(" | ")]


def assert_is_rounded(text: str, criterion: dict[str, Any]) -> None:
    """Check that a cell shows the rounded estimate and interval of a criterion."""
    numbers = NUMBER.findall(text)
    factor = 100.0 if "%" in text else 1.0
    for number, value in zip(numbers, (criterion["estimate"], *criterion["interval"]), strict=True):
        decimals = len(number.partition(".")[2])
        assert number == f"{factor * value:.{decimals}f}"


def test_the_study_is_the_registered_one() -> None:
    assert tuple(CLAIMS) == load_registration().claims
    assert min(claim["maps"] for claim in CLAIMS.values()) == 12  # of the grid of gains
    assert CLAIMS["nonconvex-final-shared"]["maps"] == 100


def read_results(claim: dict[str, Any]) -> list[CriterionResult]:
    """Return the results of the criteria of a claim."""
    return [
        CriterionResult(criterion["met"], criterion["p"], criterion["p_refutation"])
        for criterion in claim["criteria"]
    ]


def test_verdicts_follow_from_the_results() -> None:
    results = {key: read_results(claim) for key, claim in CLAIMS.items()}
    p_values = {key: max(result.p_value for result in results[key]) for key in CLAIMS}
    adjusted_p_values = adjust_p_values(p_values)
    for key, claim in CLAIMS.items():
        assert claim["maps"] >= MIN_MAPS
        assert claim["p_adjusted"] == pytest.approx(adjusted_p_values[key])
        assert claim["verdict"] == derive_verdict(results[key], claim["p_adjusted"], len(CLAIMS))


def test_the_changed_verdicts_are_recorded() -> None:
    """Before the change, a claim that meets all criteria was undecided if it was not significant."""
    changed = [
        key
        for key, claim in CLAIMS.items()
        if all(criterion["met"] for criterion in claim["criteria"])
        and claim["p_adjusted"] > ALPHA
        and claim["verdict"] != "undecided"
    ]
    (change,) = load_registration().changes
    assert list(change.changed_claims) == changed
    assert f"On {change.date}, when all results were known, one rule changed" in PAGE


@pytest.mark.parametrize("key", ROWS)
def test_rows_of_the_table_are_measured_values(key: str) -> None:
    _, threshold, *cells, verdicts = find_row(ROWS[key])
    claims = [CLAIMS[f"{key}-{gains}"] for gains in GAINS]
    criterion = claims[0]["criteria"][0]
    factor = 100.0 if "%" in threshold else 1.0
    bounds = [factor * end for end in (criterion["at_least"], criterion["at_most"]) if end is not None]
    assert [float(number) for number in NUMBER.findall(threshold)] == pytest.approx(bounds)
    for cell, claim in zip(cells, claims, strict=True):
        assert_is_rounded(cell, claim["criteria"][0])
    expected = [SHORT_VERDICTS.get(claim["verdict"], claim["verdict"]) for claim in claims]
    is_same = len(set(expected)) == 1
    assert verdicts == (f"{expected[0]} (all three)" if is_same else ", ".join(expected))


def test_the_summary_counts_the_verdicts() -> None:
    counts = Counter(claim["verdict"] for claim in CLAIMS.values())
    assert (
        f"Of {len(CLAIMS)} claims, {counts['holds']} hold, {counts['holds partly']} hold partly, "
        f"{counts['undecided']} are undecided and {counts['does not hold']} do not hold."
    ) in PAGE
