"""Comparison of controllers that start from the same positions on the same map."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from robocov.controllers import Controller, IndividualController
from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_LATTICE
from robocov.drawing import Drawable
from robocov.environment import Environment
from robocov.errors import ParameterError, quote
from robocov.metrics import CostHistory, compute_cost_history, compute_relative_excess, summarize
from robocov.optional_imports import import_optional
from robocov.record import Record
from robocov.scenario.scenario import Scenario, require_scenario_options

DEFAULT_CONTROLLERS = ("rapf", "rpf", "lloyd")
"""The controllers of the paper."""
_MEAN_TIME_TITLE = "mean time"
"""Title of the column that only teams with different speeds have."""
_COLUMNS = {
    "": "{label}",
    "mean distance": "{mean_distance_m:.3f} m",
    _MEAN_TIME_TITLE: "{mean_time_s:.3f} s",
    "above best": "{above_best:.1%}",
    "cost": "{cost_m3:.2f} m³",
    "settled": "{settled}",
    "contacts": "{contacts}",
    "clearance": "{min_clearance_m:z.3f} m",
    "path length": "{mean_path_length_m:.2f} m",
}
"""Titles of the printed table's columns, with the formats of their cells; the first column has no title."""


@dataclass(frozen=True, eq=False)
class Comparison(Drawable):
    """Runs of several controllers in the same scenario.

    Attributes
    ----------
    records : mapping of str to Record
        The runs, by the labels of the controllers.
    histories : mapping of str to CostHistory
        The coverage cost over each run.

    See Also
    --------
    compare : Run several controllers and return their comparison.

    Examples
    --------
    >>> import robocov as rc
    >>> comparison = rc.compare("rooms", ["rapf", "lloyd"], robots=4, duration=1.0, lattice=16)
    >>> comparison.records["RAPF"]
    <Record rapf on Rooms, 4 robots, 1.0 s>
    >>> [row["controller"] for row in comparison.table()]
    ['RAPF', 'Lloyd']
    """

    _drawing_name = "comparison"

    records: Mapping[str, Record]
    histories: Mapping[str, CostHistory]

    @cached_property
    def summaries(self) -> dict[str, dict[str, Any]]:
        """Summaries of the runs by label; see `summarize`."""
        return {label: summarize(record, self.histories[label]) for label, record in self.records.items()}

    def table(self) -> list[dict[str, Any]]:
        """Return the results as rows, in the order of the controllers.

        Returns
        -------
        list of dict
            One row for each controller. The units are part of the keys. ``above_best`` is the relative
            difference between the final mean distance and the lowest one in the table. ``mean_time_s`` is
            missing if all robots have the same speed.
        """
        mean_distances = [summary["mean_distance_m"] for summary in self.summaries.values()]
        excess = compute_relative_excess(mean_distances)
        rows = []
        for (label, summary), above_best in zip(self.summaries.items(), excess, strict=True):
            lengths = summary["path_length_m"]
            row = {
                "controller": label,
                "mean_distance_m": summary["mean_distance_m"],
                "above_best": above_best,
                "cost_m3": summary["cost_m3"],
                "uncovered_area_m2": summary["uncovered_area_m2"],
                "settled_at_s": summary["settled_at_s"],
                "contacts": summary["contacts"],
                "min_clearance_m": summary["min_clearance_m"],
                "mean_path_length_m": sum(lengths) / len(lengths),
            }
            if "mean_time_s" in summary:
                row["mean_time_s"] = summary["mean_time_s"]
            rows.append(row)
        return rows

    def to_pandas(self) -> Any:
        """Return the table as a data frame; requires pandas.

        Returns
        -------
        pandas.DataFrame
        """
        pandas = import_optional("pandas", "pandas")
        return pandas.DataFrame(self.table()).set_index("controller")

    def __repr__(self) -> str:
        results = self.table()
        titles, rows = format_comparison([row["controller"] for row in results], results)
        cells = [titles, *rows]
        widths = [max(len(cell) for cell in column) for column in zip(*cells, strict=True)]
        lines = []
        for label, *values in cells:
            aligned = [label.ljust(widths[0])]
            aligned += [value.rjust(width) for value, width in zip(values, widths[1:], strict=True)]
            lines.append("  ".join(aligned))
        return "\n".join(lines)


