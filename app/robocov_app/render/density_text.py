"""The density and the coverage cost as text."""

import numpy as np

from robocov.environment import Environment
from robocov_app.render.density_shading import get_density_range

_MIN_SHOWN_FRACTION = 1e-3
"""Fraction of the maximum density below which a density is written as 0."""


def describe_density(environment: Environment) -> str:
    """Return the range of the density as text; an empty text if the density is uniform."""
    density = environment.density
    if density is None or density.is_uniform:
        return ""
    low, high = get_density_range(environment)
    return describe_density_range(low, high)


def describe_density_range(low: float, high: float) -> str:
    """Return a range of densities as text.

    Examples
    --------
    >>> describe_density_range(0.5, 7.5)
    'density φ, 0.5 to 7.5'

    The tail of a Gaussian far from its center is written as 0:

    >>> describe_density_range(1e-65, 4.0)
    'density φ, 0 to 4'
    """
    return f"density φ, {_format_range(low, high)}"


def _format_range(low: float, high: float) -> str:
    """Return two densities as text, such as "0.5 to 7.5"."""
    shown_low = low if low >= _MIN_SHOWN_FRACTION * high else 0.0
    return f"{shown_low:.3g} to {high:.3g}"


def get_density_kind(environment: Environment) -> str | None:
    """Return the kind of the density; None for an environment without one."""
    if environment.density is None:
        return None
    return environment.density.kind


def list_density_lines(environment: Environment) -> list[str]:
    """Return the line that is written below values weighted by the density; [] if it is uniform."""
    density = environment.density
    if density is None or density.is_uniform:
        return []
    low, high = get_density_range(environment)
    return [f"weighted by φ   {density.kind}, {_format_range(low, high)}"]


def get_cost_name(environment: Environment) -> str:
    """Return the name of the coverage cost, which shows whether it is weighted by a density."""
    if describe_density(environment):
        return "mean distance weighted by φ"
    return "mean distance"


def format_cost(name: str, mean_distance: float, mean_time: float | None = None) -> str:
    """Return the coverage cost as text.

    Values that are not finite, such as those of a team without a working robot, are left out.

    Parameters
    ----------
    name : str
        Name of the mean distance, from `get_cost_name`.
    mean_distance : float, m
    mean_time : float, s, optional
        Mean time until the first robot arrives.

    Returns
    -------
    str

    Examples
    --------
    >>> format_cost("mean distance", 1.25, 3.0)
    'mean distance 1.250 m, mean time 3.000 s'
    """
    texts = []
    if np.isfinite(mean_distance):
        texts.append(f"{name} {mean_distance:.3f} m")
    if mean_time is not None and np.isfinite(mean_time):
        texts.append(f"mean time {mean_time:.3f} s")
    return ", ".join(texts)
