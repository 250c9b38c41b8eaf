"""Choice of the chips that fit into the layer bar."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from robocov_app.viewer.canvas.layer_chips import Chip

_DROPPED_FIRST = ("robots", "obstacles", "failed", "density")
"""Layers with symbols that need no explanation; their chips are left out first if space is short."""


def fit_chips(
    chips: Sequence[Chip],
    presets: Sequence[Chip],
    more: Chip,
    standard_commands: set[str],
    measure: Callable[[Chip], int],
    space: int,
) -> tuple[list[Chip], list[Chip]]:
    """Leave out chips, or their texts, until the others fit into a space.

    Symbols that need no explanation are left out first, then a button replaces the presets. Then the chips of
    standard layers lose their texts and are left out, from the last one, so that symbols that are new to the
    user keep their texts. Everything that is left out is also in the menu of layers, and chips without text
    have a tip.

    Parameters
    ----------
    chips, presets : sequence of Chip
        All chips of layers, and of presets.
    more : Chip
        Button that opens the menu of the presets.
    standard_commands : set of str
        Commands of the chips of layers that are visible by default.
    measure : callable
        Returns the width that a chip takes, px.
    space : int
        Available width, px.

    Returns
    -------
    chips, presets : list of Chip
    """

    def fits(some_chips: Sequence[Chip], some_presets: Sequence[Chip]) -> bool:
        return sum(measure(chip) for chip in [*some_chips, *some_presets]) <= space

    button = [more] if presets else []
    for shown_presets in (list(presets), button):
        remaining = list(chips)
        for name in _DROPPED_FIRST:
            if fits(remaining, shown_presets):
                return remaining, shown_presets
            remaining = [chip for chip in remaining if chip.command != f"layer:{name}"]
        if fits(remaining, shown_presets):
            return remaining, shown_presets
    standard = [chip for chip in remaining if chip.command in standard_commands]
    other = [chip for chip in remaining if chip.command not in standard_commands]
    chips_by_command = {chip.command: chip for chip in remaining}
    for group in (standard, other):
        for chip in reversed(group):
            chips_by_command[chip.command] = replace(chip, has_text=False)
            if fits(list(chips_by_command.values()), button):
                return list(chips_by_command.values()), button
        for chip in reversed(group):
            del chips_by_command[chip.command]
            if fits(list(chips_by_command.values()), button):
                return list(chips_by_command.values()), button
    return [], button
