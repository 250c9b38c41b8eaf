"""The reference image under the map."""

from pathlib import Path

import numpy as np
import pygame
from PIL import Image, ImageOps
from pygame import Rect, Surface

from robocov_app.editor.model.background import Background
from robocov_app.render.camera import Camera
from robocov_app.storage.regular_files import require_regular_file

MAX_IMAGE_PX = 4096  # larger pictures are reduced to this side length
MAX_SHOWN_PX = 8192  # maximum side length of the scaled picture
MIN_PIXELATED_FACTOR = 4.0  # from this magnification on, pixels are drawn as squares


class ReferenceImage:
    """Loads and draws the image under a map; the latest one is cached.

    Attributes
    ----------
    error : str
        Reason why the picture cannot be shown. The caller clears it after reporting it.
    """

    def __init__(self) -> None:
        self.error = ""
        self._path: Path | None = None
        self._picture: Surface | None = None
        self._reduction = 1.0  # pixels of the file per pixel of the cached picture

    def draw(
        self, surface: Surface, background: Background, folder: Path, camera: Camera, clip: Rect
    ) -> None:
        """Draw a picture; nothing if it is hidden or cannot be loaded.

        Parameters
        ----------
        surface : Surface
            Surface to draw on.
        background : Background
            Position and opacity of the picture.
        folder : Path
            Folder to which the path of the picture is relative.
        camera : Camera
            The view.
        clip : Rect
            Visible part of the surface, px.
        """
        self._load(folder / background.path)
        if self._picture is None or not background.shown or background.opacity <= 0.0:
            return
        factor = background.scale * camera.zoom * self._reduction
        if background.rotation_deg % 360.0:
            drawn = self._rotate(self._picture, background, camera, factor)
        else:
            drawn = self._magnify(self._picture, background, camera, factor, clip)
        if drawn is not None:
            picture, position = drawn
            picture.set_alpha(round(255 * background.opacity))
            surface.blit(picture, position)

    def _load(self, path: Path) -> None:
        """Load a picture unless it is the cached one; set `error` if that fails."""
        if path == self._path:
            return
        self._path = path
        self._picture = None
        self.error = ""
        try:
            require_regular_file(path)
            with Image.open(path) as file:
                full = ImageOps.exif_transpose(file)
                picture = _convert_to_rgb(full)
            picture.thumbnail((MAX_IMAGE_PX, MAX_IMAGE_PX))
            self._reduction = full.size[0] / picture.size[0]
            self._picture = pygame.image.frombytes(picture.tobytes(), picture.size, "RGB").convert()
        except Exception as error:  # Decoders raise all kinds of errors for broken pictures.
            self.error = f"the picture {path.name} cannot be shown: {error}"

    def _rotate(
        self, picture: Surface, background: Background, camera: Camera, factor: float
    ) -> tuple[Surface, Rect] | None:
        """Rotate and scale the picture; return it with its box in the window, or None if it is too large."""
        if factor * max(picture.get_size()) > MAX_SHOWN_PX:
            return None
        rotated = pygame.transform.rotozoom(picture.convert_alpha(), background.rotation_deg, factor)
        corners = camera.to_pixels(np.array(background.corners))
        x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
        return rotated, rotated.get_rect(center=(round(x), round(y)))

    def _magnify(
        self, picture: Surface, background: Background, camera: Camera, factor: float, clip: Rect
    ) -> tuple[Surface, Rect] | None:
        """Scale the visible part of the picture; return it with its position, or None if nothing is visible.

        The whole picture could be too large after scaling.
        """
        left, top = camera.to_pixels(np.array(background.upper_left)).tolist()
        width, height = picture.get_size()
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
        visible = picture.subsurface((first_x, first_y, last_x - first_x, last_y - first_y))
        position = Rect(low_x, low_y, 0, 0)
        if factor < MIN_PIXELATED_FACTOR:
            return pygame.transform.smoothscale(visible, (size_x, size_y)), position
        return pygame.transform.scale(visible, (size_x, size_y)), position


def _convert_to_rgb(picture: Image.Image) -> Image.Image:
    """Convert a picture to RGB: transparency becomes white; 16-bit and float values fill the whole range."""
    if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
        transparent = picture.convert("RGBA")
        white = Image.new("RGBA", transparent.size, "white")
        return Image.alpha_composite(white, transparent).convert("RGB")
    if picture.mode.startswith("I") or picture.mode == "F":
        values = np.asarray(picture, dtype=float)
        gray = (values - values.min()) * (255.0 / max(float(np.ptp(values)), 1e-9))
        return Image.fromarray(gray.astype(np.uint8)).convert("RGB")
    return picture.convert("RGB")
