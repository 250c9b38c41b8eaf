"""`python -m robocov_app` is `robocov`."""

import sys

from robocov_app.cli import main

sys.exit(main())
