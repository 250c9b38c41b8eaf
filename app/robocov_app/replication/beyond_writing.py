"""The page beyond the paper: every controller's evidence, the goals of ours, and what the paper leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov import __version__
from robocov.files.atomic import written
from robocov_app.replication import told
from robocov_app.replication.beyond_plan import HUGE, LARGE, OURS, SMALL
from robocov_app.replication.beyond_plots import WORDS, beyond_figures
from robocov_app.replication.beyond_studies import GROUPS, conditions_plan, of, ours
from robocov_app.replication.evidence import Evidence, evidence, evidence_rows
from robocov_app.replication.extensions import extension_claims
from robocov_app.replication.goals import (
    EXTENSIONS,
    GOALS,
    QUESTIONS,
    RIVALS,
    Goal,
    goals,
    rival_claims,
    unseen_claim,
)
from robocov_app.replication.pages import BEYOND_PAGE, PAGE, Image, rendered, save_drawn, style_sheet
from robocov_app.replication.plan import FULL
from robocov_app.replication.rival_gains import GRIDS, gains_words
from robocov_app.replication.steps import BLOCK, MAP
from robocov_app.replication.strips import Strip, strips
from robocov_app.replication.verdicts import amount
from robocov_app.replication.writing import told_counts
from robocov_app.sweep.study import UNITS

if TYPE_CHECKING:
    from markupsafe import Markup

    from robocov_app.replication.beyond import BeyondMaterial
    from robocov_app.replication.plan import Plan
    from robocov_app.replication.verdicts import Claim

_PARTS = (
    ("targets", "Targets", ("beyond-heights", "beyond-targets"), ("targets",)),
    ("density", "Density", ("beyond-density",), ("density",)),
    ("teams", "Mixed teams", ("beyond-teams",), ("teams-rapf", "teams-lloyd")),
    ("conditions", "What goes wrong", ("beyond-conditions",), ("conditions",)),
)
"""The parts of the extensions: anchor, name, figures, claims."""

_PART_WORDS = {
    "targets": "The paper derives the best place for f = 1/(r² + h²), (14) to (21), and simulates the "
    "centroid, the best place for r². By (22) the geometric median, the best place for r, is what counts; "
    "a sensor counts what is within a few h, and hardly anything beyond. Where a wall holds a robot, "
    "centimetres between two targets may decide how a run ends.",
    "density": "The paper's future work: a weight φ by which some places matter more. Masses and centroids "
    "of the cells are then those of φ, and so is the cost (22).",
    "teams": "The paper's future work: a speed limit for every robot. A place then belongs to the robot that "
    "is there first, which makes the cells multiplicatively weighted, and the cost a time.",
    "conditions": "The paper takes for granted that robots hear each other at once, know where they are, "
    "sense exactly and do not fail. Each panel takes one of that away.",
}


def beyond_goals(material: BeyondMaterial) -> list[Goal]:
    """Return the goals of our own controller; none where there is no such controller."""
    mine = ours()
    if not mine:
        return []
    return goals(material.outcomes, mine[0], material.contenders, material.steps, material.plan.duration)


def beyond_claims(material: BeyondMaterial) -> tuple[Claim, ...]:
    """Return all claims beyond the paper with what the runs say of them."""
    mine = ours()
    unseen = beyond_unseen(material)
    return (
        *(goal.claim for goal in beyond_goals(material)),
        *(() if unseen is None else (unseen,)),
        *(rival_claims(material.outcomes, mine[0], material.contenders) if mine else ()),
        *extension_claims(material),
    )


def beyond_unseen(material: BeyondMaterial) -> Claim | None:
    """Return what ours reached on maps that played no part in its development, if it ran there."""
    mine = ours()
    if not mine or material.unseen is None:
        return None
    return unseen_claim(material.unseen, mine[0], material.contenders)


def save_beyond_pictures(folder: Path, material: BeyondMaterial, *, quiet: bool) -> dict[str, Image]:
    """Write the figures of the page to ``figures/``.

    Raises
    ------
    OutputError
        When something cannot be written.
    """
    light, dark = (
        {name: (draw, WORDS[name]) for name, draw in beyond_figures(material, theme).items()}
        for theme in ("light", "dark")
    )
    return save_drawn(folder, light, dark, quiet=quiet)


def save_beyond_page(folder: Path, images: Mapping[str, Image], material: BeyondMaterial) -> None:
    """Write ``beyond.html``, which needs nothing but ``figures/`` beside it.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    with written(folder / BEYOND_PAGE) as part:
        part.write_text(beyond_page(images, material), encoding="utf-8")


