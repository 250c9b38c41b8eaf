"""The situation of one robot: its forces, its goal and its surroundings.

Vectors in the plane are complex numbers, x + i y. Distances to goals, obstacle points and other robots are
measured from the robot's center, as in the controllers; gaps are measured from its rim.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from robocov.environment import Environment, WallObstacle
from robocov.metrics import MAX_CONTACT_GAP_M
from robocov.observation import Decision, Snapshot
from robocov.team import Team
from robocov_app.viewer.explanation.quantities import MIN_FORCE_N, format_direction, format_length

UNEXPLAINED_FORCE = "controller"
"""Kind of the remainder of a controller's force that its terms do not account for."""
MIN_SHORTFALL_M = 0.3
"""A robot that rests farther from its goal than this has not arrived."""

_BALANCE_FRACTION = 0.1  # a resultant below this fraction of the largest force counts as zero;
_BALANCE_ACCELERATION = 0.1  # so does one that accelerates the robot by less than this, m/s²
_MIN_PRESSING_ALIGNMENT = 0.1  # cosine above which the resultant presses the robot against an object
# A remainder of the force below the sum of these is a rounding error.
_FORCE_TOLERANCE_N = 1e-6
_RELATIVE_FORCE_TOLERANCE = 1e-9
_MAX_VALUE = 1e100  # larger numbers would overflow in products
_RESERVED_KINDS = frozenset({"", UNEXPLAINED_FORCE, "viscosity", "resultant", "contact"})


@dataclass(frozen=True)
class NearbyObject:
    """An object near the robot.

    Attributes
    ----------
    name : str
        Its name in a sentence.
    offset : complex
        Vector from the robot's center, m.
    gap : float
        Distance from the robot's rim, m.
    obstruction : str
        What obstructs the straight line from the robot to it; empty if nothing does.
    """

    name: str
    offset: complex
    gap: float = math.inf
    obstruction: str = ""

    @property
    def distance_text(self) -> str:
        """Its distance, such as ``3.0 m away, behind an obstacle``."""
        text = f"{format_length(abs(self.offset))} away"
        if self.obstruction:
            return f"{text}, {self.obstruction}"
        return text

    @property
    def position_text(self) -> str:
        """Its name and relative position, such as ``robot 7, 80 cm west``."""
        distance = format_length(abs(self.offset))
        return f"{self.name}, {distance} {format_direction(self.offset)}".rstrip()

    @property
    def side_text(self) -> str:
        """Its name and direction, such as ``the wall south of it``."""
        if self.offset:
            return f"{self.name} {format_direction(self.offset)} of it"
        return self.name


class RobotSituation:
    """All facts for the report on a robot, in SI units.

    Parameters
    ----------
    snapshot : Snapshot
        What all robots observed and decided.
    team : Team
        The team.
    environment : Environment
        The map, with failed robots as obstacles. The robot itself does not know the map.
    robot : int
        Row of the robot in arrays.
    numbers : sequence of int
        Numbers of the robots.

    Attributes
    ----------
    number : int
        Number of the robot.
    mass, radius, max_speed, max_acceleration, viscosity, sensing_range : float
        Its properties.
    position, velocity : complex
        Position, m, and velocity, m/s.
    goal : NearbyObject or None
        Goal of the robot; None if its controller has none.
    senses_obstacle : bool
        Whether there is an obstacle in sensing range.
    obstacle : NearbyObject or None
        The nearest obstacle point that it senses, or one that it touches without sensing it.
    neighbors : list of NearbyObject
        Robots in communication range, nearest first.
    forces : dict of str to complex
        Terms of the controller's force, N, and the unexplained remainder; empty if the force is not finite.
    drag : complex
        Viscous force, N.
    resultant : complex
        Sum of all forces, N, before limits and contact forces.
    is_balanced : bool
        Whether the resultant is too small to set the robot visibly in motion.
    touched : list of NearbyObject
        Objects that it touches.
    holding_names : str
        Names of the objects against which it is pressed; empty for none.
    is_stuck : bool
        Whether it is far from its goal, and something obstructs the straight line to it.
    """

    def __init__(
        self, snapshot: Snapshot, team: Team, environment: Environment, robot: int, numbers: Sequence[int]
    ) -> None:
        """Collect the facts in the order in which they depend on each other."""
        self.number = numbers[robot]
        self.mass = float(team.mass[robot])
        self.radius = float(team.radius[robot])
        self.max_speed = float(team.max_speed[robot])
        self.max_acceleration = float(team.max_acceleration[robot])
        self.viscosity = float(team.viscosity[robot])
        self.sensing_range = float(team.sensing_range[robot])
        self.position = _get_vector(snapshot.positions, robot) or 0j
        self.velocity = _get_vector(snapshot.velocities, robot) or 0j
        self.goal = _build_goal(snapshot.decision, environment, self.position, robot)
        sensed_point = _get_vector(snapshot.seen.obstacle_points, robot)
        self.senses_obstacle = sensed_point is not None
        self.obstacle = _build_obstacle(environment, self.position, sensed_point, self.radius)
        self.neighbors = self._list_neighbors(snapshot, team, robot, numbers)
        self.forces = _split_force(snapshot.decision, robot)
        self.drag = -self.viscosity * self.velocity
        # Limits of speed and acceleration, and contact forces, are not included.
        self.resultant = sum(self.forces.values(), self.drag)
        self.is_balanced = self._is_balanced()
        self.touched = self._list_touched()
        self.holding_names = "" if self.is_balanced else self._name_pressed_objects()
        self.is_stuck = (
            self.goal is not None and abs(self.goal.offset) > MIN_SHORTFALL_M and self.goal.obstruction != ""
        )

    @property
    def speed(self) -> float:
        """Speed, m/s."""
        return abs(self.velocity)

    def _list_neighbors(
        self, snapshot: Snapshot, team: Team, robot: int, numbers: Sequence[int]
    ) -> list[NearbyObject]:
        neighbors: list[NearbyObject] = []
        for other in snapshot.seen.neighbors.list_neighbors(robot).tolist():
            offset = (_get_vector(snapshot.positions, other) or 0j) - self.position
            gap = abs(offset) - self.radius - float(team.radius[other])
            neighbors.append(NearbyObject(f"robot {numbers[other]}", offset, gap))
        return sorted(neighbors, key=lambda neighbor: abs(neighbor.offset))

    def _is_balanced(self) -> bool:
        largest = max(map(abs, self.forces.values()), default=0.0)
        negligible = max(_BALANCE_FRACTION * largest, _BALANCE_ACCELERATION * self.mass, MIN_FORCE_N)
        return abs(self.resultant) <= negligible

    def _list_touched(self) -> list[NearbyObject]:
        nearby = list(self.neighbors)
        if self.obstacle is not None:
            nearby.insert(0, self.obstacle)
        return [item for item in nearby if item.gap <= MAX_CONTACT_GAP_M]

    def _name_pressed_objects(self) -> str:
        """Return the names of the touched objects against which the resultant presses the robot."""

        def is_pressed(item: NearbyObject) -> bool:
            return compute_alignment(self.resultant, item.offset) > _MIN_PRESSING_ALIGNMENT

        return " and ".join(item.name for item in self.touched if is_pressed(item))


