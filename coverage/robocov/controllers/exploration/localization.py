"""Position estimates under noise and late messages: dead reckoning, and alpha-beta trackers of others."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.observation import Observations
from robocov.team import Team

_AVERAGING_S = 2.0
"""Time over which position fixes are averaged."""
_OUTLIER_SIGMAS = 6.0
"""Deviation of a fix from the prediction, in standard deviations, above which the robot was displaced."""
_MIN_FIXES = 10
"""Number of fixes after which their noise is known."""
_MIN_DISTANCE_M = 1e-9
"""Lower limit of distances in divisions."""
_MIN_SIGMA_M = 1e-9
"""Lower limit of standard deviations in divisions."""
_SENT_TOLERANCE_S = 1e-6
"""A message is new if it was sent later than the last one by more than this, to allow for rounding."""
_MANEUVER_FRACTION = 0.5
"""Assumed acceleration of others, as a fraction of their maximum acceleration."""
_MAX_EXTRAPOLATION_S = 1.5
"""Maximum time that others are assumed to keep their velocities."""
_UNCERTAINTY_SIGMAS = 1.0
"""Others may be closer than estimated by this number of standard deviations of a fix."""
_UNCERTAINTY_SPEED = 1.0
"""Speed in m/s at which others may have come closer since their last message."""
_MAX_UNCERTAINTY_FRACTION = 0.75
"""Others may be closer than estimated by at most this fraction of the estimated distance."""


class Tracks(NamedTuple):
    """Tracks of the other robots from their messages: row i, column j is robot i's track of robot j."""

    sent_times: Array
    """(n, n) s, times at which the newest messages were sent; nan for none."""
    counts: IntArray
    """(n, n) Number of messages."""
    positions: Array
    """(n, n, 2) m, filtered position at that time."""
    velocities: Array
    """(n, n, 2) m/s, filtered velocity at that time."""


class _Messages(NamedTuple):
    """The newest messages that robots have of each other."""

    receiver: IntArray
    """(m,)"""
    sender: IntArray
    """(m,)"""
    positions: Array
    """(m, 2) m, reported position of the sender."""
    sent_times: Array
    """(m,) s, time at which each message was sent."""


class Estimates(NamedTuple):
    """Filter states of n robots: of their own positions, and of the robots whose messages they receive."""

    time: float
    """s"""
    positions: Array
    """(n, 2) m, own positions."""
    velocities: Array
    """(n, 2) m/s, own velocities."""
    fix_counts: Array
    """(n,) Number of position fixes that were averaged."""
    variance: Array
    """(n,) m², of one fix in x or y."""
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
            variance=np.zeros(n),
            tracks=tracks,
        )


def estimate_positions(seen: Observations, previous: Estimates, team: Team) -> tuple[Observations, Estimates]:
    """Estimate the positions of robots and their neighbors.

    Parameters
    ----------
    seen : Observations
        With noisy positions of the robots, and reported positions of their neighbors.
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
    A robot integrates its own velocity and averages the residuals of its position fixes over two seconds.
    Others are tracked by their messages with the steady-state gains of Kalata (1984, *The tracking index*),
    and with larger gains for the first messages. Their messages are assumed to be as noisy as the robot's own
    fixes, and they are assumed to keep their velocities for at most 1.5 seconds since their last message.
    """
    assert seen.reported_positions is not None and seen.report_ages is not None
    positions, fix_counts, variance = _filter_own_positions(seen, previous, team)
    robot, neighbor = seen.neighbors.list_pairs()
    messages = _Messages(
        receiver=robot,
        sender=neighbor,
        positions=seen.reported_positions,
        sent_times=seen.time - seen.report_ages,
    )
    tracks = _update_tracks(
        previous.tracks,
        messages,
        sigma=np.sqrt(variance),
        maneuver=_MANEUVER_FRACTION * team.max_acceleration,
        max_speed=team.max_speed,
    )
    estimates = Estimates(
        time=seen.time,
        positions=positions,
        velocities=seen.velocities,
        fix_counts=fix_counts,
        variance=variance,
        tracks=tracks,
    )
    ages = np.clip(seen.time - tracks.sent_times[robot, neighbor], 0.0, _MAX_EXTRAPOLATION_S)
    neighbor_positions = (
        tracks.positions[robot, neighbor] + ages[:, None] * tracks.velocities[robot, neighbor]
    )
    # The sensor measures the offset of the obstacle point from the robot.
    obstacle_points = seen.obstacle_points - seen.positions + positions
    estimated = replace(
        seen, positions=positions, obstacle_points=obstacle_points, reported_positions=neighbor_positions
    )
    return estimated, estimates


def _filter_own_positions(seen: Observations, previous: Estimates, team: Team) -> tuple[Array, Array, Array]:
    """Return the positions, the numbers of fixes and their variances after one more fix of each robot."""
    dt = seen.time - previous.time
    predicted = previous.positions + 0.5 * dt * (previous.velocities + seen.velocities)
    squared_residual = ((seen.positions - predicted) ** 2).sum(axis=1)
    # A residual that is too large for noise means that something has displaced the robot: start again. The
    # variance is that of one of the two coordinates.
    max_squared_residual = 2.0 * _OUTLIER_SIGMAS**2 * previous.variance + (team.max_speed * dt) ** 2
    was_displaced = (squared_residual > max_squared_residual) & (previous.fix_counts >= _MIN_FIXES)
    fix_counts = np.where(was_displaced, 1.0, previous.fix_counts + 1.0)
    # At first the mean of all fixes, later that of the last few seconds.
    gain = np.maximum(1.0 / fix_counts, min(dt / _AVERAGING_S, 1.0))
    positions = predicted + gain[:, None] * (seen.positions - predicted)
    # A fix differs more from the mean of k - 1 others than from the truth. There are two coordinates.
    squared_error = 0.5 * squared_residual * (1.0 - 1.0 / np.maximum(fix_counts, 1.0))
    # The first fix has no residual, so there is one residual fewer to average than there are fixes.
    variance_gain = np.maximum(1.0 / np.maximum(fix_counts - 1.0, 1.0), gain)
    variance = previous.variance + variance_gain * (squared_error - previous.variance)
    variance = np.where(was_displaced, previous.variance, variance)
    return positions, fix_counts, variance