def beyond_page(images: Mapping[str, Image], material: BeyondMaterial) -> str:
    """Return the page; the parameters are those of `save_beyond_page`."""
    from robocov_app.report.replay import replay_css

    plan = material.plan
    claims = beyond_claims(material)
    rows = evidence_rows(material.outcomes, material.contenders, material.steps)
    each = evidence(material, rows)
    quick = plan.name == "quick"
    context: dict[str, Any] = {
        "version": __version__,
        "style": style_sheet(replay_css()),
        "quick": quick,
        "front": PAGE,
        "lead": _lead(material, each),
        "goals": beyond_goals(material),
        "goal_words": goal_words(beyond_goals(material)),
        "ours": ours()[0].label if ours() else "",
        "unseen": beyond_unseen(material),
        "questions": QUESTIONS,
        "goal_claims": _of(claims, GOALS),
        "rival_claims": _of(claims, RIVALS),
        "rival_counts": told_counts(_of(claims, RIVALS)),
        "counts": told_counts(claims),
        "rows": rows,
        "failures": _failures(material),
        "images": images,
        "controllers": [_section(one, each, material) for one in each],
        "parts": [
            {
                "id": name,
                "title": title,
                "words": _PART_WORDS[name],
                "images": [images[figure] for figure in figures if figure in images],
                "claims": [claim for claim in claims if claim.key in keys],
            }
            for name, title, figures, keys in _PARTS
        ],
        "extensions": QUESTIONS[EXTENSIONS],
        "protocol": _protocol(material),
        "small": SMALL,
        "large": LARGE,
        "made": f"Made by robocov {__version__}: robocov paper{' --quick' if quick else ''}",
        "citation": told.CITATION,
    }
    return rendered("beyond.html.jinja", context)


def goal_words(found: Sequence[Goal]) -> str:
    """Return in words how many goals are met, and which are not, with the measured values."""
    measured = [goal for goal in found if goal.met is not None]
    if not measured:
        return "Nothing was measured."
    missed = [goal for goal in measured if not goal.met]
    head = f"{len(measured) - len(missed)} of {len(measured)} goals are met."
    if not missed:
        return head
    parts = []
    for goal in missed:
        (criterion,) = goal.claim.criteria
        measured_ = amount(criterion.interval.estimate, criterion.unit)
        parts.append(f"{criterion.text} {measured_} instead of {criterion.wanted}")
    return f"{head} Missed: {'; '.join(parts)}."


def _lead(material: BeyondMaterial, each: Sequence[Evidence]) -> str:
    maps = len(set(material.outcomes.maps))
    return (
        f"{len(each)} controllers on {maps} maps from the same places, and what the paper leaves to others, "
        f"in {material.runs:,} runs beside those of the paper's claims, {material.failed:,} of which failed."
    )


def _of(claims: Sequence[Claim], question: int) -> list[Claim]:
    return [claim for claim in claims if claim.part == question]


def _failures(material: BeyondMaterial) -> list[dict[str, Any]]:
    """Return the pictures of our controller's worst runs, and what is said of them."""
    from markupsafe import Markup

    from robocov_app.report.pictures import run_picture

    found = []
    for scenario, record in material.worst:
        outcomes = material.outcomes
        k = outcomes.scenarios.index(scenario)
        others = ", ".join(
            f"{law.label} {amount(float(outcomes.of(law.key, 'gap')[k]), '%')}"
            for law in material.contenders
            if law.key in ("rapf-best", "rapf-default", "lloyd")
        )
        gap = amount(float(outcomes.of(str(material.ours), "gap")[k]), "%")
        found.append(
            {
                "picture": Markup(run_picture(record, None, 300, 240, numbers=True)),
                "title": f"{scenario.map}, start {scenario.start}, seed {scenario.seed}",
                "words": f"{gap} above the reference ({others}).",
            }
        )
    return found


def _section(one: Evidence, each: Sequence[Evidence], material: BeyondMaterial) -> dict[str, Any]:
    """Return what the page says of one controller."""
    name = one.account.controller
    return {
        "evidence": one,
        "id": f"controller-{name}",
        "gains": gains_words(name, material.gains[name]) if name in material.gains else "",
        "picture": _picture(one, each, material),
    }


