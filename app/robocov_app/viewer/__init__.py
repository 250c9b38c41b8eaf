"""The interactive window: sessions and actions (without pygame), drawing, and input.

- `launch`: opens the window
- `session`: the scenario, its edits, and the past, independent of pygame
- `presenter`, `model`, `view`, `inspection`, `actions`: state of the window, and actions of the user
- `commands`: names, keys and arguments of the actions
- `window`: the main loop, the mouse, dialogs and the status line
- `canvas`, `chart`, `panel`: the areas of the window
- `tools`: the mouse on the map
- `costs`, `explanation`: the coverage cost, and the sentences about a robot
- `lessons`: the guided tours
- `branch_output`: results, videos and images of a session's branches
"""
