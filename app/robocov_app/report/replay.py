"""The interactive replay of runs, as HTML that needs nothing else: in reports and in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files

from robocov.errors import ParameterError
from robocov_app.figures.styles import styles_of
from robocov_app.report.embedding import BUDGET, ReplayRun, embedded, script_json
from robocov_app.report.pictures import run_picture
from robocov_app.report.theme_css import theme_rules

MOST_PANES = 4  # runs side by side

_SCRIPTS = ("data.js", "arena.js", "chart.js", "replay.js")


def replay_html(
    runs: Sequence[ReplayRun], *, standalone: bool, panes: Sequence[int] | None = None, budget: int = BUDGET
) -> str:
    """Return runs as HTML in which they can be watched side by side.

    It asks for no network, defines no global name and has no ids: several may stand on one page. Where
    scripts do not run (and on paper) it shows pictures of the last moments. `standalone`: a whole page; else
    a fragment with its own style and script, for a notebook. `panes`: the runs to be shown at first.
    `budget`: bytes that the runs may take; beyond, they hold fewer moments a second.
    """
    content = replay_part(runs, panes, budget)
    style = theme_rules(".robocov-replay") + replay_css()
    fragment = f"<style>{style}</style>{content}<script>{script(replay_js() + 'startReplays();')}</script>"
    if not standalone:
        return fragment
    title = escape(runs[0].title)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width">'
        f"<style>{theme_rules(':root')}body{{margin:16px;background:var(--rc-background)}}</style></head>"
        f"<body><main>{fragment}</main></body></html>\n"
    )


def replay_part(runs: Sequence[ReplayRun], panes: Sequence[int] | None = None, budget: int = BUDGET) -> str:
    """Return a replay without style and script, for a page that has `replay_css` and `replay_js` once."""
    if not runs:
        raise ParameterError("replay: no runs were given, but at least one was wanted")
    shown = list(range(len(runs)))[:MOST_PANES] if panes is None else list(panes)
    # runs of one controller with the same gains look the same
    keys = [(run.record.controller, tuple(run.record.gains.items())) for run in runs]
    order = list(dict.fromkeys(keys))
    own = dict(zip(order, styles_of([controller for controller, _ in order]), strict=True))
    styles = [run.style or own[key] for run, key in zip(runs, keys, strict=True)]
    data = embedded(runs, styles, shown, budget)
    stills = "".join(
        f"<figure><figcaption><strong>{escape(runs[k].title)}</strong></figcaption>"
        f"{run_picture(runs[k].record, runs[k].history, 560, 460, numbers=True)}</figure>"
        for k in shown
    )
    return (
        f'<div class="robocov-replay"><div class="stills">{stills}</div>'
        f'<script type="application/json">{script_json(data)}</script></div>'
    )


def replay_css() -> str:
    """Return the style of replays and pictures; `theme_rules` gives it colours."""
    return asset("picture.css") + asset("replay.css")


def replay_js() -> str:
    """Return the definitions of the replay's script, to be run by ``startReplays()``, in a `script`."""
    return "".join(asset(name) for name in _SCRIPTS)


def script(content: str) -> str:
    """Return a script whose names nobody else sees."""
    return f'(() => {{\n"use strict";\n{content}\n}})();'


@cache
def asset(name: str) -> str:
    """Return the text of a file that pages are made of."""
    return files("robocov_app.report").joinpath("assets", name).read_text(encoding="utf-8")
