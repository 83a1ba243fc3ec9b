"""MD5 sums and definitions by ROS' own generators (genmsg 0.6, and actionlib_msgs/genaction for actions)."""

from __future__ import annotations

MESSAGES = {
    "maya_controller/FollowAction": "54108791363e519178b420ccc5c94fed",
    "maya_controller/FollowActionFeedback": "9c36d1474e0d85afb1b0133748f61080",
    "maya_controller/FollowActionGoal": "a99e83ef6185f9fdd7693efe99623a86",
    "maya_controller/FollowActionResult": "873584584c21467f44f98009d8e56047",
    "maya_controller/FollowFeedback": "1133261590d4d5d80d27bd12bdb632e8",
    "maya_controller/FollowGoal": "2a0eff76c870e8595636c2a562ca298e",
    "maya_controller/FollowResult": "bac8a8faa4c9cf707a0ecca2502653e6",
    "maya_controller/HomeAction": "dcce855318883ac7389338619de0e949",
    "maya_controller/HomeActionFeedback": "774dfd85b388af7684ac0b5b013a7d8e",
    "maya_controller/HomeActionGoal": "4b30be6cd12b9e72826df56b481f40e0",
    "maya_controller/HomeActionResult": "873584584c21467f44f98009d8e56047",
    "maya_controller/HomeFeedback": "6d2d7be4891f7e41e801034b05c9586c",
    "maya_controller/HomeGoal": "d41d8cd98f00b204e9800998ecf8427e",
    "maya_controller/HomeResult": "bac8a8faa4c9cf707a0ecca2502653e6",
    "maya_controller/MoveAction": "9fe9b7c4c7e640c6004771ff6d05bf37",
    "maya_controller/MoveActionFeedback": "9c36d1474e0d85afb1b0133748f61080",
    "maya_controller/MoveActionGoal": "566f7c39d277e4774d9e9c9980c61021",
    "maya_controller/MoveActionResult": "873584584c21467f44f98009d8e56047",
    "maya_controller/MoveFeedback": "1133261590d4d5d80d27bd12bdb632e8",
    "maya_controller/MoveGoal": "6ffac936c9b4e668039d250d853dc9b2",
    "maya_controller/MoveResult": "bac8a8faa4c9cf707a0ecca2502653e6",
    "maya_controller/RawSensorData": "850e4d32f8d3eb19cb1a3f605b8406fb",
    "maya_robot/MayaPrimitive": "e624278cbb57a7fcdec8a583e38f1ad5",
    "maya_robot/TaskAction": "4ed82f52e57316be822fefd81ea31f5e",
    "maya_robot/TaskActionFeedback": "24ecf0353736d4c34744c0b780f1ed8b",
    "maya_robot/TaskActionGoal": "bc9762fb41c6103715bc3a71989e2ce3",
    "maya_robot/TaskActionResult": "873584584c21467f44f98009d8e56047",
    "maya_robot/TaskFeedback": "9d12272aa7ca2941cab8d8f25e84b59a",
    "maya_robot/TaskGoal": "4e1df7520b6b0cdf3d35b06acea67163",
    "maya_robot/TaskResult": "bac8a8faa4c9cf707a0ecca2502653e6",
    "maya_process/ProcessQueue": "71df9e1ca79f9abb2b40455652213dc3",
    "std_msgs/Header": "2176decaecbce78abc3b96ef049fabed",
    "std_msgs/String": "992ce8a1687cec8c8bd883ec73ca41d1",
    "std_msgs/Empty": "d41d8cd98f00b204e9800998ecf8427e",
    "std_msgs/Time": "cd7166c74c552c311fbcc2fe5a7bc289",
    "std_msgs/Byte": "ad736a2e8818154c487bb80fe42ce43b",
    "geometry_msgs/Point": "4a842b65f413084dc2b10fb484ea7f17",
    "sensor_msgs/JointState": "3066dcd76a6cfaef579bd0f34173e9fd",
    "sensor_msgs/NavSatFix": "2d3a8cd499b9b4a0249fb98fd05cfa48",
    "trajectory_msgs/JointTrajectory": "65b4f94a94d1ed67169da35a02f33d3f",
    "visualization_msgs/MarkerArray": "d155b9ce5188fbaf89745847fd5882d7",
    "diagnostic_msgs/DiagnosticArray": "60810da900de1dd6ddd437c3503511da",
    "actionlib_msgs/GoalStatusArray": "8b2b82f13216d0a8ea88bd3af735e619",
    "actionlib_msgs/GoalID": "302881f31927c1df708a2dbab0e80ee8",
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "rosgraph_msgs/Log": "acffd30cd6b6de30f120938c17c593fb",
}

SERVICES = {
    "std_srvs/Empty": "d41d8cd98f00b204e9800998ecf8427e",
    "std_srvs/SetBool": "09fb03525b03e7ea1fd3992bafd87e16",
    "std_srvs/Trigger": "937c9679a518e3a18d831e57125ea522",
    "maya_robot/MayaCommand": "accaee53b86502f815f15e7bedb58165",
    "maya_controller/SetOutput": "8aa4eb2ebc4b55c56196c9590a456dcb",
    "maya_process/CallOperation": "4a4397802d724577e46d422cf2558fcb",
    "maya_process/RecoverQueue": "d9c1fcb92c797e5dc46a889a7825d3ff",
}

JOINT_STATE = (
    "070000000c00000059010000070000006261736520c3a9020000000100000061010000006202000000000000000000e03f"
    "000000000000f4bf0000000001000000000000000000f07f"
)
"""Bytes that genpy writes for the message of `test_types`."""

DIAGNOSTICS = (
    "000000000000000000000000000000000100000002010000006e010000006d010000006801000000010000006b0100000076"
)  # fmt: skip
"""The same for its diagnostics."""
