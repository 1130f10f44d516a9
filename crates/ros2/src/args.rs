//! The command line.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Parser;
use isochrone_engine::{FileKind, Source, read_text};
use isochrone_ipc::{Domain, check_service_name};
use isochrone_recording::message::MessageType;

use crate::bundled;
use crate::config::{
    Bases, Config, FromRos, MOST_DOMAIN, NoType, OnBad, Profile, QualityOfService, SLASH, ToRos,
    example, find_type, no_signal, read,
};
use crate::failure::{self, Failure};
use crate::mapping::Incoming;
use crate::names::{self, full_topic};

/// The file, as errors name it.
static FILE: FileKind = FileKind {
    name: "configuration",
    format: "TOML",
    max_bytes: 1 << 20,
    shorten: "",
    needs: "needs [[to_ros]], [[from_ros]], [[parameters]] or [diagnostics]",
};

/// Bridge frames, parameters and alarms of isochrone control nodes to ROS 2 and back
///
/// Needs no ROS installation: it speaks DDS, the wire of ROS 2. What it does is in a file, or in --to-ros and --from-ros.
#[derive(Parser, Debug)]
#[command(name = "isochrone-ros2", version, max_term_width = 100)]
#[command(
    after_help = "Exit status: 0 done, 1 it ran and something was wrong, 2 usage or configuration \
    error.\nSIGINT (Ctrl-C), SIGTERM and SIGHUP end it in order: readers of its services learn that it stops."
)]
pub(crate) struct Args {
    /// The configuration, in TOML
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Publish each signal of a service as std_msgs/msg/Float64 on a topic of its own, /SERVICE/SIGNAL; may be
    /// repeated
    #[arg(long, value_name = "SERVICE")]
    to_ros: Vec<String>,
    /// Publish every number of a topic's messages as a service of the topic's name; may be repeated
    #[arg(long, num_args = 2, value_names = ["TOPIC", "TYPE"])]
    from_ros: Vec<String>,
    /// A folder with .msg files, such as /opt/ros/jazzy/share; may be repeated
    #[arg(long, value_name = "DIR")]
    msg_path: Vec<PathBuf>,
    /// Name of the node in ROS [default: isochrone]
    #[arg(long)]
    node: Option<String>,
    /// Its namespace, such as /plant [default: /]
    #[arg(long)]
    namespace: Option<String>,
    /// Domain of DDS [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_parser = clap::value_parser!(u16).range(0..=i64::from(MOST_DOMAIN)))]
    domain: Option<u16>,
    /// Speak to this machine alone, without the network
    #[arg(long)]
    local: bool,
    /// Check the configuration, say what it would do, and end
    #[arg(long)]
    check: bool,
    /// Show the fields of a message type, or without one all types, and end
    #[arg(long, value_name = "TYPE")]
    pub(crate) show: Option<Option<String>>,
    /// Take services over from living writers that are not of isochrone
    #[arg(long)]
    pub(crate) take_over: bool,
    /// End after so many seconds
    #[arg(long)]
    pub(crate) seconds: Option<f64>,
    /// iceoryx2 configuration file; its root-path and prefix determine which processes see each other
    #[arg(long, value_name = "FILE")]
    iceoryx2_config: Option<PathBuf>,
    /// Log more to stderr: -v who comes and goes, -vv all of it
    #[arg(short, long, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,
}

impl Args {
    /// Whether the configuration is only to be checked.
    pub(crate) fn is_check(&self) -> bool {
        self.check
    }

    /// The domain of iceoryx2.
    pub(crate) fn iceoryx2_domain(&self) -> Result<Domain, Failure> {
        match &self.iceoryx2_config {
            Some(file) => Domain::from_file(file),
            None => Domain::find(),
        }
        .map_err(Failure::usage)
    }

    /// What is known before the file is read: definitions, and what the command line says.
    pub(crate) fn bases(&self) -> Result<Bases, Failure> {
        let mut definitions = bundled::definitions();
        for folder in &self.msg_path {
            let added = definitions.add_folder(folder).map_err(Failure::usage)?;
            if added == 0 {
                return Err(Failure::usage(format!("no .msg file is in {}", folder.display())));
            }
        }
        let folder = self.file.as_ref().and_then(|file| file.parent()).map(PathBuf::from);
        Ok(Bases {
            definitions,
            node: self.node.clone(),
            namespace: self.namespace.clone(),
            domain: self.domain_of_dds()?,
            folder: folder.unwrap_or_default(),
        })
    }

