//! `grideye mqtt forget`: takes away what the broker keeps of a sensor.

use super::bridge::SENSORS_MAX;
use super::connection::{CONNECT_TIME_MAX, Connection};
use super::fault::Fault;
use super::packet::Heard;
use super::topics::{self, ENTITIES, Topics};
use super::{broker, discovery, topics_of};
use crate::cli::Forget;
use crate::exit::Outcome;
use crate::output::outln;
use anyhow::{Context as _, Result, anyhow};
use tokio::time::timeout;

/// Removes it, and says whether there was anything to remove.
pub(crate) fn run(options: &Forget) -> Result<Outcome> {
    let broker = broker(&options.broker)?.context("--mqtt is missing")?;
    let topics = topics_of(&options.broker);
    let id = topics::id(&options.device, &options.sensor);
    let runtime = tokio::runtime::Runtime::new().context("cannot start a thread")?;
    let found = runtime.block_on(async {
        let client_id = format!("grideyeforget{}", std::process::id());
        let connection = Connection::open(&broker, &client_id, None).await?;
        remove(connection, &topics, &id).await
    })?;
    let (device, sensor) = (&options.device, &options.sensor);
    if !found {
        return Err(anyhow!(
            "{broker} keeps nothing of the sensor {sensor} of {device}\nhint: the live page and `grideye audit` name devices and sensors; --mqtt-prefix and --mqtt-topic are those of the collector"
        ));
    }
    outln!("removed the sensor {sensor} of {device} from {broker}")?;
    Ok(Outcome::Done)
}

/// Whether there was a configuration.
async fn remove(mut connection: Connection, topics: &Topics, id: &str) -> Result<bool, Fault> {
    let camera = topics.config(id, ENTITIES[0]);
    connection.subscribe(&[camera]).await?;
    let found = until_pong(&mut connection).await?;
    for message in discovery::removal(topics, id) {
        connection.publish(&message).await?;
    }
    // The broker has taken all before it answers this.
    until_pong(&mut connection).await?;
    connection.close().await?;
    Ok(found)
}

/// Asks for a sign of life, and says whether something was published before it came.
async fn until_pong(connection: &mut Connection) -> Result<bool, Fault> {
    connection.ping().await?;
    let mut found = false;
    for _ in 0..SENSORS_MAX {
        let heard = timeout(CONNECT_TIME_MAX, connection.hear()).await;
        match heard.map_err(|_elapsed| Fault::silent(CONNECT_TIME_MAX))?? {
            Heard::Pong => return Ok(found),
            Heard::Published(message) => found |= !message.payload.is_empty(),
            Heard::Connected(_) | Heard::Subscribed(_) => {}
        }
    }
    Err(Fault::garbled(&"no end of messages"))
}
