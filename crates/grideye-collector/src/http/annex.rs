//! Routes that the program adds, behind the collector's own middleware.

use crate::clock::Clock;
use crate::http::ingest;
use crate::http::refusal::Refusal;
use crate::http::state::{AppState, Shared};
use crate::live::{NewestFrames, RecentFrames};
use crate::shares::Sender;
use crate::store::{FrameStore, StoreError};
use axum::Router;
use grideye_recording::wire::Batch;
use std::borrow::Cow;
use std::fmt;
use std::net::Ipv4Addr;
use std::sync::{Arc, Weak};

/// A file for pages, served publicly as `/assets/NAME`.
#[derive(Debug, Clone, Copy)]
pub struct Asset {
    /// Its name, which no other file of the collector or an annex has.
    pub name: &'static str,
    /// Its `Content-Type`.
    pub kind: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The program's own routes beside the collector's, under a name that tells the page they exist.
///
/// They pass the same middleware: tokens, `Host` and `Origin`, limits, headers. GET needs a token that may read,
/// everything else one of scope admin. Run slow work off the async threads.
///
/// ```
/// use axum::{Router, routing::get};
/// use grideye_collector::Annex;
///
/// let annex = Annex::new("greetings", |inside| {
///     let store = inside.store.clone();
///     let greet = move || async move { format!("{} streams", store.streams().await.map_or(0, |all| all.len())) };
///     Router::new().route("/v1/greetings", get(greet))
/// });
/// assert_eq!(annex.name(), "greetings");
/// ```
#[derive(Clone)]
pub struct Annex {
    name: &'static str,
    pub(crate) described: &'static str,
    pub(crate) assets: &'static [Asset],
    pub(crate) head: Cow<'static, str>,
    pub(crate) is_slow: bool,
    routes: Arc<dyn Fn(&Inside) -> Router + Send + Sync>,
}

impl Annex {
    /// Adds routes, which are built once the store is open.
    pub fn new(
        name: &'static str,
        routes: impl Fn(&Inside) -> Router + Send + Sync + 'static,
    ) -> Self {
        Self {
            name,
            described: "{}",
            assets: &[],
            head: Cow::Borrowed(""),
            is_slow: false,
            routes: Arc::new(routes),
        }
    }

    /// Adds the object `paths` of an OpenAPI 3.1 document, which joins that of `GET /v1/openapi.json` and may refer to
    /// its components.
    #[must_use]
    pub fn described_by(self, paths: &'static str) -> Self {
        Self {
            described: paths,
            ..self
        }
    }

    /// Adds files for pages.
    #[must_use]
    pub fn with_assets(self, assets: &'static [Asset]) -> Self {
        Self { assets, ..self }
    }

    /// Adds HTML to the head of the live page; its scripts run before the page's own and register with it
    /// (`assets/brought.js`).
    #[must_use]
    pub fn on_the_page(self, head: impl Into<Cow<'static, str>>) -> Self {
        let head = head.into();
        Self { head, ..self }
    }

    /// Gives its routes more time ([`Limits::slow_handler_time_max`](crate::Limits::slow_handler_time_max)): limit how
    /// many answer at once, and stop work whose request was dropped.
    #[must_use]
    pub fn slow(self) -> Self {
        Self {
            is_slow: true,
            ..self
        }
    }

    /// The name listed by `GET /v1/annexes`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    pub(crate) fn routes(&self, inside: &Inside) -> Router {
        (self.routes)(inside)
    }
}

impl fmt::Debug for Annex {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Annex").field(&self.name).finish()
    }
}

/// The parts of the collector that an [`Annex`] can use.
#[derive(Clone)]
pub struct Inside {
    /// The collector's store.
    pub store: Arc<dyn FrameStore>,
    /// The records that just arrived from the sensors.
    pub recent: RecentFrames,
    /// The newest frame of every sensor.
    pub newest: NewestFrames,
    /// The collector's clock.
    pub clock: Arc<dyn Clock>,
    /// Takes frames that did not come as a post.
    pub ingest: Ingest,
}

impl Inside {
    pub(crate) fn of(state: &AppState) -> Self {
        let shared = &state.0;
        Self {
            store: Arc::clone(&shared.store),
            recent: shared.live.recent().clone(),
            newest: NewestFrames::new(Arc::clone(&shared.live)),
            clock: state.clock(),
            ingest: Ingest(Arc::downgrade(shared)),
        }
    }
}

/// Takes frames as `POST /v1/frames` does, with the same checks, limits and counters.
#[derive(Clone)]
pub struct Ingest(Weak<Shared>);

impl Ingest {
    /// Stores a batch whole or not at all, and returns once it is on disk.
    ///
    /// # Errors
    /// [`Refusal`] as the post's; one that [may pass](Refusal::may_pass) is for later.
    pub async fn store(&self, batch: Batch) -> Result<(), Refusal> {
        let shared = self.0.upgrade().ok_or(StoreError::Closed)?;
        // All that an annex brings counts as one sender's; no peer has this address.
        let sender = Sender::of(None, Ipv4Addr::UNSPECIFIED.into());
        let stored = ingest::store(&AppState(shared), &Arc::new(batch), &sender).await;
        stored.map(drop)
    }
}
