//! The topics that are listened to, and what follows from their messages.

use std::pin::Pin;

use futures_util::{Stream, StreamExt};
use ros2_client::qos::WhenFull;
use ros2_client::{MessageTypeName, Name, Node, QosProfile, Subscription};

use super::answering::Event;
use super::messages::{
    CompressedImage, Float32, Float64, FluidPressure, Header, Image, Message, Odometry,
    PoseStamped, PoseWithCovarianceStamped, Range, Vector3,
};
use super::picture::Picture;
use super::types::Heard;
use super::{DepthAxis, DepthType, ImageType, NumberType, RangeType, Ros2Config, requests};

/// What comes, as it comes.
pub(super) type Events<'a> = Pin<Box<dyn Stream<Item = Event> + Send + 'a>>;

/// What follows from a number.
type OfNumber = fn(f64, &Ros2Config) -> Option<Event>;

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
        let (setting, topic) = ("range_type", &config.range_topic);
        match config.range_type {
            RangeType::Echo => topics.listen(node, setting, topic, range)?,
            RangeType::Metres(number) => {
                topics.number(node, setting, topic, (number, distance))?;
            }
        }
        let (setting, topic) = ("depth_type", &config.depth_topic);
        match config.depth_type {
            DepthType::Metres(number) => topics.number(node, setting, topic, (number, depth))?,
            DepthType::Pressure => topics.listen(node, setting, topic, pressure)?,
            DepthType::Pose => topics.listen(node, setting, topic, pose)?,
            DepthType::PoseWithCovariance => topics.listen(node, setting, topic, estimated_pose)?,
            DepthType::Odometry => topics.listen(node, setting, topic, odometry)?,
        }
        let (setting, topic) = ("light_type", &config.light_topic);
        topics.number(node, setting, topic, (config.light_type, light))?;
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

    /// Listens to numbers.
    fn number(
        &mut self,
        node: &mut Node,
        setting: &'static str,
        topic: &str,
        (of, event): (NumberType, OfNumber),
    ) -> Result<(), String> {
        match of {
            NumberType::Float64 => {
                self.listen(node, setting, topic, move |number: Float64, config| {
                    event(number.data, config)
                })
            }
            NumberType::Float32 => {
                self.listen(node, setting, topic, move |number: Float32, config| {
                    event(number.data.into(), config)
                })
            }
        }
    }

    /// Listens to the latest message of a topic, as what is older is of no use. `setting` is what sets its type.
    fn listen<M: Message>(
        &mut self,
        node: &mut Node,
        setting: &'static str,
        topic: &str,
        event: impl Fn(M, &Ros2Config) -> Option<Event> + Send + Sync + 'static,
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

struct Topic<M: Message, E> {
    subscription: Subscription<M>,
    event: E,
}

impl<M: Message, E: Fn(M, &Ros2Config) -> Option<Event> + Send + Sync> Source for Topic<M, E> {
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

fn distance(distance_m: f64, config: &Ros2Config) -> Option<Event> {
    state(
        "distance_m",
        requests::distance_of(distance_m, config)?,
        None,
    )
}

fn depth(depth_m: f64, config: &Ros2Config) -> Option<Event> {
    let depth_m = requests::depth_along(depth_m, DepthAxis::Down, config);
    state("depth_m", depth_m, None)
}

fn pressure(pressure: FluidPressure, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(&pressure.header, config);
    state("depth_m", requests::depth_m(&pressure, config), time_s)
}

fn pose(pose: PoseStamped, config: &Ros2Config) -> Option<Event> {
    position(&pose.header, pose.position, config)
}

fn estimated_pose(pose: PoseWithCovarianceStamped, config: &Ros2Config) -> Option<Event> {
    position(&pose.header, pose.position, config)
}

fn odometry(odometry: Odometry, config: &Ros2Config) -> Option<Event> {
    position(&odometry.header, odometry.position, config)
}

fn position(header: &Header, position: Vector3, config: &Ros2Config) -> Option<Event> {
    let time_s = requests::time_s(header, config);
    let depth_m = requests::depth_along(position.z, DepthAxis::Up, config);
    state("depth_m", depth_m, time_s)
}

fn light(light_pct: f64, _: &Ros2Config) -> Option<Event> {
    state("light_pct", light_pct, None)
}

fn compressed(image: CompressedImage, _: &Ros2Config) -> Option<Event> {
    Some(Event::Picture(Picture::Compressed(image)))
}

fn raw(image: Image, _: &Ros2Config) -> Option<Event> {
    Some(Event::Picture(Picture::Raw(image)))
}
