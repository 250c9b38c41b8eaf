"""Estimates of positions from noisy and late measurements.

A robot estimates its own position by dead reckoning and position fixes, and the positions of others by
alpha-beta filters.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.observation import Observations
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_AVERAGING_S = 2.0
"""Time constant with which position fixes are averaged."""
_OUTLIER_SIGMAS = 6.0
"""Deviation of a fix from the prediction, in standard deviations, that shows that the robot was displaced."""
_MIN_FIXES = 10
"""Number of fixes from which the noise can be estimated."""
_MIN_DISTANCE_M = 1e-9
"""Minimum divisor; prevents division by zero."""
_MIN_SIGMA_M = 1e-9
"""Minimum divisor; prevents division by zero."""
_SENT_TOLERANCE_S = 1e-6
"""Minimum difference between the times at which two messages were sent; smaller ones are due to rounding."""
_MANEUVER_FRACTION = 0.5
"""Assumed acceleration of others, as a fraction of their maximum acceleration."""
_MAX_EXTRAPOLATION_S = 1.5
"""Maximum time for which others are assumed to keep their velocities."""
_UNCERTAINTY_SIGMAS = 1.0
"""Uncertainty of a position that is due to noise, in standard deviations of a fix."""
_UNCERTAINTY_SPEED = 1.0
"""Speed in m/s at which the uncertainty grows with the age of a message."""
_MAX_UNCERTAINTY_FRACTION = 0.75
"""Upper limit of the uncertainty, as a fraction of the estimated distance."""


class Tracks(NamedTuple):
    """Filter states of the other robots, from their messages. Entry (i, j) is robot i's track of robot j."""

    sent_times: FloatArray
    """(n, n) s, time at which the newest message was sent; nan for none."""
    counts: IntArray
    """(n, n) Number of messages; 0 if there is no track."""
    positions: FloatArray
    """(n, n, 2) m, filtered position when the newest message was sent."""
    velocities: FloatArray
    """(n, n, 2) m/s, filtered velocity at that time."""


class _Messages(NamedTuple):
    """The newest message that each robot has received from each of its neighbors."""

    receivers: IntArray
    """(k,) Index of the robot that has each message."""
    senders: IntArray
    """(k,) Index of the robot that sent it."""
    positions: FloatArray
    """(k, 2) Reported position of the sender, m."""
    sent_times: FloatArray
    """(k,) Time at which each message was sent, s."""


class Estimates(NamedTuple):
    """Filter states of n robots: for their own positions, and for the positions of others."""

    time: float
    """Time of the last position fixes, s."""
    positions: FloatArray
    """(n, 2) m, each robot's estimate of its own position."""
    velocities: FloatArray
    """(n, 2) m/s, velocities of the robots."""
    fix_counts: FloatArray
    """(n,) Number of position fixes since the start, or since the robot was displaced."""
    variances: FloatArray
    """(n,) m², estimated variance of one fix, in x or in y."""
    tracks: Tracks

    @classmethod
    def build_initial(cls, n: int) -> Estimates:
        """Build the state of n robots before the first observation."""
        tracks = Tracks(
            sent_times=np.full((n, n), np.nan),
            counts=np.zeros((n, n), dtype=np.intp),
            positions=np.zeros((n, n, 2)),
            velocities=np.zeros((n, n, 2)),
        )
        return cls(
            time=0.0,
            positions=np.zeros((n, 2)),
            velocities=np.zeros((n, 2)),
            fix_counts=np.zeros(n),
            variances=np.zeros(n),
            tracks=tracks,
        )


