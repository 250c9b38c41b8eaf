"""Says in words and numbers why a robot moves, or why it is stuck. Knows no pygame.

Distances to goals, obstacle points and other robots are from the robot's center, as in the laws; what
it is *clear of* is told from its rim. Plane vectors are complex here, x + i y.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import Environment, WallObstacle
from robocov.metrics import MAX_CONTACT_GAP_M, SETTLED_DISTANCE_M
from robocov.observation import Decision, Snapshot
from robocov.team import Team
from robocov_app.viewer.presenter import Presenter

SLOW = 0.05  # m/s; who is slower seems to be at rest
FAR = 0.3  # m; who rests farther from its goal has not arrived
NOTHING = 5e-4  # N; what is less is written as 0 N, and has no arrow
REST = "law"  # kind of the line for what the terms of a controller leave of its force
_SWAY = 0.02  # m; who goes to and fro by less seems to stand
_HUGE = 1e100  # what is not below is no number to reckon with
_WAYS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


@dataclass(frozen=True)
class Line:
    """One thing that is said about a robot."""

    text: str
    vector: tuple[float, float] | None = None  # N, of a force, for a small arrow
    kind: str = ""  # the force term, `REST`, ``viscosity`` or ``resultant``; empty for what is no force


@dataclass(frozen=True)
class Report:
    """Report on a robot: its name, one short sentence, and why.

    The vectors sum up to that of the resultant, to which limits and contacts have not been applied.
    """

    title: str
    verdict: str
    lines: tuple[Line, ...]


def report_on(viewer: Presenter, number: int) -> Report:
    session, pane = viewer.session, viewer.pane
    setup = session.displayed.get_setup(pane)
    if number in setup.failed:
        x, y = setup.failed[number]
        verdict = f"failed: it stands at ({x:.2f}, {y:.2f}) m, and the others see it as an obstacle"
        return Report(f"Robot {number}", verdict, ())
    robot = (
        session.displayed.get_snapshot(pane),
        setup.team,
        setup.sensed_environment,
        setup.numbers.index(number),
    )
    return explain(*robot, names=setup.numbers, recent=session.displayed.get_recent_positions(pane, number))


def explain(
    snapshot: Snapshot,
    team: Team,
    environment: Environment,
    robot: int,
    *,
    names: Sequence[int] | None = None,
    recent: Array | None = None,
) -> Report:
    """Return why a robot, by its row, moves, or why it does not.

    The robot does not know the environment, but who asks does. `names`: what people call the robots, by
    default 1, 2, ... `recent`, (k, 2) m: where the robot was during the last `SETTLED_WINDOW` seconds, oldest
    first; without it the speed alone says whether the robot is at rest.
    """
    case = _Case(snapshot, team, environment, robot, range(1, len(team) + 1) if names is None else names)
    motion, speed = _motion(case, recent), abs(case.velocity)
    how = f"{_number(speed)} m/s {_compass(case.velocity)}" if speed >= 0.005 else "at rest"
    x, y = (round(value, 2) + 0.0 for value in (case.position.real, case.position.imag))
    texts = *_reasons(case, motion), *_surroundings(case)
    lines = Line(f"at ({x:.2f}, {y:.2f}) m, {how}"), *_forces(case), *map(Line, texts)
    return Report(f"Robot {case.name}", _verdict(case, motion), lines)


@dataclass(frozen=True)
class _Thing:
    """Something seen from the robot: what it is called, where, m; its gap to the rim, m; what hides it."""

    name: str
    offset: complex
    gap: float = math.inf
    hidden: str = ""

    @property
    def away(self) -> str:
        return f"{_length(abs(self.offset))} away" + (f", {self.hidden}" if self.hidden else "")

    @property
    def there(self) -> str:
        return f"{self.name}, {_length(abs(self.offset))} {_compass(self.offset)}".rstrip()

    @property
    def beside(self) -> str:
        return f"{self.name} {_compass(self.offset)} of it" if self.offset else self.name


class _Case:
    """All that is said about one robot, before it is put in words; SI units.

    `forces` has the terms and, as `REST`, what they leave of the force; none where that is no number.
    `solid` is what the robot senses or else touches, `others` whom it hears, the nearest first.
    """

    def __init__(
        self, snapshot: Snapshot, team: Team, environment: Environment, robot: int, names: Sequence[int]
    ) -> None:
        self.name = names[robot]
        self.mass, self.radius = float(team.mass[robot]), float(team.radius[robot])
        self.max_speed, self.strength = float(team.max_speed[robot]), float(team.max_acceleration[robot])
        self.viscosity, self.reach = float(team.viscosity[robot]), float(team.sensing_range[robot])
        self.position = here = _row(snapshot.positions, robot) or 0j
        self.velocity = _row(snapshot.velocities, robot) or 0j
        self.aim = _aim(snapshot.decision, environment, here, robot)
        point = _row(snapshot.seen.obstacle_points, robot)
        self.sensing = point is not None
        self.solid, self.others = _solid(environment, here, point, self.radius), []
        for j in snapshot.seen.neighbors.list_neighbors(robot).tolist():
            offset = (_row(snapshot.positions, j) or 0j) - here
            gap = abs(offset) - self.radius - float(team.radius[j])
            self.others.append(_Thing(f"robot {names[j]}", offset, gap))
        self.others.sort(key=lambda other: abs(other.offset))
        self.forces, self.drag = _terms(snapshot.decision, robot), -self.viscosity * self.velocity
        self.resultant = sum(self.forces.values(), self.drag)
        # whether that is too little to move a robot visibly from rest
        largest = max(map(abs, self.forces.values()), default=0.0)
        self.balanced = abs(self.resultant) <= max(0.1 * largest, 0.1 * self.mass, NOTHING)
        near = [thing for thing in (self.solid, *self.others) if thing is not None]
        self.touched = [thing for thing in near if thing.gap <= MAX_CONTACT_GAP_M]
        pressed = [thing.name for thing in self.touched if _along(self.resultant, thing.offset) > 0.1]
        self.held_by = "" if self.balanced else " and ".join(pressed)
        self.stuck = self.aim is not None and abs(self.aim.offset) > FAR and self.aim.hidden != ""


def _terms(decision: Decision, robot: int) -> dict[str, complex]:
    """Return the forces by cause, N; none where their sum is no number."""
    if (total := _row(decision.forces, robot)) is None:
        return {}
    rows = {name: _row(term, robot) for name, term in decision.terms.items()}
    taken = {"", REST, "viscosity", "resultant"}  # names that mean something else here
    terms = {name: row for name, row in rows.items() if row is not None and name not in taken}
    rest = total - sum(terms.values())
    if not terms or abs(rest) > 1e-6 + 1e-9 * max(map(abs, (total, *terms.values()))):
        terms[REST] = rest
    return terms


def _aim(decision: Decision, environment: Environment, here: complex, robot: int) -> _Thing | None:
    if (goal := _row(decision.goals, robot)) is None:
        return None
    centroid = decision.cells is not None and goal == _row(decision.cells.centroid, robot)
    point, hidden = shapely.Point(goal.real, goal.imag), ""
    way = shapely.LineString([(here.real, here.imag), (goal.real, goal.imag)])
    if not environment.boundary_polygon.intersects(point):
        hidden = "outside the map"
    elif not environment.free.intersects(point):
        hidden = "inside an obstacle"
    elif shapely.difference(way, environment.free).length > MAX_CONTACT_GAP_M:
        across = shapely.difference(way, environment.boundary_polygon).length > MAX_CONTACT_GAP_M
        hidden = "behind the outer wall" if across else "behind an obstacle"
    return _Thing("its centroid" if centroid else "its goal", goal - here, hidden=hidden)


def _solid(environment: Environment, here: complex, point: complex | None, radius: float) -> _Thing | None:
    if point is None:
        line = shapely.shortest_line(shapely.Point(here.real, here.imag), environment.free.boundary)
        if line is None or line.length > radius + MAX_CONTACT_GAP_M:
            return None
        point = _row(shapely.get_coordinates(line), 1) or here
    place, name, nearest = shapely.Point(point.real, point.imag), "the obstacle", MAX_CONTACT_GAP_M
    for shape in environment.obstacles:
        if (distance := float(shape.polygon.distance(place))) < nearest:
            nearest, name = distance, "the wall" if isinstance(shape, WallObstacle) else "the obstacle"
    if environment.boundary_polygon.exterior.distance(place) < nearest:
        name = "the outer wall"
    return _Thing(name, point - here, abs(point - here) - radius)


def _row(values: object, row: int) -> complex | None:
    """Return one row of (n, 2); None where there is none or it holds no numbers."""
    try:
        x, y = np.asarray(values, dtype=np.float64)[row].tolist()
        return complex(x, y) if abs(x) < _HUGE and abs(y) < _HUGE else None
    except (TypeError, ValueError, IndexError):
        return None


def _along(vector: complex, way: complex) -> float:
    size = abs(vector) * abs(way)
    return (vector * way.conjugate()).real / size if size > 0.0 else 0.0


def _motion(case: _Case, recent: Array | None) -> str:
    """Return whether the robot is "moving", "trembling", at "rest" or "starting" from rest."""
    speed = abs(case.velocity)
    path = np.empty((0, 2)) if recent is None else recent[np.isfinite(recent).all(axis=1)]
    walked = float(np.hypot(*np.diff(path, axis=0).T).sum())
    rest = "starting" if not case.balanced and not case.held_by and walked < _SWAY else "rest"
    if len(path) < 2:
        return "moving" if speed > SLOW else rest
    if walked > 3.0 * max(_SWAY, float(np.hypot(*np.ptp(path, axis=0)))):
        return "trembling"  # to and fro, however wide
    net = complex(*(path[-1] - path[0]))
    if abs(net) >= SETTLED_DISTANCE_M:
        return "moving" if speed > 0.1 * SLOW else rest
    if speed <= SLOW:
        return rest
    # who has just set off has not come far either, but straight ahead
    ahead = _along(net, case.velocity) > 0.7 and walked < 1.5 * abs(net)
    return "moving" if ahead and abs(net) > 0.25 * speed**2 / case.strength else "trembling"


def _compass(vector: complex) -> str:
    return _WAYS[round(math.atan2(vector.imag, vector.real) / (math.pi / 4)) % 8] if vector else ""


def _number(value: float) -> str:
    """Return a number from 0 on with two digits after the point, one from 1 on and none from 10 on."""
    if value >= 9.95:
        return f"{value:.0f}" if value < 1e6 else "over a million"
    return "0" if value < 0.005 else f"{value:.2f}" if value < 0.995 else f"{value:.1f}"


def _length(meters: float) -> str:
    if meters < 0.00995:
        return f"{1000 * max(meters, 0.0):.0f} mm"
    return f"{100 * meters:.0f} cm" if meters < 0.995 else f"{_number(meters)} m"


def _force(newtons: float) -> str:
    return f"{1000 * newtons:.0f} mN" if NOTHING <= newtons < 0.00995 else f"{_number(newtons)} N"


def _verdict(case: _Case, motion: str) -> str:
    aim, held = case.aim, case.held_by
    where = f"{aim.name} is {aim.away}" if aim else ""
    pace = f"{_number(abs(case.velocity))} m/s {_compass(case.velocity)}"
    if motion == "trembling":
        return "trembling in place" + (f", stuck: {where}" if case.stuck else "")
    if motion == "moving":
        if held and abs(_along(case.velocity, case.resultant)) < 0.95:
            return f"sliding {pace} along {held}"
        if not case.balanced and _along(case.resultant, case.velocity) < -0.5:
            return f"braking from {pace}" + (f", {where}" if aim else "")
        ahead = aim is not None and _along(case.velocity, aim.offset) > 0.7
        return f"moving {pace}" + (f" to {aim.name}" if aim and ahead else f", {where}" if aim else "")
    if motion == "starting":
        ahead = aim is not None and _along(case.resultant, aim.offset) > 0.7
        return f"setting off {_compass(case.resultant)}" + (f" to {aim.name}" if aim and ahead else "")
    if case.stuck:
        return f"at rest, stuck: {where}"
    if not case.balanced and not held:
        pushed = f"a force of {_force(abs(case.resultant))} {_compass(case.resultant)} acts on it"
        return f"{_length(abs(aim.offset))} from {aim.name}, not at rest: {pushed}" if aim else pushed
    if aim and abs(aim.offset) <= FAR:
        near = "on" if abs(aim.offset) <= SETTLED_DISTANCE_M else f"{_length(abs(aim.offset))} from"
        return f"arrived: at rest {near} {aim.name}" + (f", which is {aim.hidden}" if aim.hidden else "")
    loaded = any(abs(vector) >= NOTHING for vector in case.forces.values())
    why = f"held by {held}" if held else "the forces balance" if loaded else "no force acts on it"
    return f"at rest {_length(abs(aim.offset))} short of {aim.name}: {why}" if aim else f"at rest, {why}"


def _forces(case: _Case) -> list[Line]:
    parts = [(_cause(case, kind, vector), vector, kind) for kind, vector in case.forces.items()]
    if case.viscosity > 0.0:
        slowed = f"held back {_force(abs(case.drag))}" if abs(case.drag) >= NOTHING else "not held back"
        parts.append((f"{slowed} by viscosity", case.drag, "viscosity"))
    way = _compass(case.resultant) if abs(case.resultant) >= NOTHING else ""
    parts.append((f"resultant {_force(abs(case.resultant))} {way}".rstrip(), case.resultant, "resultant"))
    return [Line(text, (vector.real, vector.imag), kind) for text, vector, kind in parts]


def _cause(case: _Case, kind: str, vector: complex) -> str:
    aim, none, away = case.aim, abs(vector) < NOTHING, False
    size, way = _force(abs(vector)), _compass(vector)
    if kind == "attraction" and aim:
        straight = _along(vector, aim.offset)
        how = f"pulled {size} to" if straight > 0.9 else f"pulled {size} {way} on the way to"
        how = f"braked {size} {way} on the way to" if straight < 0.0 else how
        return f"{'not pulled to' if none else how} {aim.name}, {aim.away}"
    cause = "the rest of its law" if kind == REST and len(case.forces) > 1 else _plain(kind)
    if kind == "repulsion_robots" and case.others and not none:
        far = 1.5 * abs(case.others[0].offset)
        nearest = [thing for thing in case.others[:2] if abs(thing.offset) <= far]
        cause = f"{' and '.join(thing.there for thing in nearest)} ({_robots(len(case.others))} in range)"
        away = len(nearest) == 1 and _along(vector, nearest[0].offset) < -0.9
    elif kind == "repulsion_obstacle" and case.solid:
        cause, away = case.solid.there, _along(vector, case.solid.offset) < -0.9
    return f"not pushed by {cause}" if none else f"pushed {size}{'' if away else ' ' + way} by {cause}"


def _called(case: _Case, kind: str) -> str:
    name = _plain(kind)
    if kind == "attraction" and case.aim:
        name = f"the pull to {case.aim.name}"
    elif kind in {"repulsion_robots", "repulsion_obstacle"}:
        solid = case.solid if kind == "repulsion_obstacle" else None
        name = f"the push of {solid.name if solid else name}"
    return f"{name} ({_force(abs(case.forces[kind]))})"


def _plain(kind: str) -> str:
    names = {"repulsion_robots": "robots", "repulsion_obstacle": "obstacles", REST: "its law"}
    return names.get(kind, kind.replace("_", " "))


def _robots(count: int) -> str:
    return f"{count} robot{'s' if count > 1 else ''}"


def _reasons(case: _Case, motion: str) -> list[str]:
    texts = ["its law gives no force that is a number"] if not case.forces else []
    wanted, speed, top = abs(case.resultant) / case.mass, abs(case.velocity), case.max_speed
    if wanted > 1.001 * case.strength:
        texts.append(f"limited: {_number(case.strength)} m/s² instead of {_number(wanted)} m/s²")
    if speed >= 0.995 * top:
        texts.append(f"{'at' if speed < 1.005 * top else 'faster than'} its top speed, {_number(top)} m/s")
    sizes = {kind: abs(vector) for kind, vector in case.forces.items() if abs(vector) >= NOTHING}
    if motion in {"moving", "starting"} or not sizes:
        return texts
    stuck = "stuck: " if case.stuck else ""
    if case.held_by:
        pressing = max(sizes, key=lambda kind: sizes[kind] * _along(case.forces[kind], case.resultant))
        return [*texts, f"{stuck}{_called(case, pressing)} presses it against {case.held_by}"]
    strong = sorted(sizes, key=lambda kind: -sizes[kind])
    pair = abs(sum(case.forces[kind] for kind in strong[:2])) < 0.2 * sizes[strong[0]]
    named = [kind for kind in sizes if kind in strong[: 2 if pair else 3]]
    if case.balanced and len(named) > 1:
        texts.append(stuck + " and ".join(_called(case, kind) for kind in named) + " balance")
    return texts


def _surroundings(case: _Case) -> list[str]:
    solid, others = case.solid, case.others
    texts = [f"touches {thing.beside}" for thing in case.touched]
    if case.aim and "attraction" not in case.forces:
        texts.append(f"{case.aim.name} is {case.aim.away}")
    if solid and case.sensing and solid not in case.touched:
        texts.append(f"{_length(solid.gap)} clear of {solid.beside}")
    if not case.sensing:
        within = f" within {_length(case.reach)}" if 0.0 < case.reach < _HUGE else ""
        texts.append(f"senses nothing{within}")
    hears = f"{_robots(len(others))}, the nearest is {others[0].there}" if others else "no other robot"
    return [*texts, f"hears {hears}"]