    fn domain_of_dds(&self) -> Result<u16, Failure> {
        if let Some(domain) = self.domain {
            return Ok(domain);
        }
        let Ok(text) = std::env::var("ROS_DOMAIN_ID") else { return Ok(0) };
        if text.is_empty() {
            return Ok(0);
        }
        let domain = text.parse().ok().filter(|domain| u32::from(*domain) <= MOST_DOMAIN);
        domain.ok_or_else(|| {
            Failure::usage(format!(
                "ROS_DOMAIN_ID is {text:?}; it is a number from 0 to {MOST_DOMAIN}"
            ))
        })
    }

    /// What the bridge is to do.
    pub(crate) fn config(&self, bases: &mut Bases) -> Result<Config, Failure> {
        let mut config = match &self.file {
            Some(file) => {
                let text = read_text(file, &FILE).map_err(Failure::usage)?;
                let source = Source { name: file.display().to_string(), text: Arc::from(text) };
                let (config, warnings) = read(source, bases).map_err(Failure::configuration)?;
                warnings.into_iter().for_each(failure::warn);
                config
            }
            None => Config {
                node: bases.node.clone().unwrap_or_else(|| "isochrone".into()),
                namespace: bases.namespace.clone().unwrap_or_else(|| "/".into()),
                domain: bases.domain,
                ..Config::default()
            },
        };
        if self.domain.is_some() {
            config.domain = bases.domain;
        }
        config.is_local |= self.local;
        for name in [&format!("/{}", config.node), &config.namespace] {
            if name != "/" {
                names::check(name).map_err(|bad| bad_name(name, &bad))?;
            }
        }
        for service in &self.to_ros {
            config.to_ros.push(each_signal(service, &config)?);
        }
        for pair in self.from_ros.chunks(2) {
            let [topic, type_name] = pair else { continue };
            let link = every_number(topic, type_name, &config, bases)?;
            if config.from_ros.iter().any(|other| other.service == link.service) {
                let service = &link.service;
                return Err(Failure::usage(format!("{service:?} has a topic already")));
            }
            config.from_ros.push(link);
        }
        if self.file.is_none() && config.to_ros.is_empty() && config.from_ros.is_empty() {
            return Err(Failure::usage(
                "nothing to do: name a configuration, or give --to-ros SERVICE or --from-ros TOPIC TYPE",
            ));
        }
        Ok(config)
    }
}

/// The type that the command line names.
pub(crate) fn message_type(bases: &Bases, name: &str) -> Result<Arc<MessageType>, Failure> {
    find_type(&bases.definitions, name)
        .map_err(|NoType { error, help }| Failure::usage(format!("{error}; {help}")))
}

fn bad_name(name: &str, bad: &names::BadName) -> Failure {
    let names::BadName { problem, suggestion } = bad;
    Failure::usage(format!("{name:?} is no name of ROS: {problem}; {suggestion:?} is"))
}

/// The link of `--to-ros`.
fn each_signal(service: &str, config: &Config) -> Result<ToRos, Failure> {
    if let Some(rest) = service.strip_prefix('/') {
        return Err(Failure::usage(format!("{service:?} {SLASH}: write --to-ros {rest}")));
    }
    check_service_name(service).map_err(Failure::usage)?;
    let topic = format!("/{service}");
    let topic = full_topic(&topic, &config.namespace, &config.node).or_else(|bad| {
        // Nobody has chosen it, so one that is like it will do.
        full_topic(&bad.suggestion, &config.namespace, &config.node)
    });
    Ok(ToRos {
        service: service.to_owned(),
        topic: topic.map_err(|bad| bad_name(service, &bad))?,
        message: None,
        rate: None,
        on_bad: OnBad::Send,
        quality: None,
        quality_of_service: QualityOfService::of(Profile::Default),
    })
}

/// The link of `--from-ros`.
fn every_number(
    topic: &str,
    type_name: &str,
    config: &Config,
    bases: &Bases,
) -> Result<FromRos, Failure> {
    let topic =
        full_topic(topic, &config.namespace, &config.node).map_err(|bad| bad_name(topic, &bad))?;
    let message = message_type(bases, type_name)?;
    let incoming = Incoming::of_all(message).map_err(Failure::usage)?;
    if incoming.signals.is_empty() {
        return Err(Failure::usage(match example(&incoming.message, "v") {
            Some(example) => format!(
                "{type_name} has no number that it always has: write a file with [[from_ros]] and fields = {{ {example} }}"
            ),
            None => no_signal(&incoming.message),
        }));
    }
    let service = topic.trim_start_matches('/').to_owned();
    check_service_name(&service).map_err(Failure::usage)?;
    Ok(FromRos {
        topic,
        message: incoming,
        service,
        max_gap: None,
        quality_of_service: QualityOfService::of(Profile::Default),
    })
}
