"""The icon of the windows: three robots in their cells."""

import pygame
from pygame import Surface

from robocov_app.look.theme import LIGHT

ICON_SIZE_PX = 64
_SUPERSAMPLING = 4
"""The icon is drawn larger by this factor and then scaled down, which smooths its edges."""
_CELLS = (
    (0, ((0, 0), (38, 0), (30, 30), (0, 42)), (16, 18)),
    (1, ((38, 0), (64, 0), (64, 44), (30, 30)), (49, 18)),
    (3, ((0, 42), (30, 30), (64, 44), (64, 64), (0, 64)), (30, 49)),
)
"""Hue, corners and position of the robot of each cell, px."""
_CORNER_RADIUS_PX = 12
_EDGE_PX = 3
_ROBOT_RADIUS_PX = 9
_RING_RADIUS_PX = 12


def render_icon() -> Surface:
    """Render the icon, which is readable on light and dark task bars."""
    size = ICON_SIZE_PX * _SUPERSAMPLING
    picture = Surface((size, size), pygame.SRCALPHA, 32)
    for hue, corners, _ in _CELLS:
        points = [(x * _SUPERSAMPLING, y * _SUPERSAMPLING) for x, y in corners]
        pygame.draw.polygon(picture, LIGHT.get_cell_color(hue), points)
        pygame.draw.polygon(picture, LIGHT.obstacle_edge, points, _EDGE_PX * _SUPERSAMPLING)
    for hue, _, (x, y) in _CELLS:
        center = (x * _SUPERSAMPLING, y * _SUPERSAMPLING)
        pygame.draw.circle(picture, LIGHT.robot_ring, center, _RING_RADIUS_PX * _SUPERSAMPLING)
        pygame.draw.circle(picture, LIGHT.robots[hue], center, _ROBOT_RADIUS_PX * _SUPERSAMPLING)
    # The corners become transparent, and the frame is drawn over the cells.
    box = picture.get_rect()
    mask = Surface(picture.get_size(), pygame.SRCALPHA, 32)
    pygame.draw.rect(mask, (255, 255, 255, 255), box, border_radius=_CORNER_RADIUS_PX * _SUPERSAMPLING)
    picture.blit(mask, (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
    radius = _CORNER_RADIUS_PX * _SUPERSAMPLING
    pygame.draw.rect(picture, LIGHT.obstacle_edge, box, _EDGE_PX * _SUPERSAMPLING, border_radius=radius)
    return pygame.transform.smoothscale(picture, (ICON_SIZE_PX, ICON_SIZE_PX))