def estimate_positions(seen: Observations, previous: Estimates, team: Team) -> tuple[Observations, Estimates]:
    """Estimate the positions of robots and of their neighbors.

    Parameters
    ----------
    seen : Observations
        Observations with noisy positions of the robots, and reported positions of their neighbors.
    previous : Estimates
        Filter states after the previous observations.
    team : Team

    Returns
    -------
    estimated : Observations
        The observations with estimated positions.
    estimates : Estimates
        Filter states after these observations.

    Notes
    -----
    A robot integrates its own velocity, and corrects the result using the residuals of its position fixes,
    averaged over two seconds. It tracks others from their messages by alpha-beta filters with the
    steady-state gains of Kalata (1984, *The tracking index*), and with larger gains for the first messages.
    It assumes that the messages are as noisy as its own fixes, and that the others keep their velocities for
    at most 1.5 seconds after their last message.
    """
    assert seen.reported_positions is not None and seen.report_ages is not None
    positions, fix_counts, variances = _filter_own_positions(seen, previous, team)
    robots, neighbors = seen.neighbors.list_pairs()
    messages = _Messages(
        receivers=robots,
        senders=neighbors,
        positions=seen.reported_positions,
        sent_times=seen.time - seen.report_ages,
    )
    tracks = _update_tracks(
        previous.tracks,
        messages,
        sigmas=np.sqrt(variances),
        accelerations=_MANEUVER_FRACTION * team.max_acceleration,
        max_speeds=team.max_speed,
    )
    estimates = Estimates(
        time=seen.time,
        positions=positions,
        velocities=seen.velocities,
        fix_counts=fix_counts,
        variances=variances,
        tracks=tracks,
    )
    ages = np.clip(seen.time - tracks.sent_times[robots, neighbors], 0.0, _MAX_EXTRAPOLATION_S)
    neighbor_positions = (
        tracks.positions[robots, neighbors] + ages[:, None] * tracks.velocities[robots, neighbors]
    )
    # The sensor measures obstacle points relative to the robot, so they move with its position.
    obstacle_points = seen.obstacle_points - seen.positions + positions
    estimated = replace(
        seen, positions=positions, obstacle_points=obstacle_points, reported_positions=neighbor_positions
    )
    return estimated, estimates


