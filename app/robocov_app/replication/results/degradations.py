"""Final costs under disturbances, relative to those under ideal conditions."""

from itertools import product
from pathlib import Path
from typing import TypeAlias

from robocov.controllers import load_controller_class
from robocov.metrics.results import read_results
from robocov_app.figures.statistics import MIN_BOOTSTRAP_MAPS, bootstrap
from robocov_app.replication.design import studies
from robocov_app.replication.design.contenders import RAPF_SHARED
from robocov_app.replication.design.plan import Plan
from robocov_app.replication.results.controller_speed import UNKNOWN
from robocov_app.replication.results.study_results import IDEAL, Degradation
from robocov_app.sweep.study.parameters import name_parameter_column

Costs: TypeAlias = dict[tuple[str, int], float]
"""Final costs, m, by map and seed."""
CostTable: TypeAlias = dict[tuple[str, float | None], Costs]
"""Final costs by controller and by the value of a disturbance."""


def read_degradations(folder: Path, plan: Plan) -> list[Degradation]:
    """Read the degradations of all controllers from the sweeps with disturbances.

    Parameters
    ----------
    folder : Path
        Folder of the sweeps.
    plan : Plan

    Returns
    -------
    list of Degradation
        First the costs under ideal conditions, relative to those of RAPF; then the costs under each
        disturbance, relative to those of the same controller under ideal conditions.
    """
    disturbances = studies.list_disturbances(plan)
    ideal: CostTable = {}
    for prefix in disturbances:
        ideal |= _read_costs(folder / f"{prefix}-ideal")
    rapf_costs = ideal.get((RAPF_SHARED.controller, None), {})
    degradations = []
    for prefix, (controllers, _, axes) in disturbances.items():
        for controller in controllers:
            costs = ideal.get((controller, None), {})
            degradations.append(_build_degradation(IDEAL, None, controller, costs, rapf_costs))
        for axis, values in axes.items():
            table = _read_costs(
                folder / f"{prefix}-{axis.replace('_', '-')}", name_parameter_column(axis), default=values[1]
            )
            for value, controller in product(values, controllers):
                ideal_costs = ideal.get((controller, None), {})
                costs = ideal_costs if value == values[0] else table.get((controller, value), {})
                degradations.append(_build_degradation(axis, value, controller, costs, ideal_costs))
    return degradations


def _build_degradation(
    axis: str,
    value: float | None,
    controller: str,
    costs: Costs,
    ideal_costs: Costs,
) -> Degradation:
    """Estimate the median ratio of the costs of a controller to ideal ones on the same maps and seeds."""
    ratios = {key: costs[key] / ideal_costs[key] for key in ideal_costs if key in costs}
    maps = [name for name, _ in ratios]
    # With few maps, runs are resampled one by one; the interval then applies to these maps only.
    clusters = maps if len(set(maps)) >= MIN_BOOTSTRAP_MAPS else None
    ratio = bootstrap([*ratios.values()], clusters=clusters) if ratios else UNKNOWN
    label = str(load_controller_class(controller).label)
    return Degradation(axis, value, controller, label, ratio, runs=len(ratios))


def _read_costs(folder: Path, column: str = "", default: float | None = None) -> CostTable:
    """Read the final costs of a sweep; failed runs are left out.

    Parameters
    ----------
    folder : Path
    column : str
        Column with the value of the disturbance.
    default : float or None
        Value of the disturbance if the table has no such column, because the sweep has a single value.
    """
    table: CostTable = {}
    for row in read_results(folder).rows():
        if row["mean_distance_m"] is not None:
            costs = table.setdefault((row["controller"], row.get(column, default)), {})
            costs[row["map"], row["seed"]] = float(row["mean_distance_m"])
    return table
