#!/usr/bin/python3
"""Node maya_dashboard: the dashboard, in rqt if it is installed."""

import sys
from pathlib import Path

sys.path[:] = [folder for folder in sys.path if not Path(folder, "maya_ui.py").is_file()]

from maya_ui.start import main  # noqa: E402 - this file is named as the package, and Python searches its folder first

if __name__ == "__main__":
    raise SystemExit(main())
