"""The first sentence of the report on a robot, by its motion."""

from robocov.metrics import SETTLED_DISTANCE_M
from robocov_app.viewer.explanation.motion_classification import Motion
from robocov_app.viewer.explanation.quantities import (
    MIN_FORCE_N,
    format_direction,
    format_force,
    format_length,
    format_number,
)
from robocov_app.viewer.explanation.situation import (
    MIN_SHORTFALL_M,
    NearbyObject,
    RobotSituation,
    compute_alignment,
)

MIN_AHEAD_ALIGNMENT = 0.7
"""A robot heads for its goal if the cosine of the angle between its direction and the goal is greater."""

_SLIDING_ALIGNMENT = 0.95  # cosine below which force and motion differ in direction: the robot slides
_BRAKING_ALIGNMENT = -0.5  # cosine below which the force is opposed to the motion: the robot brakes


def describe_motion(situation: RobotSituation, motion: Motion) -> str:
    """Describe the motion of a robot and its goal in one sentence."""
    return _DESCRIPTIONS[motion](situation)


def _describe_trembling(situation: RobotSituation) -> str:
    text = "trembling in place"
    if situation.is_stuck:
        return f"{text}, stuck: {_describe_goal(situation)}"
    return text


def _describe_trembling_at_rest(situation: RobotSituation) -> str:
    text = f"at rest (trembling by less than {format_length(SETTLED_DISTANCE_M)})"
    if situation.is_stuck:
        return f"{text}, stuck: {_describe_goal(situation)}"
    return text


def _describe_moving(situation: RobotSituation) -> str:
    pace = f"{format_number(situation.speed)} m/s"
    direction = format_direction(situation.velocity)
    alignment = compute_alignment(situation.velocity, situation.resultant)
    if situation.holding_names and abs(alignment) < _SLIDING_ALIGNMENT:
        return f"sliding {direction} at {pace} along {situation.holding_names}"
    if not situation.is_balanced and alignment < _BRAKING_ALIGNMENT:
        return _append_goal(f"braking from {pace} {direction}", situation)
    if _is_ahead(situation.goal, situation.velocity):
        return f"moving {direction} to {_name(situation.goal)} at {pace}"
    return _append_goal(f"moving {direction} at {pace}", situation)


def _describe_starting(situation: RobotSituation) -> str:
    text = f"setting off {format_direction(situation.resultant)}"
    if _is_ahead(situation.goal, situation.resultant):
        return f"{text} to {_name(situation.goal)}"
    return text


def _describe_rest(situation: RobotSituation) -> str:
    """Describe a robot at rest: stuck, pushed, arrived, or held short of its goal."""
    goal = situation.goal
    if situation.is_stuck:
        return f"at rest, stuck: {_describe_goal(situation)}"
    if not situation.is_balanced and not situation.holding_names:
        return _describe_pushed(situation)
    if goal is None:
        return f"at rest, {_explain_rest(situation)}"
    if abs(goal.offset) <= MIN_SHORTFALL_M:
        return _describe_arrival(goal)
    return f"at rest {format_length(abs(goal.offset))} short of {goal.name}: {_explain_rest(situation)}"


def _describe_pushed(situation: RobotSituation) -> str:
    """Describe a robot that stays in place although an unbalanced force acts on it."""
    size = format_force(abs(situation.resultant))
    push = f"a force of {size} {format_direction(situation.resultant)} acts on it"
    goal = situation.goal
    if goal is None:
        return push
    return f"{format_length(abs(goal.offset))} from {goal.name}, not at rest: {push}"


def _describe_arrival(goal: NearbyObject) -> str:
    distance = abs(goal.offset)
    text = f"arrived: at rest on {goal.name}"
    if distance > SETTLED_DISTANCE_M:
        text = f"at rest {format_length(distance)} from {goal.name}"
    if goal.obstruction:
        return f"{text}, which is {goal.obstruction}"
    return text


def _explain_rest(situation: RobotSituation) -> str:
    if situation.holding_names:
        return f"held by {situation.holding_names}"
    has_force = any(abs(force) >= MIN_FORCE_N for force in situation.forces.values())
    if has_force:
        return "the forces balance"
    return "no force acts on it"


_DESCRIPTIONS = {
    Motion.TREMBLING: _describe_trembling,
    Motion.TREMBLING_AT_REST: _describe_trembling_at_rest,
    Motion.MOVING: _describe_moving,
    Motion.STARTING: _describe_starting,
    Motion.AT_REST: _describe_rest,
}


def _is_ahead(goal: NearbyObject | None, direction: complex) -> bool:
    """Return whether the goal lies approximately in a direction."""
    return goal is not None and compute_alignment(direction, goal.offset) > MIN_AHEAD_ALIGNMENT


def _name(goal: NearbyObject | None) -> str:
    if goal is None:
        return ""
    return goal.name


def _describe_goal(situation: RobotSituation) -> str:
    goal = situation.goal
    if goal is None:
        return ""
    return f"{goal.name} is {goal.distance_text}"


def _append_goal(text: str, situation: RobotSituation) -> str:
    if situation.goal is None:
        return text
    return f"{text}; {_describe_goal(situation)}"
