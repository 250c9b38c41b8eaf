"""Why a robot moves, or why it does not, in words and numbers. Knows no pygame.

``explain``    the report on a robot
``situation``  the facts: forces, goal, obstacles and robots nearby
``motion``     moving, trembling, at rest or setting off
``verdict``    the first sentence of the report
``lines``      the other sentences
``text``       lengths, forces and directions as text
"""
