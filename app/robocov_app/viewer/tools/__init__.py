"""Tools of the viewer: what the mouse does on the canvas.

``tool``      base class of the tools, and what they show
``hand``      drag robots and obstacles
``outlines``  polygons and walls, point by point
``segments``  the ruler, and circles from their center
``brush``     paint the density
``clicks``    delete, add a robot, let a robot fail
``snapping``  corners and walls attract what is drawn
``toolbox``   all of them, by name
"""
