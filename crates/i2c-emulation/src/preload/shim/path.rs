//! Tells which paths are devices.

/// The folder and the bus number of a path that ends in `i2c-N`.
pub(super) fn split(path: &[u8]) -> Option<(&[u8], u32)> {
    let slash = path.iter().rposition(|byte| *byte == b'/');
    let name_at = slash.map_or(0, |at| at + 1);
    let (folder, name) = path.split_at_checked(name_at)?;
    Some((folder, decimal(name.strip_prefix(b"i2c-")?)?))
}

/// Whether an absolute folder path is `/dev`, judged by its text alone.
pub(super) fn is_dev(folder: &[u8]) -> bool {
    folder.starts_with(b"/") && parts(folder).eq([&b"dev"[..]])
}

/// Whether a relative path is the folder it starts from.
pub(super) fn is_here(folder: &[u8]) -> bool {
    !folder.starts_with(b"/") && parts(folder).next().is_none()
}

/// A number without a sign or leading zeros.
pub(super) fn decimal(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 1 && digits.starts_with(b"0") {
        return None;
    }
    digits.iter().try_fold(0u32, |number, digit| {
        let value = digit.checked_sub(b'0').filter(|value| *value < 10)?;
        number.checked_mul(10)?.checked_add(value.into())
    })
}

fn parts(path: &[u8]) -> impl Iterator<Item = &[u8]> {
    path.split(|byte| *byte == b'/')
        .filter(|part| !part.is_empty() && *part != b".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_i2c_dev_have_a_number() {
        for (path, folder, number) in [
            ("/dev/i2c-1", "/dev/", 1),
            ("i2c-0", "", 0),
            ("//dev/./i2c-12", "//dev/./", 12),
            ("/tmp/i2c-4294967295", "/tmp/", u32::MAX),
        ] {
            let expected = Some((folder.as_bytes(), number));
            assert_eq!(split(path.as_bytes()), expected, "{path}");
        }
        for name in ["i2c-", "i2c-1/", "i2c-01", "i2c-1x", "i2c-+1"] {
            let path = format!("/dev/{name}");
            assert_eq!(split(path.as_bytes()), None, "{path}");
        }
        for path in ["", "/dev/i2c-4294967296", "/dev/xi2c-1"] {
            assert_eq!(split(path.as_bytes()), None, "{path}");
        }
    }

    #[test]
    fn dev_is_known_by_its_text_alone() {
        for folder in ["/dev/", "/dev", "//dev//", "/./dev/./"] {
            assert!(is_dev(folder.as_bytes()), "{folder}");
        }
        for folder in ["", "dev/", "/", "/devx/", "/tmp/dev/", "/dev/../dev/"] {
            assert!(!is_dev(folder.as_bytes()), "{folder}");
        }
        let here = ["", "./", "././/", "../", "/"].map(|folder| is_here(folder.as_bytes()));
        assert_eq!(here, [true, true, true, false, false]);
    }
}
