"""The results as files: figures, ``claims.json`` and the two pages, ``index.html`` and ``beyond.html``."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from markupsafe import Markup

from robocov import __version__
from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import replace_file
from robocov.metrics import SETTLED_DISTANCE_M, SETTLED_WINDOW_S
from robocov.record import Record, list_versions
from robocov.text import escape_controls
from robocov_app.figures.files import save_figure
from robocov_app.figures.statistics import RESAMPLES
from robocov_app.replication import claims, contenders, evidence, figures, step_times, studies
from robocov_app.replication.claims import Claim, Criterion, amount, described, verdict_counts
from robocov_app.replication.contenders import ASSETS, LABELS, OURS
from robocov_app.replication.evidence import Evidence
from robocov_app.replication.outcomes import Outcomes, Scenario
from robocov_app.replication.plan import FULL, NON_CONVEX, ROBOTS, TEAM, UNSEEN, Plan
from robocov_app.replication.results import BeyondResults, FigureRun, PaperResults
from robocov_app.report.pictures import run_picture
from robocov_app.report.replay import ReplayRun, asset, replay_css, replay_js, replay_part, script
from robocov_app.report.theme_css import theme_rules
from robocov_app.sweep.parameters import UNITS
from robocov_app.terminal.output import replace_non_finite
from robocov_app.terminal.progress import show_progress

PAGE, BEYOND_PAGE, CLAIMS = "index.html", "beyond.html", "claims.json"

_REPLAY_BUDGET = 400_000  # bytes of the runs in the page's replay
_CASES = {"convex": "Figure 2", "a": "Figure 4", "b": "Figure 6", "other": "Figure 8"}  # which shows what
_TICKS = (0.0, 0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)  # of the axis of gaps
_UNIT = re.compile(r"(?<=\d) (?=(?:%|m|s|m²|m³|N|J)(?![\w³²]))")


class Image(NamedTuple):
    """A picture in the page: files' name in ``figures/``, size in px, what it shows, what is seen there."""

    name: str
    width: int
    height: int
    words: str
    seen: str = ""


def save(path: Path, text: str) -> None:
    with replace_file(path) as part:
        part.write_text(text, encoding="utf-8")


def save_claims(folder: Path, found: Sequence[Claim]) -> None:
    text = json.dumps([replace_non_finite(claim.to_json()) for claim in found], indent=1, ensure_ascii=False)
    save(folder / CLAIMS, text + "\n")


def save_paper_figures(
    folder: Path, runs: Mapping[str, FigureRun], first: Record, results: PaperResults | None, *, quiet: bool
) -> dict[str, Image]:
    """Write the paper's figures to ``figures/``, and the plots of the claims, without `results` none."""

    shown = {f"figure-{k}": (k, runs, first) for k in figures.FIGURES}
    if results is not None:
        shown |= {f"figure-{k}-best": (k, results.best_figures, first) for k in figures.BEST}

    def drawn(theme: str) -> figures.Plots:
        own = {name: partial(figures.draw_figure, *each, theme) for name, each in shown.items()}
        return own if results is None else {**own, **figures.paper_plots(results, theme)}

    seen = {name: figures.describe_figure(*each) for name, each in shown.items()}
    return _save_figures(folder, drawn, seen, quiet=quiet)


def save_beyond_figures(folder: Path, results: BeyondResults, *, quiet: bool) -> dict[str, Image]:
    return _save_figures(folder, partial(figures.beyond_plots, results), {}, quiet=quiet)


def _save_figures(
    folder: Path, drawn: Callable[[str], figures.Plots], seen: Mapping[str, str], *, quiet: bool
) -> dict[str, Image]:
    target = folder / "figures"
    with report_folder_errors(target):
        target.mkdir(exist_ok=True)
    light, dark = drawn("light"), drawn("dark")
    found: dict[str, Image] = {}
    with show_progress("figures", len(light), quiet=quiet) as update:
        for number, (name, draw) in enumerate(light.items(), start=1):
            figure = draw()
            for suffix in ("png", "svg", "pdf"):
                save_figure(figure, target / f"{name}.{suffix}")
            save_figure(dark[name](), target / f"{name}-dark.png")
            told = seen.get(name, "")
            words, box = f"{figures.CAPTIONS[name]} {told}".rstrip(), figure.bbox
            found[name] = Image(name, round(box.width), round(box.height), words, told)
            update(number)
    return found


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
    panes = [list(runs).index(name) for name in ("b/rapf", "b/rpf")]
    context: dict[str, Any] = {
        "results": results,
        "runs": len(runs),
        "claims": paper,
        "beyond": beyond,
        "images": images,
        "figures": [
            (number, figures.CAPTIONS[name], images[name], images.get(f"{name}-best"))
            for number, name in ((number, f"figure-{number}") for number in figures.FIGURES)
        ],
        "replay": Markup(replay_part(replays, panes, _REPLAY_BUDGET)),
        "replay_script": Markup(script(f"{replay_js()}startReplays();")),
        "versions": list_versions(),
        "all_bundled": len(plan.bundled) == len(NON_CONVEX),
    }
    if results is not None:
        outcomes, best = results.claims, {each.key: each for each in results.contenders}
        gap = outcomes.measured("gap", "rapf-shared").of("rapf-shared", "gap")
        medians = {law: outcomes.median_by_map(law) for law in LABELS}
        others = {"rapf-best": "at its best gains", "lloyd": "LA", "rpf-shared": "RPF"}
        context |= {
            "best": best,
            "maps_in_all": len({*outcomes.maps}) + len({*results.convex.maps}) + len(plan.tuning),
            "laws": evidence.law_rows(outcomes, [best[key] for key in LABELS if key in best], plan.duration),
            "maps": {
                name: {law: gaps[name] for law, gaps in medians.items() if name in gaps}
                for name in dict.fromkeys(outcomes.maps)
            },
            "failures": _failures(results.worst, outcomes, "rapf-shared", others),
            "above": [float((gap > bound).mean()) for bound in (0.25, 0.5, 1.0)],
        }
    return _rendered("paper.html.jinja", plan, context)


