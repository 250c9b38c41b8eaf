"""The editor's status line: the cursor's place, what is selected, what the tool waits for. No pygame."""

from robocov_app.editor.tools.tool import place_words
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.team import Team

HINT = "F5 try it · F1 keys"


def facts(editor: Editor, frames: float, team: Team | None) -> list[str]:
    """Return what the line says, the most important first."""
    said = [f"{editor.tool.title}: {editor.tool.hint}" if editor.tool is not editor.selector else ""]
    if editor.cursor is not None:
        said.insert(0, place_words(editor.cursor))
    owner = editor.selector.hovered
    if editor.tool is editor.selector and isinstance(owner, int) and owner in editor.sketch.places:
        item = editor.sketch.item(owner)
        said.append(f"{item.shape.name or 'note'}: {item.note}" if item.note else "")
    if editor.selection and editor.tool is editor.selector:
        said.append(editor.selection.words(editor.sketch))
    if "robots" in editor.shown and team is not None:
        said.append(team.words or f"{len(team.places)} robots at {team.start or 'anywhere'}")
    if editor.tool is editor.selector and not editor.selection:
        said.append(editor.tool.hint)
    grid = f"grid {editor.grid:g} m" if "grid" in editor.snaps else "grid off"
    said.append(grid if editor.snaps else "no snapping")
    if editor.readings.busy:
        said.append("measuring …")
    said.append(f"{frames:.0f} fps")
    return [each for each in said if each]
