"""Sentences of the report on a robot: position, forces, reasons, surroundings."""

from collections.abc import Callable
from dataclasses import dataclass

from robocov_app.viewer.explanation.motion_classification import Motion
from robocov_app.viewer.explanation.quantities import (
    MIN_FORCE_N,
    format_direction,
    format_force,
    format_length,
    format_number,
    format_robot_count,
)
from robocov_app.viewer.explanation.situation import (
    UNEXPLAINED_FORCE,
    RobotSituation,
    compute_alignment,
)

MAX_NAMED_FORCES = 3
_MIN_SPEED_M_S = 0.005  # slower robots are described as at rest
_BALANCE_FRACTION = 0.2  # forces balance if their sum is below this fraction of the largest one
_STRAIGHT_ALIGNMENT = 0.9  # cosine above which a force points straight at something, or straight away from it
_NEIGHBOR_RATIO = 1.5  # the second neighbor is named if it is at most this many times as far as the first
_FAST_ACCELERATION = 1.001  # fraction of the maximum acceleration above which the acceleration is limited
_FULL_SPEED = (0.995, 1.005)  # fractions of the maximum speed between which a robot is at that speed
_MAX_LISTED_RANGE_M = 1e100

_REPULSIONS = ("repulsion_robots", "repulsion_obstacle")
_FORCE_NAMES = {
    "repulsion_robots": "robots",
    "repulsion_obstacle": "obstacles",
    UNEXPLAINED_FORCE: "its controller",
}


@dataclass(frozen=True)
class ReportLine:
    """A sentence of the report.

    Attributes
    ----------
    text : str
        The sentence.
    vector : tuple of float or None
        The force that the sentence is about, (x, y) N.
    kind : str
        Kind of force: a term of the controller, `UNEXPLAINED_FORCE`, ``viscosity``, ``resultant`` or
        ``contact``; empty if the sentence is not about a force.
    """

    text: str
    vector: tuple[float, float] | None = None
    kind: str = ""


def build_position_line(situation: RobotSituation) -> ReportLine:
    """Return the sentence on position and speed."""
    # Adding zero turns -0.0 into 0.0.
    x = round(situation.position.real, 2) + 0.0
    y = round(situation.position.imag, 2) + 0.0
    speed = "at rest"
    if situation.speed >= _MIN_SPEED_M_S:
        speed = f"{format_number(situation.speed)} m/s {format_direction(situation.velocity)}"
    return ReportLine(f"at ({x:.2f}, {y:.2f}) m, {speed}")


def list_force_lines(situation: RobotSituation) -> list[ReportLine]:
    """Return a sentence for each force, and last one for the resultant, which is their sum."""
    lines: list[ReportLine] = []
    for kind, force in situation.forces.items():
        describe = _FORCE_DESCRIPTIONS.get(kind, _describe_push)
        lines.append(_build_force_line(describe(situation, kind, force), kind, force))
    if situation.viscosity > 0.0:
        drag = abs(situation.drag)
        text = "not slowed by viscosity"
        if drag >= MIN_FORCE_N:
            text = f"slowed with {format_force(drag)} by viscosity"
        lines.append(_build_force_line(text, "viscosity", situation.drag))
    size = abs(situation.resultant)
    direction = format_direction(situation.resultant) if size >= MIN_FORCE_N else ""
    text = f"resultant of these forces {format_force(size)} {direction}".rstrip()
    if situation.holding_names:
        text += f", opposed by {situation.holding_names}"
    lines.append(_build_force_line(text, "resultant", situation.resultant))
    return lines


def list_contact_lines(situation: RobotSituation, contact_force: complex) -> list[ReportLine]:
    """Return a sentence on the force of contacts, x + i y N, unless it is negligible.

    The resultant does not include this force, which is the answer of the touched objects to it.
    """
    if abs(contact_force) < MIN_FORCE_N:
        return []
    names = " and ".join(touched.name for touched in situation.touched)
    push = f"pushed {format_direction(contact_force)} with {format_force(abs(contact_force))}"
    return [_build_force_line(f"{push} by contact with {names}", "contact", contact_force)]


