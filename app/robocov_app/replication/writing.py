"""The results of a study of the paper as files: figures, ``claims.json`` and the page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov import __version__
from robocov.files.atomic import written
from robocov_app.replication import told
from robocov_app.replication.asking import QUESTIONS
from robocov_app.replication.claim_plots import claim_figures
from robocov_app.replication.contenders import RAPF_SHARED, RPF_SHARED
from robocov_app.replication.figures import NUMBERS, TEXTS, Shown, draw_figure
from robocov_app.replication.outcomes import Scenario
from robocov_app.replication.pages import BEYOND_PAGE, PAGE, Image, rendered, save_drawn, style_sheet
from robocov_app.replication.tables import law_rows, map_rows
from robocov_app.replication.verdicts import amount
from robocov_app.replication.words import seen
from robocov_app.terminal.output import finite

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from robocov.record import Record
    from robocov_app.replication.plan import Plan
    from robocov_app.replication.studying import Material
    from robocov_app.replication.verdicts import Claim

CLAIMS = "claims.json"

_REPLAY_BUDGET = 400_000
"""Bytes of the runs in the page's replay."""

_WORDS = {
    "claim-1-convex": "RAPF against LA in convex regions: every pair of runs, the median and its interval.",
    "claim-2-nonconvex": "RAPF against RPF and LA on non-convex maps: every pair of runs, the median and its "
    "interval. Left of 1 RAPF is better.",
    "claim-3-gains": "How far the final cost is above the reference for every set of gains, in percent: the "
    "mean over the maps of the tuning. The best set of each panel is bold.",
    "claim-4-starts": "The final cost from each kind of starts, by the reference.",
    "claim-6-gap": "The final cost of every law on the non-convex maps, by the reference.",
}
"""What is said of the claims' plots."""


def save_claims(folder: Path, claims: Sequence[Claim]) -> None:
    """Write ``claims.json``: a list of {claim, verdict, estimate, interval, runs, ...}.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    text = json.dumps([finite(claim.to_json()) for claim in claims], indent=1, ensure_ascii=False)
    with written(folder / CLAIMS) as part:
        part.write_text(text + "\n", encoding="utf-8")


def save_pictures(
    folder: Path, runs: Mapping[str, Shown], first: Record, material: Material | None, *, quiet: bool
) -> dict[str, Image]:
    """Write all figures to ``figures/``: PNG, SVG and PDF, and a PNG for dark pages.

    Parameters
    ----------
    folder : Path
    runs : dict of name to Shown
    first : Record
        Whose first moment is figure 1.
    material : Material or None
        None where only the paper's figures are wanted.
    quiet : bool
        Tell nothing.

    Raises
    ------
    OutputError
        When something cannot be written.
    """
    light, dark = (_drawn(runs, first, material, theme) for theme in ("light", "dark"))
    return save_drawn(folder, light, dark, quiet=quiet)


def save_page(
    folder: Path,
    plan: Plan,
    images: Mapping[str, Image],
    runs: Mapping[str, Shown],
    first: Record,
    material: Material | None,
    claims: Sequence[Claim],
    beyond: Sequence[Claim] = (),
) -> None:
    """Write ``index.html``, which needs nothing but ``figures/`` beside it.

    The parameters are those of `page`.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    content = page(plan, images, runs, first, material, claims, beyond)
    with written(folder / PAGE) as part:
        part.write_text(content, encoding="utf-8")


def page(
    plan: Plan,
    images: Mapping[str, Image],
    runs: Mapping[str, Shown],
    first: Record,
    material: Material | None,
    claims: Sequence[Claim],
    beyond: Sequence[Claim] = (),
) -> str:
    """Return the page.

    Parameters
    ----------
    plan : Plan
    images : dict of name to Image
    runs : dict of name to Shown
    first : Record
        Whose first moment is figure 1.
    material : Material or None
        None where only the paper's figures are wanted.
    claims, beyond : sequence of Claim
        The paper's, and those that are told in full on the page beyond the paper.
    """
    from markupsafe import Markup

    from robocov_app.report.replay import ReplayRun, replay_css, replay_js, replay_part, script

    replays = [
        ReplayRun(shown.record, shown.history, f"{_CASES[name.partition('/')[0]]}: {shown.record.label}")
        for name, shown in runs.items()
    ]
    order = list(runs)
    panes = [order.index("b/rapf"), order.index("b/rpf")]
    context: dict[str, Any] = {
        "version": __version__,
        "style": style_sheet(replay_css()),
        "quick": plan.name == "quick",
        "lead": _lead(plan, material),
        "notice": _notice(plan, material, alone=bool(beyond)),
        "sections": _sections(material),
        "beyond": beyond,
        "beyond_counts": told_counts(beyond),
        "beyond_page": BEYOND_PAGE,
        "claims": claims,
        "counts": told_counts(claims),
        "figure_gains": f"{plan.duration:g} s, RAPF {told.gains_text(RAPF_SHARED)}, "
        f"RPF {told.gains_text(RPF_SHARED)}",
        "figures": [
            {
                "number": text.number,
                "image": images[f"figure-{text.number}"],
                "shows": text.shows,
                "claim": text.claim,
                "seen": seen(text.number, runs, first),
            }
            for text in TEXTS
        ],
        "replay": Markup(replay_part(replays, panes, _REPLAY_BUDGET)),
        "replay_script": Markup(script(replay_js() + "startReplays();")),
        "questions": _questions(claims, images),
        "laws": [],
        "protocol": told.protocol(
            plan,
            material.best if material else {},
            material.runs if material else len(runs),
            material.failed if material else 0,
        ),
        "depends": told.DEPENDS,
        "errata": told.ERRATA,
        "citation": told.CITATION,
        "made": f"Made by robocov {__version__}: robocov paper{' --quick' if plan.name == 'quick' else ''}",
    }
    if material is not None:
        context |= {
            "laws": law_rows(material.claims),
            "maps": map_rows(material.claims, material.references),
            "map_count": len(set(material.claims.maps)),
            "restarts": plan.restarts,
            "failures": _failures(material),
            "failure_words": _failure_words(material),
        }
    return rendered("paper.html.jinja", context)