def assume_closer_neighbors(seen: Observations, estimates: Estimates) -> Observations:
    """Return the observations with each neighbor moved closer by the uncertainty of its position.

    Controllers that avoid collisions use them, to keep clear of a neighbor wherever it may be. The
    uncertainty grows with the localization noise and with the age of the neighbor's message.

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
    robot, neighbor = seen.neighbors.list_pairs()
    offset = seen.reported_positions - seen.positions[robot]
    distance = np.sqrt((offset**2).sum(axis=1))
    ages = np.clip(seen.time - estimates.tracks.sent_times[robot, neighbor], 0.0, _MAX_EXTRAPOLATION_S)
    uncertainty = _UNCERTAINTY_SIGMAS * np.sqrt(estimates.variance[robot]) + _UNCERTAINTY_SPEED * ages
    uncertainty = np.minimum(uncertainty, _MAX_UNCERTAINTY_FRACTION * distance)
    factor = 1.0 - uncertainty / np.maximum(distance, _MIN_DISTANCE_M)
    return replace(seen, reported_positions=seen.positions[robot] + factor[:, None] * offset)


@kernel
def _update_tracks(
    previous: Tracks, messages: _Messages, sigma: Array, maneuver: Array, max_speed: Array
) -> Tracks:
    """Return the tracks after the newest messages, some of which may already be known.

    Parameters
    ----------
    previous : Tracks
    messages : _Messages
    sigma : (n,) array, m
        Standard deviation of position fixes of each robot.
    maneuver : (n,) array, m/s²
        Assumed acceleration of others.
    max_speed : (n,) array, m/s
        Assumed maximum speed of others.
    """
    tracks = Tracks(
        sent_times=previous.sent_times.copy(),
        counts=previous.counts.copy(),
        positions=previous.positions.copy(),
        velocities=previous.velocities.copy(),
    )
    is_neighbor = np.zeros(tracks.sent_times.shape, np.bool_)
    for m in range(len(messages.receiver)):
        i = messages.receiver[m]
        j = messages.sender[m]
        is_neighbor[i, j] = True
        has_track = tracks.counts[i, j] > 0
        is_new = messages.sent_times[m] > tracks.sent_times[i, j] + _SENT_TOLERANCE_S
        if has_track and not is_new:
            continue
        if has_track:
            _update_track(tracks, messages, m, sigma[i], maneuver[i], max_speed[i])
        else:
            for axis in range(2):
                tracks.velocities[i, j, axis] = 0.0
                tracks.positions[i, j, axis] = messages.positions[m, axis]
        tracks.sent_times[i, j] = messages.sent_times[m]
        tracks.counts[i, j] += 1
    # If a robot that is not a neighbor now becomes one again later, its track starts from scratch.
    for i in range(len(is_neighbor)):
        for j in range(len(is_neighbor)):
            if not is_neighbor[i, j]:
                tracks.counts[i, j] = 0
    return tracks


@kernel
def _update_track(
    tracks: Tracks, messages: _Messages, m: int, sigma: float, maneuver: float, max_speed: float
) -> None:
    """Update the position and the velocity of one track, in place, by message m."""
    i = messages.receiver[m]
    j = messages.sender[m]
    dt = messages.sent_times[m] - tracks.sent_times[i, j]
    k = tracks.counts[i, j] + 1.0
    # The steady-state gains of an alpha-beta filter (Kalata 1984), from the ratio of the uncertainty by
    # maneuvers to that by noise.
    tracking_index = maneuver * dt * dt / max(sigma, _MIN_SIGMA_M)
    discriminant = 8.0 * tracking_index + tracking_index * tracking_index
    root = (4.0 + tracking_index - math.sqrt(discriminant)) / 4.0
    steady_alpha = 1.0 - root * root
    steady_beta = 2.0 * (1.0 - root) ** 2
    # For small k, the gains of a least-squares fit to k messages are larger.
    initial_alpha = 2.0 * (2.0 * k - 1.0) / (k * (k + 1.0))
    initial_beta = 6.0 / (k * (k + 1.0))
    alpha = max(steady_alpha, initial_alpha)
    beta = min(max(steady_beta, initial_beta), 1.0)
    for axis in range(2):
        expected = tracks.positions[i, j, axis] + dt * tracks.velocities[i, j, axis]
        residual = messages.positions[m, axis] - expected
        tracks.positions[i, j, axis] = expected + alpha * residual
        tracks.velocities[i, j, axis] += beta * residual / dt
    speed = math.sqrt(tracks.velocities[i, j, 0] ** 2 + tracks.velocities[i, j, 1] ** 2)
    if speed > max_speed:
        tracks.velocities[i, j, 0] *= max_speed / speed
        tracks.velocities[i, j, 1] *= max_speed / speed
