//! The node: it joins a domain, listens and speaks.

use futures_util::stream::select_all;
use ros2_client::qos::History;
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher,
    QosProfile, Spinner,
};

use super::Ros2Config;
use super::answering::Answering;
use super::messages::{Message as _, Suggestion};
use super::topics::Topics;
use super::types::Types;
use crate::links::Feeder;

/// Name of the node.
const NODE: &str = "uwguide";
/// Suggestions that are kept for readers that are slow.
const KEPT: usize = 10;
/// Variable that names the DDS domain.
const DOMAIN: &str = "ROS_DOMAIN_ID";

/// A node with its topics.
pub struct Link {
    config: Ros2Config,
    spinner: Spinner,
    topics: Topics,
    suggestions: Publisher<Suggestion>,
    types: Types,
    /// Keeps all of them.
    _node: Node,
}

impl Link {
    /// Joins the domain and makes the topics.
    ///
    /// # Errors
    /// The domain or a topic cannot be had; the message names it.
    pub fn open(config: &Ros2Config) -> Result<Self, String> {
        let domain_id = domain_id(config.domain_id)?;
        let options = ContextOptions::new().domain_id(domain_id);
        let context = Context::with_options(options)
            .map_err(|error| format!("ROS 2: domain {domain_id} cannot be joined: {error}"))?;
        let name = NodeName::new("/", NODE).map_err(|error| format!("ROS 2: {error}"))?;
        let options = NodeOptions::new()
            .enable_rosout(false)
            .start_parameter_services(false);
        let mut node = context
            .new_node(name, options)
            .map_err(|error| format!("ROS 2: no node: {error}"))?;
        let suggestions = publisher(&mut node, &config.suggestion_topic)?;
        let topics = Topics::open(&mut node, config)?;
        let link = Self {
            types: Types::new(context, topics.heard()),
            topics,
            suggestions,
            spinner: node
                .spinner()
                .map_err(|error| format!("ROS 2: no spinner: {error}"))?,
            config: config.clone(),
            _node: node,
        };
        tracing::info!(
            domain_id,
            range = config.range_topic,
            depth = config.depth_topic,
            light = config.light_topic,
            image = config.image_topic,
            image_type = ?config.image_type,
            suggestion = config.suggestion_topic,
            "ROS 2 node {NODE}"
        );
        Ok(link)
    }

    /// Answers pictures for ever.
    pub async fn run(self, feeder: Feeder) {
        let Self {
            config,
            spinner,
            topics,
            suggestions,
            types,
            _node,
        } = self;
        let events = select_all(topics.events());
        let mut answering = Answering::new(&config, feeder, &suggestions, types);
        tokio::select! {
            () = answering.answer(events) => {}
            ended = spinner.spin() => tracing::error!(?ended, "the ROS 2 node ended"),
        }
    }
}

fn publisher(node: &mut Node, topic: &str) -> Result<Publisher<Suggestion>, String> {
    let qos = QosProfile::publisher_default().history(History::KeepLast { depth: KEPT });
    let failed = |error: &dyn std::fmt::Display| format!("ROS 2: topic {topic}: {error}");
    let parsed = Name::parse(topic).map_err(|error| failed(&error))?;
    let (package, name) = Suggestion::TYPE;
    let type_name = MessageTypeName::new(package, name);
    let made = node
        .create_topic(&parsed, type_name, &qos)
        .map_err(|error| failed(&error))?;
    node.create_publisher(&made, None)
        .map_err(|error| failed(&error))
}

/// The domain: the configured one, else that of the environment, else 0.
fn domain_id(configured: Option<u16>) -> Result<u16, String> {
    let given = std::env::var(DOMAIN).unwrap_or_default();
    match (configured, given.trim()) {
        (Some(domain_id), _) => Ok(domain_id),
        (None, "") => Ok(0),
        (None, given) => match given.parse() {
            Ok(domain_id @ 0..=super::MOST_DOMAIN) => Ok(domain_id),
            _ => Err(format!(
                "{DOMAIN} must be a whole number from 0 to {}, got {given:?}",
                super::MOST_DOMAIN
            )),
        },
    }
}
