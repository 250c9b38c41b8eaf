"""Output of a session's branch, which is simulated again without a window: records, costs, figures, video.

A branch is split into parts at its edits, because a record has a single map, team and controller. A branch
without edits has one part, and its folder has the same form as that of ``robocov run`` or
``robocov compare``.

``parts``    division into parts, and their records
``save``     evaluation of the records, and writing of all files
``video``    frames of the whole branch
``folders``  folders of the parts of a saved branch
"""
