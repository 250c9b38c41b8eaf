"""A scenario: everything that the result of one run depends on."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from robocov.conditions import Conditions
from robocov.controllers import (
    CONTROLLERS,
    Controller,
    IndividualController,
    get_recorded_name,
    make_controller,
)
from robocov.controllers.gains import Value, get_gain_values, require_gain_mapping, to_plain_value
from robocov.controllers.individual import require_controller, unwrap_controller
from robocov.controllers.user_modules import ControllerSource, provide_modules
from robocov.defaults import DEFAULT_CONTROLLER, DEFAULT_DT_S, DEFAULT_DURATION_S, DEFAULT_ROBOTS
from robocov.environment import Environment
from robocov.errors import (
    MAX_SEED,
    InputError,
    MapError,
    ParameterError,
    StartError,
    describe_unknown_name,
    find_similar_names,
    format_count,
    quote,
    require_number,
    require_type,
    require_whole_number,
)
from robocov.files.documents import check_header, validate_document
from robocov.files.paths import is_existing_file
from robocov.files.strictjson import parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov.mapfile import find_map_file, from_json, list_bundled_maps, load_map, to_json
from robocov.record import Record, Recorder
from robocov.scenario.scenario_document import FORMAT, FORMAT_VERSION, ScenarioDocument
from robocov.simulation import Simulation, TeamState, check_dt, check_joins
from robocov.team import PARAMETERS, Team
from robocov.typing import FloatArray

MAX_RECORD_ROWS = 2e7
"""Maximum number of recorded steps times the number of robots: about 2 GB."""
MAX_DURATION_S = 1e6
"""Maximum simulated time of a run."""


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Scenario:
    """Everything that the result of one run depends on.

    Parameters
    ----------
    environment : Environment, str or Path
        A map, or what `load_map` accepts: the name of a bundled map or the path of a file.
    controller : str, Controller or IndividualController
        A name as `make_controller` accepts it, or the controller itself.
    gains : mapping of str to float, str or None
        Gains that differ from their defaults; only valid if `controller` is a name.
    robots : int or None
        Number of robots with the default properties; 6 by default. Only valid without `team`.
    team : Team or None
        The robots, if they do not have the default properties.
    start : str or None
        Name of the map's start from which the positions are sampled; by default the first start.
    seed : int or None
        Seed of the starting positions, from 0. None if the positions were not sampled.
    starts : (n, 2) array_like or None, m
        Starting positions. By default they are sampled.
    velocities : (n, 2) array_like or None, m/s
        Initial velocities; by default robots are at rest.
    steering : (n, 2) array_like or None, rad and rad/s
        Initial headings and turning rates of unicycles; see `TeamState`.
    duration : float, s
        Simulated time.
    dt : float, s
        Control period.
    conditions : Conditions or None
        Noise, message loss, and robots that fail or join; ideal by default.
    source : ControllerSource or None
        The source code of a controller in a file, in case the file is no longer at the path in the name.

    Attributes
    ----------
    controller : str
        Name of the controller.
    gains : mapping
        The given gains; if a controller object was given, all of its gains.
    given_starts : (n, 2) array or None, m
        Starting positions, unless they are sampled.

    Raises
    ------
    ParameterError
        If an argument cannot be used.
    StartError
        If given starts, velocities or steering cannot be used.
    MapError
        If the map cannot be read.

    See Also
    --------
    run : Simulate one run.
    compare : Run several controllers in the same scenario.
    Simulation : A run that is advanced step by step.

    Examples
    --------
    >>> import robocov as rc
    >>> scenario = rc.Scenario("rooms", controller="rapf", robots=4, duration=1.0)
    >>> scenario.run()
    <Record rapf on Rooms, 4 robots, 1.0 s>
    >>> scenario.replace(controller="lloyd").run()
    <Record lloyd on Rooms, 4 robots, 1.0 s>
    """

    environment: Environment
    controller: str
    gains: Mapping[str, Value]
    team: Team
    start: str | None
    seed: int | None
    given_starts: FloatArray | None
    velocities: FloatArray | None
    steering: FloatArray | None
    duration: float
    dt: float
    conditions: Conditions | None
    source: ControllerSource | None
    _controller_object: Controller | None

    def __init__(  # noqa: PLR0913 - a keyword for everything that a result depends on
        self,
        environment: Environment | str | Path,
        controller: str | Controller | IndividualController = DEFAULT_CONTROLLER,
        gains: Mapping[str, Value] | None = None,
        *,
        robots: int | None = None,
        team: Team | None = None,
        start: str | None = None,
        seed: int | None = 0,
        starts: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        steering: ArrayLike | None = None,
        duration: float = DEFAULT_DURATION_S,
        dt: float = DEFAULT_DT_S,
        conditions: Conditions | None = None,
        source: ControllerSource | None = None,
    ) -> None:
        state = None
        given_starts = None
        if starts is not None:
            state = TeamState(positions=starts, velocities=velocities, steering=steering)  # type: ignore[arg-type]
            given_starts = state.positions
            velocities = state.velocities
            steering = state.steering
        elif velocities is not None or steering is not None:
            name = "steering" if velocities is None else "velocities"
            raise ParameterError(f"{name}: expected starts as well, got none")
        check_dt(dt)
        if seed is not None:
            require_number("seed", seed, 0, MAX_SEED, whole=True)
        values: dict[str, Any] = {
            "environment": environment if isinstance(environment, Environment) else load_map(environment),
            "team": _build_team(team, robots, state),
            "start": start,
            # JSON has no numbers of NumPy.
            "seed": None if seed is None else int(seed),
            "given_starts": given_starts,
            "velocities": velocities,
            "steering": steering,
            "duration": require_number("duration", duration, 0.0, MAX_DURATION_S, "s"),
            "dt": float(dt),
            "conditions": conditions,
            "source": source,
            **_describe_controller(controller, gains),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)  # Attributes of a frozen object cannot be assigned.
        if source is not None:
            require_type("source", source, ControllerSource, "a ControllerSource")
        if conditions is not None:
            require_type("conditions", conditions, Conditions, "Conditions")
            conditions.check_team(len(self.team))

    def __repr__(self) -> str:
        robots = format_count(len(self.team), "robot")
        return f"<Scenario {self.controller} on {self.environment.name}, {robots}, {self.duration:g} s>"

    @cached_property
    def starts(self) -> FloatArray:
        """Starting positions, (n, 2) m, sampled unless they were given.

        Raises
        ------
        StartError
            If the start is unknown, or has no space for the team.
        """
        if self.given_starts is not None:
            return self.given_starts
        largest_radius = float(self.team.radius.max())
        start = self.environment.start(self.start)
        return start.sample(len(self.team), seed=self.seed or 0, radius=largest_radius)

    @property
    def robots(self) -> int:
        """Number of robots."""
        return len(self.team)

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return round(self.duration / self.dt)

    def check(self) -> None:
        """Check the controller, sampled starts and joins, which a run checks only when it starts.

        If the controller is in a file, this runs the code of the file.

        Raises
        ------
        ParameterError
            If the controller cannot be built, or a robot cannot join at the requested position.
        StartError
            If the start is unknown, or has no space for the team.
        """
        self.build_controller()
        _ = self.starts
        check_joins(self.environment, self.conditions)

    def replace(self, **changes: Any) -> Scenario:
        """Return a copy of the scenario with some parameters changed.

        Parameters
        ----------
        **changes
            Parameters of `Scenario`. A new controller has its default gains unless `gains` is given
            as well. A new number of robots replaces the team with one that has the default
            properties, and requires new `starts` if these were given. With a new number of robots or
            sampled starts, the robots are at rest unless `velocities` is given as well.

        Returns
        -------
        Scenario

        Raises
        ------
        ParameterError, StartError
            If a value cannot be used.
        TypeError
            If `Scenario` has no such parameter.
        """
        require_scenario_options("replace", changes)
        controller: str | Controller = self.controller
        gains: Mapping[str, Value] | None = self.gains
        if self._controller_object is not None:
            # The object contains the gains.
            controller = self._controller_object
            gains = None
        arguments: dict[str, Any] = {
            "environment": self.environment,
            "controller": controller,
            "gains": gains,
            "team": self.team,
            "start": self.start,
            "seed": self.seed,
            "starts": self.given_starts,
            "velocities": self.velocities,
            "steering": self.steering,
            "duration": self.duration,
            "dt": self.dt,
            "conditions": self.conditions,
            "source": self.source,
        }
        if "controller" in changes:
            arguments["gains"] = None
            arguments["source"] = None
        if "robots" in changes:
            arguments["team"] = None
        has_sampled_starts = changes.get("starts", self.given_starts) is None
        if "robots" in changes or has_sampled_starts:
            # The velocities and headings are those of the robots at the earlier starts.
            arguments["velocities"] = None
            arguments["steering"] = None
        return Scenario(**(arguments | changes))

    def build_controller(self) -> Controller:
        """Build the controller. If it is in a file, this runs the code of the file.

        Returns
        -------
        Controller

        Raises
        ------
        ParameterError
            If there is no such controller or gain, or a value is out of range.
        """
        if self._controller_object is not None:
            return self._controller_object
        return make_controller(self.controller, self.gains, source=self.source)

    def build_simulation(
        self, controller: Controller | None = None, *, steps: int = 0, is_computed: bool = False
    ) -> Simulation:
        """Build the simulation for this run.

        Parameters
        ----------
        controller : Controller or None
            By default the controller of the scenario.
        steps : int
            Number of control steps already taken; the simulation starts at the corresponding time.
        is_computed : bool
            Whether a simulation computed the starting positions. They are then not checked for overlaps.

        Returns
        -------
        Simulation
        """
        state = TeamState(
            positions=self.starts,
            velocities=self.velocities,
            steering=self.steering,
            steps=steps,
            is_computed=is_computed,
        )
        return Simulation(
            self.environment,
            controller or self.build_controller(),
            state,
            self.team,
            self.dt,
            conditions=self.conditions,
        )

    def build_recorder(self, controller: Controller, name: str | None = None) -> Recorder:
        """Build the recorder for this run.

        Parameters
        ----------
        controller : Controller
            The controller of the run, whose label and gains are recorded.
        name : str or None
            Name of the controller in the record; by default its own name.

        Returns
        -------
        Recorder
        """
        start = self.start
        if self.given_starts is None:
            start = self.environment.start(self.start).name
        return Recorder(
            self.environment,
            self.team,
            controller,
            self.dt,
            name=name,
            start=start,
            seed=self.seed,
            conditions=self.conditions,
        )

    def run(
        self,
        simulation: Simulation | None = None,
        *,
        every: int = 1,
        on_step: Callable[[int], bool] | None = None,
    ) -> Record:
        """Simulate and record the run.

        Parameters
        ----------
        simulation : Simulation or None
            The simulation to run; by default a new one.
        every : int
            Number of steps from one recorded step to the next, at least 1. The last step is always recorded.
        on_step : callable or None
            Called at each step with its number, from 0 for the initial state. The run ends with this step if
            it returns True.

        Returns
        -------
        Record

        Raises
        ------
        ParameterError
            If `simulation` is not a `Simulation`, or `every` is not a whole number of at least 1.
        RobocovError
            If the run cannot start, or the controller fails.
        """
        require_whole_number("every", every, 1)
        if simulation is not None and not isinstance(simulation, Simulation):
            expected = "expected a Simulation (the duration is an attribute of the scenario)"
            raise ParameterError(f"simulation: {expected}, got {quote(simulation)}")
        modules = {} if self.source is None else self.source.modules
        with provide_modules(modules):
            if simulation is None:
                simulation = self.build_simulation()
            recorder = self.build_recorder(simulation.controller, self.controller)
            for step, snapshot in enumerate(simulation.snapshots(self.duration)):
                is_last = step == self.steps
                if on_step is not None and on_step(step):
                    is_last = True
                if is_last or step % every == 0:
                    recorder.add(snapshot)
                if is_last:
                    break
            return recorder.record(simulation.joined)

    @classmethod
    def from_record(cls, record: Record) -> Scenario:
        """Return the scenario of a recorded run.

        Parameters
        ----------
        record : Record
            The recorded run.

        Returns
        -------
        Scenario
            A scenario that starts from the recorded positions, and has the duration of the record. Changes
            that the user made in the window during the run are not part of the scenario.

        Raises
        ------
        ParameterError
            If the controller of the record is neither built in nor in a file, or if the record starts later
            than at 0 s although obstacles move, or robots fail or join: a scenario always starts at 0 s.
        """
        has_failures_or_joins = record.conditions is not None and record.conditions.has_team_changes
        if record.time[0] > 0.0 and (has_failures_or_joins or record.environment.has_moving_obstacles):
            raise ParameterError(f"record: expected a run that starts at 0 s, got {record.time[0]:g} s")
        velocities = record.velocities[0] if record.velocities[0].any() else None
        steering = None if record.steering is None else record.steering[0]
        return cls(
            record.environment,
            record.controller,
            record.gains,
            team=record.team,
            start=record.start,
            seed=record.seed,
            starts=record.positions[0],
            velocities=velocities,
            steering=steering,
            duration=float(record.time[-1] - record.time[0]),
            dt=record.dt,
            conditions=record.conditions,
        )

    def to_json(self) -> dict[str, Any]:
        """Return the scenario as a JSON object, which contains the map.

        Returns
        -------
        dict
            Its keys are those of ``run.json``.
        """
        document: dict[str, Any] = {
            "format": FORMAT,
            "version": FORMAT_VERSION,
            "map": to_json(self.environment),
            "controller": {"name": self.controller, "gains": dict(self.gains)},
            "team": self.team.to_dict(),
            "start": self.start,
            "seed": self.seed,
        }
        arrays = {
            "starts_m": self.given_starts,
            "start_velocities_m_per_s": self.velocities,
            "start_steering": self.steering,
        }
        document |= {key: array.tolist() for key, array in arrays.items() if array is not None}
        document |= {"duration_s": self.duration, "dt_s": self.dt}
        if self.conditions is not None:
            document["conditions"] = self.conditions.to_dict()
        return document

    @classmethod
    def from_json(
        cls,
        document: Mapping[str, Any],
        source_name: str = "scenario",
        *,
        folder: Path | None = None,
        controllers: Collection[str] = (),
    ) -> Scenario:
        """Build the scenario that a JSON object describes.

        Parameters
        ----------
        document : mapping
            JSON object in the format of `to_json`. Only ``format``, ``version`` and ``map`` are required. The
            map may also be the name of a bundled map or the path of a file.
        source_name : str
            Name of the document in messages.
        folder : Path or None
            Folder to which the path of the map is relative; by default the current folder.
        controllers : collection of str
            Names of controllers in files that the document may use. Other files are never executed.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            If the document cannot be used. The message names the document and the value.
        """
        check_header(document, source_name, FORMAT, FORMAT_VERSION)
        try:
            content = validate_document(document, source_name, ScenarioDocument)
            name = content.controller.name
            if name not in CONTROLLERS and name not in controllers:
                raise InputError(
                    f"{source_name}: controller.name: expected a built-in controller, got {quote(name)}; "
                    "a file does not run code unless the user also names the controller"
                )
            conditions = None
            if content.conditions is not None:
                conditions = Conditions.from_dict(content.conditions.model_dump())
            scenario = cls(
                _load_environment(content.map, source_name, folder),
                name,
                content.controller.gains,
                team=_read_team(content.team),
                start=content.start,
                seed=content.seed,
                starts=content.starts_m,
                velocities=content.start_velocities_m_per_s,
                steering=content.start_steering,
                duration=content.duration_s,
                dt=content.dt_s,
                conditions=conditions,
            )
        except (ParameterError, StartError) as error:
            raise InputError(f"{source_name}: {error}") from error
        return scenario

    def save(self, path: Path | str) -> None:
        """Write the scenario to a JSON file. If this fails, an existing file stays unchanged.

        Parameters
        ----------
        path : Path or str
            Path of the file, which is overwritten if it exists.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        text = json.dumps(self.to_json(), indent=1, allow_nan=False)
        with replace_file(Path(path)) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: Path | str, *, controllers: Collection[str] = ()) -> Scenario:
        """Read a scenario from a JSON file.

        Parameters
        ----------
        path : Path or str
            Path of the file.
        controllers : collection of str
            See `from_json`.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            If the file cannot be read or used. The message names the file and the value.
        """
        path = Path(path)
        document = parse_json(read_bytes(path), str(path))
        return cls.from_json(document, str(path), folder=path.parent, controllers=controllers)


