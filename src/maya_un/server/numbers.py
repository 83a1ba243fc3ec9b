"""Numbers in paths."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path

MOST = 2**53
"""The greatest number that JSON carries exactly."""

JobNumber = Annotated[int, Path(ge=1, le=MOST, description="number of a job")]
"""The number of a job."""
