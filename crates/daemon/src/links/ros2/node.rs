//! The node: its topics, and what it does with what comes.

use std::pin::Pin;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use futures_util::stream::select_all;
use futures_util::{FutureExt, Stream, StreamExt};
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher,
    QosProfile, ReadError, Spinner, Subscription,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tokio::task::block_in_place;
use tokio::time::{Instant, timeout_at};

use super::messages::{CompressedImage, Float64, FluidPressure, Header, Range, Suggestion, Time};
use super::{DepthType, Ros2Config, requests};
use crate::links::Feeder;

/// Name of the node.
const NODE: &str = "uwguide";
/// Suggestions that are kept for readers that are slow.
const KEPT: usize = 10;
/// What may wait while a picture is answered, and is looked through for a newer one.
const WAITING: usize = 1000;
/// Warnings of one kind come this far apart.
const QUIET: Duration = Duration::from_secs(10);
/// Variable that names the DDS domain.
const DOMAIN: &str = "ROS_DOMAIN_ID";

/// A node with its topics.
pub struct Link {
    config: Ros2Config,
    spinner: Spinner,
    range: Subscription<Range>,
    depth: Depth,
    light: Subscription<Float64>,
    image: Subscription<CompressedImage>,
    suggestions: Publisher<Suggestion>,
    /// Keeps all of them.
    _node: Node,
}

enum Depth {
    Metres(Subscription<Float64>),
    Pressure(Subscription<FluidPressure>),
}

/// What has come.
enum Event {
    /// A request that tells of the state.
    State(Value),
    Picture(CompressedImage),
    /// A message that is none of its type.
    Unreadable(ReadError),
}

type Events<'a> = Pin<Box<dyn Stream<Item = Event> + Send + 'a>>;

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
        let of = Wanted {
            reliable: config.reliable,
        };
        let link = Self {
            range: of.subscribe(&mut node, &config.range_topic, ("sensor_msgs", "Range"))?,
            depth: match config.depth_type {
                DepthType::Metres => Depth::Metres(of.subscribe(
                    &mut node,
                    &config.depth_topic,
                    ("std_msgs", "Float64"),
                )?),
                DepthType::Pressure => Depth::Pressure(of.subscribe(
                    &mut node,
                    &config.depth_topic,
                    ("sensor_msgs", "FluidPressure"),
                )?),
            },
            light: of.subscribe(&mut node, &config.light_topic, ("std_msgs", "Float64"))?,
            image: of.subscribe(
                &mut node,
                &config.image_topic,
                ("sensor_msgs", "CompressedImage"),
            )?,
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
            range,
            depth,
            light,
            image,
            suggestions,
            _node,
        } = self;
        let state = |field, value, time_s| requests::state(field, value, time_s).map(Event::State);
        let ranges: Events = messages(&range, |range: Range| {
            let time_s = requests::time_s(&range.header, &config);
            state("distance_m", requests::distance_m(&range, &config)?, time_s)
        });
        let depths: Events = match &depth {
            Depth::Metres(metres) => {
                messages(metres, |depth: Float64| state("depth_m", depth.data, None))
            }
            Depth::Pressure(pressure) => messages(pressure, |pressure: FluidPressure| {
                let time_s = requests::time_s(&pressure.header, &config);
                state("depth_m", requests::depth_m(&pressure, &config), time_s)
            }),
        };
        let lights: Events = messages(&light, |light: Float64| {
            state("light_pct", light.data, None)
        });
        let pictures: Events = messages(&image, |image| Some(Event::Picture(image)));
        let events = select_all([ranges, depths, lights, pictures]);
        let mut answering = Answering {
            config: &config,
            feeder,
            suggestions: &suggestions,
            frame_id: String::new(),
            warned: None,
        };
        tokio::select! {
            () = answering.answer(events) => {}
            ended = spinner.spin() => tracing::error!(?ended, "the ROS 2 node ended"),
        }
    }
}

/// How messages are subscribed to.
struct Wanted {
    reliable: bool,
}

impl Wanted {
    /// Of the latest message of a topic, as what is older is of no use.
    fn subscribe<M: 'static>(
        &self,
        node: &mut Node,
        topic: &str,
        (package, name): (&str, &str),
    ) -> Result<Subscription<M>, String> {
        let qos = match self.reliable {
            true => QosProfile::subscription_default().reliability_reliable(WhenFull::DEFAULT),
            false => QosProfile::subscription_default(),
        };
        let failed = |error: &dyn std::fmt::Display| format!("ROS 2: topic {topic}: {error}");
        let parsed = Name::parse(topic).map_err(|error| failed(&error))?;
        let made = node
            .create_topic(&parsed, MessageTypeName::new(package, name), &qos)
            .map_err(|error| failed(&error))?;
        node.create_subscription(&made, None)
            .map_err(|error| failed(&error))
    }
}