def run(
    environment: Environment | str | Path,
    controller: str | Controller | IndividualController = DEFAULT_CONTROLLER,
    **options: Any,
) -> Record:
    """Simulate one run.

    Parameters
    ----------
    environment : Environment, str or Path
        A map, the name of a bundled map or the path of a file.
    controller : str, Controller or IndividualController
        A name as `make_controller` accepts it, or the controller itself.
    **options
        Other parameters of `Scenario`, such as `gains`, `robots`, `start`, `seed`, `duration` and
        `conditions`.

    Returns
    -------
    Record

    Raises
    ------
    RobocovError
        If an argument cannot be used, or the controller fails.
    TypeError
        If a keyword argument is not a parameter of `Scenario`.

    See Also
    --------
    Scenario : Describes a run completely.
    compare : Run several controllers in the same scenario.
    Simulation : A run that is advanced step by step.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.run("rooms", "rapf", robots=6, duration=1.0)
    <Record rapf on Rooms, 6 robots, 1.0 s>
    """
    require_scenario_options("run", options)
    return Scenario(environment, controller, **options).run()


def require_scenario_options(function_name: str, options: Iterable[str]) -> None:
    """Raise an error unless the keyword arguments that a function passes on are options of `Scenario`.

    Without this check, the error would name ``Scenario.__init__``, which the caller has not called.

    Parameters
    ----------
    function_name : str
        Name of the function that was called.
    options : iterable of str
        Names of its keyword arguments.

    Raises
    ------
    TypeError
        If `Scenario` has no such parameter.
    """
    known_options = list(inspect.signature(Scenario).parameters)
    for option in options:
        if option in known_options:
            continue
        message = f"{function_name}() got an unexpected keyword argument {option!r}"
        similar_options = find_similar_names(option, known_options)
        if similar_options:
            message += f". Did you mean {' or '.join(map(repr, similar_options))}?"
        raise TypeError(message)


