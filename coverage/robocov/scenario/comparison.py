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
from robocov.metrics import CostHistory, compute_cost_history, summarize
from robocov.optional_imports import import_optional
from robocov.record import Record
from robocov.scenario.scenario import Scenario

DEFAULT_CONTROLLERS = ("rapf", "rpf", "lloyd")
"""The controllers of the paper."""
_COLUMNS = {
    "mean_distance_m": "mean distance (m)",
    "above_best": "above lowest",
    "settled_at_s": "settled at (s)",
    "contacts": "contacts",
    "mean_path_length_m": "path length (m)",
}
"""Keys of the columns of the printed table, with their headers."""


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
            One row for each controller. Lengths are in meters and times in seconds, as the keys say.
            ``above_best`` is the relative difference between the final mean distance and the lowest one.
        """
        lowest = min(summary["mean_distance_m"] for summary in self.summaries.values())
        rows = []
        for label, summary in self.summaries.items():
            lengths = summary["path_length_m"]
            row = {
                "controller": label,
                "mean_distance_m": summary["mean_distance_m"],
                "above_best": summary["mean_distance_m"] / lowest - 1.0,
                "uncovered_area_m2": summary["uncovered_area_m2"],
                "settled_at_s": summary["settled_at_s"],
                "contacts": summary["contacts"],
                "min_clearance_m": summary["min_clearance_m"],
                "mean_path_length_m": sum(lengths) / len(lengths),
            }
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
        rows = [["controller", *_COLUMNS.values()]]
        for row in self.table():
            settled = row["settled_at_s"]
            cells = [
                row["controller"],
                f"{row['mean_distance_m']:.3f}",
                f"{row['above_best']:.1%}",
                "-" if settled is None else f"{settled:.1f}",
                str(row["contacts"]),
                f"{row['mean_path_length_m']:.1f}",
            ]
            rows.append(cells)
        widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
        lines = []
        for label, *values in rows:
            aligned = [label.ljust(widths[0])]
            aligned += [value.rjust(width) for value, width in zip(values, widths[1:], strict=True)]
            lines.append("  ".join(aligned))
        return "\n".join(lines)


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
    if isinstance(controllers, str) or len(controllers) == 0:
        raise ParameterError(f"controllers: expected a list of controllers, got {quote(controllers)}")
    scenario = Scenario(environment, controllers[0], **options)
    cost = CoverageCost(scenario.environment, lattice=lattice, radius=scenario.team.min_radius)
    records: dict[str, Record] = {}
    histories: dict[str, CostHistory] = {}
    for controller in controllers:
        record = scenario.replace(controller=controller).run()
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
