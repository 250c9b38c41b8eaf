"""Play mode: the viewer opens the edited map in the same window, and later returns to the editor."""
