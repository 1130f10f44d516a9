//! Names of topics, services and nodes of ROS, and what DDS makes of them.

/// What is wrong with a name, and what would be right.
pub(crate) struct BadName {
    pub(crate) problem: String,
    pub(crate) suggestion: String,
}

/// The full name of a topic, from one that is relative to the namespace or, after `~/`, to the node.
pub(crate) fn full_topic(written: &str, namespace: &str, node: &str) -> Result<String, BadName> {
    let base = namespace.trim_end_matches('/');
    let full = match written.strip_prefix("~/") {
        Some(rest) => format!("{base}/{node}/{rest}"),
        None if written.starts_with('/') => written.to_owned(),
        None => format!("{base}/{written}"),
    };
    check(&full)?;
    Ok(full)
}

/// Whether a full name consists of parts that ROS allows: letters, digits and single underscores, no digit first.
pub(crate) fn check(full: &str) -> Result<(), BadName> {
    if full.trim_matches('/').is_empty() {
        return Err(BadName { problem: "it is empty".into(), suggestion: "/level".into() });
    }
    if !full.starts_with('/') {
        let problem = "it does not begin with a slash".into();
        return Err(BadName { problem, suggestion: suggestion(full) });
    }
    let problem = full.split('/').skip(1).find_map(|part| {
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if part.is_empty() {
            Some("two slashes follow each other, or one ends it".to_owned())
        } else if let Some(other) = part.chars().find(|c| !is_allowed(*c)) {
            Some(format!("{other:?} stands in it"))
        } else if part.starts_with(|c: char| c.is_ascii_digit()) {
            Some(format!("the part {part:?} begins with a digit"))
        } else if part.contains("__") {
            Some("two underscores follow each other".to_owned())
        } else {
            None
        }
    });
    match problem {
        Some(problem) => Err(BadName { problem, suggestion: suggestion(full) }),
        None => Ok(()),
    }
}

/// A name of ROS that is like a name that is none.
fn suggestion(full: &str) -> String {
    let parts = full.split('/').filter(|part| !part.is_empty());
    let part = |part: &str| {
        let mut like = String::new();
        for c in part.chars() {
            let c = if c.is_ascii_alphanumeric() { c } else { '_' };
            if c != '_' || !like.ends_with('_') {
                like.push(c);
            }
        }
        if like.starts_with(|c: char| c.is_ascii_digit()) { format!("x{like}") } else { like }
    };
    parts.map(|it| format!("/{}", part(it))).collect()
}

/// The name of a topic in DDS.
pub(crate) fn dds_topic(full: &str) -> String {
    format!("rt{full}")
}

/// The full name in ROS of a topic by its name in DDS.
pub(crate) fn topic_of_ros(dds: &str) -> &str {
    dds.strip_prefix("rt").filter(|full| full.starts_with('/')).unwrap_or(dds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_is_relative_to_the_namespace_or_to_the_node() {
        let full = |written, namespace| full_topic(written, namespace, "bridge").ok().unwrap();
        assert_eq!(full("/cmd_vel", "/plant"), "/cmd_vel");
        assert_eq!(full("level", "/plant"), "/plant/level");
        assert_eq!(full("level", "/"), "/level");
        assert_eq!(full("~/level", "/plant"), "/plant/bridge/level");
        assert_eq!(dds_topic("/plant/level"), "rt/plant/level");
        assert_eq!(topic_of_ros("rt/plant/level"), "/plant/level");
        assert_eq!(topic_of_ros("ros_discovery_info"), "ros_discovery_info");
    }

    #[test]
    fn a_name_that_ros_does_not_allow_comes_with_one_that_it_does() {
        for (written, suggestion) in [
            ("/pump-2/on", "/pump_2/on"),
            ("/axis/17", "/axis/x17"),
            ("/a__b", "/a_b"),
            ("/a//b/", "/a/b"),
            ("plant-1", "/plant_1"),
            ("/", "/level"),
        ] {
            let bad = check(written).err().unwrap();
            assert_eq!(bad.suggestion, suggestion, "{}", bad.problem);
            assert!(check(suggestion).is_ok());
        }
    }
}
