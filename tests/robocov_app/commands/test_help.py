"""The help of every command."""

import re

import pytest

from robocov_app.cli import COMMANDS, main


@pytest.mark.parametrize("name", COMMANDS)
def test_values_of_options_have_names_that_users_understand(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main([name, "--help"])
    text = capsys.readouterr().out
    assert not re.findall(r"\{\[.*|\[(?:STR|FLOAT|INT|PATH) \[.*|\{(?:FLOAT|INT) .*", text)