def _build_team(team: Team | None, robots: int | None, state: TeamState | None) -> Team:
    """Return the given team, or one of robots with the default properties.

    Without `team` and `robots`, there is one robot for each given start.
    """
    if team is not None:
        require_type("team", team, Team, "a Team")
        if robots not in (None, len(team)):
            raise ParameterError(f"robots: expected {len(team)} as in the team, got {quote(robots)}")
    elif state is not None and robots is None:
        team = Team.homogeneous(len(state))
    else:
        team = Team.homogeneous(DEFAULT_ROBOTS if robots is None else robots)
    if state is not None and len(state) != len(team):
        raise StartError(f"starts: expected one for each of {len(team)} robots, got {len(state)}")
    return team


def _describe_controller(
    controller: str | Controller | IndividualController, gains: Mapping[str, Value] | None
) -> dict[str, Any]:
    """Return the attributes of a scenario that describe its controller."""
    if isinstance(controller, str):
        if ":" not in controller:
            # This checks the name and the gains. A controller in a file ("file:class") is only checked when
            # it is needed, because that runs the code of the file.
            make_controller(controller, gains)
        given_gains = {} if gains is None else gains
        require_gain_mapping(given_gains)
        plain_gains = {name: to_plain_value(value) for name, value in given_gains.items()}
        _require_finite_gains(plain_gains)
        return {"controller": controller, "gains": plain_gains, "_controller_object": None}
    if gains:
        raise ParameterError("gains: expected none together with a controller object, which has its own")
    team_controller = require_controller(controller)
    own_gains = get_gain_values(unwrap_controller(team_controller))
    _require_finite_gains(own_gains)
    return {
        "controller": get_recorded_name(team_controller),
        "gains": own_gains,
        "_controller_object": team_controller,
    }