def _filter_own_positions(
    seen: Observations, previous: Estimates, team: Team
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the positions, the numbers of fixes, and their variances, after one more fix of each robot."""
    dt = seen.time - previous.time
    predicted = previous.positions + 0.5 * dt * (previous.velocities + seen.velocities)
    squared_residual = ((seen.positions - predicted) ** 2).sum(axis=1)
    # A residual that is too large for noise means that something has displaced the robot: start again. The
    # variance is that of one coordinate, so both together have twice the variance.
    max_squared_residual = 2.0 * _OUTLIER_SIGMAS**2 * previous.variances + (team.max_speed * dt) ** 2
    was_displaced = (squared_residual > max_squared_residual) & (previous.fix_counts >= _MIN_FIXES)
    fix_counts = np.where(was_displaced, 1.0, previous.fix_counts + 1.0)
    # The estimate is the mean of all fixes at first, and of those of the last few seconds later.
    gain = np.maximum(1.0 / fix_counts, min(dt / _AVERAGING_S, 1.0))
    positions = predicted + gain[:, None] * (seen.positions - predicted)
    # The residual of fix k contains its own error, and that of the mean of k - 1 earlier fixes: its variance
    # is larger than that of a fix by the factor 1 + 1 / (k - 1) = 1 / (1 - 1 / k). A residual has two
    # coordinates, hence the factor 0.5.
    squared_error = 0.5 * squared_residual * (1.0 - 1.0 / np.maximum(fix_counts, 1.0))
    # The first fix has no residual, so there is one residual fewer to average than there are fixes.
    variance_gain = np.maximum(1.0 / np.maximum(fix_counts - 1.0, 1.0), gain)
    variances = previous.variances + variance_gain * (squared_error - previous.variances)
    variances = np.where(was_displaced, previous.variances, variances)
    return positions, fix_counts, variances


def assume_closer_neighbors(seen: Observations, estimates: Estimates) -> Observations:
    """Return the observations with each neighbor moved closer by the uncertainty of its position.

    A robot that avoids collisions with these positions also avoids them if a neighbor is closer than
    estimated. The uncertainty grows with the localization noise and with the age of the neighbor's message.

    Parameters
    ----------
    seen : Observations
        Observations returned by `estimate_positions`.
    estimates : Estimates
        Estimates returned by the same call.

    Returns
    -------
    Observations
    """
    assert seen.reported_positions is not None
    robots, neighbors = seen.neighbors.list_pairs()
    offset = seen.reported_positions - seen.positions[robots]
    distance = np.sqrt((offset**2).sum(axis=1))
    ages = np.clip(seen.time - estimates.tracks.sent_times[robots, neighbors], 0.0, _MAX_EXTRAPOLATION_S)
    uncertainty = _UNCERTAINTY_SIGMAS * np.sqrt(estimates.variances[robots]) + _UNCERTAINTY_SPEED * ages
    uncertainty = np.minimum(uncertainty, _MAX_UNCERTAINTY_FRACTION * distance)
    factor = 1.0 - uncertainty / np.maximum(distance, _MIN_DISTANCE_M)
    return replace(seen, reported_positions=seen.positions[robots] + factor[:, None] * offset)


@kernel
def _update_tracks(
    previous: Tracks,
    messages: _Messages,
    sigmas: FloatArray,
    accelerations: FloatArray,
    max_speeds: FloatArray,
) -> Tracks:
    """Return the tracks after the newest messages. Messages that the tracks already contain are ignored.

    Parameters
    ----------
    previous : Tracks
    messages : _Messages
    sigmas : (n,) array, m
        Standard deviation of the position fixes of each robot.
    accelerations : (n,) array, m/s²
        Acceleration that each robot assumes of the others.
    max_speeds : (n,) array, m/s
        Maximum speed that each robot assumes of the others.
    """
    tracks = Tracks(
        sent_times=previous.sent_times.copy(),
        counts=previous.counts.copy(),
        positions=previous.positions.copy(),
        velocities=previous.velocities.copy(),
    )
    is_neighbor = np.zeros(tracks.sent_times.shape, np.bool_)
    for message in range(len(messages.receivers)):
        receiver = messages.receivers[message]
        sender = messages.senders[message]
        is_neighbor[receiver, sender] = True
        has_track = tracks.counts[receiver, sender] > 0
        is_new = messages.sent_times[message] > tracks.sent_times[receiver, sender] + _SENT_TOLERANCE_S
        if has_track and not is_new:
            continue
        if has_track:
            _update_track(
                tracks, messages, message, sigmas[receiver], accelerations[receiver], max_speeds[receiver]
            )
        else:
            for axis in range(2):
                tracks.velocities[receiver, sender, axis] = 0.0
                tracks.positions[receiver, sender, axis] = messages.positions[message, axis]
        tracks.sent_times[receiver, sender] = messages.sent_times[message]
        tracks.counts[receiver, sender] += 1
    # If a robot that is not a neighbor now becomes one again later, its track starts from scratch.
    for receiver in range(len(is_neighbor)):
        for sender in range(len(is_neighbor)):
            if not is_neighbor[receiver, sender]:
                tracks.counts[receiver, sender] = 0
    return tracks


@kernel
def _update_track(
    tracks: Tracks, messages: _Messages, message: int, sigma: float, acceleration: float, max_speed: float
) -> None:
    """Update the position and the velocity of one track, in place, by the message with the given index."""
    receiver = messages.receivers[message]
    sender = messages.senders[message]
    dt = messages.sent_times[message] - tracks.sent_times[receiver, sender]
    # An alpha-beta filter corrects the predicted position by alpha, and the velocity by beta / dt, times the
    # residual. Kalata (1984) derives the steady-state gains from the tracking index: the ratio of the
    # uncertainty due to maneuvers to that due to noise.
    tracking_index = acceleration * dt * dt / max(sigma, _MIN_SIGMA_M)
    discriminant = 8.0 * tracking_index + tracking_index * tracking_index
    root = (4.0 + tracking_index - math.sqrt(discriminant)) / 4.0
    steady_alpha = 1.0 - root * root
    steady_beta = 2.0 * (1.0 - root) ** 2
    # The first gains are larger: those of a least-squares fit of a straight line to the k messages so far.
    k = tracks.counts[receiver, sender] + 1.0
    initial_alpha = 2.0 * (2.0 * k - 1.0) / (k * (k + 1.0))
    initial_beta = 6.0 / (k * (k + 1.0))
    alpha = max(steady_alpha, initial_alpha)
    beta = min(max(steady_beta, initial_beta), 1.0)
    # Views of the track: assignments to their elements change it.
    position = tracks.positions[receiver, sender]
    velocity = tracks.velocities[receiver, sender]
    for axis in range(2):
        predicted = position[axis] + dt * velocity[axis]
        residual = messages.positions[message, axis] - predicted
        position[axis] = predicted + alpha * residual
        velocity[axis] += beta * residual / dt
    speed = math.sqrt(velocity[0] ** 2 + velocity[1] ** 2)
    if speed > max_speed:
        velocity[0] *= max_speed / speed
        velocity[1] *= max_speed / speed
