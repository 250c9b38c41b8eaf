"""The controller that the benchmark rates, and the selection of runs for it."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from robocov.controllers import CONTROLLERS, get_information, make_controller
from robocov.controllers.gains import Value
from robocov.controllers.user_modules import ControllerSource
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov_app.benchmark import suite
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.coverage_control_cvt import LIBRARY, PEAKS_KEY
from robocov_app.benchmark.maps.worlds import draw_peaks
from robocov_app.benchmark.results import find_reference
from robocov_app.sweep.study.controller_files import read_controller_source
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.worker import list_result_versions

ORACLE = "oracle"
"""Name of the controller that knows the reference placements; see `robocov_app.benchmark.oracle`."""
LEARNED = "learned"
"""Name of the controller with a trained network; see `robocov_app.benchmark.learned`."""
STAND_IN = "rapf"
"""Controller that replaces the controller of a user in studies that must not execute the user's code."""
COVERAGE_CONTROL_FILES = {
    "coverage-control-clairvoyant": "coverage_control_cvt.py:ClairvoyantCvt",
    "coverage-control-centralized": "coverage_control_cvt.py:CentralizedCvt",
    "coverage-control-decentralized": "coverage_control_cvt.py:DecentralizedCvt",
}
"""Controllers of CoverageControl, which need its library, and their files in this folder."""
_FILES = {ORACLE: "oracle.py:Oracle", LEARNED: "learned.py:Learned", **COVERAGE_CONTROL_FILES}
"""Controllers that only the benchmark has, and their files in this folder."""


@dataclass(frozen=True)
class Selection:
    """Selection of runs of the suite.

    Parameters
    ----------
    quick : bool
        Whether to use only two tracks, with the first map of each family and the first seed.
    tracks, maps : tuple of str
        Names of tracks and maps; if empty, all of them are selected.
    """

    quick: bool = False
    tracks: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()

    def list_runs(self) -> Iterator[tuple[str, tuple[str, ...], tuple[int, ...]]]:
        """Yield each selected track with its maps and seeds.

        Raises
        ------
        ParameterError
            If a track or map is unknown.
        """
        for track, maps in suite.select_maps(self.tracks, self.maps, quick=self.quick).items():
            seeds = suite.TRACKS[track].seeds
            if self.quick:
                seeds = seeds[:1]
            yield track, maps, seeds


