"""Messages that several modules of the viewer print."""

NO_DISPLAY = (
    "no display: the window needs one. Over ssh, try ssh -X. To render without a display, use --out DIR "
    "with --frames N (for a saved run, with --video); robocov run needs no display."
)
