//! What a number or an escape sequence says.

use std::f64::consts::{PI, TAU};

/// The value of a number as it is written, with `_` between digits and with `deg` or `turn` behind
/// it for angles, which become radians. Infinite where it is too large for a float.
pub(super) fn number_value(text: &str) -> Option<f64> {
    if let Some(degrees) = text.strip_suffix("deg") {
        Some(decimal(degrees)? / 180.0 * PI)
    } else if let Some(turns) = text.strip_suffix("turn") {
        Some(decimal(turns)? * TAU)
    } else {
        decimal(text)
    }
}

fn decimal(text: &str) -> Option<f64> {
    if text.contains('_') {
        text.replace('_', "").parse().ok()
    } else {
        text.parse().ok()
    }
}

/// The character that an escape sequence in a string stands for, braces included (`{{`).
pub(super) fn escape_value(text: &str) -> Option<char> {
    match text {
        "{{" => Some('{'),
        "}}" => Some('}'),
        "\\n" => Some('\n'),
        "\\t" => Some('\t'),
        "\\r" => Some('\r'),
        "\\\"" => Some('"'),
        "\\\\" => Some('\\'),
        _ => {
            let digits = text.strip_prefix("\\u{")?.strip_suffix('}')?;
            char::from_u32(u32::from_str_radix(digits, 16).ok()?)
        }
    }
}

/// The largest number of digits after the point that a format may ask for.
pub(super) const MAXIMUM_PRECISION: usize = 99;

/// The digits after the point that a format such as `:.3` asks for.
pub(super) fn precision_value(text: &str) -> Option<usize> {
    let digits = text.trim_end().strip_prefix(":.")?;
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    digits
        .parse()
        .ok()
        .filter(|&precision| precision <= MAXIMUM_PRECISION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_value_and_angles_are_radians() {
        for (text, value) in [
            ("1", 1.0),
            ("0.5", 0.5),
            ("1e-3", 1e-3),
            ("2.5E+2", 250.0),
            ("1_000", 1000.0),
            ("1_0.2_5", 10.25),
            ("180deg", PI),
            ("45deg", PI / 4.0),
            ("0.25turn", PI / 2.0),
            ("1e400", f64::INFINITY),
        ] {
            assert_eq!(number_value(text), Some(value), "{text}");
        }
    }

    #[test]
    fn escapes_and_formats_have_their_value() {
        assert_eq!(escape_value("\\u{3c0}"), Some('π'));
        assert_eq!(escape_value("{{"), Some('{'));
        assert_eq!(escape_value("\\u{d800}"), None);
        assert_eq!(escape_value("\\q"), None);
        assert_eq!(precision_value(":.3"), Some(3));
        assert_eq!(precision_value(":.99"), Some(99));
        for wrong in [":", ":3", ":.", ":.x", ":.100", ":.+3"] {
            assert_eq!(precision_value(wrong), None, "{wrong}");
        }
    }
}
