"""Options of the commands: parsed values, defaults and rejected values."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov_app.commands import cost, demo, edit, optimum
from robocov_app.commands.options import RunOptions, VideoOptions
from robocov_app.terminal.arguments import parse_gains
from robocov_app.viewer.costs.costs import Costs

SQUARE = Environment("square", ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)))


def test_gains_are_json_values() -> None:
    assert parse_gains(("k_rep=0.3", "attraction_limit=null", "n=2")) == {
        "k_rep": 0.3,
        "attraction_limit": None,
        "n": 2,
    }


@given(st.lists(st.text(max_size=12), max_size=3))
def test_any_text_is_a_gain_or_rejected_in_one_line(texts: list[str]) -> None:
    try:
        parse_gains(tuple(texts))
    except ParameterError as error:
        assert str(error).startswith("--set")
        assert "\n" not in str(error)


@pytest.mark.parametrize(("text", "size"), [("640x480", (640, 480)), ("800X600", (800, 600)), (None, None)])
def test_sizes_of_videos_are_parsed(text: str | None, size: tuple[int, int] | None) -> None:
    options = VideoOptions(size=text)  # type: ignore[arg-type]
    assert options.parse_size() == size
    assert options.build_settings().video_size == (size or (1280, 720))


@pytest.mark.parametrize(
    "values",
    [
        {"robots": 0},
        {"lattice": 5000},
        {"dt": 0.0},
        {"duration": 1e7},
        {"robots": 10_000, "duration": 100.0, "record_hz": 60.0},
    ],
)
def test_invalid_run_options_are_rejected(values: dict[str, object]) -> None:
    with pytest.raises(ParameterError, match="expected"):
        RunOptions(**values)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [demo.Arguments, edit.Arguments])
def test_the_folder_of_a_window_must_exist(kind: type, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(
        ParameterError,
        match=r"^--folder: .*missing: expected an existing folder, got a path that does not",
    ):
        kind(folder=tmp_path / "missing")
    with pytest.raises(ParameterError, match=r"^--folder: .*file: expected an existing folder, got a file"):
        kind(folder=tmp_path / "file")


def test_the_folder_of_a_served_window_is_created_later(tmp_path: Path) -> None:
    assert demo.Arguments(serve=True, folder=tmp_path / "new").folder == tmp_path / "new"


@pytest.mark.parametrize(
    "values", [{"size": "640"}, {"size": "1x1"}, {"size": "99999x99999"}, {"fps": 0}, {"video_speed": 0.0}]
)
def test_invalid_video_options_are_rejected(values: dict[str, object]) -> None:
    with pytest.raises(ParameterError, match="expected"):
        VideoOptions(**values)  # type: ignore[arg-type]


def test_defaults_of_runs_are_those_of_the_library() -> None:
    from robocov.defaults import DEFAULT_CONTROLLER
    from robocov.team import Team
    from robocov_app.commands.compare import Arguments as Compare
    from robocov_app.commands.run import Arguments as Run

    assert Run().controller == Compare().controllers[0] == DEFAULT_CONTROLLER
    assert RunOptions().build_team().to_dict() == Team.homogeneous(6).to_dict()


def test_the_default_lattice_is_the_same_everywhere() -> None:
    commands = (cost.Arguments, optimum.Arguments, demo.Arguments, RunOptions)
    defaults = {each.__dataclass_fields__["lattice"].default for each in commands}
    assert defaults == {Costs().lattice, CoverageCost(SQUARE).lattice}
