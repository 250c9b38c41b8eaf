"""The table of the coverage cost over time, as saved in ``cost.csv``."""

from collections.abc import Iterator

from robocov.metrics import CostHistory


def build_cost_table(history: CostHistory) -> tuple[str, Iterator[tuple[float, ...]]]:
    """Build the content of ``cost.csv``.

    Parameters
    ----------
    history : CostHistory
        The coverage cost over a run.

    Returns
    -------
    header : str
        Names of the columns, with a column of mean times only if the robots differ in speed.
    rows : iterator of tuple of float
        Values of the columns at each sampled time.
    """
    columns = {
        "time_s": history.time,
        "mean_distance_m": history.mean_distance,
        "cost_m3": history.cost,
        "uncovered_area_m2": history.uncovered_area,
    }
    if history.mean_time is not None:
        columns["mean_time_s"] = history.mean_time
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return ",".join(columns), rows
