//! The topics that are listened to, and what follows from their messages.

use std::pin::Pin;

use futures_util::{Stream, StreamExt};
use ros2_client::qos::WhenFull;
use ros2_client::{MessageTypeName, Name, Node, QosProfile, Subscription};

use super::answering::Event;
use super::messages::{
    CompressedImage, Float64, FluidPressure, Image, Message, Odometry, PoseStamped, Range,
};
use super::picture::Picture;
use super::types::Heard;
use super::{DepthAxis, DepthType, ImageType, Ros2Config, requests};

/// What comes, as it comes.
pub(super) type Events<'a> = Pin<Box<dyn Stream<Item = Event> + Send + 'a>>;

/// All topics of a node.
pub(super) struct Topics {
    config: Ros2Config,
    sources: Vec<Box<dyn Source>>,
    heard: Vec<Heard>,
}

impl Topics {
    /// Subscribes to the topics of a configuration.
    ///
    /// # Errors
    /// A topic cannot be had; the message names it.
    pub(super) fn open(node: &mut Node, config: &Ros2Config) -> Result<Self, String> {
        let mut topics = Self {
            config: config.clone(),
            sources: Vec::new(),
            heard: Vec::new(),
        };
        topics.listen(node, "range_topic", &config.range_topic, range)?;
        let (setting, topic) = ("depth_type", &config.depth_topic);
        match config.depth_type {
            DepthType::Metres => topics.listen(node, setting, topic, metres)?,
            DepthType::Pressure => topics.listen(node, setting, topic, pressure)?,
            DepthType::Pose => topics.listen(node, setting, topic, pose)?,
            DepthType::Odometry => topics.listen(node, setting, topic, odometry)?,
        }
        topics.listen(node, "light_topic", &config.light_topic, light)?;
        let (setting, topic) = ("image_type", &config.image_topic);
        match config.image_type {
            ImageType::Compressed => topics.listen(node, setting, topic, compressed)?,
            ImageType::Raw => topics.listen(node, setting, topic, raw)?,
        }
        Ok(topics)
    }

    /// Names and types.
    pub(super) fn heard(&self) -> Vec<Heard> {
        self.heard.clone()
    }

    /// What each brings.
    pub(super) fn events(&self) -> Vec<Events<'_>> {
        let sources = self.sources.iter();
        sources.map(|source| source.events(&self.config)).collect()
    }

    /// Listens to the latest message of a topic, as what is older is of no use. `setting` is what sets its type or, where that is the
    /// topic's own choice, the topic.
    fn listen<M: Message>(
        &mut self,
        node: &mut Node,
        setting: &'static str,
        topic: &str,
        event: fn(M, &Ros2Config) -> Option<Event>,
    ) -> Result<(), String> {
        let qos = match self.config.reliable {
            true => QosProfile::subscription_default().reliability_reliable(WhenFull::DEFAULT),
            false => QosProfile::subscription_default(),
        };
        let failed = |error: &dyn std::fmt::Display| format!("ROS 2: topic {topic}: {error}");
        let parsed = Name::parse(topic).map_err(|error| failed(&error))?;
        let (package, name) = M::TYPE;
        let made = node
            .create_topic(&parsed, MessageTypeName::new(package, name), &qos)
            .map_err(|error| failed(&error))?;
        let subscription = node
            .create_subscription(&made, None)
            .map_err(|error| failed(&error))?;
        self.heard.push(Heard {
            setting,
            topic: topic.to_owned(),
            of: M::TYPE,
        });
        self.sources.push(Box::new(Topic {
            subscription,
            event,
        }));
        Ok(())
    }
}

/// A topic, whatever its type.
trait Source: Send + Sync {
    /// Its messages as events; those of which nothing follows are left out.
    fn events<'a>(&'a self, config: &'a Ros2Config) -> Events<'a>;
}

struct Topic<M: Message> {
    subscription: Subscription<M>,
    event: fn(M, &Ros2Config) -> Option<Event>,
}

impl<M: Message> Source for Topic<M> {
    fn events<'a>(&'a self, config: &'a Ros2Config) -> Events<'a> {
        let stream = self.subscription.async_stream();
        Box::pin(stream.filter_map(move |message| {
            let event = match message {
                Ok((message, _)) => (self.event)(message, config),
                Err(error) => Some(Event::Unreadable(error)),
            };
            std::future::ready(event)
        }))
    }
}

fn state(field: &str, value: f64, time_s: Option<f64>) -> Option<Event> {
    requests::state(field, value, time_s).map(Event::State)
}

fn range(range: Range, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(&range.header, config);
    state("distance_m", requests::distance_m(&range, config)?, time_s)
}

fn metres(depth: Float64, config: &Ros2Config) -> Option<Event> {
    let depth_m = requests::depth_along(depth.data, DepthAxis::Down, config);
    state("depth_m", depth_m, None)
}

fn pressure(pressure: FluidPressure, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(&pressure.header, config);
    state("depth_m", requests::depth_m(&pressure, config), time_s)
}

fn pose(pose: PoseStamped, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(&pose.header, config);
    let depth_m = requests::depth_along(pose.position.z, DepthAxis::Up, config);
    state("depth_m", depth_m, time_s)
}

fn odometry(odometry: Odometry, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(&odometry.header, config);
    let depth_m = requests::depth_along(odometry.position.z, DepthAxis::Up, config);
    state("depth_m", depth_m, time_s)
}

fn light(light: Float64, _: &Ros2Config) -> Option<Event> {
    state("light_pct", light.data, None)
}

fn compressed(image: CompressedImage, _: &Ros2Config) -> Option<Event> {
    Some(Event::Picture(Picture::Compressed(image)))
}

fn raw(image: Image, _: &Ros2Config) -> Option<Event> {
    Some(Event::Picture(Picture::Raw(image)))
}
