"""Errors: each is declared once, with its code, its English sentence and its details; see `dmc41x3.errors`.

1xxx `link` · 2xxx and 3xxx `motion` · 26xx `commissioning` · 4xxx `requests` · 5xxx `system`. Those that need no robot
stand in `dmc41x3.errors`. Every interface shows the same code and the same sentence.
"""

from __future__ import annotations

from dmc41x3.errors import *
from maya_un.errors.base import *
from maya_un.errors.commissioning import *
from maya_un.errors.link import *
from maya_un.errors.motion import *
from maya_un.errors.requests import *
from maya_un.errors.system import *