def beyond_page(images: Mapping[str, Image], results: BeyondResults) -> str:
    found, rows = claims.beyond_claims(results), evidence.ranked_rows(results)
    each, tuned = evidence.evidence(results, rows), bool(results.plan.beyond.tuning)
    goal_claims = [claim for claim in found if claim.part == claims.GOALS]
    beside = ("rapf-best", "rapf-default", "lloyd")
    others = {law.key: law.label for law in results.contenders if law.key in beside}
    context: dict[str, Any] = {
        "results": results,
        "found": found,
        "goals": [claim for claim in goal_claims if claim.key != "goal-unseen"],
        "unseen": next((claim for claim in found if claim.key == "goal-unseen"), None),
        "goal_claims": goal_claims,
        "rival_claims": [claim for claim in found if claim.part == claims.RIVALS],
        "rows": rows,
        "conditions": evidence.conditions_rows(results, rows),
        "captions": figures.CAPTIONS,
        "controllers": [(one, _strips(one, each)) for one in each],
        "failures": _failures(results.worst, results.outcomes, OURS[0], others),
        "images": images,
        "tuned": tuned,
        "unseen_families": UNSEEN,
        "tuning": results.plan if tuned else FULL,
    }
    return _rendered("beyond.html.jinja", results.plan, context)


def _failures(
    worst: Sequence[tuple[Scenario, Record]], outcomes: Outcomes, law: str, others: Mapping[str, str]
) -> list[tuple[Scenario, Markup, str]]:
    """Return runs with their pictures, and how far they and those of `others`, labels by key, ended above."""
    found = []
    for scenario, record in worst:
        k = outcomes.scenarios.index(scenario)
        gaps = {key: amount(outcomes.of(key, "gap")[k], "%") for key in (law, *others)}
        beside = ", ".join(f"{label} {gaps[key]}" for key, label in others.items())
        words = f"{gaps[law]} above the reference ({beside})"
        if law not in OURS:
            stuck = outcomes.of(law, "stuck")[k]
            words += f"; {stuck:.0f} of {len(record.team)} robots rest away from their goals"
        found.append((scenario, Markup(run_picture(record, None, 300, 240, numbers=True)), f"{words}."))
    return found


def _rendered(template: str, plan: Plan, context: Mapping[str, Any]) -> str:
    import jinja2

    loader, undefined = jinja2.FileSystemLoader(ASSETS), jinja2.StrictUndefined
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=undefined, finalize=_unbroken)
    environment.filters.update(span=span, g="{:g}".format, amount=amount)
    environment.filters["hundredths"] = lambda value: f"{value:.2f}" if math.isfinite(value) else "–"
    environment.filters["unbroken"] = lambda text: Markup(_unbroken(str(text)))
    known = environment.globals.update
    known(t=claims, contender=contenders, studies=studies, timing=step_times)
    known(bar=interval_bar, amount=amount, described=described, counts=verdict_counts)
    known(account_of=evidence.account_of, units=UNITS, team=TEAM, robots=ROBOTS)
    known(settled=(SETTLED_DISTANCE_M, SETTLED_WINDOW_S), resamples=RESAMPLES)
    known(page=PAGE, beyond_page=BEYOND_PAGE, version=__version__, plan=plan, quick=plan.name == "quick")
    own = (ASSETS / "paper.css").read_text("utf-8")
    style = Markup(theme_rules(":root") + replay_css() + asset("report.css") + own)
    return escape_controls(environment.get_template(template).render(style=style, **context))


def span(numbers: Sequence[int]) -> str:
    """Return whole numbers, those in a row by their ends: "1 to 3"."""
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(number) for number in numbers)


def _unbroken(value: Any) -> Any:
    return _UNIT.sub("\N{NO-BREAK SPACE}", value) if type(value) is str else value


def _strips(one: Evidence, each: Sequence[Evidence]) -> Markup:
    highest = max((max(other.maps.values()) for other in each if other.maps), default=0.0)
    beside = "rapf" if one.account.controller == OURS[0] else OURS[0]
    rows = [one, *(other for other in each if other.account.controller == beside)]
    parts = [Strip(row.rows[0].contender.label, row.account.controller in OURS, row.maps) for row in rows]
    return strips(parts, highest)