def _picture(one: Evidence, each: Sequence[Evidence], material: BeyondMaterial) -> Markup:
    """Return the medians map by map of a controller above those of ours, or of ours above RAPF's."""
    highest = max((max(other.maps.values()) for other in each if other.maps), default=0.0)
    rows = [_strip(one)]
    first = material.ours
    beside = "rapf" if one.account.controller == first or first is None else first
    rows += [_strip(other) for other in each if other.account.controller == beside and other is not one]
    return strips(rows, highest)


def _strip(one: Evidence) -> Strip:
    label = one.best.law.label if one.best else one.account.label
    return Strip(label, one.ours, one.maps)


def _gains_told(plan: Plan) -> str:
    """Return in words where the gains of rivals and ours come from."""
    tuned = bool(of(plan).tuning)
    where = plan if tuned else FULL
    sets = sum(len(grid) for grid in GRIDS.values())
    words = (
        f"with the least mean of J/J_ref among {sets} sets of gains for {len(GRIDS)} rivals, in runs of "
        f"{where.duration:g} s on {len(of(where).tuning)} generated maps (seeds "
        f"{told.span(of(where).tuning)}) "
        f"on which nothing is tested, starts {', '.join(where.tuning_starts)} with a seed of their own "
        f"({where.tuning_seed}). What the sets do not name has its default. Ours has its default gains."
    )
    if tuned:
        return f"Each rival has those {words}"
    return (
        f"Each rival has its default gains: those that the full study, robocov paper without --quick, found, "
        f"{words}"
    )


def _protocol(material: BeyondMaterial) -> list[tuple[str, str]]:
    """Return what was done, as pairs of a name and a sentence."""
    plan: Plan = material.plan
    beyond = of(plan)
    team = plan.team
    seeds = {
        "rivals": beyond.seeds,
        **{law.label: beyond.seeds_of(law.controller) for law in ours() if law.controller in OURS},
    }
    unseen = (
        f" {ours()[0].label}, RAPF and LA also on generated maps with seeds {told.span(beyond.unseen)}, on "
        "which nothing was looked at before."
        if beyond.unseen and ours()
        else ""
    )
    conditions = conditions_plan(plan).always.items()
    listed = ", ".join(
        f"{name.replace('_', ' ')} {value:g} {UNITS[name]}".rstrip() for name, value in conditions
    )
    always = f"All runs, the ideal ones as well: {listed}." if listed else ""
    groups = ", ".join(f"{group['count']} of {group['max_speed']:g} m/s" for group in GROUPS)
    return [
        (
            "Robots",
            f"As in the paper's part: {SMALL} discs, the same limits for every controller, a range sensor of "
            f"{team['sensing_range']:g} m, every other robot heard; {plan.duration:g} s.",
        ),
        ("Gains", _gains_told(plan)),
        (
            "Runs",
            f"Starts {', '.join(beyond.starts)}; seeds of the starts: "
            f"{'; '.join(f'{name} {told.span(values)}' for name, values in seeds.items())}; the paper's "
            f"controllers {told.span(plan.seeds)}. Pairs are runs of both from the same places.{unseen}",
        ),
        (
            "Information",
            "Own: what the robot itself senses and hears. Shared map: also what neighbours tell of the map. "
            "Whole map: known from the beginning.",
        ),
        (
            "Steps",
            f"On {MAP}, {beyond.warm_up} steps to begin with, then the median of {beyond.blocks} blocks of "
            f"{BLOCK} steps, controllers in turn, as a multiple of RAPF's in the same turn; real time with "
            f"{HUGE} robots. They are those of the machine that did the study.",
        ),
        (
            "Targets, density, mixed teams",
            f"{len(beyond.maps)} generated maps (seeds {told.span(beyond.maps)}), starts "
            f"{', '.join(beyond.map_starts)}, seed 0, robocov's default gains. Mixed teams: {groups}.",
        ),
        (
            "What goes wrong",
            f"{', '.join(beyond.conditions_maps)}; the first start of each, {beyond.conditions_seeds} seeds, "
            f"{beyond.conditions_duration:g} s, RAPF and LA. {always}",
        ),
        (
            "Statistics",
            "As in the paper's part: medians with 95 % percentile bootstrap intervals that draw whole maps. "
            "Goals on every single map draw runs within each map. A goal is met or missed by the measured "
            "value; its verdict as a claim says whether the interval agrees.",
        ),
    ]
