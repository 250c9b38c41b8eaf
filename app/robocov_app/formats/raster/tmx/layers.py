"""Layers of tiles and objects, possibly in groups, selected by their names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from robocov.typing import FloatArray
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.raster.tmx.attributes import parse_vector
from robocov_app.formats.raster.tmx.solidity import is_declared_solid


class Layer(NamedTuple):
    """A layer of tiles or objects.

    Attributes
    ----------
    element : Element
    labels : tuple of str
        Labels of the layer and of the groups that contain it.
    offset : (2,) array, px
        Offset of the layer on the map, with the y axis down.
    is_solid : bool
        Whether the user selects the layer, or the file declares it solid.
    """

    element: Element
    labels: tuple[str, ...]
    offset: FloatArray
    is_solid: bool

    @property
    def has_tiles(self) -> bool:
        """Whether it is a layer of tiles, not of objects."""
        return self.element.tag == "layer"


def list_layers(root: Element, shapes: Shapes) -> list[Layer]:
    """Return the layers of a map to read; layers that the user skips are counted as left out."""
    surroundings = Layer(root, (), np.zeros(2), is_solid=False)
    return list(_iterate_layers(surroundings, shapes))


def _iterate_layers(group: Layer, shapes: Shapes) -> Iterator[Layer]:
    """Yield the layers of a group and, recursively, of the groups in it."""
    selection = shapes.labels
    for element in group.element.children:
        if element.tag not in ("layer", "objectgroup", "group"):
            continue
        names = [element.attributes.get(key, "") for key in ("name", "class")]
        labels = (*filter(None, names), *group.labels)
        folded_labels = selection.register_and_fold(labels)
        offset = group.offset + parse_vector(element, "offsetx", "offsety")
        if selection.only is None:
            is_solid = group.is_solid or is_declared_solid(element, labels)
        else:
            is_solid = group.is_solid or bool(selection.only & folded_labels)
        layer = Layer(element, labels, offset, is_solid)
        if selection.skip & folded_labels:
            shapes.count_omission("layer", "by their names (--only, --skip)")
        elif element.tag == "group":
            yield from _iterate_layers(layer, shapes)
        elif element.tag == "objectgroup" or selection.only is None or is_solid:
            yield layer
