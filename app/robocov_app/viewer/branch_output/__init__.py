"""A branch of a session, simulated again without a window: records, costs, figures and a video.

A branch is divided into parts at its edits, because a record has one map, one team and one controller.
Without edits it has one part, and its folder is that of ``robocov run`` or ``robocov compare``.

``parts``    division into parts, and their records
``save``     evaluate the records, and write all files
``video``    frames of the whole branch
``folders``  folders of the parts of a saved branch
"""
