//! Real collectors and their stores: several on one database, a mishandled store, metrics, and the API as documented.

mod careless_store;
mod observability;
mod rest;
mod several;