_QUESTION_NAMES = {
    1: "Convex regions",
    2: "RAPF and RPF",
    3: "Gains",
    4: "Starts",
    5: "Lloyd's algorithm",
    6: "Optimum",
}
"""What the questions are called in the page's contents."""

_CASES = {"convex": "Figure 2", "a": "Figure 4", "b": "Figure 6", "other": "Figure 8"}
"""Which figure shows which runs."""


def _drawn(
    runs: Mapping[str, Shown], first: Record, material: Material | None, theme: str
) -> dict[str, tuple[Callable[[], Figure], str]]:
    """Return how every picture is drawn, and what it shows."""

    def of(number: int) -> Callable[[], Figure]:
        return lambda: draw_figure(number, runs, first, theme)

    drawn = {
        f"figure-{text.number}": (of(text.number), f"{text.shows} {seen(text.number, runs, first)}")
        for text in TEXTS
    }
    assert len(drawn) == len(NUMBERS)
    if material is not None:
        drawn |= {name: (draw, _WORDS[name]) for name, draw in claim_figures(material, theme).items()}
    return drawn


def _lead(plan: Plan, material: Material | None) -> str:
    if material is None:
        return "Figures 1 to 8 on environments of the same kinds."
    maps = len(set(material.claims.maps)) + len(set(material.convex.maps)) + len(plan.tuning)
    return (
        f"Figures 1 to 8 on environments of the same kinds, and its claims tested in {material.runs:,} "
        f"simulated runs on {maps} maps."
    )


def _notice(plan: Plan, material: Material | None, *, alone: bool) -> str:
    if material is None and alone:
        return (
            "Only the figures and what goes beyond the paper were asked for: without --beyond-only the "
            "claims are tested too."
        )
    if material is None:
        return "Only the figures were asked for: without --figures-only the claims are tested too."
    if plan.name == "quick":
        return (
            "This is the quick study: it shows that everything works and where things point. Its maps, "
            "starts "
            "and seeds are too few for more; the full study is robocov paper without --quick."
        )
    return ""


def _sections(material: Material | None) -> list[tuple[str, str]]:
    head = [("verdicts", "Verdicts")] if material else []
    parts = [("figures", "Figures"), ("replay", "Replay")]
    if material:
        parts += [(f"question-{number}", name) for number, name in _QUESTION_NAMES.items()]
        parts += [("gaps", "Gap to the reference"), ("failures", "Where RAPF fails")]
    return [*head, *parts, ("protocol", "Protocol"), ("errata", "Errata")]


def told_counts(claims: Sequence[Claim]) -> str:
    """Return in words how many claims hold, hold partly, do not hold, or are undecided."""
    words = [claim.verdict for claim in claims]
    parts = [
        f"{words.count(word)} {one if words.count(word) == 1 else more}"
        for word, (one, more) in (
            ("holds", ("holds", "hold")),
            ("holds partly", ("holds partly", "hold partly")),
            ("does not hold", ("does not hold", "do not hold")),
            ("undecided", ("is undecided", "are undecided")),
        )
        if word in words
    ]
    return f"Of {len(claims)} claims {', '.join(parts)}."


def _questions(claims: Sequence[Claim], images: Mapping[str, Image]) -> list[dict[str, Any]]:
    found = []
    for number, text in QUESTIONS.items():
        own = [claim for claim in claims if claim.part == number]
        image = next((each for name, each in images.items() if name.startswith(f"claim-{number}-")), None)
        if own:
            found.append({"number": number, "text": text, "claims": own, "image": image})
    return found


def _failures(material: Material) -> list[dict[str, Any]]:
    from markupsafe import Markup

    from robocov_app.report.pictures import run_picture

    return [
        {
            "picture": Markup(run_picture(record, None, 300, 240, numbers=True)),
            "title": f"{scenario.map}, start {scenario.start}, seed {scenario.seed}",
            "words": _failure(material, scenario),
        }
        for scenario, record in material.worst
    ]


def _failure(material: Material, scenario: Scenario) -> str:
    outcomes = material.claims
    k = outcomes.scenarios.index(scenario)
    gaps = ", ".join(
        f"{label} {amount(float(outcomes.of(law, 'gap')[k]), '%')}"
        for law, label in (("rapf-best", "at its best gains"), ("lloyd", "LA"), ("rpf-shared", "RPF"))
    )
    held = outcomes.of("rapf-shared", "stuck")[k]
    return (
        f"{amount(float(outcomes.of('rapf-shared', 'gap')[k]), '%')} above the reference ({gaps}); "
        f"{held:.0f} of {len(material.worst[0][1].team)} robots rest away from their goals."
    )


def _failure_words(material: Material) -> str:
    gap = material.claims.of("rapf-shared", "gap")
    gap = gap[gap == gap]
    above = [amount(float((gap > bound).mean()), "%") for bound in (0.25, 0.5, 1.0)]
    return (
        f"With the shared gains {above[0]} of the runs end more than 25 % above the reference, {above[1]} "
        f"more "
        f"than 50 %, and {above[2]} at more than twice its cost. The goal of a robot, the centroid of its "
        f"cell, "
        f"may lie behind a wall or in it; then attraction and repulsion balance in front of the wall and the "
        f"robot rests there. These are the worst runs, one a map: starts green, trajectories red, final "
        f"positions blue."
    )
