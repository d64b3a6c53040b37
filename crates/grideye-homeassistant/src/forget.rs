//! Deletes what the broker retains of a sensor.

use crate::bridge::{SENSORS_MAX, TOLD_BYTES_MAX};
use crate::broker::Broker;
use crate::connection::{CONNECT_TIME_MAX, Client, Connection};
use crate::discovery;
use crate::fault::Fault;
use crate::packet::Heard;
use crate::topics::{self, ENTITIES, Topics};
use tokio::time::timeout;

/// Removes a sensor from Home Assistant; returns whether there was anything to remove.
///
/// # Errors
/// If the broker is not reachable, or is not an MQTT broker.
pub async fn forget(
    broker: &Broker,
    topics: &Topics,
    device: &str,
    sensor: &str,
) -> Result<bool, Fault> {
    let id = topics::id(device, sensor);
    let client_id = format!("grideyeforget{}", std::process::id());
    let client = Client {
        id: &client_id,
        will: None,
        is_kept: false,
        bytes_max: TOLD_BYTES_MAX,
    };
    let connection = Connection::open(broker, client).await?;
    remove(connection, topics, &id).await
}

/// Returns whether there was a configuration.
async fn remove(mut connection: Connection, topics: &Topics, id: &str) -> Result<bool, Fault> {
    let camera = topics.config(id, ENTITIES[0]);
    connection.subscribe(&[camera], 0).await?;
    let found = until_pong(&mut connection).await?;
    for message in discovery::removal(topics, id) {
        connection.publish(&message).await?;
    }
    // The broker has processed everything before it answers this ping.
    until_pong(&mut connection).await?;
    connection.close().await?;
    Ok(found)
}

/// Pings, and returns whether a message arrived before the answer.
async fn until_pong(connection: &mut Connection) -> Result<bool, Fault> {
    connection.ping().await?;
    let mut found = false;
    for _ in 0..SENSORS_MAX {
        let heard = timeout(CONNECT_TIME_MAX, connection.hear()).await;
        match heard.map_err(|_elapsed| Fault::silent(CONNECT_TIME_MAX))?? {
            Heard::Pong => return Ok(found),
            Heard::Published(message, _) => found |= !message.payload.is_empty(),
            Heard::Connected(_) | Heard::Subscribed(_) | Heard::TooLong(..) => {}
        }
    }
    Err(Fault::garbled(&"no end of messages"))
}
