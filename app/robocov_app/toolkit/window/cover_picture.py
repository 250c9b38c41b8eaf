"""A picture of the dialog or menu that covers a window, in the size of the screen of a phone."""

from pygame import Rect, Surface, transform

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme

_TOP_FRACTION = 0.1
"""Height above the dialog, in heights of the screen; a keyboard on the screen covers its lower part."""
_VEIL_STRENGTH = 0.25


class CoverPicture:
    """Shows a box of a window as large as possible on a screen of another size."""

    def __init__(self) -> None:
        self._box = Rect(0, 0, 1, 1)  # of the window
        self._target = Rect(0, 0, 1, 1)  # where the picture shows it
        self._size = (0, 0)

    def draw(
        self, window: Surface, box: Rect, size: tuple[int, int], max_factor: float, theme: Theme
    ) -> Surface:
        """Draw a box of the window.

        Parameters
        ----------
        window : pygame.Surface
        box : pygame.Rect
            The box, px of the window.
        size : (width, height), px
            Size of the picture.
        max_factor : float
            Maximum factor by which the box is enlarged.
        theme : Theme
            Colors around the box.

        Returns
        -------
        pygame.Surface
        """
        width, height = size
        self._size = size
        self._box = box.clip(window.get_rect())
        factor = min(width / self._box.width, height / self._box.height, max_factor)
        self._target = Rect(0, 0, round(factor * self._box.width), round(factor * self._box.height))
        free_height = height - self._target.height
        self._target.midtop = width // 2, min(round(_TOP_FRACTION * height), free_height // 2)
        picture = Surface(size, 0, 32)
        picture.fill(mix(theme.background, theme.ink, _VEIL_STRENGTH))
        picture.blit(transform.smoothscale(window.subsurface(self._box), self._target.size), self._target)
        return picture

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of a picture of a size.

        A pixel next to the box becomes a pixel of the window next to the box.
        """
        if size != self._size:
            return pixel
        factor = self._box.width / self._target.width
        x = self._box.left + (pixel[0] - self._target.left) * factor
        y = self._box.top + (pixel[1] - self._target.top) * factor
        return x, y
