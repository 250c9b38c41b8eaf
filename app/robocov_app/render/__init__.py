"""Drawing: theme, camera and layers that show an environment, a team and one moment of a run."""

import os

# pygame greets on stdout, which belongs to the answers of commands
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
