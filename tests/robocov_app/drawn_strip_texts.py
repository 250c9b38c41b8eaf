"""Checks of the texts below the map, which a message may hide but not cover in part."""

from collections.abc import Sequence

import numpy as np
import pygame

MESSAGES_OF_ALL_LENGTHS = ("a message", "a message of some length", "a message as wide as the map " * 2)


def check_only_boxes_have_texts(
    frame: np.ndarray, boxes: Sequence[pygame.Rect], arena: tuple[int, int, int, int]
) -> None:
    """Check that the rows of the boxes contain nothing else in the arena, and that no box is empty."""
    left, _, width, _ = arena
    background = _find_background(frame, boxes)
    rest = frame.copy()
    for box in boxes:
        assert (_crop(frame, box) != background).any()
        rest[box.top : box.bottom, box.left : box.right] = background
    row = pygame.Rect(left + 2, boxes[0].top, width - 4, boxes[0].height)
    assert (_crop(rest, row) == background).all()


def check_texts_are_complete_or_hidden(
    frame: np.ndarray, without_message: np.ndarray, boxes: Sequence[pygame.Rect], message_box: pygame.Rect
) -> None:
    """Check that a message covers no box in part, and that boxes next to it are either complete or empty."""
    background = _find_background(without_message, boxes)
    visible = frame.copy()
    visible[message_box.top : message_box.bottom, message_box.left : message_box.right] = background
    for box in boxes:
        is_complete = np.array_equal(_crop(visible, box), _crop(without_message, box))
        assert is_complete or (_crop(visible, box) == background).all()


def _find_background(frame: np.ndarray, boxes: Sequence[pygame.Rect]) -> np.ndarray:
    return frame[boxes[0].top, boxes[0].right + 4]


def _crop(frame: np.ndarray, box: pygame.Rect) -> np.ndarray:
    return frame[box.top : box.bottom, box.left : box.right]
