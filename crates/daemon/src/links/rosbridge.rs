//! ROS 2 through rosbridge (WebSocket): offers a service whose request and response are JSON texts.
//!
//! ROS has no message for guidance, and rosbridge needs a type that exists. The service type is therefore
//! configurable; the request's string field (`data` by default, else the only string) holds a request of
//! the protocol without `op` ("{}" asks with the latest state), and the response has `success` and the
//! reply as text in `message`.

use std::io;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::client_async_with_config;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;

use super::{Backoff, Feeder, Pauses};

/// How long connecting may take.
const CONNECT_TIME: Duration = Duration::from_secs(5);
/// A ping is sent after this much silence; none answered by the next one ends the connection.
const SILENCE: Duration = Duration::from_secs(20);
/// Longest message, bytes: a line of the protocol and its wrapping.
const MAX_MESSAGE_BYTES: usize = 2 << 20;

/// Where rosbridge is and what is offered there.
#[derive(Clone, Debug, PartialEq)]
pub struct RosbridgeConfig {
    /// Host and port; rosbridge's port is 9090.
    pub address: String,
    /// Name of the service.
    pub service: String,
    /// Its type.
    pub service_type: String,
    /// Pauses before connecting again.
    pub pauses: Pauses,
}

/// Offers the service for ever.
pub async fn run(config: RosbridgeConfig, mut feeder: Feeder) {
    let mut backoff = Backoff::new("rosbridge", config.pauses);
    loop {
        let mut useful = false;
        let ended = offer(&config, &mut feeder, &mut useful).await;
        backoff.wait(ended, useful).await;
    }
}

async fn offer(config: &RosbridgeConfig, feeder: &mut Feeder, useful: &mut bool) -> io::Result<()> {
    let connecting = async {
        let stream = TcpStream::connect(&config.address).await?;
        let limits = WebSocketConfig::default().max_message_size(Some(MAX_MESSAGE_BYTES));
        let url = format!("ws://{}/", config.address);
        client_async_with_config(url, stream, Some(limits))
            .await
            .map_err(io::Error::other)
    };
    let (mut socket, _) = timeout(CONNECT_TIME, connecting).await??;
    let advertised = json!({
        "op": "advertise_service",
        "service": config.service,
        "type": config.service_type,
    });
    let send = |value: Value| Message::text(value.to_string());
    socket
        .send(send(advertised))
        .await
        .map_err(io::Error::other)?;
    tracing::info!(
        address = config.address,
        service = config.service,
        "offered to ROS"
    );
    *useful = true;
    let mut quiet = false;
    loop {
        let message = match timeout(SILENCE, socket.next()).await {
            Ok(None) => return Ok(()),
            Ok(Some(message)) => message.map_err(io::Error::other)?,
            Err(_) if quiet => return Err(io::ErrorKind::TimedOut.into()),
            Err(_) => {
                quiet = true;
                let ping = Message::Ping(Vec::new().into());
                socket.send(ping).await.map_err(io::Error::other)?;
                continue;
            }
        };
        quiet = false;
        if let Message::Text(text) = message
            && let Some(response) = respond(&text, config, feeder)
        {
            socket
                .send(send(response))
                .await
                .map_err(io::Error::other)?;
        }
    }
}

/// The response to a call of the service; `None` for any other message.
fn respond(text: &str, config: &RosbridgeConfig, feeder: &mut Feeder) -> Option<Value> {
    let call: Value = serde_json::from_str(text).ok()?;
    let ours = call["op"] == "call_service" && call["service"] == config.service.as_str();
    if !ours {
        return None;
    }
    let reply = feeder.ask(&request(&call["args"]));
    let valid = reply["ok"] == true && reply["valid"] == true;
    Some(json!({
        "op": "service_response",
        "service": config.service,
        "id": call["id"],
        "values": {"success": valid, "message": reply.to_string()},
        "result": true,
    }))
}

/// The request in the arguments of a call; anything that is none becomes one that the protocol refuses.
fn request(args: &Value) -> Value {
    let text = match args {
        Value::Object(fields) => fields
            .get("data")
            .or_else(|| fields.values().next())
            .and_then(Value::as_str)
            .unwrap_or("{}"),
        _ => "{}",
    };
    let text = if text.trim().is_empty() { "{}" } else { text };
    match serde_json::from_str(text) {
        Ok(Value::Object(mut request)) => {
            request.insert("op".to_owned(), "suggest".into());
            Value::Object(request)
        }
        _ => json!({"op": "suggest", "the arguments, which must be a JSON object": text}),
    }
}