def format_comparison(
    labels: Sequence[str], results: Sequence[Mapping[str, Any]]
) -> tuple[list[str], list[list[str]]]:
    """Format the results of several runs as a table of text.

    Parameters
    ----------
    labels : sequence of str
        Label of each run's controller.
    results : sequence of mapping
        Results of each run, with the keys of `Comparison.table`.

    Returns
    -------
    titles : list of str
        Titles of the columns. The first one, of the labels, is empty.
    rows : list of list of str
        Cells of each run. The mean time is left out unless all runs have one.
    """
    columns = dict(_COLUMNS)
    have_mean_times = all("mean_time_s" in row for row in results)
    if not have_mean_times:
        del columns[_MEAN_TIME_TITLE]
    rows = []
    for label, row in zip(labels, results, strict=True):
        settled = "not yet"
        if row["settled_at_s"] is not None:
            settled = f"{row['settled_at_s']:.1f} s"
        values = {**row, "label": label, "settled": settled}
        rows.append([cell_format.format(**values) for cell_format in columns.values()])
    return list(columns), rows


def compare(
    environment: Environment | str | Path,
    controllers: Sequence[str | Controller | IndividualController] = DEFAULT_CONTROLLERS,
    *,
    lattice: int = DEFAULT_LATTICE,
    **options: Any,
) -> Comparison:
    """Run several controllers from the same starting positions, and compute their coverage costs.

    Parameters
    ----------
    environment : Environment, str or Path
        A map, the name of a bundled map or the path of a file.
    controllers : sequence of str, Controller or IndividualController
        Names as `make_controller` accepts them, or controllers with other gains, such as ``Rapf(k_rep=0.3)``.
    lattice : int
        The coverage cost is computed on this number of sites along each side of the map.
    **options
        Parameters of `Scenario`, the same for all controllers, such as `robots`, `seed` and `duration`.

    Returns
    -------
    Comparison

    Raises
    ------
    RobocovError
        If an argument cannot be used, or a controller fails.
    TypeError
        If a keyword argument is not a parameter of `Scenario`.

    See Also
    --------
    run : Simulate one run.
    Scenario : Describes a run completely.

    Examples
    --------
    >>> import robocov as rc
    >>> comparison = rc.compare("rooms", ["rapf", "lloyd"], robots=4, duration=1.0, lattice=16)
    >>> list(comparison.records)
    ['RAPF', 'Lloyd']
    """
    require_scenario_options("compare", options)
    if isinstance(controllers, str) or len(controllers) == 0:
        raise ParameterError(f"controllers: expected a list of controllers, got {quote(controllers)}")
    scenario = Scenario(environment, controllers[0], **options)
    cost = CoverageCost(scenario.environment, lattice=lattice, radius=scenario.team.min_radius)
    # A scenario drops these when its controller is replaced, unless they are given again.
    controller_options = {name: options[name] for name in ("gains", "source") if name in options}
    records: dict[str, Record] = {}
    histories: dict[str, CostHistory] = {}
    for controller in controllers:
        record = scenario.replace(controller=controller, **controller_options).run()
        label = _make_unique(record.label, records)
        records[label] = record
        histories[label] = compute_cost_history(record, cost)
    return Comparison(records=records, histories=histories)


def _make_unique(label: str, labels: Collection[str]) -> str:
    """Return a label, with a number appended if it is already one of the given labels."""
    unique_label = label
    number = 1
    while unique_label in labels:
        number += 1
        unique_label = f"{label} ({number})"
    return unique_label
