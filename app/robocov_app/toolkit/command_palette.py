"""The palette: commands found by typing, with completion of what they take."""

from collections.abc import Callable

from robocov.errors import InputError
from robocov_app.toolkit.command import Commands, Offer
from robocov_app.toolkit.dialogs import Choice, Option


def palette(commands: Commands, ghost: str, told: Callable[[str], object]) -> Choice:
    """Return the dialog that finds and does commands; `told` gets the words of what was done, if any."""

    def options(text: str) -> list[Option]:
        return [Option(each.text, each.aside, each.fills, each.why, each) for each in commands.offered(text)]

    def accept(text: str, option: Option | None) -> object:
        offer = option.value if option is not None else None
        if isinstance(offer, Offer) and offer.call is None:
            return offer.fills
        if isinstance(offer, Offer) and offer.why:
            raise InputError(offer.why)
        words = offer.call() if isinstance(offer, Offer) and offer.call else commands.typed(text)
        told(words if isinstance(words, str) else "")
        return None

    hint = "↑ ↓ choose · Tab completes · Enter does it · Esc closes"
    return Choice("", options, accept, ghost, hint)
