"""Choice of the chips that fit into the layer bar."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from robocov_app.viewer.canvas.layer_chips import Chip

_DROPPED_FIRST = ("robots", "obstacles", "failed")
"""Layers with symbols that need no explanation; their chips are left out first if space is short."""


class FittedChips(NamedTuple):
    """The chips that are shown in the layer bar."""

    layers: list[Chip]
    presets: list[Chip]
    """Chips of the presets, or only the button that opens their menu."""


def fit_chips(
    chips: Sequence[Chip],
    presets: Sequence[Chip],
    presets_button: Chip,
    standard_commands: set[str],
    fits: Callable[[Sequence[Chip]], bool],
) -> FittedChips:
    """Leave out chips, or their texts, until the others fit.

    Symbols that need no explanation are left out first, then a button replaces the presets. Then the chips of
    standard layers lose their texts and are left out, from the last one, so that symbols that are new to the
    user keep their texts. Finally, texts return where the remaining space allows it. What is left out is also
    in the menu of layers, and chips without text have a tooltip.

    Parameters
    ----------
    chips, presets : sequence of Chip
        All chips of layers, and of presets.
    presets_button : Chip
        Button that opens the menu of the presets.
    standard_commands : set of str
        Commands of the chips of layers that are visible by default.
    fits : callable
        Returns whether chips fit into the layer bar together.

    Returns
    -------
    FittedChips
    """
    button = [presets_button] if presets else []
    for shown_presets in (list(presets), button):
        for remaining in _drop_known_symbols(chips):
            if fits([*remaining, *shown_presets]):
                return FittedChips(remaining, shown_presets)
    *_, unknown_symbols = _drop_known_symbols(chips)
    for remaining in _shorten(unknown_symbols, standard_commands):
        if fits([*remaining, *button]):
            shown = _restore_texts(remaining, lambda chips: fits([*chips, *button]))
            return FittedChips(shown, button)
    return FittedChips([], button)


def _drop_known_symbols(chips: Sequence[Chip]) -> Iterator[list[Chip]]:
    """Yield all chips, and again after each one whose symbol needs no explanation has been left out."""
    remaining = list(chips)
    yield remaining
    for name in _DROPPED_FIRST:
        remaining = [chip for chip in remaining if chip.command != f"layer:{name}"]
        yield remaining


def _restore_texts(chips: Sequence[Chip], fits: Callable[[Sequence[Chip]], bool]) -> list[Chip]:
    """Give chips without texts their texts again, from the first one, as long as the bar has space.

    A long text may have been left out last, so that shorter ones fit into its place.
    """
    shown = list(chips)
    for index, chip in enumerate(chips):
        candidate = [*shown[:index], replace(chip, has_text=True), *shown[index + 1 :]]
        if fits(candidate):
            shown = candidate
    return shown


def _shorten(chips: Sequence[Chip], standard_commands: set[str]) -> Iterator[list[Chip]]:
    """Yield the chips after each step: one more loses its text, or is left out, standard layers first."""
    remaining = {chip.command: chip for chip in chips}
    standard = [chip for chip in chips if chip.command in standard_commands]
    other = [chip for chip in chips if chip.command not in standard_commands]
    for group in (standard, other):
        for chip in reversed(group):
            remaining[chip.command] = replace(chip, has_text=False)
            yield list(remaining.values())
        for chip in reversed(group):
            del remaining[chip.command]
            yield list(remaining.values())
