"""Gains of controllers: units, ranges, choices, and messages."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import (
    CONTROLLERS,
    Adaptive,
    Boosting,
    Poduri,
    Rapf,
    get_gain_values,
    get_gains,
    make_controller,
)
from robocov.controllers.gains import Gain, Option, choice, gain, instantiate_controller
from robocov.controllers.registry import update_gain_names
from robocov.errors import ParameterError


def test_gains_are_validated_by_name_and_range() -> None:
    assert make_controller("rapf", {"k_rep": 1, "attraction_limit": None}) == Rapf(
        k_rep=1.0, attraction_limit=None
    )
    assert isinstance(make_controller("rapf", {"k_rep": 1}).k_rep, float)
    with pytest.raises(ParameterError, match=r"rapf.k_rep: expected a number from 0 to 1000000 N m³, got -1"):
        make_controller("rapf", {"k_rep": -1})
    with pytest.raises(ParameterError, match=r"rapf: unknown gain 'krep': did you mean 'k_rep'\?"):
        make_controller("rapf", {"krep": 1})
    with pytest.raises(ParameterError, match=r"rapf.rho_0: expected a number from .*, got 'wide'"):
        make_controller("rapf", {"rho_0": "wide"})
    with pytest.raises(ParameterError, match=r"rapf.k_att: expected a number .*, got nan"):
        Rapf(k_att=float("nan"))
    with pytest.raises(ParameterError, match=r"rapf.k_rep: expected a number .*, got True"):
        Rapf(k_rep=True)
    with pytest.raises(ParameterError, match=r"or null for no limit, got 'none'"):
        make_controller("rapf", {"attraction_limit": "none"})


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, 10**400])
def test_numbers_that_are_not_finite_are_rejected(value: float, whole: bool) -> None:
    unlimited = Gain("k", 1.0, "", 0.0, math.inf, "", whole=whole)
    with pytest.raises(ParameterError, match=r"mine.k: expected a (whole )?number from 0 to inf, got"):
        unlimited.validate(value, "mine")


def test_whole_numbers_may_be_floats() -> None:
    count = Gain("k", 1.0, "", 0.0, 10.0, "", whole=True)
    assert count.validate(3.0, "mine") == 3.0
    with pytest.raises(ParameterError, match=r"mine.k: expected a whole number from 0 to 10, got 2.5"):
        count.validate(2.5, "mine")


@pytest.mark.slow
@given(
    st.sampled_from(sorted(CONTROLLERS)),
    st.dictionaries(
        st.sampled_from(["k_rep", "rho_0", "k_att", "attraction_limit", "k_prop", "response_time", "x"]),
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.lists(st.integers())),
        max_size=3,
    ),
)
def test_any_gains_make_a_controller_or_one_clear_line(name: str, gains: dict[str, object]) -> None:
    try:
        controller = make_controller(name, gains)
    except ParameterError as error:
        assert "\n" not in str(error)
        assert str(error).startswith(name)
    else:
        values = get_gain_values(controller)
        assert set(gains) <= set(values)
        assert not any(isinstance(value, int) for value in values.values())


def test_every_gain_has_a_unit_a_meaning_and_a_default_in_range() -> None:
    for kind in CONTROLLERS.values():
        assert kind.summary
        assert kind.label
        declared = {
            field.name: field.metadata["gain"].unit for field in fields(kind) if "gain" in field.metadata
        }
        for known in get_gains(kind).values():
            assert isinstance(known, Option) or declared[known.name]
            assert known.unit != "1", "it is not written after a number"
            assert known.meaning
            known.validate(known.default, kind.name)


def test_gains_may_be_one_of_several_choices() -> None:
    assert make_controller("rapf", {"target": "median"}) == Rapf(target="median")
    assert get_gain_values(Rapf())["target"] == "centroid"
    for wrong in ("Median", "", 3, None, True, ["median"]):
        with pytest.raises(ParameterError, match=r"^rapf\.target: .*centroid, "):
            Rapf(target=wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="default: expected one of left, right, got 'up'"):
        choice("up", ("left", "right"), "where to pass")


def test_former_names_in_files_are_accepted() -> None:
    assert make_controller("poduri", {"neighbours": 3.0}) == Poduri(neighbors=3.0)
    assert make_controller("adaptive", {"least": 0.1}) == Adaptive(min_density=0.1)
    assert update_gain_names("adaptive", {"least": 0.1}) == {"min_density": 0.1}
    assert make_controller("boosting", {"boost": "neighbours"}) == Boosting(boost="neighbors")
    assert update_gain_names("boosting", {"boost": "neighbours"}) == {"boost": "neighbors"}
    assert update_gain_names("mine.py:Mine", {"neighbours": 3.0}) == {"neighbours": 3.0}


def test_gains_of_users_keep_their_spelling() -> None:
    @dataclass(frozen=True)
    class Mine:
        neighbours: float = 2.0

    assert instantiate_controller(Mine, {"neighbours": 5.0}) == Mine(neighbours=5.0)


def test_plain_numbers_of_a_dataclass_are_gains_and_other_fields_are_not() -> None:
    @dataclass(frozen=True)
    class Mixed:
        pull: float = gain(1.0, "1", "pull")
        bias: float = -3.5
        note: str = "text"
        flag: bool = True
        gear: float = field(default=2.0, init=False)

    gains = get_gains(Mixed)
    assert list(gains) == ["pull", "bias"]
    assert gains["pull"].unit == ""
    assert get_gain_values(Mixed(bias=2.0)) == {"pull": 1.0, "bias": 2.0}
    assert get_gains(object()) == {}


def test_a_controller_without_gains_takes_none() -> None:
    class Plain:
        pass

    with pytest.raises(ParameterError, match=r"Plain\.k: controller 'Plain' has no gains"):
        instantiate_controller(Plain, {"k": 1.0})


def test_gain_names_that_are_not_strings_are_rejected() -> None:
    with pytest.raises(ParameterError, match="gains: expected names as keys, got 3"):
        make_controller("rapf", {3: 1.0})  # type: ignore[dict-item]


@pytest.mark.parametrize("gains", [3, ["k_rep"], "k_rep"])
def test_gains_that_are_not_a_mapping_are_rejected(gains: object) -> None:
    with pytest.raises(ParameterError, match="gains: expected a mapping of names to values, got"):
        make_controller("rapf", gains)  # type: ignore[arg-type]
