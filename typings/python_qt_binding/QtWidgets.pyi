from typing import Any

from python_qt_binding.QtCore import QObject

def __getattr__(name: str) -> Any: ...

class QWidget(QObject):
    def showEvent(self, event: Any) -> None: ...  # noqa: N802 - Qt's name
    def resizeEvent(self, event: Any) -> None: ...  # noqa: N802 - Qt's name
    def eventFilter(self, watched: Any, event: Any) -> bool: ...  # noqa: N802 - Qt's name
