"""The chart of the coverage cost against time, and the time slider below it.

Modules
-------
chart
    `Chart`, the part of the window.
scale
    Positions of times and values.
frame
    Place, look and content that all parts share.
axes, events, curves
    Parts of the page, which changes seldom.
captions, time_slider, pointer_tag
    Parts that change in each frame.
scrubbing
    Dragging the time slider.
"""
