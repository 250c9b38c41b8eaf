"""Options for the gains of controllers."""

from pathlib import Path

import pytest

from robocov.errors import ParameterError
from robocov_app.commands.gain_options import select_gains

NAMES = ("rapf", "rpf", "lloyd")
CONTROLLER = """
from dataclasses import dataclass
import robocov as rc


@dataclass(frozen=True)
class Mine:
    pull: float = rc.gain(1.0, "N/m", "attraction to the centroid")

    def force(self, own):
        return self.pull * (own.centroid - own.position)
"""


def test_a_gain_applies_to_every_controller_that_has_it() -> None:
    assert select_gains(NAMES, {"k_rep": 1, "k_att": 3}) == [{"k_rep": 1, "k_att": 3}, {"k_rep": 1}, {}]


@pytest.mark.parametrize("order", [("k_rep", "rpf.k_rep"), ("rpf.k_rep", "k_rep")])
def test_a_gain_of_one_controller_takes_precedence(order: tuple[str, str]) -> None:
    gains = {key: {"k_rep": 1, "rpf.k_rep": 2}[key] for key in order}
    assert select_gains(NAMES, gains) == [{"k_rep": 1}, {"k_rep": 2}, {}]


def test_a_controller_in_a_file_may_be_named_by_its_class(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(CONTROLLER)
    names = ("rapf", f"{file}:Mine")
    assert select_gains(names, {"Mine.pull": 2}) == [{}, {"pull": 2}]
    assert select_gains(names, {f"{file}:Mine.pull": 2}) == [{}, {"pull": 2}]


def test_an_ambiguous_class_name_is_rejected(tmp_path: Path) -> None:
    names = []
    for stem in ("first", "second"):
        file = tmp_path / f"{stem}.py"
        file.write_text(CONTROLLER)
        names.append(f"{file}:Mine")
    with pytest.raises(ParameterError, match=r"--set Mine\.pull: unknown controller 'Mine'"):
        select_gains(names, {"Mine.pull": 2})


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("krep", "--set krep: unknown gain 'krep': did you mean 'k_rep'"),
        ("lloyd.k_rep", r"--set lloyd.k_rep: unknown gain 'k_rep': did you mean 'k_prop'\?"),
        ("rap.k_rep", "--set rap.k_rep: unknown controller 'rap': did you mean 'rapf'"),
    ],
)
def test_a_gain_that_no_controller_has_is_rejected(key: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        select_gains(NAMES, {key: 1})
