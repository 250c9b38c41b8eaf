"""Reports in words and numbers on why a robot moves, or why it does not. Independent of pygame.

``explain``                the report on a robot
``situation``              the facts: forces, goal, obstacles and robots nearby
``contact_force``          the force of contacts on the robot
``motion_classification``  whether the robot moves, trembles, is at rest or is setting off
``motion_sentence``        the first sentence of the report: why the robot moves or has stopped
``sentences``              the other sentences
``quantities``             lengths, forces and directions as text
"""
