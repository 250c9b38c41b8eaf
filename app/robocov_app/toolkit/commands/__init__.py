"""Commands, and where they are listed: menus, palette and help page."""
