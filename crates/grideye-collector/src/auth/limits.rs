//! Limits of the folder of tokens.

/// Maximum tokens in a folder, including revoked ones.
pub const TOKENS_MAX: usize = 20_000;
/// Maximum devices per token.
pub const DEVICES_PER_TOKEN_MAX: usize = 64;
/// Maximum characters of a token's name.
pub const TOKEN_NAME_CHARS_MAX: usize = 64;
/// Maximum size of a file in the folder, in bytes: [`TOKENS_MAX`] tokens of one device each take 5 MB.
pub const FILE_BYTES_MAX: u64 = 32 * 1024 * 1024;
