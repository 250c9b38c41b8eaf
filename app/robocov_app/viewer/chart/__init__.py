"""The chart of the coverage cost against time, and the time slider below it.

Modules
-------
chart
    `Chart`, the area of the window with chart and time slider.
scale
    Conversion of times and values to pixels.
frame
    Layout, theme and content that all parts share.
axes, events, curves
    Parts of the cached page, which rarely changes.
captions, time_slider, pointer_tag
    Parts that are drawn in each frame.
scrubbing
    Dragging the time slider.
"""
