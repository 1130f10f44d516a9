//! Tells of services that are silent, and which ones there are instead.

use std::sync::Arc;

use isochrone_engine::KnownNames;
use isochrone_ipc::{Domain, Participant, ipc};
use isochrone_model::OWN_SERVICES;

use super::counts::{Hearing, LinkCounts};

/// Watches what links of services hear.
pub(crate) struct Watch {
    /// What was told last of each.
    links: Vec<(Arc<LinkCounts>, Hearing)>,
}

impl Watch {
    pub(crate) fn of<'c>(links: impl Iterator<Item = &'c Arc<LinkCounts>>) -> Self {
        Self { links: links.map(|counts| (counts.clone(), Hearing::Well)).collect() }
    }

    /// Tells what has changed. Asks the domain for its services where one has no publisher, so this is for a thread that may
    /// wait.
    pub(crate) fn tell(&mut self, domain: &Domain) {
        let mut asked: Option<Vec<String>> = None;
        for (counts, told) in &mut self.links {
            let hearing = counts.hearing();
            let before = std::mem::replace(told, hearing);
            let LinkCounts { name, from, .. } = &**counts;
            match hearing {
                _ if hearing == before => {}
                Hearing::Well => tracing::info!("{name}: frames come again"),
                Hearing::Silence => {
                    tracing::warn!("{name}: \"{from}\" is silent: its publisher sends nothing");
                }
                Hearing::Nobody => {
                    let services = asked.get_or_insert_with(|| published(domain));
                    tracing::warn!("{name}: nobody publishes \"{from}\"{}", others(from, services));
                }
            }
        }
    }
}

/// The services that somebody publishes, without those of nodes themselves.
fn published(domain: &Domain) -> Vec<String> {
    let participant = Participant::<ipc::Service>::join("isochrone-ros2/services", domain);
    let listed = participant.ok().and_then(|participant| participant.frame_services().ok());
    let services = listed.unwrap_or_default().into_iter();
    let is_published =
        |name: &str, publishers: usize| publishers > 0 && !name.starts_with(OWN_SERVICES);
    services
        .filter(|service| is_published(&service.name, service.publishers.len()))
        .map(|service| service.name)
        .collect()
}

/// What there is instead of a service.
fn others(service: &str, published: &[String]) -> String {
    let known = KnownNames::new(published.iter().map(String::as_str));
    let nearest = known.nearest(service).map(|name| format!(" (did you mean \"{name}\"?)"));
    format!("{}; of services with a publisher, {}", nearest.unwrap_or_default(), known.listing())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_service_that_is_meant_comes_first() {
        let published = ["plant/analog", "plant/level"].map(str::to_owned);
        assert_eq!(
            others("plant/levle", &published),
            " (did you mean \"plant/level\"?); of services with a publisher, there is: plant/analog, plant/level"
        );
        assert_eq!(others("x", &[]), "; of services with a publisher, there is none");
    }
}
