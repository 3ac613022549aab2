//! PNG (ISO/IEC 15948): a picture in sRGB, eight bits a channel, without loss. Opacity is
//! written only where a pixel has less than all of it.

use std::io::{self, Write};

use ::png::{BitDepth, ColorType, Compression, Encoder, EncodingError, SrgbRenderingIntent};

use crate::geometry::{Animation, Image};

/// The whole picture as RGB or RGBA.
///
/// An error for a picture without pixels or with more in a row or column than 2³¹ − 1, which the
/// format cannot hold.
pub(super) fn write_image(output: &mut dyn Write, image: &Image) -> io::Result<()> {
    let is_opaque = image.is_opaque();
    let encoder = encoder(output, image, is_opaque)?;
    let mut writer = encoder.write_header().map_err(refused)?;
    writer
        .write_image_data(&bytes(image, is_opaque))
        .map_err(refused)?;
    writer.finish().map_err(refused)
}

/// All pictures as an animated PNG that begins anew for ever; programs that know of no animations show
/// the first.
///
/// An error where there is no picture, or where they differ in size, and as for one picture.
pub(super) fn write_animation(output: &mut dyn Write, animation: &Animation) -> io::Result<()> {
    let wrong = |message: &str| io::Error::new(io::ErrorKind::InvalidInput, message);
    let frames = &animation.frames;
    let Some(first) = frames.first() else {
        return Err(wrong("an animation needs a picture"));
    };
    let size = (first.width, first.height);
    if frames
        .iter()
        .any(|frame| (frame.width, frame.height) != size)
    {
        return Err(wrong("the pictures of an animation differ in size"));
    }
    let is_opaque = frames.iter().all(Image::is_opaque);
    let number = u32::try_from(frames.len()).map_err(|_| wrong("too many pictures"))?;
    let mut encoder = encoder(output, first, is_opaque)?;
    encoder.set_animated(number, 0).map_err(refused)?;
    encoder
        .set_frame_delay(animation.delay, 1000)
        .map_err(refused)?;
    let mut writer = encoder.write_header().map_err(refused)?;
    for frame in frames {
        writer
            .write_image_data(&bytes(frame, is_opaque))
            .map_err(refused)?;
    }
    writer.finish().map_err(refused)
}

/// An encoder for pictures of this size.
fn encoder<'a>(
    output: &'a mut dyn Write,
    image: &Image,
    is_opaque: bool,
) -> io::Result<Encoder<'static, &'a mut dyn Write>> {
    let [width, height] = [image.width, image.height].map(u32::try_from);
    let (Ok(width), Ok(height)) = (width, height) else {
        let message = "a PNG file holds at most 2147483647 pixels in a row";
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    };
    let mut encoder = Encoder::new(output, width, height);
    encoder.set_depth(BitDepth::Eight);
    // A picture of 1024² takes 10 ms instead of 110, in a file that is a third larger.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_color(match is_opaque {
        true => ColorType::Rgb,
        false => ColorType::Rgba,
    });
    Ok(encoder)
}

/// The channels of all pixels.
fn bytes(image: &Image, is_opaque: bool) -> Vec<u8> {
    let channels = if is_opaque { 3 } else { 4 };
    let pixels = image.pixels.iter();
    pixels
        .flat_map(|pixel| &pixel[..channels])
        .copied()
        .collect()
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
    use super::super::test_values::{animation, bytes, image};
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
    fn the_pictures_of_an_animation_read_back_in_order() {
        let animation = animation();
        let bytes = bytes(write_animation, &animation);
        let mut reader = ::png::Decoder::new(io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let control = reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (2, 0));
        for frame in &animation.frames {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, frame.pixels.concat());
            let shown = reader.info().frame_control().unwrap();
            assert_eq!((shown.delay_num, shown.delay_den), (40, 1000));
        }
    }

    #[test]
    fn animations_have_pictures_of_one_size() {
        let none = write_animation(&mut Vec::new(), &Animation::default());
        assert_eq!(none.unwrap_err().kind(), io::ErrorKind::InvalidInput);
        let mut animation = animation();
        animation.frames[1] = Image {
            width: 1,
            height: 1,
            pixels: vec![[0; 4]],
        };
        let differing = write_animation(&mut Vec::new(), &animation);
        assert_eq!(differing.unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }

    #[test]
    fn a_picture_without_pixels_is_an_error() {
        let error = write_image(&mut Vec::new(), &Image::default()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
    }
}