@dataclass(frozen=True)
class RatedController:
    """A controller that is rated.

    Parameters
    ----------
    controller : str
        Name of a controller, including those that only the benchmark has, or ``FILE.py:CLASS``.
    gains : Mapping
        Gains that differ from the defaults.
    """

    controller: str
    gains: Mapping[str, Value]

    def build_studies(self, selection: Selection) -> Iterator[tuple[str, Study]]:
        """Yield each selected track with the sweep of its runs.

        Raises
        ------
        ParameterError
            If the controller, one of its gains, a track or a map is unknown or invalid.
        InputError
            If a map of the suite has changed.
        """
        self._check_controller()
        for track, names, seeds in selection.list_runs():
            maps = []
            for map_name in names:
                environment = suite.load_suite_map(map_name)
                if self.controller == ORACLE:
                    environment = _add_placements(environment, track, map_name)
                if self.controller in COVERAGE_CONTROL_FILES:
                    environment = _add_peaks(environment, self.controller, track, map_name)
                maps.append(StudyMap(map_name, environment))
            yield track, self.build_study(track, maps, seeds)

    def build_study(self, track: str, maps: Sequence[StudyMap], seeds: Sequence[int]) -> Study:
        """Build the sweep of the controller on some maps, under the conditions of a track.

        Parameters
        ----------
        track : str
        maps : sequence of StudyMap
            The maps, which need not be part of the suite.
        seeds : sequence of int
            Seeds of the starting positions.

        Returns
        -------
        Study
        """
        name, folder = self._locate_controller()
        gains = {name: dict(self.gains)} if self.gains else {}
        return suite.build_study(track, maps, name, gains=gains, seeds=seeds, folder=folder)

    @property
    def decides_jointly(self) -> bool:
        """Whether the controller decides for all robots at once, by information that no single robot has."""
        return self.controller == ORACLE or self.controller in COVERAGE_CONTROL_FILES

    def list_versions(self) -> dict[str, str]:
        """Return the versions of the packages on which results of the controller depend, by name."""
        versions = dict(list_result_versions())
        if self.controller in COVERAGE_CONTROL_FILES:
            versions[LIBRARY] = version(LIBRARY)
        return versions

    @property
    def is_built_in(self) -> bool:
        """Whether the controller is part of robocov."""
        return self.controller in CONTROLLERS or self.controller in _FILES

    def replace_user_code(self) -> "RatedController":
        """Return this controller if it is built in, otherwise `STAND_IN`, so that no user's code runs."""
        return self if self.is_built_in else RatedController(STAND_IN, {})

    def read_code(self) -> ControllerCode:
        """Read the code of the controller without executing it.

        Returns
        -------
        ControllerCode

        Raises
        ------
        ParameterError
            If its file cannot be read.
        """
        name, folder = self._locate_controller()
        try:
            source = read_controller_source(name, folder)
        except ParameterError as error:
            raise ParameterError(f"--controller: {error}") from None
        return ControllerCode(name, dict(self.gains), source)

    def _locate_controller(self) -> tuple[str, Path]:
        """Return the name of the controller, and the folder to which a relative path of its file refers."""
        if self.controller in _FILES:
            return _FILES[self.controller], Path(__file__).parent
        return self.controller, Path()

    def _check_controller(self) -> None:
        """Raise ParameterError if the controller or one of its gains is unknown or invalid.

        Called before the maps are built, because building them takes seconds.
        """
        name, folder = self._locate_controller()
        if self.controller in _FILES:
            # `make_controller` takes no folder, so a relative path would refer to the current one.
            name = str(folder / name)
        try:
            make_controller(name, dict(self.gains))
        except ParameterError as error:
            raise ParameterError(f"--controller: {error}") from None

    def describe(self, study: Study) -> dict[str, Any]:
        """Describe the controller for a result.

        Parameters
        ----------
        study : Study
            One of the sweeps of the controller.

        Returns
        -------
        dict
            Name, label, information, all gains, the gains that were set, and, for a controller in a file of
            the user, the SHA-256 of its source code. Controllers that are part of robocov have none.
        """
        name = study.controllers[0]
        controller_class = study.load_controller_class(name)
        return {
            **self.identify(study.sources.get(name)),
            "label": getattr(controller_class, "label", controller_class.__name__),
            "information": get_information(controller_class),
            "gains": dict(study.get_gains(name).choices[0]),
        }

    def identify(self, source: ControllerSource | None) -> dict[str, Any]:
        """Return the part of a description that does not depend on the code of the controller.

        Parameters
        ----------
        source : ControllerSource or None
            Source text of a controller in a file.

        Returns
        -------
        dict
            Name, the gains that were set, and the SHA-256 of the source code.
        """
        source_hash = None
        if source is not None and not self.is_built_in:
            texts = [source.text, *(module.text for module in source.modules.values())]
            source_hash = hashlib.sha256("\0".join(texts).encode()).hexdigest()
        return {
            "controller": self.controller.rpartition("/")[2],
            "set": dict(self.gains),
            "source_sha256": source_hash,
        }


def _add_placements(environment: Environment, track_name: str, map_name: str) -> Environment:
    """Return a map with reference placements for the oracle: one for the start, one after each failure."""
    track = suite.TRACKS[track_name]
    working = list(range(track.robots))
    stages = []
    time = 0.0
    # The last pair is not a failure; it only ends the last stage.
    for failed_robot, failure_time in (*track.failures, (-1, np.inf)):
        positions = find_reference(map_name, len(working))["positions_m"]
        stages.append([time, working, positions])
        working = [robot for robot in working if robot != failed_robot]
        time = failure_time
    return replace(environment, extra={**environment.extra, "oracle": stages})


def _add_peaks(environment: Environment, controller: str, track: str, map_name: str) -> Environment:
    """Return a map with the peaks of its density, for the controllers of CoverageControl.

    Raises
    ------
    ParameterError
        If the map is not in the family `worlds`.
    """
    if suite.FAMILY_OF[map_name] != suite.WORLDS:
        raise ParameterError(f"--track: expected open-square for {controller}, got {track}")
    peaks = draw_peaks(int(map_name.rpartition("-")[2]))
    return replace(environment, extra={**environment.extra, PEAKS_KEY: [list(peak) for peak in peaks]})
