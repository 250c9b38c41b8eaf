"""Controllers of records that no longer exist, or that may not be loaded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from robocov.controllers import CONTROLLERS
from robocov.controllers.base import Controller
from robocov.controllers.gains import Gain, Option
from robocov.errors import ParameterError, RobocovError
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.record import Record
from robocov.team import Team
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice


@dataclass(frozen=True)
class MissingController(ControllerChoice):
    """A controller that cannot be built; its records can be displayed, but not continued.

    Attributes
    ----------
    title : str
        Label of the controller in the record.
    reason : str
        Why it cannot be built.
    is_placeholder : bool
        Whether `build` returns this object, which stands in for the controller until a decision is needed.
    """

    title: str = ""
    reason: str = ""
    is_placeholder: bool = False
    summary = "takes the place of a missing controller"

    @property
    def label(self) -> str:
        """Name of the controller in the window."""
        return self.title

    @property
    def available_gains(self) -> Mapping[str, Gain | Option]:
        """An empty mapping, because the gains are not known."""
        return {}

    def build(self) -> Controller:
        """Return the placeholder itself, or raise a ParameterError with the reason."""
        if self.is_placeholder:
            return self
        raise ParameterError(f"the run can be displayed, but not resumed: {self.reason}")

    def begin(self, region: Region, team: Team) -> None:
        """Do nothing: a placeholder has no memory."""

    def decide(self, seen: Observations, memory: None) -> Decision:
        """Raise a ParameterError with the reason."""
        replace(self, is_placeholder=False).build()  # always raises
        raise AssertionError


def find_controller(record: Record, controllers: Sequence[str] = ()) -> ControllerChoice:
    """Find the controller of a record.

    Parameters
    ----------
    record : Record
        The record.
    controllers : sequence of str
        Controllers that the user named as ``file.py:ClassName``. No other file is executed.

    Returns
    -------
    ControllerChoice
        The controller with its gains; a `MissingController` if it cannot be built.
    """
    name = record.controller
    gains = dict(record.gains)
    class_name = name.rpartition(":")[2]
    same_class = [known for known in controllers if known.rpartition(":")[2] == class_name]
    if name in CONTROLLERS or name in same_class:
        choice = ControllerChoice(name, gains)
    elif same_class:
        # The user's file may have moved since the run, so that a class of the same name is enough.
        choice = ControllerChoice(same_class[0], gains)
    else:
        advice = f"open it with --controller FILE.py:{class_name}"
        if class_name == name:
            advice = f"install the package that provides {name!r}, or open it with --controller FILE.py:CLASS"
        reason = f"{record.label} is not one of robocov's controllers; to resume the run, {advice}"
        return MissingController(name, gains, record.label, reason)
    try:
        choice.build()
        return choice.drop_defaults()
    except RobocovError as error:
        return MissingController(record.controller, gains, record.label, str(error))


def use_placeholder(choice: ControllerChoice) -> ControllerChoice:
    """Replace a missing controller with a placeholder that can be built; return other choices unchanged."""
    if isinstance(choice, MissingController):
        return replace(choice, is_placeholder=True)
    return choice
