"""Starts `maya up --ros2`, on the twin or on the controller of the configuration, and rviz2.

ros2 launch maya_bringup maya.launch.py options:='--speed 20'
ros2 launch maya_bringup maya.launch.py address:=real
"""

import shlex

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "maya": ("maya", "the command of Maya, with its path if the shell does not find it"),
    "address": ("sim", "sim for the twin, real for the controller of the configuration, or HOST"),
    "namespace": ("", "the namespace of the robot"),
    "options": ("", "more options of `maya up`"),
    "rviz": ("true", "show the robot in rviz2"),
}

SHOWN = ("tf", "tf_static", "robot_description", "maya_markers")
"""The topics of the robot that rviz2 shows, in its namespace."""


def program(context: LaunchContext) -> list[ExecuteProcess]:
    """Return the control program with the options of the launch."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    named = ["--address", given["address"], "--ros-namespace", given["namespace"]]
    return [
        ExecuteProcess(cmd=[given["maya"], "up", "--ros2", *named, *shlex.split(given["options"])], output="screen")
    ]


def generate_launch_description() -> LaunchDescription:
    """Return what the launch file starts."""
    arguments = [DeclareLaunchArgument(name, default_value=value, description=meaning)
                 for name, (value, meaning) in ARGUMENTS.items()]  # fmt: skip
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", PathJoinSubstitution([FindPackageShare("maya_description"), "rviz", "maya.rviz"])],
        remappings=[(f"/{name}", name) for name in SHOWN],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription([*arguments, OpaqueFunction(function=program), rviz])
