//! Pictures made of characters.
//!
//! A character is about twice as high as wide, so with `▀` each cell shows two pixels, one above the
//! other: the foreground is the upper one. What is transparent stays the terminal's own background.
//! Where there are no colours, a letter shows how light the two pixels are together.

use super::screen::Colors;
use crate::geometry::Image;

/// Letters from dark to light.
const SHADES: &[u8] = b".:-=+*#%@";

/// More opaque pixels than this are shown.
const OPAQUE: u8 = 127;

/// The lines of a picture; a cell for each pixel across and two down. Every line ends in the colours
/// with which it began.
pub(super) fn lines(image: &Image, colors: Colors) -> Vec<String> {
    let pixel = |x: usize, y: usize| {
        let pixel = image.pixels.get(y * image.width + x)?;
        (y < image.height && pixel[3] > OPAQUE).then_some([pixel[0], pixel[1], pixel[2]])
    };
    (0..image.height.div_ceil(2))
        .map(|row| {
            let pairs = (0..image.width).map(|x| [pixel(x, 2 * row), pixel(x, 2 * row + 1)]);
            match colors {
                Colors::None => letters(pairs),
                colors => blocks(pairs, colors),
            }
        })
        .collect()
}

type Pair = [Option<[u8; 3]>; 2];

fn letters(pairs: impl Iterator<Item = Pair>) -> String {
    let line: String = pairs
        .map(|pair| {
            let seen: Vec<[u8; 3]> = pair.into_iter().flatten().collect();
            if seen.is_empty() {
                return ' ';
            }
            let light = seen.iter().map(|&pixel| luma(pixel)).sum::<usize>() / seen.len();
            char::from(SHADES[light * SHADES.len() / 256])
        })
        .collect();
    line.trim_end().to_string()
}

/// How light a pixel is (BT.601), 0 to 255.
fn luma([red, green, blue]: [u8; 3]) -> usize {
    (299 * usize::from(red) + 587 * usize::from(green) + 114 * usize::from(blue)) / 1000
}

fn blocks(pairs: impl Iterator<Item = Pair>, colors: Colors) -> String {
    let mut line = String::new();
    let mut present = [None, None];
    let mut blanks = 0;
    for [upper, lower] in pairs {
        let (letter, wanted) = match (upper, lower) {
            (None, None) => {
                blanks += 1;
                continue;
            }
            (Some(upper), Some(lower)) => ('▀', [Some(upper), Some(lower)]),
            (Some(upper), None) => ('▀', [Some(upper), None]),
            (None, Some(lower)) => ('▄', [Some(lower), None]),
        };
        if blanks > 0 {
            if present[1].is_some() {
                line += "\u{1b}[49m";
                present[1] = None;
            }
            line.extend(std::iter::repeat_n(' ', blanks));
            blanks = 0;
        }
        if present[0] != wanted[0] {
            line += &color(38, wanted[0], colors);
        }
        if present[1] != wanted[1] {
            line += &color(48, wanted[1], colors);
        }
        present = wanted;
        line.push(letter);
    }
    if present != [None, None] {
        line += "\u{1b}[0m";
    }
    line
}

/// The escape sequence that sets the foreground (38) or background (48).
fn color(place: u8, pixel: Option<[u8; 3]>, colors: Colors) -> String {
    match (pixel, colors) {
        (None, _) => format!("\u{1b}[{}m", place + 1),
        (Some([red, green, blue]), Colors::True) => {
            format!("\u{1b}[{place};2;{red};{green};{blue}m")
        }
        (Some(pixel), _) => format!("\u{1b}[{place};5;{}m", indexed(pixel)),
    }
}

/// The nearest of xterm's 256 colours: of its cube of 6·6·6 and its 24 greys.
fn indexed(pixel: [u8; 3]) -> usize {
    const LEVELS: [usize; 6] = [0, 95, 135, 175, 215, 255];
    let level = |value: u8| {
        let distance = |&place: &usize| LEVELS[place].abs_diff(value.into());
        (0..6).min_by_key(distance).unwrap_or(0)
    };
    let cube = pixel.map(level);
    let grey = (luma(pixel).max(8) - 8).div_ceil(10).min(23);
    let distance = |color: [usize; 3]| -> usize {
        let differences = color.iter().zip(pixel);
        differences.map(|(&a, b)| a.abs_diff(b.into()).pow(2)).sum()
    };
    let of_cube = distance(cube.map(|level| LEVELS[level]));
    let of_grey = distance([8 + 10 * grey; 3]);
    match of_grey < of_cube {
        true => 232 + grey,
        false => 16 + 36 * cube[0] + 6 * cube[1] + cube[2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rows: &[&[[u8; 4]]]) -> Image {
        Image {
            width: rows[0].len(),
            height: rows.len(),
            pixels: rows.concat(),
        }
    }

    const RED: [u8; 4] = [255, 0, 0, 255];
    const BLUE: [u8; 4] = [0, 0, 255, 255];
    const CLEAR: [u8; 4] = [9, 9, 9, 0];

    #[test]
    fn two_pixels_share_a_cell() {
        let shown = lines(&image(&[&[RED, CLEAR], &[BLUE, RED]]), Colors::True);
        let expected = "\u{1b}[38;2;255;0;0m\u{1b}[48;2;0;0;255m▀\u{1b}[49m▄\u{1b}[0m";
        assert_eq!(shown, [expected]);
    }

    #[test]
    fn what_is_transparent_is_left_out() {
        let shown = lines(&image(&[&[CLEAR, RED, CLEAR]]), Colors::Indexed);
        assert_eq!(shown, [" \u{1b}[38;5;196m▀\u{1b}[0m"]);
        assert_eq!(lines(&image(&[&[CLEAR; 3]]), Colors::True), [""]);
    }

    #[test]
    fn colours_of_the_table_are_found_exactly() {
        assert_eq!(indexed([0, 0, 0]), 16);
        assert_eq!(indexed([255, 255, 255]), 231);
        assert_eq!(indexed([95, 135, 175]), 67);
        assert_eq!(indexed([128, 128, 128]), 244);
        assert_eq!(indexed([8, 8, 8]), 232);
    }

    #[test]
    fn letters_show_light() {
        let grey = |value: u8| [value, value, value, 255];
        let row = [grey(0), grey(128), CLEAR, grey(255), CLEAR];
        assert_eq!(lines(&image(&[&row, &row]), Colors::None), [".+ @"]);
    }
}