def _build_force_line(text: str, kind: str, force: complex) -> ReportLine:
    return ReportLine(text, (force.real, force.imag), kind)


def _describe_attraction(situation: RobotSituation, kind: str, force: complex) -> str:
    """Describe the pull to the goal, which may point elsewhere to avoid obstacles or to brake."""
    goal = situation.goal
    if goal is None:
        return _describe_push(situation, kind, force)
    size = format_force(abs(force))
    direction = format_direction(force)
    alignment = compute_alignment(force, goal.offset)
    if abs(force) < MIN_FORCE_N:
        text = "not pulled toward"
    elif alignment < 0.0:
        text = f"braked with {size} on the way to"
    elif alignment > _STRAIGHT_ALIGNMENT:
        text = f"pulled with {size} toward"
    else:
        text = f"pulled {direction} with {size} on the way to"
    return f"{text} {goal.name}, {goal.distance_text}"


def _describe_robot_repulsion(situation: RobotSituation, kind: str, force: complex) -> str:
    """Describe the push by other robots, and name the nearest one or two."""
    neighbors = situation.neighbors
    if not neighbors or abs(force) < MIN_FORCE_N:
        return _describe_push(situation, kind, force)
    max_distance = _NEIGHBOR_RATIO * abs(neighbors[0].offset)
    nearest = [neighbor for neighbor in neighbors[:2] if abs(neighbor.offset) <= max_distance]
    names = " and ".join(neighbor.position_text for neighbor in nearest)
    source = f"{names} ({format_robot_count(len(neighbors))} in range)"
    if len(nearest) == 1 and compute_alignment(force, nearest[0].offset) < -_STRAIGHT_ALIGNMENT:
        return f"repelled with {format_force(abs(force))} by {source}"
    return f"repelled {format_direction(force)} with {format_force(abs(force))} by {source}"


def _describe_obstacle_repulsion(situation: RobotSituation, kind: str, force: complex) -> str:
    obstacle = situation.obstacle
    if obstacle is None:
        return _describe_push(situation, kind, force)
    source = obstacle.position_text
    if abs(force) < MIN_FORCE_N:
        return f"not repelled by {source}"
    if compute_alignment(force, obstacle.offset) < -_STRAIGHT_ALIGNMENT:
        return f"repelled with {format_force(abs(force))} by {source}"
    return f"repelled {format_direction(force)} with {format_force(abs(force))} by {source}"


def _describe_push(situation: RobotSituation, kind: str, force: complex) -> str:
    """Describe a force only by its name, magnitude and direction."""
    source = _name_force(kind)
    if kind == UNEXPLAINED_FORCE and len(situation.forces) > 1:
        source = "other forces of its controller"
    verb = "repelled" if kind in _REPULSIONS else "pushed"
    if abs(force) < MIN_FORCE_N:
        return f"not {verb} by {source}"
    return f"{verb} {format_direction(force)} with {format_force(abs(force))} by {source}"


_FORCE_DESCRIPTIONS: dict[str, Callable[[RobotSituation, str, complex], str]] = {
    "attraction": _describe_attraction,
    "repulsion_robots": _describe_robot_repulsion,
    "repulsion_obstacle": _describe_obstacle_repulsion,
}


def list_reasons(situation: RobotSituation, motion: Motion) -> list[str]:
    """Return the reasons why the robot is slower than its forces suggest, or does not move."""
    return [*_list_limits(situation), *_list_rest_reasons(situation, motion)]


def _list_limits(situation: RobotSituation) -> list[str]:
    """Describe the limits of acceleration and speed that the robot has reached."""
    texts: list[str] = []
    if not situation.forces:
        texts.append("its controller returned an invalid force")
    acceleration = abs(situation.resultant) / situation.mass
    limit = situation.max_acceleration
    if acceleration > _FAST_ACCELERATION * limit:
        allowed = format_number(limit)
        requested = format_number(acceleration)
        if requested != allowed:
            texts.append(f"acceleration limited to {allowed} m/s² (the forces ask for {requested} m/s²)")
    max_speed = situation.max_speed
    low, high = _FULL_SPEED
    if situation.speed >= low * max_speed:
        relation = "at" if situation.speed < high * max_speed else "faster than"
        texts.append(f"{relation} its maximum speed, {format_number(max_speed)} m/s")
    return texts


