"""The picture under the map, as large as the camera asks."""

from pathlib import Path

import numpy as np
import pygame
from PIL import Image, ImageOps
from pygame import Rect, Surface

from robocov_app.editor.model.background import Background
from robocov_app.render.camera import Camera

LARGEST = 4096  # pixels of a side that are kept of a larger picture
_LARGEST_SHOWN = 8192  # of a side of what is made of it at most


class ReferenceImage:
    """Keeps the picture that was loaded last, and draws it."""

    def __init__(self) -> None:
        self._of: Path | None = None
        self._picture: Surface | None = None
        self._shrunk = 1.0
        self.trouble = ""

    def draw(self, page: Surface, background: Background, folder: Path, camera: Camera, clip: Rect) -> None:
        """Draw the picture on a page; `folder` is where its path counts from."""
        self._load(folder / background.path)
        picture = self._picture
        if picture is None or not background.shown or background.opacity <= 0.0:
            return
        factor = background.scale * camera.zoom * self._shrunk
        if background.turn % 360.0:
            if factor * max(picture.get_size()) > _LARGEST_SHOWN:
                return
            shown = pygame.transform.rotozoom(picture.convert_alpha(), background.turn, factor)
            corners = camera.to_pixels(np.array(background.corners))
            x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
            at = shown.get_rect(center=(round(x), round(y)))
        else:  # the part that can be seen: magnified, the whole may be huge
            left, top = camera.to_pixels(np.array(background.corners[3])).tolist()
            width, height = picture.get_size()
            first_x = max(int((clip.left - left) / factor) - 1, 0)
            first_y = max(int((clip.top - top) / factor) - 1, 0)
            last_x = min(int((clip.right - left) / factor) + 2, width)
            last_y = min(int((clip.bottom - top) / factor) + 2, height)
            at = Rect(round(left + first_x * factor), round(top + first_y * factor), 0, 0)
            to_x, to_y = round(left + last_x * factor), round(top + last_y * factor)
            size = max(to_x - at.x, 1), max(to_y - at.y, 1)
            if last_x <= first_x or last_y <= first_y or max(size) > _LARGEST_SHOWN:
                return
            part = picture.subsurface((first_x, first_y, last_x - first_x, last_y - first_y))
            shown = (pygame.transform.smoothscale if factor < 4.0 else pygame.transform.scale)(part, size)
        shown.set_alpha(round(255 * background.opacity))
        page.blit(shown, at)

    def _load(self, path: Path) -> None:
        if path == self._of:
            return
        self._of, self._picture, self.trouble = path, None, ""
        try:
            with Image.open(path) as opened:
                full = ImageOps.exif_transpose(opened)
                width = full.size[0]
                rgb = _on_white(full)
        except Exception as error:  # whatever a broken picture makes its decoder raise
            self.trouble = f"the picture {path.name} cannot be shown: {error}"
            return
        rgb.thumbnail((LARGEST, LARGEST))
        self._shrunk = width / rgb.size[0]
        self._picture = pygame.image.frombytes(rgb.tobytes(), rgb.size, "RGB").convert()


def _on_white(picture: Image.Image) -> Image.Image:
    if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
        clear = picture.convert("RGBA")
        page = Image.new("RGBA", clear.size, (255, 255, 255, 255))
        return Image.alpha_composite(page, clear).convert("RGB")
    if picture.mode.startswith("I") or picture.mode == "F":
        values = np.asarray(picture, dtype=float)
        grey = (values - values.min()) * (255.0 / max(float(np.ptp(values)), 1e-9))
        return Image.fromarray(grey.astype(np.uint8)).convert("RGB")
    return picture.convert("RGB")
