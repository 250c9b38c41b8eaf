"""Writing the figures of the study, as PNG, SVG and PDF, in light and dark."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

from robocov.files.result_folder import report_folder_errors
from robocov.record import Record
from robocov_app.figures.files import save_figure
from robocov_app.replication.figures.beyond_plots import prepare_beyond_plots
from robocov_app.replication.figures.claim_plots import prepare_paper_plots
from robocov_app.replication.figures.comparison_plots import Draw, Plots
from robocov_app.replication.figures.paper_figures import (
    CAPTIONS,
    FIGURES_OF_VARIANTS,
    HALF_STEP,
    describe_figure,
    describe_half_step,
    draw_figure,
    name_figure,
)
from robocov_app.replication.results.study_results import BeyondResults, FigureRuns, PaperResults
from robocov_app.terminal.progress import show_progress

FIGURES_FOLDER = "figures"
_SUFFIXES = ("png", "svg", "pdf")


class FigureFile(NamedTuple):
    """A written figure that a page shows."""

    name: str
    """Name of its files in ``figures/``."""
    width: int
    """px"""
    height: int
    """px"""
    description: str
    """Caption, followed by the findings."""
    findings: str = ""
    """Observations, in sentences; empty for plots."""


def save_paper_figures(
    folder: Path,
    runs: FigureRuns,
    partition_run: Record,
    results: PaperResults | None,
    *,
    quiet: bool,
) -> dict[str, FigureFile]:
    """Write the paper's figures and the plots of its claims.

    Parameters
    ----------
    folder : Path
        Folder of the study.
    runs : dict
        Runs of the figures by variant and "case/controller".
    partition_run : Record
        The run whose first frame is figure 1.
    results : PaperResults or None
        Without them, no plots are written.
    quiet : bool
        Whether to show no progress.

    Returns
    -------
    dict
        Figures by name.
    """
    runs_by_figure = {}
    for variant, variant_runs in runs.items():
        for number in FIGURES_OF_VARIANTS[variant]:
            runs_by_figure[name_figure(number, variant)] = (number, variant_runs)

    def prepare_plots(theme: str) -> Plots:
        plots: dict[str, Draw] = {}
        for name, (number, figure_runs) in runs_by_figure.items():
            plots[name] = partial(draw_figure, number, figure_runs, partition_run, theme)
        if results is not None:
            plots.update(prepare_paper_plots(results, theme))
        return plots

    findings = {
        name: describe_figure(number, figure_runs, partition_run)
        for name, (number, figure_runs) in runs_by_figure.items()
    }
    if HALF_STEP in runs:
        findings[name_figure(4, HALF_STEP)] += f" {describe_half_step(runs[''], runs[HALF_STEP])}"
    return _save_figures(folder, prepare_plots, findings, quiet=quiet)


def save_beyond_figures(folder: Path, results: BeyondResults, *, quiet: bool) -> dict[str, FigureFile]:
    """Write the plots beyond the paper, and return them by name."""
    return _save_figures(folder, partial(prepare_beyond_plots, results), {}, quiet=quiet)


def _save_figures(
    folder: Path, prepare_plots: Callable[[str], Plots], findings: Mapping[str, str], *, quiet: bool
) -> dict[str, FigureFile]:
    """Write all plots in the light theme, in all formats, and in the dark theme as PNG.

    Parameters
    ----------
    folder : Path
        Folder of the study.
    prepare_plots : callable
        Takes the name of a theme, and returns the plots by name.
    findings : Mapping
        Observations by the name of the plot.
    quiet : bool
        Whether to show no progress.
    """
    target = folder / FIGURES_FOLDER
    with report_folder_errors(target):
        target.mkdir(exist_ok=True)
    light = prepare_plots("light")
    dark = prepare_plots("dark")
    files: dict[str, FigureFile] = {}
    with show_progress("figures", len(light), quiet=quiet) as update:
        for number, (name, draw) in enumerate(light.items(), start=1):
            figure = draw()
            for suffix in _SUFFIXES:
                save_figure(figure, target / f"{name}.{suffix}")
            save_figure(dark[name](), target / f"{name}-dark.png")
            figure_findings = findings.get(name, "")
            files[name] = FigureFile(
                name,
                width=round(figure.bbox.width),
                height=round(figure.bbox.height),
                description=f"{CAPTIONS[name]} {figure_findings}".rstrip(),
                findings=figure_findings,
            )
            update(number)
    return files
