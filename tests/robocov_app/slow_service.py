"""A service for tests of workers: it doubles numbers, and can be slow, print, or fail."""

import os
import time

from robocov.errors import InputError

SLOW_STEPS = 1000
SLOW_STEP_S = 0.01
SLEEP_S = 60.0


class Doubling:
    """Doubles numbers. Some texts make it slow, print or fail."""

    failure_message = "it could not be doubled"

    def __init__(self) -> None:
        self.received = []

    def __call__(self, requests, channel):
        self.received += requests
        match requests[-1]:
            case "slow":
                for step in range(1, SLOW_STEPS):
                    channel.report_progress(step)
                    time.sleep(SLOW_STEP_S)
                    if channel.get_newer_requests():
                        raise InputError("there is a newer one")
            case "sleep":
                time.sleep(SLEEP_S)
            case "print":
                print("among the messages")
                return os.getpid()
            case "list received":
                return self.received
            case "bad":
                raise InputError("bad: it is")
            case number:
                return 2 * number
        return None