def _require_finite_gains(gains: Mapping[str, Value]) -> None:
    """Raise a ParameterError if a gain cannot be written to JSON, which has no infinite numbers."""
    for name, value in gains.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise ParameterError(f"gains: {name}: expected a finite number, got {quote(value)}")


def _load_environment(content: str | dict[str, Any], source_name: str, folder: Path | None) -> Environment:
    """Return the map of a document, which contains the map itself, its name, or the path of its file."""
    if not isinstance(content, str):
        return from_json(content, f"{source_name}: map", folder)
    is_name_of_bundled_map = content in list_bundled_maps()
    if folder is not None and not is_name_of_bundled_map and is_existing_file(folder / content):
        return load_map(folder / content)
    try:
        path = find_map_file(content)
    except MapError as error:
        raise MapError(f"{source_name}: map: {error}") from error
    if folder is not None and not path.is_absolute():
        path = folder / path
    return load_map(path)


def _read_team(content: Mapping[str, Any]) -> Team:
    """Return the team of a document, in which every key may be missing."""
    keys = ["robots", *(parameter.json_key for parameter in PARAMETERS.values())]
    for key in content:
        if key not in keys:
            raise ParameterError(f"team: {describe_unknown_name('key', key, keys)}")
    return Team.from_dict({**Team.homogeneous(DEFAULT_ROBOTS).to_dict(), **content})
