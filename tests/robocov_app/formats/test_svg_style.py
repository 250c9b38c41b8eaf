"""Styles of elements: attributes, style sheets, inheritance."""

import pytest

from robocov.errors import MapError
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.vector.svg.style import (
    INHERITED,
    MAX_RULE_CHECKS,
    MAX_SHEET_CHARACTERS,
    StyleSheet,
    inherit_style,
    is_hidden,
    is_painted,
    parse_declarations,
)


def build_element(tag: str = "rect", **attributes: str) -> Element:
    return Element(
        tag,
        {name.replace("_", "-").removesuffix("-"): text for name, text in attributes.items()},
        "plan.svg",
        1,
    )


def read_styles(*texts: str) -> StyleSheet:
    found = StyleSheet("plan.svg")
    for text in texts:
        found.add(text)
    return found


def test_the_more_specific_rule_wins() -> None:
    rules = read_styles("#a{fill:red} .b{fill:green} rect{fill:blue} *{fill:white}")
    assert rules.get_properties(build_element(id="a", class_="b"))["fill"] == "red"
    assert rules.get_properties(build_element(class_="x b"))["fill"] == "green"
    assert rules.get_properties(build_element(class_="B"))["fill"] == "blue"
    assert rules.get_properties(build_element("path", fill="black"))["fill"] == "white"
    assert rules.get_properties(build_element(id="a", style="fill:none"))["fill"] == "none"
    assert (
        read_styles("rect.b{fill:red} .b{fill:green}").get_properties(build_element(class_="b"))["fill"]
        == "red"
    )
    assert (
        read_styles(".b{fill:red}", ".b{fill:green}").get_properties(build_element(class_="b"))["fill"]
        == "green"
    )
    assert (
        read_styles(".b{fill:red !important}").get_properties(build_element(class_="b", style="fill:green"))[
            "fill"
        ]
        == "red"
    )


def test_style_sheets_of_drawing_programs_are_parsed() -> None:
    text = "<!-- .cls-1,\n.cls-2{fill:none;stroke:#000;} /* a; {comment} */ .cls-2{stroke-width:2px} -->"
    assert read_styles(text).get_properties(build_element(class_="cls-2")) == {
        "fill": "none",
        "stroke": "#000",
        "stroke-width": "2px",
    }


def test_unsupported_rules_are_counted() -> None:
    rules = read_styles(
        "@import url(http://example.org/x.css); @media print { rect { fill: none } }"
        "@supports (x:y) {rect{fill:none}} g > rect {fill:none} rect:hover{fill:none} rect{fill:red}"
    )
    assert rules.get_properties(build_element())["fill"] == "red"
    assert rules.unsupported_count == 4


def test_unfinished_rules_are_left_out() -> None:
    assert (
        read_styles("@media {").get_properties(build_element())
        == read_styles("rect{fill:red").get_properties(build_element())
        == read_styles("}{").get_properties(build_element())
        == {}
    )


def test_properties_are_inherited() -> None:
    group = inherit_style(INHERITED, {"fill": "none", "stroke": "red", "stroke-width": "3"})
    inner = inherit_style(group, {"fill": "inherit", "stroke": "unset", "stroke-width": "1"})
    assert (inner["fill"], inner["stroke"], inner["stroke-width"]) == ("none", "red", "1")
    assert inherit_style(group, {"opacity": "0"}).keys() == INHERITED.keys()


@pytest.mark.parametrize("paint", ["none", "transparent", "NONE"])
def test_invisible_paint_is_detected(paint: str) -> None:
    assert not is_painted(inherit_style(INHERITED, {"fill": paint}), "fill")
    assert not is_painted(inherit_style(INHERITED, {"fill-opacity": "0"}), "fill")
    assert not is_painted(inherit_style(INHERITED, {"fill-opacity": "0%"}), "fill")
    assert is_painted(inherit_style(INHERITED, {"fill": "url(#gradient)", "fill-opacity": "x"}), "fill")
    assert not is_painted(INHERITED, "stroke")


def test_hidden_elements_are_detected() -> None:
    assert is_hidden({"display": "None"})
    assert is_hidden({"opacity": "0.0"})
    assert not is_hidden({"display": "inline", "opacity": ".5"})


def test_declarations_are_parsed() -> None:
    assert parse_declarations(" Fill : url(a:b) ;; x ; stroke:red") == {"fill": "url(a:b)", "stroke": "red"}


@pytest.mark.slow
def test_expensive_style_sheets_are_rejected() -> None:
    with pytest.raises(
        MapError, match=rf"plan\.svg: expected style sheets of at most {MAX_SHEET_CHARACTERS} characters"
    ):
        read_styles("*" * (MAX_SHEET_CHARACTERS + 1))
    rules = read_styles("*{fill:red} " * 9000)
    with pytest.raises(MapError, match=r"plan\.svg: too many rules for too many elements"):
        for _ in range(MAX_RULE_CHECKS // 9000 + 1):
            rules.get_properties(build_element())
    read_styles("@" * 500_000)
    read_styles("@media{" * 100_000)
    read_styles("/* " * 300_000)
    read_styles("/*" * 300_000 + "*/")
