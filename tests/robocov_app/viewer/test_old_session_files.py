"""Session files of released and earlier versions stay readable, and lead to the same states."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from robocov_app.viewer.session.files.session_file import build_session_content, format_session, load_session
from robocov_app.viewer.session.session import Session

DATA_FOLDER = Path(__file__).parents[2] / "data"
FILES = sorted(DATA_FOLDER.glob("*.robocov"))
TOLERANCE_M = 1e-6
"""Other processors may round the last digits differently."""
NEW_KEYS = {'"touches":': '"edits":', '"words":': '"description":', '"place_m":': '"position_m":'}
"""Keys that have another name since; the files have the old names."""
NEW_DIGESTS = {"f80cc6154428d973": "cba28802d2e3d19d"}
"""Digests of maps, which no longer depend on the descriptions."""


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_file_that_is_read_and_written_again_differs_only_in_its_keys(file: Path) -> None:
    saved = load_session(file)
    content = build_session_content(saved.document, saved.head, saved.step, saved.view)
    content["robocov"] = json.loads(file.read_text())["robocov"]
    expected = file.read_text()
    assert '"touches":' in expected
    for old_key, new_key in NEW_KEYS.items():
        expected = expected.replace(old_key, new_key)
    for old_digest, new_digest in NEW_DIGESTS.items():
        expected = expected.replace(old_digest, new_digest)
    assert format_session(content) == expected


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_branch_of_an_old_file_ends_where_it_ended(file: Path) -> None:
    session = Session.open(load_session(file))
    ends = json.loads(file.with_suffix(".ends.json").read_text())
    assert len(ends) == len(session.timeline.document.list_branches())
    for number, positions_by_pane in ends.items():
        session.seek(session.timeline.document.nodes[int(number)])
        assert {str(pane.number) for pane in session.timeline.panes} == set(positions_by_pane)
        for pane in session.timeline.panes:
            expected = positions_by_pane[str(pane.number)]
            np.testing.assert_allclose(pane.positions, expected, atol=TOLERANCE_M)