def interval_bar(criterion: Criterion) -> Markup:
    """Return an SVG element: the wanted range shaded, the interval a line, the estimate a mark."""
    interval, wide, edge = criterion.interval, 320.0, 14.0
    known = [*filter(math.isfinite, (interval.estimate, interval.low, interval.high))]
    ends = [*filter(math.isfinite, (criterion.low, criterion.high))]
    if not known or not ends:
        return Markup("")
    low, high = min(known + ends), max(known + ends)
    room = 0.18 * (high - low) if high > low else max(0.1 * abs(high), 0.01)
    low, high = max(low - room, 0.0 if criterion.unit == "%" and low >= 0.0 else -math.inf), high + room

    def at(value: float) -> float:
        part = (min(max(value, low), high) - low) / (high - low)
        return round(edge + part * (wide - 2 * edge), 1)

    begin, end = at(criterion.low), at(criterion.high)
    parts = [f'<rect class="wanted" x="{begin}" y="4" width="{round(end - begin, 1)}" height="26" rx="3"/>']
    parts.append(f'<path class="axis" d="M{edge} 30H{wide - edge}"/>')
    near = len(ends) == 2 and end - begin < 40.0  # their numbers then stand aside
    for value, anchor in zip(ends, ("end", "start"), strict=False):
        parts.append(f'<path class="bound" d="M{at(value)} 4V34"/>')
        aside = f' style="text-anchor: {anchor}"' if near else ""
        parts.append(f'<text x="{at(value)}" y="43"{aside}>{amount(value, criterion.unit)}</text>')
    state = {True: "yes", False: "no", None: "open"}[criterion.met]
    if math.isfinite(interval.low):
        parts.append(f'<path class="interval {state}" d="M{at(interval.low)} 17.0H{at(interval.high)}"/>')
    parts.append(f'<circle class="estimate {state}" cx="{at(interval.estimate)}" cy="17.0" r="5.5"/>')
    return _svg("bar", wide, 44.0, f"{criterion.found}; wanted: {criterion.wanted}", parts)


class Strip(NamedTuple):
    """A row of dots: the median gap on each map; `ours` stands out."""

    label: str
    ours: bool
    maps: Mapping[str, float]


def strips(rows: Sequence[Strip], highest: float) -> Markup:
    """Return an SVG element: a dot for each map, on an axis of square roots up to the `highest` of all."""
    rows = [row for row in rows if row.maps]
    if not rows:
        return Markup("")
    wide, left, right, tall, name_height = 440.0, 12.0, 16.0, 40.0, 13.0
    highest, lowest = max(highest, 0.01), min(0.0, *(min(row.maps.values()) for row in rows))
    begin, end = _root(lowest), _root(highest)

    def at(value: float) -> float:
        part = (_root(value) - begin) / (end - begin)
        return round(left + min(max(part, 0.0), 1.0) * (wide - left - right), 1)

    bottom = tall * len(rows) + 22.0
    parts, words, last = [], [], -math.inf
    for tick in _TICKS:
        x = at(tick)
        if tick <= highest and x - last >= 36.0:
            last = x
            parts.append(f'<path class="grid" d="M{x} 0V{tall * len(rows)}"/>')
            parts.append(f'<text class="tick" x="{x}" y="{bottom - 6}">{amount(tick, "%")}</text>')
    for number, row in enumerate(rows):
        top, kind, label = tall * number, "ours" if row.ours else "other", escape(row.label)
        parts.append(f'<text class="name" x="{left - 4}" y="{top + name_height - 2}">{label}</text>')
        middle = top + name_height + (tall - name_height) / 2
        ranked = sorted(row.maps.items(), key=lambda item: item[1])
        for k, (name, value) in enumerate(ranked):
            y = round(middle + 7.0 * ((k * 5 % 8) / 7.0 - 0.5) * 2.0, 1)
            title = f"<title>{escape(name)}: {amount(value, '%')}</title>"
            parts.append(f'<circle class="{kind}" cx="{at(value)}" cy="{y}" r="3">{title}</circle>')
        half = ranked[(len(ranked) - 1) // 2][1] / 2 + ranked[len(ranked) // 2][1] / 2
        parts.append(f'<path class="middle" d="M{at(half)} {middle - 11}V{middle + 11}"/>')
        words.append(f"{label}: {amount(ranked[0][1], '%')} to {amount(ranked[-1][1], '%')}")
    most = max(len(row.maps) for row in rows)
    return _svg("strips", wide, bottom, f"Median gap on each of {most} maps. {'; '.join(words)}", parts)


def _svg(kind: str, wide: float, tall: float, words: str, parts: Sequence[str]) -> Markup:
    head = f'<svg class="{kind}" viewBox="0 0 {wide:g} {tall:g}" role="img" aria-label="{words}">'
    return Markup(f"{head}{''.join(parts)}</svg>")


def _root(value: float) -> float:
    return math.copysign(math.sqrt(abs(value)), value)
