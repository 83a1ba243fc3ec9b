"""Node joint_sliders: a window that publishes on /joint_sliders the joints that a person wants drawn.

joint_state_publisher_gui does the same, but its version in Debian 12 does not start with Debian's Python.
"""

import math
import signal
import sys
import xml.etree.ElementTree as ET

import rospy
from python_qt_binding.QtCore import Qt, QTimer
from python_qt_binding.QtWidgets import QApplication, QFormLayout, QLabel, QPushButton, QSlider, QWidget
from sensor_msgs.msg import JointState

RATE = 25.0
STEPS = 2000
ROWS = (
    ("a", "a, boom", "{:.1f}°", math.degrees(1.0)),
    ("b", "b, inner line", "{:.0f} mm", 1e3),
    ("c", "c, outer line", "{:.0f} mm", 1e3),
    ("jaw", "gripper", "{:.0f} mm", 2e3),
)


class Row(QSlider):
    """The slider of one joint between its limits, with its value in a unit for people."""

    def __init__(self, low: float, high: float, words: str, factor: float) -> None:
        super().__init__(Qt.Horizontal)
        self._low, self._high, self._words, self._factor = low, high, words, factor
        self.label = QLabel()
        self.label.setMinimumWidth(70)
        self.setRange(0, STEPS)
        self.valueChanged.connect(self._say)
        self.rest()

    @property
    def position(self) -> float:
        """The wanted position of the joint (rad, m)."""
        return self._low + (self._high - self._low) * self.value() / STEPS

    def rest(self) -> None:
        """Go to the middle of the limits."""
        self.setValue(STEPS // 2)
        self._say()

    def _say(self) -> None:
        self.label.setText(self._words.format(self._factor * self.position))


class Sliders(QWidget):
    """The window; it publishes all joints periodically, because a subscriber may come later."""

    def __init__(self, limits: dict[str, tuple[float, float]]) -> None:
        super().__init__()
        self.setWindowTitle("Maya: joints drawn while the robot is silent")
        self._publisher = rospy.Publisher("joint_sliders", JointState, queue_size=1)
        self._rows = {name: Row(*limits[name], words, factor) for name, _, words, factor in ROWS}
        form = QFormLayout(self)
        for name, title, _, _ in ROWS:
            row = self._rows[name]
            form.addRow(title, row)
            form.addRow("", row.label)
        middle = QPushButton("Middle")
        middle.clicked.connect(lambda: [row.rest() for row in self._rows.values()])
        form.addRow(middle)
        self.resize(460, self.sizeHint().height())
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._tell)
        self._timer.start(round(1000.0 / RATE))

    def _tell(self) -> None:
        if rospy.is_shutdown():
            QApplication.instance().quit()
            return
        message = JointState(name=list(self._rows), position=[row.position for row in self._rows.values()])
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)


def limits_of(description: str) -> dict[str, tuple[float, float]]:
    """Return the limits of the joints of a description (rad, m)."""
    found = {}
    for joint in ET.fromstring(description).findall("joint"):
        limit = joint.find("limit")
        if limit is not None:
            found[joint.attrib["name"]] = float(limit.attrib["lower"]), float(limit.attrib["upper"])
    return found


def main() -> int:
    """Show the window until it is closed or the node must end."""
    rospy.init_node("joint_sliders", disable_signals=True)
    application = QApplication(sys.argv[:1])
    for kind in (signal.SIGINT, signal.SIGTERM):
        signal.signal(kind, lambda *_: application.quit())
    window = Sliders(limits_of(rospy.get_param("robot_description")))
    window.show()
    code = application.exec_()
    rospy.signal_shutdown("the window is closed")
    return code


if __name__ == "__main__":
    raise SystemExit(main())
