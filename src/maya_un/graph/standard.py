"""Definitions of ROS' own services, and of the few messages that the library's store of types does not hold.

Each stands here as its package writes it, by its name; a service has its request and its response around `---`.
"""

from __future__ import annotations

SERVICES = {
    "std_srvs/Empty": "---",
    "std_srvs/SetBool": "bool data\n---\nbool success\nstring message",
    "std_srvs/Trigger": "---\nbool success\nstring message",
    "rosapi/Topics": "---\nstring[] topics\nstring[] types",
    "rosapi/TopicType": "string topic\n---\nstring type",
    "rosapi/TopicsForType": "string type\n---\nstring[] topics",
    "rosapi/TopicsAndRawTypes": "---\nstring[] topics\nstring[] types\nstring[] typedefs_full_text",
    "rosapi/Services": "---\nstring[] services",
    "rosapi/ServicesForType": "string type\n---\nstring[] services",
    "rosapi/ServiceType": "string service\n---\nstring type",
    "rosapi/ServiceNode": "string service\n---\nstring node",
    "rosapi/ServiceHost": "string service\n---\nstring host",
    "rosapi/ServiceProviders": "string service\n---\nstring[] providers",
    "rosapi/ServiceRequestDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/ServiceResponseDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/MessageDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/Nodes": "---\nstring[] nodes",
    "rosapi/NodeDetails": "string node\n---\nstring[] subscribing\nstring[] publishing\nstring[] services",
    "rosapi/Publishers": "string topic\n---\nstring[] publishers",
    "rosapi/Subscribers": "string topic\n---\nstring[] subscribers",
    "rosapi/GetParam": "string name\nstring default\n---\nstring value",
    "rosapi/SetParam": "string name\nstring value\n---",
    "rosapi/HasParam": "string name\n---\nbool exists",
    "rosapi/DeleteParam": "string name\n---",
    "rosapi/SearchParam": "string name\n---\nstring global_name",
    "rosapi/GetParamNames": "---\nstring[] names",
    "rosapi/GetTime": "---\ntime time",
    "rosapi/GetActionServers": "---\nstring[] action_servers",
}

MESSAGES = {
    "rosapi/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
}
