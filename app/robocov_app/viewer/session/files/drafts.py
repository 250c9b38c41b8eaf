"""Drafts of sessions that earlier windows left behind.

The start page uses this module, so it imports nothing that takes long to load.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robocov_app.storage.autosave import Draft, find_drafts

DRAFT_KIND = "robocov-session-draft"
"""Kind of the drafts of sessions."""


def find_recoverable_drafts(folder: Path | None) -> tuple[Draft, ...]:
    """Return the drafts left behind by processes that have ended, newest first."""
    return find_drafts(folder, DRAFT_KIND, _check_draft)


def _check_draft(draft: Draft) -> Draft | None:
    """Return a draft; None if it contains no unsaved session. A damaged draft raises a KeyError."""
    if "session" not in draft.content:
        return None
    describe_draft(draft)  # raises if the draft is damaged
    return draft


def describe_draft(draft: Draft) -> str:
    """Describe a draft for the question whether to recover it."""
    name = "session" if draft.path is None else f"changes to {draft.path.name}"
    session = draft.content["session"]
    nodes = session["touches"] if "touches" in session else session["edits"]  # the former in old drafts
    count = len(nodes) - 1
    unit = "edit" if count == 1 else "edits"
    map_name = _get_map_name(session)
    if draft.path is None and map_name:
        name = f"{name} of {map_name}"
    return f"Unsaved {name}, {draft.when:%H:%M}, {count} {unit}"


def _get_map_name(session: Mapping[str, Any]) -> str:
    """Return the name of the first map of a saved session; empty if it has none."""
    maps = session.get("maps")
    if not isinstance(maps, list) or not maps or not isinstance(maps[0], dict):
        return ""
    return str(maps[0].get("bundled") or maps[0].get("name") or "").capitalize()
