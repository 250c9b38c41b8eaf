"""The results as files: figures, ``claims.json`` and the two pages, ``index.html`` and ``beyond.html``."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from markupsafe import Markup

from robocov import __version__
from robocov.errors import OutputError
from robocov.files.atomic import written
from robocov.metrics import SETTLED_DISTANCE, SETTLED_WINDOW
from robocov.record import Record, versions
from robocov_app.figures.files import save_figure
from robocov_app.figures.statistics import RESAMPLES
from robocov_app.replication import beyond_claims, claims, contenders, maps, studies
from robocov_app.replication.evidence import ASSETS, Evidence, evidence, evidence_rows, law_rows, map_rows
from robocov_app.replication.figures import FIGURES, describe_figure, draw_figure
from robocov_app.replication.outcomes import Scenario
from robocov_app.replication.plan import FULL, ROBOTS, TEAM, Plan
from robocov_app.replication.plots import WORDS, beyond_plots, paper_plots
from robocov_app.replication.results import BeyondResults, FigureRun, PaperResults
from robocov_app.replication.step_times import BLOCK, MAP
from robocov_app.replication.svg import Strip, interval_bar, strips
from robocov_app.replication.verdicts import LEAST_MAPS, Claim, amount, described, verdict_counts
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.pictures import run_picture
from robocov_app.report.replay import asset, replay_css, replay_js, replay_part, script
from robocov_app.report.theme_css import theme_rules
from robocov_app.sweep.study import UNITS
from robocov_app.terminal.output import finite
from robocov_app.terminal.progress import progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE, BEYOND_PAGE, CLAIMS = "index.html", "beyond.html", "claims.json"

_REPLAY_BUDGET = 400_000
"""Bytes of the runs in the page's replay."""

_CASES = {"convex": "Figure 2", "a": "Figure 4", "b": "Figure 6", "other": "Figure 8"}
"""Which figure shows which runs."""

_QUESTION_NAMES = ("Convex regions", "RAPF and RPF", "Gains", "Starts", "Lloyd's algorithm", "Optimum")
"""What the questions are called in the page's contents."""

_EXTENSIONS = (
    ("targets", ("beyond-heights", "beyond-targets"), ("targets",)),
    ("density", ("beyond-density",), ("density",)),
    ("teams", ("beyond-teams",), ("teams-rapf", "teams-lloyd")),
    ("conditions", ("beyond-conditions",), ("conditions",)),
)
"""The parts of the extensions: name, figures, claims."""

_UNIT = re.compile(r"(?<=\d) (?=(?:%|m|s|m²|m³|N)(?![\w³²]))")


class Image(NamedTuple):
    """A picture in the page: the name of its files in ``figures/``, its size in px, and what it shows."""

    name: str
    width: int
    height: int
    words: str


def save_claims(folder: Path, found: Sequence[Claim]) -> None:
    """Write ``claims.json``: claims with verdict, estimate, interval, runs, ...; may raise OutputError."""
    text = json.dumps([finite(claim.to_json()) for claim in found], indent=1, ensure_ascii=False)
    _write(folder / CLAIMS, text + "\n")


def save_paper_figures(
    folder: Path, runs: Mapping[str, FigureRun], first: Record, results: PaperResults | None, *, quiet: bool
) -> dict[str, Image]:
    """Write the paper's figures to ``figures/``, and the plots of the claims; may raise OutputError.

    The first moment of `first` is figure 1; without `results` there are no claims.
    """

    def drawn(theme: str) -> dict[str, Callable[[], Figure]]:
        def of(number: int) -> Callable[[], Figure]:
            return lambda: draw_figure(number, runs, first, theme)

        figures = {f"figure-{each.number}": of(each.number) for each in FIGURES}
        return figures if results is None else {**figures, **paper_plots(results, theme)}

    words = {
        f"figure-{each.number}": f"{each.shows} {describe_figure(each.number, runs, first)}"
        for each in FIGURES
    }
    return _save_figures(folder, drawn, words, quiet=quiet)


def save_beyond_figures(folder: Path, results: BeyondResults, *, quiet: bool) -> dict[str, Image]:
    """Write the figures beyond the paper to ``figures/``; may raise OutputError."""
    return _save_figures(folder, lambda theme: beyond_plots(results, theme), {}, quiet=quiet)


