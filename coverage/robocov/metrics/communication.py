"""The messages that robots send over a run."""

from __future__ import annotations

from robocov.record import Record


def compute_sent_rate(record: Record) -> float:
    """Compute the data rate of the messages of a robot, not including positions.

    Parameters
    ----------
    record : Record
        The run.

    Returns
    -------
    float, bytes/s
        Mean over the robots and the run. It is 0 if the robots send no messages, or the run has no duration.
    """
    duration = float(record.time[-1] - record.time[0])
    if record.sent_bytes is None or duration == 0.0:
        return 0.0
    sent_bytes = float(record.sent_bytes[-1] - record.sent_bytes[0])
    return sent_bytes / (duration * len(record.team))
