"""Gains of several controllers from the option ``--set``."""

from collections.abc import Mapping, Sequence
from typing import Any

from robocov.controllers import get_gains, load_controller_class
from robocov.errors import ParameterError, describe_unknown_name


def select_gains(controllers: Sequence[str], gains: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Distribute the gains of the option ``--set`` to the controllers.

    Parameters
    ----------
    controllers : sequence of str
        Names of the controllers.
    gains : mapping of str to object
        A key such as ``k_rep`` applies to all controllers that have the gain; ``rapf.k_rep`` applies to one,
        and takes precedence. A controller ``mine.py:Mine`` may be called ``Mine``.

    Returns
    -------
    list of dict
        The gains of each controller.

    Raises
    ------
    ParameterError
        If no controller has one of the gains, or if a key names an unknown controller.
    """
    known_gains = {name: get_gains(load_controller_class(name)) for name in controllers}
    selected: list[dict[str, Any]] = [{} for _ in controllers]
    # Keys for a single controller (with a dot) come last, so that they overwrite keys for all controllers.
    for key, value in sorted(gains.items(), key=lambda item: "." in item[0]):
        owner, _, gain = key.rpartition(".")
        owner = _complete_name(owner, controllers)
        if owner and owner not in known_gains:
            raise ParameterError(f"--set {key}: {describe_unknown_name('controller', owner, known_gains)}")
        candidates = [owner] if owner else controllers
        if not any(gain in known_gains[name] for name in candidates):
            all_gains = set().union(*(known_gains[name] for name in candidates))
            raise ParameterError(f"--set {key}: {describe_unknown_name('gain', gain, all_gains)}")
        for name, values in zip(controllers, selected, strict=True):
            if name in candidates and gain in known_gains[name]:
                values[gain] = value
    return selected


def _complete_name(name: str, controllers: Sequence[str]) -> str:
    """Return the complete name of a controller in a file, given the name of its class.

    A name is returned unchanged if no class or several classes have it.
    """
    matches = [controller for controller in controllers if controller.endswith(f":{name}")]
    return matches[0] if name and len(matches) == 1 else name
