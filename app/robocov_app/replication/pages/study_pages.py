"""The pages of the study, ``index.html`` and ``beyond.html``, and ``claims.json``."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from robocov import __version__
from robocov.files.writing import replace_file
from robocov.metrics import SETTLED_DISTANCE_M, SETTLED_WINDOW_S
from robocov.record import Record, list_versions
from robocov.text import escape_controls
from robocov_app.figures.statistics import RESAMPLES
from robocov_app.replication.assets import ASSETS
from robocov_app.replication.claims import goals, judge_beyond_claims, summarize_verdicts, thresholds
from robocov_app.replication.claims.claim import GOALS, RIVALS, Claim
from robocov_app.replication.claims.registration import load_registration
from robocov_app.replication.design import contenders, studies, study_maps
from robocov_app.replication.design.contenders import LABELS, MAIN_CONTROLLER, OURS
from robocov_app.replication.design.plan import (
    FAMILIES,
    FULL,
    LIMITED_RANGES,
    NON_CONVEX,
    ROBOTS,
    TEAM,
    UNSEEN,
    Plan,
    format_start,
)
from robocov_app.replication.design.study_maps import build_tuning_maps
from robocov_app.replication.evidence import (
    ControllerEvidence,
    collect_degradations,
    collect_evidence,
    load_profile,
    rank_contenders,
    summarize_contenders,
)
from robocov_app.replication.figures.figure_files import FigureFile
from robocov_app.replication.figures.paper_figures import CAPTIONS, FIGURES, name_figure
from robocov_app.replication.formatting import NO_VALUE, format_amount, format_interval
from robocov_app.replication.pages.svg_marks import DotStrip, draw_interval_bar, draw_strips
from robocov_app.replication.results import controller_speed
from robocov_app.replication.results.outcomes import Outcomes, ProblemInstance
from robocov_app.replication.results.study_results import (
    BeyondResults,
    FigureRun,
    FigureRuns,
    PaperResults,
)
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.pictures import draw_run
from robocov_app.report.replay import (
    build_replay_element,
    read_asset,
    read_replay_css,
    read_replay_js,
    wrap_script,
)
from robocov_app.report.theme_css import build_theme_rules
from robocov_app.sweep.study.parameters import UNITS
from robocov_app.terminal.output import replace_non_finite

PAGE_FILE = "index.html"
BEYOND_PAGE_FILE = "beyond.html"
CLAIMS_FILE = "claims.json"

_MAX_REPLAY_BYTES = 400_000
"""Maximum size of the runs in the page's replay."""
_REPLAY_PANES = ("b/rapf", "b/rpf")
"""Runs that the replay shows initially."""
_FIGURES_OF_CASES = {"convex": "Figure 2", "a": "Figure 4", "b": "Figure 6", "other": "Figure 8"}
FIGURE_VARIANTS = {
    "": "",
    "best": "With the best gains",
    "limited": "At limited ranges",
    "half-step": "With half the control period",
}
"""Titles of the variants of a figure, in the order of the page; see `FigureRuns`."""
_PICTURE_SIZE_PX = (300, 240)
_MAX_IMAGINARY_PART = 1e-9
"""Imaginary part up to which a root counts as real, 1/m."""
_REPORTED_GAPS = (0.25, 0.5, 1.0)
"""Gaps for which the page reports the fraction of runs that exceed them."""
_SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:m|s|m²|m³|N|J)(?![\w³²]))")


class ShownFailure(NamedTuple):
    """One of the worst runs of a controller."""

    instance: ProblemInstance
    picture: Markup
    description: str


