"""The example in the documentation of `robocov_app.learning`, in which a team learns."""

from __future__ import annotations

from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from robocov_app import learning


@pytest.mark.slow
def test_the_example_learns(capsys: pytest.CaptureFixture[str]) -> None:
    """The example of the package, with fewer samples: its best policy exceeds the median on new starts."""
    _, _, code = (learning.__doc__ or "").partition("    import numpy")
    code = "    import numpy" + code.rpartition("Names are loaded")[0]
    shortened = code.replace("range(16)", "range(5)").replace("duration=20.0", "duration=12.0")
    assert shortened.count("range(5)") == shortened.count("duration=12.0") == 1
    names: dict[str, Any] = {}
    exec(dedent(shortened.replace("range(10, 14)", "range(10, 12)")), names)
    output = capsys.readouterr().out.split()
    median = float(output[1])
    best = float(output[-1])
    assert best > median + 1.0
    assert best > 1.0
    assert len(names["returns"]) == 5
    assert np.ptp(names["returns"]) > 2.0
