"""A service for tests of the worker: doubles numbers, and more."""

import os
import time

from robocov.errors import InputError


class Doubling:
    failing = "it could not be doubled"

    def __init__(self) -> None:
        self.heard = []

    def __call__(self, questions, line):
        self.heard += questions
        match questions[-1]:
            case "slow":
                for k in range(1, 1000):
                    line.tell(k)
                    time.sleep(0.01)
                    if line.newer():
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
