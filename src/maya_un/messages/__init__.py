"""The sentences of Maya, looked up by code: one module for each language.

They are added to those of `dmc41x3.messages`, and replace the ones that name commands of `maya`.
"""

from __future__ import annotations

from dmc41x3.messages import LANGUAGES, sentence, table

__all__ = ["LANGUAGES", "sentence", "table"]
