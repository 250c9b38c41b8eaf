"""Random numbers that depend only on a seed, a stream and a step.

A generator with a state would have to be copied, rewound and branched together with a run. Here, each step of
each stream has its own generator, so that a step has the same random numbers whenever it is computed.
"""

import numpy as np

LOSS_STREAM = 0
"""Stream of the loss of messages with positions."""
POSITION_STREAM = 1
"""Stream of the noise of localization."""
SENSING_STREAM = 2
"""Stream of the noise of the nearest obstacle point."""
SCANNING_STREAM = 3
"""Stream of the noise of scans."""
FAILURE_STREAM = 4
"""Stream of the times of failures."""
MESSAGE_LOSS_STREAM = 5
"""Stream of the loss of controller messages."""


def create_generator(seed: int, stream: int, step: int = 0, robot: int | None = None) -> np.random.Generator:
    """Create the random number generator of one step of a stream.

    Parameters
    ----------
    seed : int
        Seed of the run, at least 0.
    stream : int
        Number of the stream, such as `LOSS_STREAM`.
    step : int
        Index of the step, from 0 at time zero.
    robot : int or None
        Index of the robot, from 0, if the stream has separate random numbers for each robot.

    Returns
    -------
    numpy.random.Generator
        A new generator, independent of those of all other seeds, streams, steps and robots.
    """
    key = [seed, stream, step] if robot is None else [seed, stream, step, robot]
    return np.random.default_rng(key)