def compute_alignment(first: complex, second: complex) -> float:
    """Return the cosine of the angle between two vectors; 0 if one of them is zero."""
    size = abs(first) * abs(second)
    if size > 0.0:
        return (first * second.conjugate()).real / size
    return 0.0


def _get_vector(values: object, row: int) -> complex | None:
    """Return one row of an (n, 2) array as x + i y; None if it does not exist or is not finite.

    User-defined controllers may return anything as a term.
    """
    try:
        x, y = np.asarray(values, dtype=np.float64)[row].tolist()
        is_usable = abs(x) < _MAX_VALUE and abs(y) < _MAX_VALUE
    except (TypeError, ValueError, IndexError):
        return None
    if is_usable:
        return complex(x, y)
    return None


def _split_force(decision: Decision, robot: int) -> dict[str, complex]:
    """Return the controller's force on a robot, split into its terms, N; empty if it is not finite."""
    total = _get_vector(decision.forces, robot)
    if total is None:
        return {}
    terms: dict[str, complex] = {}
    for name, values in decision.terms.items():
        term = _get_vector(values, robot)
        if term is not None and name not in _RESERVED_KINDS:
            terms[name] = term
    unexplained = total - sum(terms.values())
    largest = max(map(abs, (total, *terms.values())))
    tolerance = _FORCE_TOLERANCE_N + _RELATIVE_FORCE_TOLERANCE * largest
    if not terms or abs(unexplained) > tolerance:
        terms[UNEXPLAINED_FORCE] = unexplained
    return terms


def _build_goal(
    decision: Decision, environment: Environment, position: complex, robot: int
) -> NearbyObject | None:
    goal = _get_vector(decision.goals, robot)
    if goal is None:
        return None
    is_centroid = decision.cells is not None and goal == _get_vector(decision.cells.centroids, robot)
    name = "its centroid" if is_centroid else "its goal"
    return NearbyObject(name, goal - position, obstruction=_find_obstruction(environment, position, goal))


def _find_obstruction(environment: Environment, position: complex, goal: complex) -> str:
    """Describe what prevents a robot from moving straight to its goal; empty if nothing does."""
    point = shapely.Point(goal.real, goal.imag)
    if not environment.boundary_polygon.intersects(point):
        return "outside the map"
    if not environment.free.intersects(point):
        return "inside an obstacle"
    route = shapely.LineString([(position.real, position.imag), (goal.real, goal.imag)])
    if shapely.difference(route, environment.free).length <= MAX_CONTACT_GAP_M:
        return ""
    if shapely.difference(route, environment.boundary_polygon).length > MAX_CONTACT_GAP_M:
        return "behind the outer wall"
    return "behind an obstacle"


def _build_obstacle(
    environment: Environment, position: complex, sensed_point: complex | None, radius: float
) -> NearbyObject | None:
    """Return the obstacle that a robot senses or touches; None if there is no such obstacle."""
    point = sensed_point
    if point is None:
        center = shapely.Point(position.real, position.imag)
        shortest = shapely.shortest_line(center, environment.free.boundary)
        if shortest is None or shortest.length > radius + MAX_CONTACT_GAP_M:
            return None
        x, y = shapely.get_coordinates(shortest)[1].tolist()
        point = complex(x, y)
    name = _name_obstacle(environment, point)
    return NearbyObject(name, point - position, abs(point - position) - radius)


def _name_obstacle(environment: Environment, position: complex) -> str:
    """Return the name of the obstacle with a given point on its outline."""
    point = shapely.Point(position.real, position.imag)
    name = "the obstacle"
    nearest = MAX_CONTACT_GAP_M
    for obstacle in environment.obstacles:
        distance = float(obstacle.polygon.distance(point))
        if distance < nearest:
            nearest = distance
            name = "the wall" if isinstance(obstacle, WallObstacle) else "the obstacle"
    if environment.boundary_polygon.exterior.distance(point) < nearest:
        return "the outer wall"
    return name
