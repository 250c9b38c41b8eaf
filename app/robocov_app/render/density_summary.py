"""What is said where places do not count all the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.render.phi import density_range

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.environment import Environment


def density_kind(environment: Environment) -> str | None:
    """Return the kind of a map's density, as its file calls it; None where there is none."""
    return None if environment.density is None else environment.density.kind


def weighed_lines(environment: Environment) -> Iterator[str]:
    """Yield the line that says by what the figures above it are weighed; none where nothing weighs them."""
    density = environment.density
    if density is None or density.uniform:
        return
    low, high = density_range(environment)
    yield f"weighed by φ    {density.kind}, {low:.3g} to {high:.3g}"
