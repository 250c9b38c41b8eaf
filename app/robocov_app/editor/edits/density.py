"""Edits of the density: Gaussian hot spots added, moved, sized, weighed and taken away, and their floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.density import HEAVIEST, Density, Gaussian, Gaussians, Raster
from robocov.environment import Point
from robocov.errors import MapError
from robocov.mapfile.models import FARTHEST, LARGEST
from robocov_app.editor.model.geometry import ring_near, tenths
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.viewer.session.map_edits import SHORTEST

LIGHTEST = 1e-6
"""Smallest weight of a hot spot, and of every place where there is none."""


def peaks_of(sketch: Sketch) -> tuple[Gaussian, ...]:
    """Return the hot spots; none where the density is of another kind."""
    return sketch.density.peaks if isinstance(sketch.density, Gaussians) else ()


def spread_of(peak: Gaussian) -> float:
    """Return the standard deviation of a hot spot, m: of one that is not round, the geometric mean."""
    if peak.sigma is not None:
        return peak.sigma
    (a, b), (c, d) = peak.matrix
    return float((a * d - b * c) ** 0.25)


def peak_added(sketch: Sketch, center: Point, sigma: float, weight: float) -> Change:
    """Add a hot spot; without a density, to one that is 1 everywhere."""
    peaks, floor = _parts(sketch)
    peak = _peak(center, sigma, weight)
    return _put(sketch, Gaussians((*peaks, peak), floor), "hot spot added")


def peak_removed(sketch: Sketch, number: int) -> Change:
    """Take a hot spot away; with the last one the density goes."""
    peaks, floor = _parts(sketch)
    kept = peaks[:number] + peaks[number + 1 :]
    return _put(sketch, Gaussians(kept, floor) if kept else None, "hot spot taken away")


def peak_moved(sketch: Sketch, number: int, center: Point) -> Change:
    """Move a hot spot."""
    (place,) = ring_near(np.array([center], dtype=float))
    return _changed(sketch, number, replace(_peak_at(sketch, number), center=place), "moved")


def peak_sized(sketch: Sketch, number: int, sigma: float) -> Change:
    """Give a hot spot another standard deviation; one that is not round keeps its shape."""
    peak = _peak_at(sketch, number)
    if not SHORTEST <= sigma <= LARGEST:
        raise MapError("a hot spot needs a size: drag from its middle outwards")
    if peak.covariance is None:
        return _changed(sketch, number, replace(peak, sigma=tenths(sigma)), "sized")
    factor = (sigma / spread_of(peak)) ** 2
    (a, b), (c, d) = ((factor * x, factor * y) for x, y in peak.matrix)
    return _changed(sketch, number, replace(peak, covariance=((a, b), (c, d))), "sized")


def peak_weighed(sketch: Sketch, number: int, weight: float) -> Change:
    """Give a hot spot another weight."""
    peak = replace(_peak_at(sketch, number), weight=_weight(weight, least=LIGHTEST))
    return _changed(sketch, number, peak, f"weighs {peak.weight:g}")


def floor_set(sketch: Sketch, floor: float) -> Change:
    """Let every place count so much, without the hot spots."""
    peaks, _ = _parts(sketch)
    floor = _weight(floor, least=0.0 if peaks else LIGHTEST)
    return _put(sketch, Gaussians(peaks, floor), f"every place counts {floor:g} at least")


def density_removed(sketch: Sketch) -> Change:
    """Let every place count the same."""
    if sketch.density is None:
        raise MapError("every place counts the same already")
    return _put(sketch, None, "density taken away")


def weight_of(text: str) -> float:
    """Return a typed weight of a hot spot."""
    try:
        weight = float(text)
    except ValueError:
        raise MapError(f"“{text}”, but a weight was wanted: a number above 0") from None
    return _weight(weight, least=LIGHTEST)


def density_words(density: Density | None) -> str:
    """Return what a density is, in a few words."""
    if density is None:
        return "none: every place counts the same"
    if isinstance(density, Gaussians):
        count = len(density.peaks)
        return f"{count} hot spot{'' if count == 1 else 's'}, floor {density.floor:g}"
    if isinstance(density, Raster):
        rows, columns = density.values.shape
        return f"picture, {columns} x {rows}"
    return f"{density.kind}, {density.lowest:g} to {density.highest:g}"


def _parts(sketch: Sketch) -> tuple[tuple[Gaussian, ...], float]:
    density = sketch.density
    if isinstance(density, Gaussians):
        return density.peaks, density.floor
    if density is None or density.uniform:
        return (), 1.0 if density is None else density.highest
    raise MapError(
        f"this map's density is a {density.kind}, hot spots are not: “density none” takes it away first"
    )


def _peak(center: Point, sigma: float, weight: float) -> Gaussian:
    (place,) = ring_near(np.array([center], dtype=float))
    if not SHORTEST <= sigma <= LARGEST:
        raise MapError("a hot spot needs a size: drag from its middle outwards")
    if max(map(abs, place)) > FARTHEST:
        raise MapError("that is too far away")
    return Gaussian(place, _weight(weight, least=LIGHTEST), tenths(sigma))


def _weight(weight: float, *, least: float) -> float:
    if not least <= weight <= HEAVIEST:
        raise MapError(f"weight: {weight:g}, but a number {'above' if least else 'from'} 0 was wanted")
    return float(weight)


def _peak_at(sketch: Sketch, number: int) -> Gaussian:
    peaks = peaks_of(sketch)
    if not 0 <= number < len(peaks):
        raise MapError("there is no such hot spot any more")
    return peaks[number]


def _changed(sketch: Sketch, number: int, peak: Gaussian, words: str) -> Change:
    peaks, floor = _parts(sketch)
    return _put(sketch, Gaussians((*peaks[:number], peak, *peaks[number + 1 :]), floor), f"hot spot {words}")


def _put(sketch: Sketch, density: Density | None, words: str) -> Change:
    return Change(replace(sketch, density=density), Selection(), words)
