"""A service for tests of the worker: doubles numbers, and more."""

import os
import time

from robocov.errors import InputError


class Doubling:
    failure_message = "it could not be doubled"

    def __init__(self) -> None:
        self.heard = []

    def __call__(self, questions, channel):
        self.heard += questions
        match questions[-1]:
            case "slow":
                for k in range(1, 1000):
                    channel.report_progress(k)
                    time.sleep(0.01)
                    if channel.get_newer_questions():
                        raise InputError("there is a newer one")
            case "sleep":
                time.sleep(60)
            case "print":
                print("among the messages")
                return os.getpid()
            case "heard":
                return self.heard
            case "bad":
                raise InputError("bad: it is")
            case number:
                return 2 * number
        return None
