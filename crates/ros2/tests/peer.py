"""A peer of the bridge on Cyclone DDS, with the names and types of ROS 2 and without ROS.

    peer.py subscribe TOPIC TYPE          prints each message as a line of JSON
    peer.py publish TOPIC TYPE JSON       sends a message again and again, its fields from the JSON
    peer.py play TOPIC TYPE FILE          sends the messages of a file, a line of JSON each, to the first subscriber
    peer.py call SERVICE TYPE JSON        asks a service as rmw_cyclonedds does, until it answers

TOPIC is that of ROS, such as /cmd_vel. Loopback only, without multicast, unless CYCLONEDDS_URI says otherwise.
"""

import argparse
import json
import math
import os
import sys
import time
import types
from dataclasses import dataclass, field, fields, is_dataclass

os.environ.setdefault(
    "CYCLONEDDS_URI",
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers><Peer Address='127.0.0.1'/></Peers>"
    "</Discovery></Domain></CycloneDDS>",
)

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Float64(IdlStruct, typename="std_msgs.msg.dds_.Float64_"):
    data: float64 = 0.0


@dataclass
class Int32(IdlStruct, typename="std_msgs.msg.dds_.Int32_"):
    data: int32 = 0


@dataclass
class MultiArrayDimension(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayDimension_"):
    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0


@dataclass
class MultiArrayLayout(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension] = field(default_factory=list)
    data_offset: uint32 = 0


@dataclass
class Float64MultiArray(IdlStruct, typename="std_msgs.msg.dds_.Float64MultiArray_"):
    layout: MultiArrayLayout = field(default_factory=MultiArrayLayout)
    data: sequence[float64] = field(default_factory=list)


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Twist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header = field(default_factory=Header)
    name: sequence[str] = field(default_factory=list)
    position: sequence[float64] = field(default_factory=list)
    velocity: sequence[float64] = field(default_factory=list)
    effort: sequence[float64] = field(default_factory=list)


@dataclass
class Imu(IdlStruct, typename="sensor_msgs.msg.dds_.Imu_"):
    header: Header = field(default_factory=Header)
    orientation: Quaternion = field(default_factory=Quaternion)
    orientation_covariance: array[float64, 9] = field(default_factory=lambda: [0.0] * 9)
    angular_velocity: Vector3 = field(default_factory=Vector3)
    angular_velocity_covariance: array[float64, 9] = field(default_factory=lambda: [0.0] * 9)
    linear_acceleration: Vector3 = field(default_factory=Vector3)
    linear_acceleration_covariance: array[float64, 9] = field(default_factory=lambda: [0.0] * 9)


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str = ""
    value: str = ""


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level: uint8 = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: sequence[KeyValue] = field(default_factory=list)


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header = field(default_factory=Header)
    status: sequence[DiagnosticStatus] = field(default_factory=list)


@dataclass
class ParameterValue(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
class Parameter(IdlStruct, typename="rcl_interfaces.msg.dds_.Parameter_"):
    name: str = ""
    value: ParameterValue = field(default_factory=ParameterValue)


@dataclass
class ParameterEvent(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterEvent_"):
    stamp: Time = field(default_factory=Time)
    node: str = ""
    new_parameters: sequence[Parameter] = field(default_factory=list)
    changed_parameters: sequence[Parameter] = field(default_factory=list)
    deleted_parameters: sequence[Parameter] = field(default_factory=list)


@dataclass
class FloatingPointRange(IdlStruct, typename="rcl_interfaces.msg.dds_.FloatingPointRange_"):
    from_value: float64 = 0.0
    to_value: float64 = 0.0
    step: float64 = 0.0


@dataclass
class IntegerRange(IdlStruct, typename="rcl_interfaces.msg.dds_.IntegerRange_"):
    from_value: int64 = 0
    to_value: int64 = 0
    step: uint64 = 0


@dataclass
class ParameterDescriptor(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterDescriptor_"):
    name: str = ""
    type: uint8 = 0
    description: str = ""
    additional_constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: sequence[FloatingPointRange] = field(default_factory=list)
    integer_range: sequence[IntegerRange] = field(default_factory=list)


@dataclass
class SetParametersResult(IdlStruct, typename="rcl_interfaces.msg.dds_.SetParametersResult_"):
    successful: bool = False
    reason: str = ""


@dataclass
class ListParametersResult(IdlStruct, typename="rcl_interfaces.msg.dds_.ListParametersResult_"):
    names: sequence[str] = field(default_factory=list)
    prefixes: sequence[str] = field(default_factory=list)


def half(name, **members):
    """A half of a service, behind what rmw_cyclonedds puts before it: who asks, and a number."""
    members = {"guid": uint64, "number": int64, **members}
    named = {"typename": f"rcl_interfaces.srv.dds_.{name}_"}
    made = types.new_class(name, (IdlStruct,), named, lambda body: body.update(__annotations__=members))
    return dataclass(made)


SERVICES = {
    "GetParameters": ({"names": sequence[str]}, {"values": sequence[ParameterValue]}),
    "GetParameterTypes": ({"names": sequence[str]}, {"types": sequence[uint8]}),
    "ListParameters": ({"prefixes": sequence[str], "depth": uint64}, {"result": ListParametersResult}),
    "DescribeParameters": ({"names": sequence[str]}, {"descriptors": sequence[ParameterDescriptor]}),
    "SetParameters": ({"parameters": sequence[Parameter]}, {"results": sequence[SetParametersResult]}),
    "SetParametersAtomically": ({"parameters": sequence[Parameter]}, {"result": SetParametersResult}),
}


def parameter(name, value):
    """A parameter of the type that a value has in JSON."""
    if isinstance(value, bool):
        return Parameter(name, ParameterValue(type=1, bool_value=value))
    if isinstance(value, int):
        return Parameter(name, ParameterValue(type=2, integer_value=value))
    return Parameter(name, ParameterValue(type=3, double_value=value))


def call(participant, args, qos):
    """Asks a service, and prints its answer."""
    asked, answered = SERVICES[args.type]
    request_type = half(args.type + "_Request", **asked)
    response_type = half(args.type + "_Response", **answered)
    requests = Topic(participant, f"rq{args.topic}Request", request_type, qos=qos)
    replies = Topic(participant, f"rr{args.topic}Reply", response_type, qos=qos)
    reader = DataReader(Subscriber(participant), replies, qos=qos)
    writer = DataWriter(Publisher(participant), requests, qos=qos)
    values = json.loads(args.values)
    if "parameters" in values:
        values["parameters"] = [parameter(*it) for it in values["parameters"].items()]
    while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
        time.sleep(0.02)
    # The other side may know only one of the two yet.
    time.sleep(0.5)
    guid = 0x0102030405060708
    writer.write(request_type(guid=guid, number=42, **values))
    while True:
        for answer in reader.take(N=10):
            if is_dataclass(answer) and (answer.guid, answer.number) == (guid, 42):
                print(json.dumps(plain(answer)), flush=True)
                return
        time.sleep(0.005)


def plain(value):
    """A message as what JSON has."""
    if is_dataclass(value):
        return {part.name: plain(getattr(value, part.name)) for part in fields(value)}
    if isinstance(value, (list, tuple)):
        return [plain(element) for element in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def fill(message, values):
    """Puts values into the fields of a message; `now` is the time."""
    for name, value in values.items():
        old = getattr(message, name)
        if value == "now":
            now = time.time_ns()
            value = Time(now // 1_000_000_000, now % 1_000_000_000)
        elif is_dataclass(old):
            value = fill(old, value)
        elif isinstance(value, list):
            value = [float(it) if isinstance(it, (int, float)) else it for it in value]
        elif isinstance(old, float):
            value = float(value)
        setattr(message, name, value)
    return message


def play(writer, message_type, args):
    """Sends each message of a file once, and waits then for its end."""
    while not writer.get_matched_subscriptions():
        time.sleep(0.02)
    # The other side may not know this one yet.
    time.sleep(0.5)
    with open(args.values, encoding="utf-8") as lines:
        for line in lines:
            writer.write(fill(message_type(), json.loads(line)))
            time.sleep(1.0 / args.rate)
    while True:
        time.sleep(1.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("verb", choices=["publish", "subscribe", "play", "call"])
    parser.add_argument("topic")
    parser.add_argument("type")
    parser.add_argument("values", nargs="?", default="{}")
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--best-effort", action="store_true")
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--count", type=int, default=1 << 60)
    args = parser.parse_args()
    message_type = globals().get(args.type)
    reliability = (
        Policy.Reliability.BestEffort
        if args.best_effort
        else Policy.Reliability.Reliable(duration(milliseconds=100))
    )
    qos = Qos(reliability, Policy.Durability.Volatile, Policy.History.KeepLast(10))
    participant = DomainParticipant(args.domain)
    if args.verb == "call":
        print("ready", flush=True)
        return call(participant, args, qos)
    topic = Topic(participant, "rt" + args.topic, message_type, qos=qos)
    if args.verb == "subscribe":
        reader = DataReader(Subscriber(participant), topic, qos=qos)
        print("ready", flush=True)
        while True:
            for message in reader.take(N=100):
                if is_dataclass(message):
                    print(json.dumps(plain(message)), flush=True)
            time.sleep(0.001)
    writer = DataWriter(Publisher(participant), topic, qos=qos)
    print("ready", flush=True)
    if args.verb == "play":
        return play(writer, message_type, args)
    for _ in range(args.count):
        writer.write(fill(message_type(), json.loads(args.values)))
        time.sleep(1.0 / args.rate)


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError):
        sys.exit(0)