def write_text(path: Path, text: str) -> None:
    """Write or replace a text file atomically."""
    with replace_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_claims(folder: Path, claims: Sequence[Claim]) -> None:
    """Write ``claims.json``."""
    content = [replace_non_finite(claim.to_json()) for claim in claims]
    write_text(folder / CLAIMS_FILE, json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def build_paper_page(
    plan: Plan,
    figure_files: Mapping[str, FigureFile],
    runs: FigureRuns,
    *,
    results: PaperResults | None,
    claims: Sequence[Claim],
    beyond: Sequence[Claim] = (),
) -> str:
    """Build ``index.html``.

    Parameters
    ----------
    plan : Plan
    figure_files : Mapping
        Figures by name.
    runs : dict
        Runs of the figures by variant and "case/controller".
    results : PaperResults or None
        Results of the paper's claims; None if only the figures were drawn.
    claims : sequence of Claim
        The paper's claims.
    beyond : sequence of Claim
        Claims beyond the paper, which have a page of their own.

    Returns
    -------
    str
        The page as HTML. Equal results give identical pages.
    """
    numbered_figures = []
    for number in FIGURES:
        variants = []
        for variant, title in FIGURE_VARIANTS.items():
            image = figure_files.get(name_figure(number, variant))
            if image is not None:
                variants.append((title, image))
        numbered_figures.append((number, CAPTIONS[name_figure(number)], variants))
    context: dict[str, Any] = {
        "results": results,
        "runs": sum(len(variant) for variant in runs.values()),
        "claims": claims,
        "beyond": beyond,
        "images": figure_files,
        "figures": numbered_figures,
        "replay": _build_replay(runs[""]),
        "registration": load_registration(),
        "replay_script": Markup(wrap_script(f"{read_replay_js()}startReplays();")),
        "versions": list_versions(),
        "all_bundled": len(plan.bundled) == len(NON_CONVEX),
    }
    if results is not None:
        context |= _build_claims_context(plan, results)
    return _render("paper.html.jinja", plan, context)


def _build_replay(runs: Mapping[str, FigureRun]) -> Markup:
    """Build the HTML element that replays the runs of the figures, named by figure and controller."""
    replays = []
    for name, run in runs.items():
        figure = _FIGURES_OF_CASES[name.partition("/")[0]]
        replays.append(ReplayRun(run.record, run.history, f"{figure}: {run.record.label}"))
    panes = [list(runs).index(name) for name in _REPLAY_PANES]
    return Markup(build_replay_element(replays, panes, _MAX_REPLAY_BYTES))


def _build_claims_context(plan: Plan, results: PaperResults) -> dict[str, Any]:
    """Return the template variables of ``index.html`` that depend on the results of the claims."""
    outcomes = results.claims
    by_key = {contender.key: contender for contender in results.contenders}
    participants = [by_key[key] for key in LABELS if key in by_key]
    gaps = outcomes.select_finite("gap", "rapf-shared").get_values("rapf-shared", "gap")
    others = {"rapf-best": "with its best gains", "lloyd": "Lloyd", "rpf-shared": "RPF"}
    map_count = len(set(outcomes.maps)) + len(set(results.convex.maps)) + len(build_tuning_maps(plan))
    return {
        "best": by_key,
        "distances": compute_grid_distances(plan),
        "map_count": map_count,
        "summaries": summarize_contenders(outcomes, participants, plan.duration),
        "maps": _tabulate_medians(outcomes),
        "failures": _show_failures(results.worst, outcomes, "rapf-shared", others),
        "above": [float((gaps > bound).mean()) for bound in _REPORTED_GAPS],
    }


def compute_grid_distances(plan: Plan) -> tuple[float, float, float, float]:
    """Compute distances that show what the ends of the gain grid mean.

    Returns
    -------
    tuple of float, m
        The minimum and maximum distance from a wall at which the repulsion is 1 N, and the smallest and
        largest distance from the goal at which the attraction drives a robot at full speed.
    """
    wall_distances = [
        compute_balance_distance(k_rep, rho_0) for k_rep, rho_0 in product(plan.k_rep, plan.rho_0)
    ]
    full_speed_force = TEAM["viscosity"] * TEAM["max_speed"]
    goal_distances = [(full_speed_force / k_att) ** (1.0 / 3.0) for k_att in plan.k_att]
    return min(wall_distances), max(wall_distances), min(goal_distances), max(goal_distances)


def compute_balance_distance(k_rep: float, rho_0: float, force: float = 1.0) -> float:
    """Compute the distance, m, at which the repulsion (24) equals a force, N.

    Examples
    --------
    >>> round(compute_balance_distance(1.0, 2.0), 2)
    0.84
    """
    # In terms of 1 / distance, the equation is the cubic k_rep (s - 1 / rho_0) s² = force.
    roots = np.roots([k_rep, -k_rep / rho_0, 0.0, -force])
    real_roots = roots[np.abs(roots.imag) < _MAX_IMAGINARY_PART].real
    return float(1.0 / real_roots.max())


def _tabulate_medians(outcomes: Outcomes) -> dict[str, dict[str, float]]:
    """Return the median gap of each contender on each map, by map and then by contender."""
    table: dict[str, dict[str, float]] = {name: {} for name in dict.fromkeys(outcomes.maps)}
    for key in LABELS:
        for name, median in outcomes.compute_medians_by_map(key).items():
            table[name][key] = median
    return table


def build_beyond_page(figure_files: Mapping[str, FigureFile], results: BeyondResults) -> str:
    """Build ``beyond.html``.

    Parameters
    ----------
    figure_files : Mapping
        Figures by name.
    results : BeyondResults

    Returns
    -------
    str
        The page as HTML. Equal results give identical pages.
    """
    claims = judge_beyond_claims(results)
    goal_claims = [claim for claim in claims if claim.question == GOALS]
    summaries = rank_contenders(results)
    evidence = collect_evidence(results, summaries)
    is_tuned = bool(results.plan.beyond.tuning)
    compared = ("rapf-best", "rapf-default", "lloyd")
    others = {contender.key: contender.label for contender in results.contenders if contender.key in compared}
    context: dict[str, Any] = {
        "results": results,
        "claims": claims,
        "goals": [claim for claim in goal_claims if claim.key != "goal-unseen"],
        "unseen": next((claim for claim in claims if claim.key == "goal-unseen"), None),
        "goal_claims": goal_claims,
        "rival_claims": [claim for claim in claims if claim.question == RIVALS],
        "rows": summaries,
        "conditions": collect_degradations(results, summaries),
        "captions": CAPTIONS,
        "controllers": [(item, _draw_evidence_strips(item, evidence)) for item in evidence],
        "failures": _show_failures(results.worst, results.outcomes, MAIN_CONTROLLER, others),
        "images": figure_files,
        "tuned": is_tuned,
        "unseen_families": UNSEEN,
        "tuning": results.plan if is_tuned else FULL,
    }
    return _render("beyond.html.jinja", results.plan, context)


def _draw_evidence_strips(item: ControllerEvidence, evidence: Sequence[ControllerEvidence]) -> Markup:
    """Draw a strip with the medians of a controller on all maps, above that of a baseline.

    The baseline is the project's main controller. The main controller itself is compared with RAPF, the
    controller of the paper.
    """
    highest = 0.0
    for row in evidence:
        highest = max([highest, *row.medians_by_map.values()])
    baseline = MAIN_CONTROLLER
    if item.profile.controller == MAIN_CONTROLLER:
        baseline = "rapf"
    rows = [item, *(row for row in evidence if row.profile.controller == baseline)]
    strips = [
        DotStrip(row.summaries[0].contender.label, row.profile.controller in OURS, row.medians_by_map)
        for row in rows
    ]
    return draw_strips(strips, highest)


def _show_failures(
    worst: Sequence[tuple[ProblemInstance, Record]], outcomes: Outcomes, key: str, others: Mapping[str, str]
) -> list[ShownFailure]:
    """Return pictures of the worst runs of a contender, with its gap and the gaps of others.

    Parameters
    ----------
    worst : sequence of (ProblemInstance, Record)
    outcomes : Outcomes
    key : str
        Key of the contender.
    others : Mapping
        Labels of other contenders by key.
    """
    failures = []
    for instance, record in worst:
        k = outcomes.instances.index(instance)
        gaps = {name: format_amount(outcomes.get_values(name, "gap")[k], "%") for name in (key, *others)}
        compared = ", ".join(f"{label} {gaps[name]}" for name, label in others.items())
        description = f"gap {gaps[key]} ({compared})"
        if key not in OURS:
            blocked = outcomes.get_values(key, "blocked")[k] * len(record.team)
            description += f"; a wall is between {blocked:.0f} of {len(record.team)} robots and their goals"
        picture = Markup(draw_run(record, None, *_PICTURE_SIZE_PX, has_numbers=True))
        failures.append(ShownFailure(instance, picture, f"{description}."))
    return failures


def _render(template: str, plan: Plan, context: Mapping[str, Any]) -> str:
    """Render a page template with its variables, and with the functions that all pages use."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_join_units,
    )
    environment.filters.update(
        span=format_span,
        start_name=format_start,
        g="{:g}".format,
        amount=format_amount,
        hundredths=_format_hundredths,
        unbroken=lambda text: Markup(_join_units(str(text))),
    )
    environment.globals.update(
        thresholds=thresholds,
        claim_goals=goals,
        contenders=contenders,
        studies=studies,
        study_maps=study_maps,
        controller_speed=controller_speed,
        draw_bar=draw_interval_bar,
        amount=format_amount,
        format_interval=format_interval,
        summarize_verdicts=summarize_verdicts,
        load_profile=load_profile,
        units=UNITS,
        team=TEAM,
        limited_ranges=LIMITED_RANGES,
        is_rpf_unaffected=_is_rpf_unaffected(),
        families=FAMILIES,
        robots=ROBOTS,
        settled=(SETTLED_DISTANCE_M, SETTLED_WINDOW_S),
        resamples=RESAMPLES,
        page=PAGE_FILE,
        beyond_page=BEYOND_PAGE_FILE,
        version=__version__,
        plan=plan,
        quick=plan.name == "quick",
    )
    own_style = (ASSETS / "paper.css").read_text("utf-8")
    style = Markup(build_theme_rules(":root") + read_replay_css() + read_asset("report.css") + own_style)
    return escape_controls(environment.get_template(template).render(style=style, **context))


def _is_rpf_unaffected() -> bool:
    """Return whether RPF with shared gains moves alike at limited and at unlimited ranges.

    Robots and obstacles beyond the range of the repulsion exert no force.
    """
    repulsion_range = contenders.SHARED["rho_0"]
    assert isinstance(repulsion_range, float)
    return repulsion_range <= min(LIMITED_RANGES.values())


def format_span(numbers: Sequence[int]) -> str:
    """Format integers as a list, or as a range if they are consecutive.

    Examples
    --------
    >>> format_span((1, 2, 3)), format_span((1, 3))
    ('1 to 3', '1, 3')
    """
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(number) for number in numbers)


def _format_hundredths(value: float) -> str:
    """Format a number with two decimals; a dash if it is not finite."""
    return f"{value:.2f}" if math.isfinite(value) else NO_VALUE


def _join_units(value: Any) -> Any:
    """Put no-break spaces between numbers and units of a text; return other values, markup too, unchanged."""
    return _SPACE_BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", value) if type(value) is str else value
