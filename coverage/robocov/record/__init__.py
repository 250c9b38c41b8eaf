"""The record of a run: taken while it goes on, thinned, saved in one folder and read back."""

from __future__ import annotations

from robocov.record.run_record import ARRAYS, Record, versions

__all__ = ["ARRAYS", "Record", "versions"]
