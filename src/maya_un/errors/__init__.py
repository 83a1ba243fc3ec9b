"""Every error, its stable code, and the branch that decides whether the robot stops.

MayaError
├── RequestError            somebody asked for something impossible: refused, the robot is not disturbed
│   ├── NotConnected 1010 · ServiceNotRunning 1020 · ServiceNotAnswering 1021
│   │   TwinNotFound 1022 · ControllerOwned 1030 · ControllerMoves 1032
│   │   ProgramLost 1040 · RobotNotReached 1050 · SupervisorsNotReached 1051
│   │   BrokerRefused 1052 · SessionTakenOver 1053 · WrongRobot 1054
│   ├── Unreachable 2101 · PathRefused 2102 · NotHomed 2103 · Busy 2104 · Faulted 2105
│   │   MarkerMissing 2106 · TrajectoryRefused 2107 · NothingToRecover 2108 · GuardBlocked 2109
│   │   ProgramRuns 2110 · CannotPause 2111 · NotPaused 2112 · PositionNotKept 2314
│   ├── Stopped 2201 · Cancelled 2202
│   ├── GripperNotEmpty 3001 · GripperEmpty 3002
│   ├── InvalidValue 4001 · InvalidJob 4002 · UnknownName 4003 · NotFound 4004 · InvalidRequest 4005
│   │   SpeedOnRealMachine 4006 · FileUnreadable 4007 · InvalidCommandLine 4008
│   │   NotIdentifiable 4009 · NotTaught 4010 · NameTaken 4011 · KeyReused 4012
│   │   EventsForgotten 4013 · WrongState 4014 · AnswerNeeded 4015 · StreamLagging 4016
│   │   DependencyFailed 4017 · InvalidMessage 4018 · UnknownInterface 4019 · ServiceFailed 4020
│   │   NotOverRos 4021 · JobChanged 4022 · TooMuchAsked 4030 · TakesTooLong 4031 · TooLarge 4032
│   │   StepExpired 4040 · StepOfOtherRobot 4041 · StepNotBegun 4042
│   │   StepInterrupted 4043 · StepFailed 4044 · InvalidProcess 4045 · ProcessChanged 4046
│   │   DecisionNeeded 4047 · ProcessAborted 4048 · StepTakenElsewhere 4049
│   ├── NotSignedIn 4101 · NotAllowed 4102 · LeaseHeld 4103 · LeaseNeeded 4104 · LeaseLost 4105
│   │   TooManyRequests 4106 · CertificateRefused 4110
│   └── InvalidConfig 5001 · FileUnwritable 5002 · AddressInUse 5003 · AlreadyRunning 5004
│       FileNotOurs 5005 · NothingToRevert 5006 · StorageFailed 5007 · StorageDamaged 5008
│       StorageTooNew 5009 · StorageInUse 5010 · MasterGone 5011 · RosMissing 5012
│       TooFewDescriptors 5013 · StorageUnavailable 5014 · WorkerFailed 5020
└── MachineError            the machine did something unexpected: motion ends, a person recovers
    ├── LinkLost 1001 · ConnectFailed 1002 · LinkTimeout 1003 · CommandRejected 1004
    │   WrongController 1005 · UnexpectedReply 1006 · ParameterMismatch 1007
    │   ProgramDiffers 1008 · MemoryDamaged 1009 · NodeGone 1011 · OwnershipLost 1031
    │   OwnerErased 1033
    ├── LimitReached 2301 · FollowingError 2302 · AbortInput 2303 · AmplifierFault 2304
    │   UnexpectedStop 2305 · MotorOff 2306 · ControllerReset 2307 · EndNotReached 2308
    │   GuardNotRunning 2309 · HostSilent 2310 · PositionChanged 2311 · RegisterChanged 2312
    │   ForeignMotion 2313 · SwitchBlocks 2315
    ├── WiringContradictsCn 2401 · HomingStalled 2402 · SwitchNotFound 2403 · StrokeDiffers 2404
    └── InternalError 5999

1xxx link · 2xxx motion · 3xxx work-piece (`gripping`) · 4xxx request (`asking`) · 5xxx house: one module each. The
branches, and the leaves that need no robot, stand in `dmc41x3.errors`. The words belong to the code and stand in
`maya_un.messages` and `dmc41x3.messages`, one module a language; every edge shows the same code and words.
"""

from __future__ import annotations

