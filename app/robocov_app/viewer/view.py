"""Appearance of the window: layers, theme, panel, and other display options."""

from dataclasses import dataclass

from robocov_app.viewer.layer_presets import LAYER_PRESETS, LayerPreset, find_preset

FADE_S = 12.0  # duration for which fading trajectories are visible


@dataclass
class ViewState:
    """Appearance of the window, independent of the session.

    Attributes
    ----------
    layers : set of str
        Names of the visible layers.
    theme : str
        ``light`` or ``dark``.
    has_panel : bool
        Whether the panel is visible.
    fades_trajectories : bool
        Whether trajectories show only the last `FADE_S` seconds.
    has_suggestions : bool
        Whether the window suggests what to try once the team has settled.
    has_motion : bool
        Whether the user of this window wants the camera to glide when the zoom changes.
    is_motion_reduced : bool
        Whether the user's system asks for reduced motion, so that the camera does not glide.
    is_compact : bool
        Whether the window is on a phone, whose page has the buttons of the bar and of the rail.
    is_recording : bool
        Whether a video of the window is being recorded.
    has_branches : bool
        Whether the chart shows other branches. They are hidden while a lesson's question is open, because
        they would give away the answer.
    """

    layers: set[str]
    theme: str = "light"
    has_panel: bool = True
    fades_trajectories: bool = False
    has_suggestions: bool = True
    has_motion: bool = True
    is_motion_reduced: bool = False
    is_compact: bool = False
    is_recording: bool = False
    has_branches: bool = True

    def toggle_layer(self, name: str) -> None:
        """Show or hide a layer."""
        self.layers ^= {name}

    def use_preset(self, preset: LayerPreset) -> str:
        """Show exactly the layers of a preset; return a message."""
        self.layers = set(preset.layers)
        return f"{preset.title} · {preset.description}"

    def use_next_preset(self) -> str:
        """Show the layers of the next preset, or of the first one; return a message."""
        current = find_preset(self.layers)
        index = 0
        if current is not None:
            index = (LAYER_PRESETS.index(current) + 1) % len(LAYER_PRESETS)
        return self.use_preset(LAYER_PRESETS[index])

    def toggle_theme(self) -> None:
        """Switch between the light and the dark theme."""
        self.theme = "dark" if self.theme == "light" else "light"

    def toggle_fading(self) -> str:
        """Switch between complete trajectories and their last seconds; return a message."""
        self.fades_trajectories = not self.fades_trajectories
        if self.fades_trajectories:
            return f"trajectories show the last {FADE_S:g} s"
        return "complete trajectories are shown"

    def toggle_suggestions(self) -> str:
        """Switch suggestions on or off; return a message."""
        self.has_suggestions = not self.has_suggestions
        if self.has_suggestions:
            return "suggestions on"
        return "suggestions off"

    def toggle_motion(self) -> str:
        """Switch between smooth and instant zooming; return a message."""
        self.has_motion = not self.has_motion
        if self.has_motion and self.is_motion_reduced:
            return "zooming is instant, because the system asks for reduced motion"
        if self.has_motion:
            return "zooming is smooth"
        return "zooming is instant"

    def toggle_panel(self) -> None:
        """Show or hide the panel."""
        self.has_panel = not self.has_panel