def _save_figures(
    folder: Path,
    drawn: Callable[[str], Mapping[str, Callable[[], Figure]]],
    words: Mapping[str, str],
    *,
    quiet: bool,
) -> dict[str, Image]:
    """Write figures as PNG, SVG and PDF, and as PNG for dark pages."""
    target = folder / "figures"
    try:
        target.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be used for results: {error.strerror or error}") from error
    light, dark = drawn("light"), drawn("dark")
    found: dict[str, Image] = {}
    with progress("figures", len(light), quiet=quiet) as update:
        for number, (name, draw) in enumerate(light.items(), start=1):
            figure = draw()
            for suffix in ("png", "svg", "pdf"):
                save_figure(figure, target / f"{name}.{suffix}")
            save_figure(dark[name](), target / f"{name}-dark.png")
            size = round(figure.bbox.width), round(figure.bbox.height)
            found[name] = Image(name, *size, words.get(name) or WORDS[name])
            update(number)
    return found


def save_paper_page(folder: Path, *content: Any) -> None:
    """Write ``index.html``, which needs nothing but ``figures/`` beside it; may raise OutputError.

    The parameters are those of `paper_page`.
    """
    _write(folder / PAGE, paper_page(*content))


def save_beyond_page(folder: Path, images: Mapping[str, Image], results: BeyondResults) -> None:
    """Write ``beyond.html``, which needs nothing but ``figures/`` beside it; may raise OutputError."""
    _write(folder / BEYOND_PAGE, beyond_page(images, results))


def paper_page(
    plan: Plan,
    images: Mapping[str, Image],
    runs: Mapping[str, FigureRun],
    first: Record,
    results: PaperResults | None,
    paper: Sequence[Claim],
    beyond: Sequence[Claim] = (),
) -> str:
    """Return ``index.html``; `beyond` are the claims that are told in full on the page beyond the paper."""
    replays = [
        ReplayRun(run.record, run.history, f"{_CASES[name.partition('/')[0]]}: {run.record.label}")
        for name, run in runs.items()
    ]
    order = list(runs)
    panes = [order.index("b/rapf"), order.index("b/rpf")]
    context: dict[str, Any] = {
        "results": results,
        "runs": len(runs),
        "claims": paper,
        "beyond": beyond,
        "figures": [
            (each, images[f"figure-{each.number}"], describe_figure(each.number, runs, first))
            for each in FIGURES
        ],
        "replay": Markup(replay_part(replays, panes, _REPLAY_BUDGET)),
        "replay_script": Markup(script(replay_js() + "startReplays();")),
        "question_names": _QUESTION_NAMES,
        "questions": [
            (
                number,
                text,
                own,
                next((images[name] for name in images if name.startswith(f"claim-{number}-")), None),
            )
            for number, text in claims.QUESTIONS.items()
            if (own := [claim for claim in paper if claim.part == number])
        ],
        "settled": (SETTLED_DISTANCE, SETTLED_WINDOW),
        "versions": versions(),
        "resamples": RESAMPLES,
        "least_maps": LEAST_MAPS,
        "all_bundled": len(plan.bundled) == len(maps.NON_CONVEX),
    }
    if results is not None:
        gap = results.claims.measured("gap", "rapf-shared").of("rapf-shared", "gap")
        context |= {
            "best": {each.key: each for each in results.contenders},
            "maps_in_all": len({*results.claims.maps}) + len({*results.convex.maps}) + len(plan.tuning),
            "laws": law_rows(results.claims),
            "maps": map_rows(results.claims, results.references),
            "failures": [
                (scenario, _picture(record), _paper_failure(results, scenario, len(record.team)))
                for scenario, record in results.worst
            ],
            "above": [float((gap > bound).mean()) for bound in (0.25, 0.5, 1.0)],
        }
    return _rendered("paper.html.jinja", plan, context)


