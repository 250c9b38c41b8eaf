"""The start page: examples that move, maps as thumbnails, and recent sessions.

- `cards`: the examples, and the choice of each
- `previews`: recorded runs and outlines of maps, which are drawn without a simulation
- `recording`: records the previews; ``python -m robocov_app.viewer.start.recording`` writes them
- `page`: the window
- `preparation`: imports the viewer and compiles its kernels while the page is shown
"""
