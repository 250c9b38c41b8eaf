"""The chart of the coverage cost against time, and the time line below it.

Modules
-------
chart
    `Chart`: what the window shows and asks for.
scale
    Positions of times and values.
frame
    What all parts of the chart are drawn from.
axes, events, curves
    Parts of the page, which changes seldom.
captions, time_line, pointer_tag
    Parts that change in each frame.
"""
