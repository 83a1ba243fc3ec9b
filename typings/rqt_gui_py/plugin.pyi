from typing import Any

from python_qt_binding.QtCore import QObject

class Plugin(QObject):
    def __init__(self, context: Any) -> None: ...
