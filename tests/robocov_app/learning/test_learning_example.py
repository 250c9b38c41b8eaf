from __future__ import annotations

from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from robocov_app import learning


@pytest.mark.slow
def test_the_example_learns(capsys: pytest.CaptureFixture[str]) -> None:
    """What the package shows, with fewer tries: the best law is better than most on starts it never saw."""
    _, _, code = (learning.__doc__ or "").partition("    import numpy")
    code = "    import numpy" + code.rpartition("Names are loaded")[0]
    few = code.replace("range(16)", "range(5)").replace("duration=20.0", "duration=12.0")
    assert few.count("range(5)") == few.count("duration=12.0") == 1
    names: dict[str, Any] = {}
    exec(dedent(few.replace("range(10, 14)", "range(10, 12)")), names)
    told = capsys.readouterr().out.split()
    median = float(told[1])
    best = float(told[-1])
    assert best > median + 1.0
    assert best > 1.0
    assert len(names["returns"]) == 5 and np.ptp(names["returns"]) > 2.0
