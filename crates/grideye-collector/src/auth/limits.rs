//! How much the folder of tokens takes.

/// Tokens that a folder holds at most, revoked ones included.
pub const TOKENS_MAX: usize = 20_000;
/// Devices that one token may speak for at most.
pub const DEVICES_PER_TOKEN_MAX: usize = 64;
/// Characters of a token's name.
pub const TOKEN_NAME_CHARS_MAX: usize = 64;
/// Length of a file of the folder at most, in bytes: [`TOKENS_MAX`] tokens of one device each have 5 MB.
pub const FILE_BYTES_MAX: u64 = 32 * 1024 * 1024;
