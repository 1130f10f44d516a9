//! The bridge between a domain of iceoryx2 and peers on Cyclone DDS and Fast DDS, which know nothing of it but the names and types of
//! ROS 2.

mod configuration;
mod fast_dds;
mod harness;
mod operate;
mod recorded;
mod trouble;
mod types;
mod worth;