def _list_rest_reasons(situation: RobotSituation, motion: Motion) -> list[str]:
    """For a robot that does not move steadily, return which object holds it, or which forces balance."""
    forces = {kind: force for kind, force in situation.forces.items() if abs(force) >= MIN_FORCE_N}
    if motion in (Motion.MOVING, Motion.STARTING) or not forces:
        return []
    prefix = "stuck: " if situation.is_stuck else ""
    if situation.holding_names:
        pressing = max(forces, key=lambda kind: _compute_component(forces[kind], situation.resultant))
        name = _name_force_with_size(situation, pressing)
        return [f"{prefix}{name} presses it against {situation.holding_names}"]
    balancing = _find_balancing_forces(forces)
    # While a robot still creeps, viscosity is one of the forces that cancel, and the others do not balance.
    if not situation.is_balanced or len(balancing) < 2 or not _are_balanced(list(forces.values())):
        return []
    names = " and ".join(_name_force_with_size(situation, kind) for kind in balancing)
    return [f"{prefix}{names} balance"]


def _compute_component(force: complex, direction: complex) -> float:
    return abs(force) * compute_alignment(force, direction)


def _find_balancing_forces(forces: dict[str, complex]) -> list[str]:
    """Return the kinds of the two strongest forces if they cancel, or else of the three strongest."""
    strongest = sorted(forces, key=lambda kind: -abs(forces[kind]))
    is_pair = _are_balanced([forces[kind] for kind in strongest[:2]])
    named = strongest[: 2 if is_pair else MAX_NAMED_FORCES]
    return [kind for kind in forces if kind in named]


def _are_balanced(forces: list[complex]) -> bool:
    """Return whether the sum of forces is much smaller than the largest one."""
    return abs(sum(forces)) < _BALANCE_FRACTION * max(map(abs, forces))


def _name_force_with_size(situation: RobotSituation, kind: str) -> str:
    name = _name_force(kind)
    if kind == "attraction" and situation.goal is not None:
        name = f"the pull to {situation.goal.name}"
    elif kind == "repulsion_obstacle" and situation.obstacle is not None:
        name = f"the repulsion of {situation.obstacle.name}"
    elif kind in _REPULSIONS:
        name = f"the repulsion of {name}"
    return f"{name} ({format_force(abs(situation.forces[kind]))})"


def _name_force(kind: str) -> str:
    return _FORCE_NAMES.get(kind, kind.replace("_", " "))


def list_surroundings(situation: RobotSituation) -> list[str]:
    """Describe the objects that the robot touches and senses, and its communication partners."""
    texts = [f"touches {touched.side_text}" for touched in situation.touched]
    goal = situation.goal
    if goal is not None and "attraction" not in situation.forces:
        texts.append(f"{goal.name} is {goal.distance_text}")
    texts += _list_sensed(situation)
    neighbors = situation.neighbors
    if len(neighbors) == 1:
        texts.append(f"1 robot in communication range: {neighbors[0].position_text}")
    elif neighbors:
        count = format_robot_count(len(neighbors))
        texts.append(f"{count} in communication range; the nearest is {neighbors[0].position_text}")
    else:
        texts.append("no robot in communication range")
    return texts


def _list_sensed(situation: RobotSituation) -> list[str]:
    obstacle = situation.obstacle
    if situation.senses_obstacle:
        if obstacle is None or obstacle in situation.touched:
            return []
        return [f"its rim is {format_length(obstacle.gap)} from {obstacle.side_text}"]
    if 0.0 < situation.sensing_range < _MAX_LISTED_RANGE_M:
        return [f"senses nothing within {format_length(situation.sensing_range)}"]
    return ["senses nothing"]
