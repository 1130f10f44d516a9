//! The definitions that the program carries.

use isochrone_recording::message::Definitions;

/// These files of `msg/`, each with its text.
macro_rules! texts {
    ($($file:literal,)*) => {
        &[$(($file, include_str!(concat!("../msg/", $file)))),*]
    };
}

const TEXTS: &[(&str, &str)] = texts! {
    "builtin_interfaces/Duration.msg",
    "builtin_interfaces/Time.msg",
    "control_msgs/GripperCommand.msg",
    "control_msgs/JointControllerState.msg",
    "control_msgs/JointJog.msg",
    "control_msgs/PidState.msg",
    "diagnostic_msgs/DiagnosticArray.msg",
    "diagnostic_msgs/DiagnosticStatus.msg",
    "diagnostic_msgs/KeyValue.msg",
    "geometry_msgs/Accel.msg",
    "geometry_msgs/AccelStamped.msg",
    "geometry_msgs/AccelWithCovariance.msg",
    "geometry_msgs/AccelWithCovarianceStamped.msg",
    "geometry_msgs/Inertia.msg",
    "geometry_msgs/InertiaStamped.msg",
    "geometry_msgs/Point.msg",
    "geometry_msgs/Point32.msg",
    "geometry_msgs/PointStamped.msg",
    "geometry_msgs/Pose.msg",
    "geometry_msgs/Pose2D.msg",
    "geometry_msgs/PoseStamped.msg",
    "geometry_msgs/PoseWithCovariance.msg",
    "geometry_msgs/PoseWithCovarianceStamped.msg",
    "geometry_msgs/Quaternion.msg",
    "geometry_msgs/QuaternionStamped.msg",
    "geometry_msgs/Transform.msg",
    "geometry_msgs/TransformStamped.msg",
    "geometry_msgs/Twist.msg",
    "geometry_msgs/TwistStamped.msg",
    "geometry_msgs/TwistWithCovariance.msg",
    "geometry_msgs/TwistWithCovarianceStamped.msg",
    "geometry_msgs/Vector3.msg",
    "geometry_msgs/Vector3Stamped.msg",
    "geometry_msgs/VelocityStamped.msg",
    "geometry_msgs/Wrench.msg",
    "geometry_msgs/WrenchStamped.msg",
    "nav_msgs/Odometry.msg",
    "rcl_interfaces/DescribeParameters.srv",
    "rcl_interfaces/FloatingPointRange.msg",
    "rcl_interfaces/GetParameterTypes.srv",
    "rcl_interfaces/GetParameters.srv",
    "rcl_interfaces/IntegerRange.msg",
    "rcl_interfaces/ListParameters.srv",
    "rcl_interfaces/ListParametersResult.msg",
    "rcl_interfaces/Parameter.msg",
    "rcl_interfaces/ParameterDescriptor.msg",
    "rcl_interfaces/ParameterEvent.msg",
    "rcl_interfaces/ParameterType.msg",
    "rcl_interfaces/ParameterValue.msg",
    "rcl_interfaces/SetParameters.srv",
    "rcl_interfaces/SetParametersAtomically.srv",
    "rcl_interfaces/SetParametersResult.msg",
    "rmw_dds_common/Gid.msg",
    "rmw_dds_common/NodeEntitiesInfo.msg",
    "rmw_dds_common/ParticipantEntitiesInfo.msg",
    "sensor_msgs/BatteryState.msg",
    "sensor_msgs/FluidPressure.msg",
    "sensor_msgs/Illuminance.msg",
    "sensor_msgs/Imu.msg",
    "sensor_msgs/JointState.msg",
    "sensor_msgs/Joy.msg",
    "sensor_msgs/LaserScan.msg",
    "sensor_msgs/MagneticField.msg",
    "sensor_msgs/NavSatFix.msg",
    "sensor_msgs/NavSatStatus.msg",
    "sensor_msgs/Range.msg",
    "sensor_msgs/RelativeHumidity.msg",
    "sensor_msgs/Temperature.msg",
    "sensor_msgs/TimeReference.msg",
    "std_msgs/Bool.msg",
    "std_msgs/Byte.msg",
    "std_msgs/ByteMultiArray.msg",
    "std_msgs/Char.msg",
    "std_msgs/ColorRGBA.msg",
    "std_msgs/Empty.msg",
    "std_msgs/Float32.msg",
    "std_msgs/Float32MultiArray.msg",
    "std_msgs/Float64.msg",
    "std_msgs/Float64MultiArray.msg",
    "std_msgs/Header.msg",
    "std_msgs/Int16.msg",
    "std_msgs/Int16MultiArray.msg",
    "std_msgs/Int32.msg",
    "std_msgs/Int32MultiArray.msg",
    "std_msgs/Int64.msg",
    "std_msgs/Int64MultiArray.msg",
    "std_msgs/Int8.msg",
    "std_msgs/Int8MultiArray.msg",
    "std_msgs/MultiArrayDimension.msg",
    "std_msgs/MultiArrayLayout.msg",
    "std_msgs/String.msg",
    "std_msgs/UInt16.msg",
    "std_msgs/UInt16MultiArray.msg",
    "std_msgs/UInt32.msg",
    "std_msgs/UInt32MultiArray.msg",
    "std_msgs/UInt64.msg",
    "std_msgs/UInt64MultiArray.msg",
    "std_msgs/UInt8.msg",
    "std_msgs/UInt8MultiArray.msg",
    "trajectory_msgs/JointTrajectory.msg",
    "trajectory_msgs/JointTrajectoryPoint.msg",
    "trajectory_msgs/MultiDOFJointTrajectoryPoint.msg",
};

/// The definitions that the program carries.
pub(crate) fn definitions() -> Definitions {
    let mut definitions = Definitions::default();
    for (file, text) in TEXTS {
        match file.rsplit_once('.') {
            Some((name, "srv")) => definitions.add_service(name, text),
            Some((name, _)) => definitions.add(name, text),
            None => {}
        }
    }
    definitions
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use isochrone_recording::ByteOrder;
    use isochrone_recording::message::{RosValue, decode, encode};

    use super::*;

    #[test]
    fn every_file_is_carried_and_every_message_can_be_sent() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("msg");
        let mut files = 0;
        for package in std::fs::read_dir(folder).unwrap() {
            files += std::fs::read_dir(package.unwrap().path()).unwrap().count();
        }
        assert_eq!(files, TEXTS.len());
        let definitions = definitions();
        for name in definitions.names() {
            let message = definitions.find(name).unwrap();
            let value = RosValue::of(&message);
            let body = encode(&message, &value).unwrap();
            assert_eq!(decode(&message, &body, ByteOrder::Little), Ok(value), "{name}");
        }
    }
}
