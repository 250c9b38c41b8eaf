"""Tools of the viewer, which are used with the mouse on the canvas.

``tool``      base class of the tools, and their previews
``hand``      drag robots and obstacles
``outlines``  polygons and walls, point by point
``segments``  the ruler, and circles from their center
``brush``     paint the density
``clicks``    delete, add a robot, make a robot fail
``snapping``  snapping of new points to corners and walls
``toolbox``   all tools, by name
"""