def beyond_page(images: Mapping[str, Image], results: BeyondResults) -> str:
    """Return ``beyond.html``."""
    plan = results.plan
    found = beyond_claims.beyond_claims(results)
    goals = beyond_claims.beyond_goals(results)
    rows = evidence_rows(results.outcomes, results.contenders, results.steps)
    each = evidence(results, rows)
    tuned = bool(plan.beyond.tuning)
    context: dict[str, Any] = {
        "results": results,
        "ours": contenders.OWN[0].label,
        "goals": goals,
        "goal_words": beyond_claims.goal_counts(goals),
        "unseen": beyond_claims.beyond_unseen(results),
        "questions": beyond_claims.QUESTIONS,
        "goal_claims": [claim for claim in found if claim.part == beyond_claims.GOALS],
        "rival_claims": [claim for claim in found if claim.part == beyond_claims.RIVALS],
        "rows": rows,
        "controllers": [(one, _strips(one, each)) for one in each],
        "failures": [
            (scenario, _picture(record), _beyond_failure(results, scenario))
            for scenario, record in results.worst
        ],
        "images": images,
        "parts": {
            name: (
                [images[figure] for figure in figures if figure in images],
                [claim for claim in found if claim.key in keys],
            )
            for name, figures, keys in _EXTENSIONS
        },
        "tuned": tuned,
        "tuning": plan if tuned else FULL,
        "grids": contenders.GRIDS,
        "seeds": {"rivals": plan.beyond.seeds}
        | {law.label: plan.beyond.seeds_of(law.controller) for law in contenders.OWN},
        "always": studies.ALWAYS,
        "units": UNITS,
        "groups": studies.GROUPS,
        "timed": {"map": MAP, "block": BLOCK},
    }
    return _rendered("beyond.html.jinja", plan, context)


def _rendered(template: str, plan: Plan, context: Mapping[str, Any]) -> str:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_unbroken,
    )
    environment.filters |= {"span": span, "g": "{:g}".format, "amount": amount, "unbroken": _unbroken_markup}
    environment.globals |= {
        "bar": interval_bar,
        "amount": amount,
        "described": described,
        "counts": verdict_counts,
        "t": claims,
        "contender": contenders,
        "map_rules": maps,
    }
    style = (
        theme_rules(":root") + replay_css() + asset("report.css") + (ASSETS / "paper.css").read_text("utf-8")
    )
    return environment.get_template(template).render(
        version=__version__,
        style=Markup(style),
        plan=plan,
        quick=plan.name == "quick",
        team=TEAM,
        robots=ROBOTS,
        page=PAGE,
        beyond_page=BEYOND_PAGE,
        **context,
    )


def span(numbers: Sequence[int]) -> str:
    """Return whole numbers, those in a row by their ends.

    >>> span((1, 2, 3)), span((5,)), span((1, 3))
    ('1 to 3', '5', '1, 3')
    """
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(number) for number in numbers)


def _unbroken(value: object) -> object:
    """Return a text in which no line breaks between a number and its unit."""
    if isinstance(value, str) and not hasattr(value, "__html__"):
        return _UNIT.sub("\N{NO-BREAK SPACE}", value)
    return value


def _unbroken_markup(value: Markup) -> Markup:
    return Markup(_UNIT.sub("\N{NO-BREAK SPACE}", str(value)))


def _write(path: Path, text: str) -> None:
    with written(path) as part:
        part.write_text(text, encoding="utf-8")


def _picture(record: Record) -> Markup:
    return Markup(run_picture(record, None, 300, 240, numbers=True))


def _paper_failure(results: PaperResults, scenario: Scenario, robots: int) -> str:
    """Return in words how RAPF and the others did in a scenario."""
    outcomes = results.claims
    k = outcomes.scenarios.index(scenario)
    gaps = ", ".join(
        f"{label} {amount(float(outcomes.of(law, 'gap')[k]), '%')}"
        for law, label in (("rapf-best", "at its best gains"), ("lloyd", "LA"), ("rpf-shared", "RPF"))
    )
    return (
        f"{amount(float(outcomes.of('rapf-shared', 'gap')[k]), '%')} above the reference ({gaps}); "
        f"{outcomes.of('rapf-shared', 'stuck')[k]:.0f} of {robots} robots rest away from their goals."
    )


def _beyond_failure(results: BeyondResults, scenario: Scenario) -> str:
    """Return in words how ours and the paper's contenders did in a scenario."""
    outcomes = results.outcomes
    k = outcomes.scenarios.index(scenario)
    others = ", ".join(
        f"{law.label} {amount(float(outcomes.of(law.key, 'gap')[k]), '%')}"
        for law in results.contenders
        if law.key in ("rapf-best", "rapf-default", "lloyd")
    )
    gap = amount(float(outcomes.of(contenders.OURS[0], "gap")[k]), "%")
    return f"{gap} above the reference ({others})."


def _strips(one: Evidence, each: Sequence[Evidence]) -> Markup:
    """Return the medians map by map of a controller above those of ours, or of ours above RAPF's."""
    highest = max((max(other.maps.values()) for other in each if other.maps), default=0.0)
    first = contenders.OURS[0]
    beside = "rapf" if one.best.controller == first else first
    rows = [one, *(other for other in each if other.best.controller == beside and other is not one)]
    return strips([Strip(row.best.law.label, row.best.ours, row.maps) for row in rows], highest)
