//! The HTTP API through the router, without a socket.

mod client;
mod every_request;
mod health;
mod ingest;
mod live;
mod recordings;
mod sensors;
