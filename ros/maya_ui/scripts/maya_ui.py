#!/usr/bin/env python3
"""Node maya_dashboard: the dashboard, in rqt where there is one."""

from maya_ui.start import main

if __name__ == "__main__":
    raise SystemExit(main())
