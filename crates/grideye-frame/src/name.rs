//! The rule for names of devices, sensors and boots.

/// Maximum characters in the name of a device, sensor or boot, or of a reason in an account.
pub const NAME_CHARS_MAX: usize = 64;

/// The rule of [`is_name`] for error messages.
pub const NAME_RULE: &str =
    "a name of 1 to 64 characters A-Z a-z 0-9 . _ : - that begins with a letter or a digit";

/// Whether a device, sensor or boot may have this name, in a scene, on the wire and in files ([`NAME_RULE`]).
///
/// Such a name needs no quoting in CSV, JSON or a shell, is no spreadsheet formula, and cannot lead out of a folder.
///
/// ```
/// assert!(grideye_frame::is_name("i2c-1:0x69"));
/// assert!(!grideye_frame::is_name("right arm"));
/// ```
#[must_use]
pub fn is_name(name: &str) -> bool {
    let goes_on = |byte: u8| byte.is_ascii_alphanumeric() || b"._:-".contains(&byte);
    name.starts_with(|first: char| first.is_ascii_alphanumeric())
        && name.len() <= NAME_CHARS_MAX
        && name.bytes().all(goes_on)
}
