"""The choice of a controller and its gains in a session."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Self, TypeAlias

from pydantic import AfterValidator, ConfigDict, Field

from robocov.controllers import CONTROLLERS, get_gains, load_controller_class, make_controller
from robocov.controllers.base import Controller
from robocov.controllers.gains import Gain, Option, Value, format_value
from robocov.controllers.registry import update_gain_names
from robocov.errors import RobocovError
from robocov_app.viewer.session.files.fields import MAX_TEXT_CHARS, build_refusal, convert_field

_GAIN_VALUE: TypeAlias = Annotated[float, Field(strict=True)] | Annotated[str, Field(strict=True)] | None
_GAINS = convert_field(
    dict[str, _GAIN_VALUE],
    load=lambda gains, _: gains,
    dump=lambda gains, _: dict(gains),
)


@dataclass(frozen=True)
class ControllerChoice:
    """A controller, given by its name and its gains.

    Attributes
    ----------
    name : str
        Name as `make_controller` accepts it.
    gains : mapping of str to float, str or None
        Gains that differ from their defaults.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    name: Annotated[str, Field(strict=True, min_length=1, max_length=MAX_TEXT_CHARS)]
    gains: Annotated[Mapping[str, Value], _GAINS] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Sessions and runs of earlier versions contain former spellings.
        object.__setattr__(self, "gains", update_gain_names(self.name, self.gains))

    def build(self) -> Controller:
        """Build the controller. If it is in a user's file, that file is executed.

        Returns
        -------
        Controller

        Raises
        ------
        ParameterError
            If there is no such controller or gain, or a value is out of range.
        """
        return make_controller(self.name, self.gains)

    # The following two are cached, because loading a controller from a user's file executes that file.
    @cached_property
    def label(self) -> str:
        """Name of the controller in the window."""
        return str(load_controller_class(self.name).label)

    @cached_property
    def available_gains(self) -> Mapping[str, Gain | Option]:
        """All gains of the controller, by name."""
        return get_gains(load_controller_class(self.name))

    def get_value(self, gain: str) -> Value:
        """Return the chosen value of a gain, or its default."""
        if gain in self.gains:
            return self.gains[gain]
        return self.available_gains[gain].default

    def with_gain(self, gain: str, value: Value) -> Self:
        """Return a choice with another value for one gain.

        Raises
        ------
        ParameterError
            If the controller does not accept the value.
        """
        changed = replace(self, gains={**self.gains, gain: value})
        changed.build()
        return changed.drop_defaults()

    def drop_defaults(self) -> Self:
        """Return a choice without the gains that have their default values."""
        defaults = {name: gain.default for name, gain in self.available_gains.items()}
        gains = {
            name: value
            for name, value in self.gains.items()
            if name not in defaults or value != defaults[name]
        }
        return replace(self, gains=gains)

    @property
    def description(self) -> str:
        """Label of the controller, and the gains that differ from their defaults."""
        gains = [f"{name} {_format_gain(value)}" for name, value in self.drop_defaults().gains.items()]
        return ", ".join([self.label, *gains])

    def describe_changes(self, before: Self) -> str:
        """Describe the gains that differ from those of another choice of the same controller."""
        changed = [name for name in self.available_gains if self.get_value(name) != before.get_value(name)]
        return ", ".join(f"{name} = {_format_gain(self.get_value(name))}" for name in changed)


def _format_gain(value: Value) -> str:
    return format_value(value, digits=3, none="no limit")


def _require_known_controller(choice: ControllerChoice, info: Any) -> ControllerChoice:
    """Check the controller of a session file, and return it with the name that the user has typed.

    A controller in a user's file is loaded only if the user has named it, never just because a session file
    names it.
    """
    user_names = info.context.controllers
    if choice.name not in CONTROLLERS and choice.name not in user_names:
        class_name = choice.name.rpartition(":")[2]
        # The session file may have been saved where the user's file had another path.
        same_class = [name for name in user_names if name.rpartition(":")[2] == class_name]
        if not same_class:
            advice = f"to run it, pass --controller {choice.name} (--controllers for robocov demo)"
            raise build_refusal(f"{choice.name!r} is not one of robocov's controllers; {advice}")
        choice = replace(choice, name=same_class[0])
    try:
        choice.build()
    except RobocovError as error:
        raise build_refusal(error) from None
    return choice


FileController: TypeAlias = Annotated[ControllerChoice, AfterValidator(_require_known_controller)]
"""A controller choice in a session file."""
