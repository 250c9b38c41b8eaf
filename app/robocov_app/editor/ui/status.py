"""The editor's status line: the cursor's place, what is selected, what the tool waits for. No pygame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.tools.tool import place_words

if TYPE_CHECKING:
    from robocov_app.editor.ui.editor import Editor
    from robocov_app.editor.ui.team import Team

HINT = "F5 try it · F1 keys"


def hovered_words(desk: Editor) -> str:
    """Return what is noted about what the cursor is on."""
    owner = desk.selector.hovered
    if desk.tool is not desk.selector or not isinstance(owner, int) or owner not in desk.sketch.places:
        return ""
    item = desk.sketch.item(owner)
    return f"{item.shape.name or 'note'}: {item.note}" if item.note else ""


def facts(desk: Editor, frames: float, team: Team | None) -> list[str]:
    """Return what the line says, the most important first."""
    said = [f"{desk.tool.title}: {desk.tool.hint}" if desk.tool is not desk.selector else ""]
    if desk.cursor is not None:
        said.insert(0, place_words(desk.cursor))
    said.append(hovered_words(desk))
    if desk.selection and desk.tool is desk.selector:
        said.append(desk.selection.words(desk.sketch))
    if "robots" in desk.shown and team is not None:
        said.append(team.words or f"{len(team.places)} robots at {team.start or 'anywhere'}")
    if desk.tool is desk.selector and not desk.selection:
        said.append(desk.tool.hint)
    snaps = (
        "no snapping" if not desk.snaps else f"grid {desk.grid:g} m" if "grid" in desk.snaps else "grid off"
    )
    said.append(snaps)
    if desk.readings.busy:
        said.append("measuring …")
    said.append(f"{frames:.0f} fps")
    return [each for each in said if each]
