"""The plugin that rqt loads; rqt provides `rqt_gui_py`."""

from __future__ import annotations

from typing import Any

from python_qt_binding.QtCore import QTimer
from rqt_gui_py.plugin import Plugin

from maya_ui.dashboard import Dashboard
from maya_ui.start import preferred
from maya_ui.ui_controller import UiController


class MayaPlugin(Plugin):
    """The dashboard as a dock of rqt; its language is stored with the perspective.

    rqt opens a window of 600 by 450 pixels. Without a stored window, the dashboard makes it larger; a window that was
    stored on a larger screen is made to fit this one.
    """

    def __init__(self, context: Any) -> None:
        super().__init__(context)
        self.setObjectName("MayaPlugin")
        self._dashboard = Dashboard(UiController(), preferred(), context.serial_number())
        context.add_widget(self._dashboard)

    def shutdown_plugin(self) -> None:
        """Leave the graph; a jog that is held ends."""
        self._dashboard.shut_down()

    def save_settings(self, plugin_settings: Any, instance_settings: Any) -> None:
        """Store the language, and that the window has a size that a person has seen."""
        instance_settings.set_value("sized", value=True)
        instance_settings.set_value("language", self._dashboard.spoken)

    def restore_settings(self, plugin_settings: Any, instance_settings: Any) -> None:
        """Use the stored language, and size the window."""
        sized = instance_settings.contains("sized")
        QTimer.singleShot(0, self._dashboard.keep_window_on_screen if sized else self._dashboard.widen_window)
        self._dashboard.speak(str(instance_settings.value("language", self._dashboard.spoken)))
