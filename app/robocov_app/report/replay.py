"""The interactive replay of runs as self-contained HTML, for reports and notebooks."""

from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files

from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.report.embedding import MAX_BYTES, ReplayRun, embed_replay, format_script_json
from robocov_app.report.pictures import draw_run
from robocov_app.report.theme_css import build_theme_rules

MAX_PANES = 4
"""Maximum number of runs side by side."""
_SCRIPTS = ("data.js", "arena.js", "chart.js", "replay.js")
_STILL_SIZE_PX = (560, 460)


def build_replay_html(runs: Sequence[ReplayRun]) -> str:
    """Build a replay as an HTML fragment with its own style and script.

    It needs no network, defines no global names and has no ids, so a page can contain several replays. On
    paper, and where scripts are disabled, it shows pictures of the final positions.

    Parameters
    ----------
    runs : sequence of ReplayRun
        Runs that the reader can choose. The first `MAX_PANES` are shown side by side at first.

    Returns
    -------
    str
    """
    style = build_theme_rules(".robocov-replay") + read_replay_css()
    code = wrap_script(f"{read_replay_js()}startReplays();")
    return f"<style>{style}</style>{build_replay_element(runs)}<script>{code}</script>"


def build_replay_element(
    runs: Sequence[ReplayRun], panes: Sequence[int] | None = None, max_bytes: int = MAX_BYTES
) -> str:
    """Build a replay for a page that contains the results of `read_replay_css` and `read_replay_js` once.

    Parameters
    ----------
    runs : sequence of ReplayRun
    panes : sequence of int, optional
        Indices of the runs that are shown at first.
    max_bytes : int
        Maximum size of the data of the runs.

    Returns
    -------
    str
    """
    if panes is None:
        panes = range(min(len(runs), MAX_PANES))
    data = embed_replay(runs, _choose_styles(runs), panes, max_bytes)
    stills = "".join(_build_still(runs[pane]) for pane in panes)
    return (
        f'<div class="robocov-replay"><div class="stills">{stills}</div>'
        f'<script type="application/json">{format_script_json(data)}</script></div>'
    )


def _choose_styles(runs: Sequence[ReplayRun]) -> list[CurveStyle]:
    """Choose the style of each run; runs with the same controller and gains have the same style."""
    keys = [(run.record.controller, tuple(run.record.gains.items())) for run in runs]
    different_keys = list(dict.fromkeys(keys))
    different_styles = choose_curve_styles([controller for controller, _ in different_keys])
    styles = dict(zip(different_keys, different_styles, strict=True))
    return [run.style or styles[key] for run, key in zip(runs, keys, strict=True)]


def _build_still(run: ReplayRun) -> str:
    """Build a figure with the title of a run and a picture of its final positions."""
    picture = draw_run(run.record, run.history, *_STILL_SIZE_PX, has_numbers=True)
    return f"<figure><figcaption><strong>{escape(run.title)}</strong></figcaption>{picture}</figure>"


def read_replay_css() -> str:
    """Return the style of replays without the colors, for which see `build_theme_rules`."""
    return read_asset("picture.css") + read_asset("replay.css")


def read_replay_js() -> str:
    """Return the definitions of the replay script; to run it, add ``startReplays()`` and `wrap_script`."""
    return "".join(read_asset(name) for name in _SCRIPTS)


def wrap_script(content: str) -> str:
    """Wrap a script so that its names are not visible to the rest of the page."""
    return f'(() => {{\n"use strict";\n{content}\n}})();'


@cache
def read_asset(name: str) -> str:
    """Return the text of a file in the folder ``assets``."""
    return files("robocov_app.report").joinpath("assets", name).read_text(encoding="utf-8")
