"""What `robocov check` says of a map, for people: its rows, and what they were before."""

from __future__ import annotations

from collections.abc import Iterator

from robocov.mapfile.check import MapReport

_LISTED = 5
"""Components whose areas are told."""


def report_lines(report: MapReport, former: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, with what was otherwise in a former one.

    `former`: of the same map before it was changed; None for none.
    """
    rows, was = _rows(report), {} if former is None else _rows(former)
    told = [(title, _changed(value, was.get(title), former)) for title, value in rows.items()]
    told += [(title, f"none, was {value}") for title, value in was.items() if title not in rows]
    before = () if former is None else former.warnings
    for warning in report.warnings:
        told.append(("warning", warning + (" (new)" if former and warning not in before else "")))
    told += [("no longer", warning) for warning in before if warning not in report.warnings]
    width = max(len(title) for title, _ in told)
    for title, value in told:
        yield f"  {title:<{width}}  {value}"


def _changed(value: str, was: str | None, former: MapReport | None) -> str:
    if former is None or value == was:
        return value
    return f"{value}, was {was or 'none'}"


def _rows(report: MapReport) -> dict[str, str]:
    return {
        "name": report.name,
        "area": f"{report.area:.6g} m²",
        "free area": f"{report.free_area:.6g} m² ({report.free_fraction:.1%})",
        "obstacles": f"{report.obstacles}, with {report.vertices} vertices (boundary included)",
        "components": _components(report),
        "narrowest gap": _gap(report),
        **({} if report.density is None else {"density": _density(report)}),
        **{
            f"start {start.name}": f"{start.kind}, room for about {start.capacity}" for start in report.starts
        },
    }


def _density(report: MapReport) -> str:
    assert report.density_range is not None
    low, high = report.density_range
    return f"{report.density}, {low:.4g} to {high:.4g}, mean {report.mean_density:.4g}"


def _components(report: MapReport) -> str:
    areas = ", ".join(f"{area:.6g} m²" for area in report.components[:_LISTED])
    more = ", ..." if len(report.components) > _LISTED else ""
    return f"{len(report.components)} ({areas}{more})"


def _gap(report: MapReport) -> str:
    if report.narrowest_gap is None:
        return "none"
    (a, b), (c, d) = report.narrowest_gap.between
    return f"{report.narrowest_gap.width:.3f} m, between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}]"
