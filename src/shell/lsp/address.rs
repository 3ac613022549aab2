//! The addresses of files in the protocol, `file:///a%20b.imp`, and their paths.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_types::Uri;

use crate::assist::project::plain;

/// The path of a file. An address that is none of a file stands for itself, so that a text which
/// has not been saved yet has a path too.
pub(super) fn path(uri: &Uri) -> PathBuf {
    let written = written_path(uri);
    match uri.as_str().starts_with("file://") {
        true => plain(&written),
        false => written,
    }
}

/// The same path with its symbolic links.
pub(super) fn written_path(uri: &Uri) -> PathBuf {
    let text = uri.as_str();
    let Some(rest) = text.strip_prefix("file://") else {
        return PathBuf::from(text);
    };
    let start = rest.find('/').unwrap_or(rest.len());
    let decoded = decoded(&rest[start..]);
    // `/c:/folder` is a path of Windows.
    let is_drive = cfg!(windows) && decoded.as_bytes().get(2) == Some(&b':');
    let decoded = match is_drive {
        true => decoded[1..].to_owned(),
        false => decoded,
    };
    PathBuf::from(decoded)
}

/// The address of a file.
pub(super) fn uri(path: &Path) -> Option<Uri> {
    let text = path.to_str()?;
    let mut encoded = match text.starts_with('/') {
        true => String::from("file://"),
        false if cfg!(windows) => String::from("file:///"),
        false => return Uri::from_str(text).ok(),
    };
    for byte in text.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'.' | b'_' | b'~' => {
                encoded.push(char::from(byte));
            }
            b'\\' if cfg!(windows) => encoded.push('/'),
            _ => encoded += &format!("%{byte:02X}"),
        }
    }
    Uri::from_str(&encoded).ok()
}

fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut place = 0;
    while let Some(&byte) = bytes.get(place) {
        let code = bytes.get(place + 1..place + 3);
        let code = code.and_then(|code| std::str::from_utf8(code).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(code) if byte == b'%' => {
                decoded.push(code);
                place += 3;
            }
            _ => {
                decoded.push(byte);
                place += 1;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn paths_and_addresses_belong_together() {
        let path_of = |text: &str| path(&Uri::from_str(text).expect("an address"));
        let here = Path::new("/no such/é 100%.imp");
        let address = uri(here).expect("an address");
        assert_eq!(address.as_str(), "file:///no%20such/%C3%A9%20100%25.imp");
        assert_eq!(path_of(address.as_str()), here);
        assert_eq!(path_of("file://host/no/a.imp"), Path::new("/no/a.imp"));
        let untitled = path_of("untitled:Untitled-1");
        assert_eq!(untitled, Path::new("untitled:Untitled-1"));
        let address = uri(&untitled).expect("an address");
        assert_eq!(address.as_str(), "untitled:Untitled-1");
    }
}
