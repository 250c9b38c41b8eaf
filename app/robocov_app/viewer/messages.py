"""Messages that several modules of the viewer print."""

NO_DISPLAY = (
    "no display: the window needs one. Add --serve to use it in a browser, or try ssh -X over ssh. To render "
    "without a display, use --out DIR with --frames N (for a saved run, with --video); "
    "robocov run needs no display."
)