fn publisher(node: &mut Node, topic: &str) -> Result<Publisher<Suggestion>, String> {
    let qos = QosProfile::publisher_default().history(History::KeepLast { depth: KEPT });
    let failed = |error: &dyn std::fmt::Display| format!("ROS 2: topic {topic}: {error}");
    let parsed = Name::parse(topic).map_err(|error| failed(&error))?;
    let type_name = MessageTypeName::new("uwguide_msgs", "Suggestion");
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

/// Messages of a subscription as events; those of which nothing follows are left out.
fn messages<'a, M: DeserializeOwned + Send + Sync + 'static>(
    subscription: &'a Subscription<M>,
    event: impl Fn(M) -> Option<Event> + Send + Sync + 'a,
) -> Events<'a> {
    let stream = subscription.async_stream();
    Box::pin(stream.filter_map(move |message| {
        let event = match message {
            Ok((message, _)) => event(message),
            Err(error) => Some(Event::Unreadable(error)),
        };
        std::future::ready(event)
    }))
}

/// Asks for what has come, and publishes the answers.
struct Answering<'a> {
    config: &'a Ros2Config,
    feeder: Feeder,
    suggestions: &'a Publisher<Suggestion>,
    /// Frame of the latest picture.
    frame_id: String,
    /// When the last warning was.
    warned: Option<Instant>,
}

impl Answering<'_> {
    async fn answer(&mut self, mut events: impl Stream<Item = Event> + Unpin) {
        let silence = Duration::from_secs_f64(self.config.silence_s);
        let between = Duration::from_secs_f64(1.0 / self.config.rate_hz);
        let mut next = Instant::now() + silence;
        loop {
            match timeout_at(next, events.next()).await {
                Ok(Some(event)) => {
                    if let Some(image) = self.take(event) {
                        let newest = self.newest(image, &mut events);
                        self.look(newest).await;
                        next = Instant::now() + silence;
                    }
                }
                Ok(None) => return,
                Err(_) => {
                    let reply = self.ask(&json!({"op": "suggest"}));
                    self.publish(&reply, now()).await;
                    next = Instant::now() + between;
                }
            }
        }
    }

    /// Tells what has come; a picture is given back.
    fn take(&mut self, event: Event) -> Option<CompressedImage> {
        match event {
            Event::State(request) => self.tell(&request),
            Event::Picture(image) => return Some(image),
            Event::Unreadable(error) => self.warn(&format!("a message cannot be read: {error}")),
        }
        None
    }

    /// The newest picture that has come: advice on one that waited is late.
    fn newest(
        &mut self,
        mut image: CompressedImage,
        mut events: impl Stream<Item = Event> + Unpin,
    ) -> CompressedImage {
        let mut skipped = 0;
        for _ in 0..WAITING {
            let Some(Some(event)) = events.next().now_or_never() else {
                break;
            };
            if let Some(newer) = self.take(event) {
                image = newer;
                skipped += 1;
            }
        }
        if skipped > 0 {
            self.warn(&format!(
                "pictures come faster than they are answered: {skipped} left out for a newer one"
            ));
        }
        image
    }

    fn tell(&mut self, request: &Value) {
        let reply = self.ask(request);
        if reply["ok"] == false {
            let message = reply["error"]["message"].as_str().unwrap_or_default();
            self.warn(message);
        }
    }

    async fn look(&mut self, image: CompressedImage) {
        let time_s = requests::time_s(&image.header, self.config);
        let reply = self.ask(&requests::picture(&image, time_s));
        let Header { stamp, frame_id } = image.header;
        self.frame_id = frame_id;
        self.publish(&reply, stamp).await;
    }

    /// Pictures take their time, for which other tasks go on elsewhere.
    fn ask(&mut self, request: &Value) -> Value {
        block_in_place(|| self.feeder.ask(request))
    }

    async fn publish(&mut self, reply: &Value, stamp: Time) {
        let header = Header {
            stamp,
            frame_id: self.frame_id.clone(),
        };
        let message = super::suggestion::suggestion(reply, header, self.config.camera_axis);
        if let Err(error) = self.suggestions.async_publish(message).await {
            self.warn(&format!("a suggestion was not published: {error}"));
        }
    }

    fn warn(&mut self, message: &str) {
        let now = Instant::now();
        if self.warned.is_none_or(|before| now - before > QUIET) {
            tracing::warn!(link = "ros2", "{message}");
            self.warned = Some(now);
        }
    }
}

/// The time of this machine's clock.
fn now() -> Time {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Time {
        sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX),
        nanosec: since.subsec_nanos(),
    }
}
