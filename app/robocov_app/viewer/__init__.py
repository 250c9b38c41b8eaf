"""The interactive window: sessions and actions (without pygame), drawing, and input.

- `launch`: opens the window
- `session`: the scenario, the edits of the user, and the recorded past; independent of pygame
- `presenter`, `model`, `view`, `inspection`, `actions`: state of the window, and the user's actions on it
- `commands`: names, keys and arguments of the actions
- `window`: the main loop, the mouse, dialogs and the status line
- `canvas`, `chart`, `panel`: the areas of the window
- `tools`: mouse tools for the map
- `costs`, `explanation`: the coverage cost, and the report on why a robot moves or does not
- `recovery`: the offer to recover unsaved sessions
- `lessons`: the guided tours
- `branch_output`: results, videos and images of a session's branches
"""
