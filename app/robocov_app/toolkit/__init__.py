"""Widgets, dialogs, commands and the main loop of both windows, independent of robots and maps.

- `window`: the main loop, the display, the layout, and how a window ends
- `commands`: the table of commands, context menus, the palette and the help page
- `widgets`: buttons, sliders and fields of a panel
- `dialogs`: questions and choices
- `tools`: gestures of the mouse, snapping and zooming
- `command_bar`, `tool_rail`, `panel`: the parts around a map
- `overlay`: drawings over the window
"""
