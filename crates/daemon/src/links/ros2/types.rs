//! Types of topics: a topic that others have with another type brings nothing, and DDS says nothing about it.

use std::collections::BTreeSet;

use ros2_client::{Context, DiscoveredTopic, MessageTypeName};

/// A topic that is listened to.
#[derive(Clone, Debug)]
pub(super) struct Heard {
    /// Its setting.
    pub(super) setting: &'static str,
    /// Its name, as in `/depth`.
    pub(super) topic: String,
    /// Package and name of its type.
    pub(super) of: (&'static str, &'static str),
}

/// What has been told of topics with other types.
pub(super) struct Types {
    context: Context,
    heard: Vec<Heard>,
    told: BTreeSet<String>,
}

impl Types {
    pub(super) fn new(context: Context, heard: Vec<Heard>) -> Self {
        Self {
            context,
            heard,
            told: BTreeSet::new(),
        }
    }

    /// What is to be told of topics that have been found since, each once.
    pub(super) fn news(&mut self) -> Vec<String> {
        let found = self.context.discovered_topics();
        let mut all = others(&self.heard, &found);
        all.retain(|message| self.told.insert(message.clone()));
        all
    }
}

/// Of every topic that others have with another type.
fn others(heard: &[Heard], found: &[DiscoveredTopic]) -> Vec<String> {
    let mut all = BTreeSet::new();
    for Heard { setting, topic, of } in heard {
        let ours = ros_type(&MessageTypeName::new(of.0, of.1).dds_msg_type());
        let same = |found: &&DiscoveredTopic| ros_topic(&found.name) == topic.as_str();
        let types = found.iter().filter(same).map(|topic| &topic.type_name);
        for theirs in types
            .map(|name| ros_type(name))
            .filter(|name| *name != ours)
        {
            all.insert(format!(
                "topic {topic} has the type {theirs} elsewhere, and is listened to as {ours} (ros2.{setting}): nothing of it is heard"
            ));
        }
    }
    all.into_iter().collect()
}

/// A type as ROS 2 names it; what is none of its types stays as it is.
fn ros_type(dds: &str) -> String {
    match dds.split_once("::msg::dds_::") {
        Some((package, name)) => format!("{package}/msg/{}", name.trim_end_matches('_')),
        None => dds.to_owned(),
    }
}

/// A topic without the prefix that ROS 2 gives it in DDS.
fn ros_topic(dds: &str) -> &str {
    dds.strip_prefix("rt").unwrap_or(dds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_of_another_type_is_told() {
        let heard = [
            Heard {
                setting: "image_type",
                topic: "/camera/image_raw".to_owned(),
                of: ("sensor_msgs", "CompressedImage"),
            },
            Heard {
                setting: "depth_type",
                topic: "/depth".to_owned(),
                of: ("std_msgs", "Float64"),
            },
        ];
        let found = |name: &str, type_name: &str| DiscoveredTopic {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
        };
        let all = [
            found("rt/depth", "std_msgs::msg::dds_::Float64_"),
            found(
                "rt/camera/image_raw",
                "sensor_msgs::msg::dds_::CompressedImage_",
            ),
            found("rt/camera/image_raw", "sensor_msgs::msg::dds_::Image_"),
            found("rt/camera/image_raw", "sensor_msgs::msg::dds_::Image_"),
            found("rt/depth/raw", "std_msgs::msg::dds_::Float32_"),
        ];
        assert_eq!(
            others(&heard, &all),
            [
                "topic /camera/image_raw has the type sensor_msgs/msg/Image elsewhere, and is listened to as \
                 sensor_msgs/msg/CompressedImage (ros2.image_type): nothing of it is heard"
            ]
        );
    }
}
