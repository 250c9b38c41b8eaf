"""The code of a controller, from which a process builds it."""

from collections.abc import Mapping
from dataclasses import dataclass

from robocov.controllers.gains import Value
from robocov.controllers.user_modules import ControllerSource


@dataclass(frozen=True)
class ControllerCode:
    """A controller, as a process builds it.

    Attributes
    ----------
    name : str
        Name of the controller, or ``file.py:Class``.
    gains : mapping of str to float, str or None
        Gains that differ from the defaults.
    source : ControllerSource or None
        Source text, if the controller is in a file.
    """

    name: str
    gains: Mapping[str, Value]
    source: ControllerSource | None
