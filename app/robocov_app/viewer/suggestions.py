"""Suggestions of what to try next, once the team has settled."""

from __future__ import annotations

from robocov_app.viewer.presenter import Desk

_OFFERED = (
    ("obstacle", "draw a wall in a doorway (W)"),
    ("hand", "drag a robot"),
    ("failure", "let one fail (D)"),
    ("pane", "compare controllers (K)"),
    ("law", "change the controller (O)"),
    ("density", "paint where it matters (G)"),
    ("robot", "let one more join (A)"),
)
"""Kinds of touches of the document, and the words for each."""

_AT_ONCE = 3


def suggestion(desk: Desk) -> str:
    """Return what this session has not tried yet, if the present is shown and has settled; else nothing."""
    session = desk.session
    if not (desk.suggests and session.settled and session.live) or session.hand is not None:
        return ""
    tried = {node.kind for node in session.document.nodes}
    tried |= {"pane"} if len(session.lanes) > 1 else set()
    new = [words for kind, words in _OFFERED if kind not in tried][:_AT_ONCE]
    return f"The team has settled. Try:\n{' · '.join(new)}" if new else ""
