//! PNG (ISO/IEC 15948): a picture in sRGB, eight bits a channel, without loss. Opacity is
//! written only where a pixel has less than all of it.

use std::io::{self, Write};

use ::png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use crate::geometry::Image;

/// The whole picture as RGB or RGBA.
///
/// An error for a picture without pixels or with more in a row or column than 2³¹ − 1, which the
/// format cannot hold.
pub(super) fn write_image(output: &mut dyn Write, image: &Image) -> io::Result<()> {
    let [width, height] = [image.width, image.height].map(u32::try_from);
    let (Ok(width), Ok(height)) = (width, height) else {
        let message = "a PNG file holds at most 2147483647 pixels in a row";
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    };
    let is_opaque = image.is_opaque();
    let mut encoder = Encoder::new(output, width, height);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_color(match is_opaque {
        true => ColorType::Rgb,
        false => ColorType::Rgba,
    });
    let channels = if is_opaque { 3 } else { 4 };
    let pixels = image.pixels.iter();
    let bytes: Vec<u8> = pixels
        .flat_map(|pixel| &pixel[..channels])
        .copied()
        .collect();
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(&bytes).map_err(refused)?;
    writer.finish().map_err(refused)
}

/// What the encoder refused, or the error of the file below it.
fn refused(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::new(io::ErrorKind::InvalidInput, other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_values::{bytes, image};
    use super::*;

    fn decoded(bytes: &[u8]) -> (::png::OutputInfo, Vec<u8>) {
        let mut reader = ::png::Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info, pixels)
    }

    #[test]
    fn pixels_read_back_with_their_opacity() {
        let image = image();
        let (info, pixels) = decoded(&bytes(write_image, &image));
        assert_eq!((info.width, info.height), (3, 2));
        assert_eq!(info.color_type, ColorType::Rgba);
        assert_eq!(pixels, image.pixels.concat());
    }

    #[test]
    fn opaque_pictures_have_three_channels() {
        let mut image = image();
        image.pixels.iter_mut().for_each(|pixel| pixel[3] = 255);
        let (info, pixels) = decoded(&bytes(write_image, &image));
        assert_eq!(info.color_type, ColorType::Rgb);
        let colors: Vec<u8> = image
            .pixels
            .iter()
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        assert_eq!(pixels, colors);
    }

    #[test]
    fn a_picture_without_pixels_is_an_error() {
        let error = write_image(&mut Vec::new(), &Image::default()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
    }
}