from dmc41x3.errors import (
    AddressInUse,
    CommandRejected,
    ConnectFailed,
    FileNotOurs,
    FileUnreadable,
    FileUnwritable,
    InternalError,
    InvalidCommandLine,
    InvalidRequest,
    InvalidValue,
    LinkLost,
    LinkTimeout,
    MemoryDamaged,
    NotConnected,
    ProgramDiffers,
    ProgramLost,
    ProgramRuns,
    TooFewDescriptors,
    UnexpectedReply,
    UnknownName,
    WrongController,
    as_said,
    by_code,
    from_notice,
)
from maya_un.errors.asking import (
    AnswerNeeded,
    CertificateRefused,
    DecisionNeeded,
    DependencyFailed,
    EventsForgotten,
    InvalidJob,
    InvalidMessage,
    InvalidProcess,
    JobChanged,
    KeyReused,
    LeaseHeld,
    LeaseLost,
    LeaseNeeded,
    NameTaken,
    NotAllowed,
    NotFound,
    NotIdentifiable,
    NotOverRos,
    NotSignedIn,
    NotTaught,
    ProcessAborted,
    ProcessChanged,
    ServiceFailed,
    SpeedOnRealMachine,
    StepExpired,
    StepFailed,
    StepInterrupted,
    StepNotBegun,
    StepOfOtherRobot,
    StepTakenElsewhere,
    StreamLagging,
    TakesTooLong,
    TooLarge,
    TooManyRequests,
    TooMuchAsked,
    UnknownInterface,
    WrongState,
)
from maya_un.errors.base import (
    MachineError,
    MayaError,
    RequestError,
)
from maya_un.errors.gripping import (
    GripperEmpty,
    GripperNotEmpty,
)
from maya_un.errors.house import (
    AlreadyRunning,
    InvalidConfig,
    MasterGone,
    NothingToRevert,
    RosMissing,
    StorageDamaged,
    StorageFailed,
    StorageInUse,
    StorageTooNew,
    StorageUnavailable,
    WorkerFailed,
)
from maya_un.errors.link import (
    BrokerRefused,
    ControllerMoves,
    ControllerOwned,
    NodeGone,
    OwnerErased,
    OwnershipLost,
    ParameterMismatch,
    RobotNotReached,
    ServiceNotAnswering,
    ServiceNotRunning,
    SessionTakenOver,
    SupervisorsNotReached,
    TwinNotFound,
    WrongRobot,
)
from maya_un.errors.motion import (
    AbortInput,
    AmplifierFault,
    Busy,
    Cancelled,
    CannotPause,
    ControllerReset,
    EndNotReached,
    Faulted,
    FollowingError,
    ForeignMotion,
    GuardBlocked,
    GuardNotRunning,
    HomingStalled,
    HostSilent,
    LimitReached,
    MarkerMissing,
    MotorOff,
    NothingToRecover,
    NotHomed,
    NotPaused,
    PathRefused,
    PositionChanged,
    PositionNotKept,
    RegisterChanged,
    Stopped,
    StrokeDiffers,
    SwitchBlocks,
    SwitchNotFound,
    TrajectoryRefused,
    UnexpectedStop,
    Unreachable,
    WiringContradictsCn,
)

__all__ = [
    "AbortInput",
    "AddressInUse",
    "AlreadyRunning",
    "AmplifierFault",
    "AnswerNeeded",
    "BrokerRefused",
    "Busy",
    "Cancelled",
    "CannotPause",
    "CertificateRefused",
    "CommandRejected",
    "ConnectFailed",
    "ControllerMoves",
    "ControllerOwned",
    "ControllerReset",
    "DecisionNeeded",
    "DependencyFailed",
    "EndNotReached",
    "EventsForgotten",
    "Faulted",
    "FileNotOurs",
    "FileUnreadable",
    "FileUnwritable",
    "FollowingError",
    "ForeignMotion",
    "GripperEmpty",
    "GripperNotEmpty",
    "GuardBlocked",
    "GuardNotRunning",
    "HomingStalled",
    "HostSilent",
    "InternalError",
    "InvalidCommandLine",
    "InvalidConfig",
    "InvalidJob",
    "InvalidMessage",
    "InvalidProcess",
    "InvalidRequest",
    "InvalidValue",
    "JobChanged",
    "KeyReused",
    "LeaseHeld",
    "LeaseLost",
    "LeaseNeeded",
    "LimitReached",
    "LinkLost",
    "LinkTimeout",
    "MachineError",
    "MarkerMissing",
    "MasterGone",
    "MayaError",
    "MemoryDamaged",
    "MotorOff",
    "NameTaken",
    "NodeGone",
    "NotAllowed",
    "NotConnected",
    "NotFound",
    "NotHomed",
    "NotIdentifiable",
    "NotOverRos",
    "NotPaused",
    "NotSignedIn",
    "NotTaught",
    "NothingToRecover",
    "NothingToRevert",
    "OwnerErased",
    "OwnershipLost",
    "ParameterMismatch",
    "PathRefused",
    "PositionChanged",
    "PositionNotKept",
    "ProcessAborted",
    "ProcessChanged",
    "ProgramDiffers",
    "ProgramLost",
    "ProgramRuns",
    "RegisterChanged",
    "RequestError",
    "RobotNotReached",
    "RosMissing",
    "ServiceFailed",
    "ServiceNotAnswering",
    "ServiceNotRunning",
    "SessionTakenOver",
    "SpeedOnRealMachine",
    "StepExpired",
    "StepFailed",
    "StepInterrupted",
    "StepNotBegun",
    "StepOfOtherRobot",
    "StepTakenElsewhere",
    "Stopped",
    "StorageDamaged",
    "StorageFailed",
    "StorageInUse",
    "StorageTooNew",
    "StorageUnavailable",
    "StreamLagging",
    "StrokeDiffers",
    "SupervisorsNotReached",
    "SwitchBlocks",
    "SwitchNotFound",
    "TakesTooLong",
    "TooFewDescriptors",
    "TooLarge",
    "TooManyRequests",
    "TooMuchAsked",
    "TrajectoryRefused",
    "TwinNotFound",
    "UnexpectedReply",
    "UnexpectedStop",
    "UnknownInterface",
    "UnknownName",
    "Unreachable",
    "WiringContradictsCn",
    "WorkerFailed",
    "WrongController",
    "WrongRobot",
    "WrongState",
    "as_said",
    "by_code",
    "from_notice",
]
