//! Pictures by a terminal's own graphics: kitty's protocol and sixels.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use icy_sixel::SixelImage;

use crate::file::png_bytes;
use crate::geometry::Image;

/// The most bytes of one part of a transmission by kitty's protocol.
const PART: usize = 4096;

/// A picture as kitty's protocol sends it, shown in so many columns and rows: a PNG in base64, in
/// parts of which all but the last say that there are more.
pub(super) fn kitty(image: &Image, [columns, rows]: [usize; 2]) -> Result<String, String> {
    let bytes = png_bytes(image).map_err(|error| error.to_string())?;
    let text = STANDARD.encode(bytes);
    let mut sent = String::new();
    let mut rest = text.as_str();
    let mut head = format!("a=T,f=100,q=2,c={columns},r={rows},");
    while !rest.is_empty() {
        let (part, more) = rest.split_at(rest.len().min(PART));
        let is_more = u8::from(!more.is_empty());
        sent += &format!("\u{1b}_G{head}m={is_more};{part}\u{1b}\\");
        head.clear();
        rest = more;
    }
    Ok(sent)
}

/// A picture as sixels.
pub(super) fn sixel(image: &Image) -> Result<String, String> {
    let bytes = image.pixels.concat();
    SixelImage::try_from_rgba(bytes, image.width, image.height)
        .and_then(|image| image.encode())
        .map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> Image {
        // Colours without a pattern, so that the file is as large as it can be.
        let pixel = |place: usize| {
            let mut noise = (place as u32).wrapping_mul(2_654_435_761);
            noise = (noise ^ (noise >> 15)).wrapping_mul(2_246_822_519);
            let [red, green, blue, _] = (noise ^ (noise >> 13)).to_le_bytes();
            [red, green, blue, 255]
        };
        Image {
            width: 90,
            height: 60,
            pixels: (0..90 * 60).map(pixel).collect(),
        }
    }

    #[test]
    fn kitty_gets_the_png_in_parts() {
        let sent = kitty(&image(), [9, 3]).unwrap();
        let parts: Vec<&str> = sent.split_terminator("\u{1b}\\").collect();
        assert!(parts.len() > 1, "{}", sent.len());
        let mut text = String::new();
        for (place, part) in parts.iter().enumerate() {
            let (head, body) = part.split_once(';').unwrap();
            let is_last = place + 1 == parts.len();
            assert!(head.starts_with("\u{1b}_G"));
            assert!(
                head.ends_with(if is_last { "m=0" } else { "m=1" }),
                "{head}"
            );
            assert_eq!(head.contains("c=9,r=3"), place == 0);
            assert!(body.len() <= 4096);
            text += body;
        }
        assert_eq!(STANDARD.decode(text).unwrap(), png_bytes(&image()).unwrap());
    }

    #[test]
    fn sixels_read_back() {
        let flat = Image {
            width: 8,
            height: 6,
            pixels: vec![[255, 0, 0, 255]; 48],
        };
        let sent = sixel(&flat).unwrap();
        assert!(sent.starts_with("\u{1b}P") && sent.ends_with("\u{1b}\\"));
        let read = SixelImage::decode(sent.as_bytes()).unwrap();
        assert_eq!((read.width, read.height), (8, 6));
        assert_eq!(&read.pixels[..4], [255, 0, 0, 255]);
    }
}
