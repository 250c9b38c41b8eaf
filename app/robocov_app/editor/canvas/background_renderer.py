"""Drawing of the background image of a map."""

from pathlib import Path

import numpy as np
import pygame
from PIL import Image, ImageOps
from pygame import Rect, Surface

from robocov_app.editor.model.background import Background
from robocov_app.render.camera import Camera
from robocov_app.storage.regular_files import require_regular_file

MAX_IMAGE_PX = 4096  # larger images are reduced to this side length
MAX_SHOWN_PX = 8192  # maximum side length of the scaled image
MIN_PIXELATED_FACTOR = 4.0  # from this magnification on, pixels are drawn as squares


class BackgroundRenderer:
    """Loads and draws the background image of a map; the latest one is cached.

    Attributes
    ----------
    error : str
        Reason why the image cannot be shown. The caller clears it after reporting it.
    """

    def __init__(self) -> None:
        self.error = ""
        self._path: Path | None = None
        self._image: Surface | None = None
        self._reduction = 1.0  # pixels of the file per pixel of the cached image

    def draw(
        self, surface: Surface, background: Background, folder: Path, camera: Camera, clip: Rect
    ) -> None:
        """Draw a background image; nothing if it is hidden or cannot be loaded.

        Parameters
        ----------
        surface : Surface
            Surface to draw on.
        background : Background
            The image, with its position and opacity.
        folder : Path
            Folder to which the path of the image is relative.
        camera : Camera
            The view.
        clip : Rect
            Visible part of the surface, px.
        """
        self._load(folder / background.path)
        if self._image is None or not background.shown or background.opacity <= 0.0:
            return
        factor = background.scale * camera.zoom * self._reduction
        if background.rotation_deg % 360.0:
            drawn = self._rotate(self._image, background, camera, factor)
        else:
            drawn = self._magnify(self._image, background, camera, factor, clip)
        if drawn is not None:
            image, position = drawn
            image.set_alpha(round(255 * background.opacity))
            surface.blit(image, position)

    def _load(self, path: Path) -> None:
        """Load an image unless it is the cached one; set `error` if that fails."""
        if path == self._path:
            return
        self._path = path
        self._image = None
        self.error = ""
        try:
            require_regular_file(path)
            with Image.open(path) as file:
                full = ImageOps.exif_transpose(file)
                image = _convert_to_rgb(full)
            image.thumbnail((MAX_IMAGE_PX, MAX_IMAGE_PX))
            self._reduction = full.size[0] / image.size[0]
            self._image = pygame.image.frombytes(image.tobytes(), image.size, "RGB").convert()
        except Exception as error:  # Decoders raise all kinds of errors for broken images.
            self.error = f"the background image {path.name} cannot be shown: {error}"

    def _rotate(
        self, image: Surface, background: Background, camera: Camera, factor: float
    ) -> tuple[Surface, Rect] | None:
        """Rotate and scale the image; return it with its box in the window, or None if it is too large."""
        if factor * max(image.get_size()) > MAX_SHOWN_PX:
            return None
        rotated = pygame.transform.rotozoom(image.convert_alpha(), background.rotation_deg, factor)
        corners = camera.to_pixels(np.array(background.corners))
        x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
        return rotated, rotated.get_rect(center=(round(x), round(y)))

    def _magnify(
        self, image: Surface, background: Background, camera: Camera, factor: float, clip: Rect
    ) -> tuple[Surface, Rect] | None:
        """Scale the visible part of the image; return it with its position, or None if nothing is visible.

        The whole image could be too large after scaling.
        """
        left, top = camera.to_pixels(np.array(background.upper_left)).tolist()
        width, height = image.get_size()
        first_x = max(int((clip.left - left) / factor) - 1, 0)
        first_y = max(int((clip.top - top) / factor) - 1, 0)
        last_x = min(int((clip.right - left) / factor) + 2, width)
        last_y = min(int((clip.bottom - top) / factor) + 2, height)
        low_x = round(left + first_x * factor)
        low_y = round(top + first_y * factor)
        size_x = max(round(left + last_x * factor) - low_x, 1)
        size_y = max(round(top + last_y * factor) - low_y, 1)
        if last_x <= first_x or last_y <= first_y or max(size_x, size_y) > MAX_SHOWN_PX:
            return None
        visible = image.subsurface((first_x, first_y, last_x - first_x, last_y - first_y))
        position = Rect(low_x, low_y, 0, 0)
        if factor < MIN_PIXELATED_FACTOR:
            return pygame.transform.smoothscale(visible, (size_x, size_y)), position
        return pygame.transform.scale(visible, (size_x, size_y)), position


def _convert_to_rgb(image: Image.Image) -> Image.Image:
    """Convert an image to RGB: transparency becomes white; 16-bit and float values fill the whole range."""
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        transparent = image.convert("RGBA")
        white = Image.new("RGBA", transparent.size, "white")
        return Image.alpha_composite(white, transparent).convert("RGB")
    if image.mode.startswith("I") or image.mode == "F":
        values = np.asarray(image, dtype=float)
        gray = (values - values.min()) * (255.0 / max(float(np.ptp(values)), 1e-9))
        return Image.fromarray(gray.astype(np.uint8)).convert("RGB")
    return image.convert("RGB")
