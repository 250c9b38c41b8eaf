"""Tools of the viewer: actions of the mouse on the canvas.

``tool``      base class of the tools, and their previews
``hand``      drag robots and obstacles
``outlines``  polygons and walls, point by point
``segments``  the ruler, and circles from their center
``brush``     paint the density
``clicks``    delete, add a robot, let a robot fail
``snapping``  corners and walls attract new points
``toolbox``   all of them, by name
"""
