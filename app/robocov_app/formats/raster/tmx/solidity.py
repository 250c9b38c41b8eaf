"""Names and properties that make tiles, objects and layers of a TMX file solid, or objects robot starts."""

import re
from collections.abc import Iterable

from robocov_app.formats.files.xml_tree import Element

_SOLID = re.compile(
    r"(is|has|ge)?(collid(e|es|er|ers|able)|collisions?|(map)?walls?|solids?|block(s|ed|ing)?|obstacles?)"
    r"(layer|tiles?|objects?)?"
)
_ROBOT = re.compile(r"(robot|start|spawn)s?")
_FALSE_WORDS = ("false", "0", "no")


def is_declared_solid(element: Element, names: Iterable[str] = ()) -> bool:
    """Return whether names, the class or a property of an element make it solid."""
    words = list(names)
    words += [element.attributes.get(key, "") for key in ("class", "type")]
    properties = element.find_child("properties")
    if properties is not None:
        for child in properties.children:
            if child.attributes.get("value", "").casefold() not in _FALSE_WORDS:
                words.append(child.attributes.get("name", ""))
    return any(_SOLID.fullmatch(_fold_name(word)) for word in words)


def is_robot_name(name: str) -> bool:
    """Return whether an object of this name is the start of a robot."""
    return _ROBOT.fullmatch(_fold_name(name)) is not None


def _fold_name(name: str) -> str:
    """Return the letters of a name in lower case: "blocktile" for "Block_Tile 2"."""
    return re.sub(r"[\W\d_]", "", name.casefold())
