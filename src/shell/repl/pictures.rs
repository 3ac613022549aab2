//! Pictures of fields in the terminal.

use super::super::output;
use super::cells;
use super::graphics;
use super::screen::{Colors, Graphics};
use super::session::Repl;
use crate::geometry::Image;
use crate::language::{FieldValue, Value};
use crate::syntax::parse_expression;

/// The most columns and rows of a picture that nobody asked for.
const SMALL: [usize; 2] = [48, 16];

/// The most columns of any.
const WIDEST: usize = 120;

/// The most pixels across or down that are sent to a terminal.
const MOST_PIXELS: usize = 800;

/// A graph over R1 is so much higher than wide.
const GRAPH_HEIGHT: f64 = 0.625;

/// How much room there is for a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    /// A part of the screen.
    Small,
    /// The screen, but for a line for the command and one for the prompt.
    Full,
}

impl Repl {
    /// Shows a field or an image that is the last value, if a person sees it and wants that.
    pub(super) fn show_picture(&mut self, value: &Value) {
        if !self.is_typed || !self.pictures {
            return;
        }
        let shown = match value {
            Value::Field(field) if field.components() == 1 => {
                let session = &mut self.workspace.session;
                // Nobody has asked for a picture, so no long search for a box is made.
                let Some(bounds) = field.domain().or_else(|| session.box_at_hand(field)) else {
                    return;
                };
                self.field_image(&field.clone().with_domain(Some(bounds)), Room::Small)
            }
            Value::Image(set) => Ok(set.picture.image.clone()),
            _ => return,
        };
        match shown {
            Ok(image) => self.show_image(&image, Room::Small),
            Err(message) => {
                let text = format!("no picture: {message}");
                output::data(&self.screen.dim(&text));
            }
        }
    }

    /// A picture of a field of the size that there is room for.
    fn field_image(&mut self, field: &FieldValue, room: Room) -> Result<Image, String> {
        let size = self.size(field.dimension(), room);
        let is_clear = self.leaves_background(field.dimension());
        let mut options = Vec::new();
        for (name, text) in [
            ("size", size.to_string()),
            ("transparent", is_clear.to_string()),
        ] {
            let id = self
                .workspace
                .heard
                .sources
                .borrow_mut()
                .add("<picture>", text.as_str());
            if let Ok(expression) = parse_expression(id, &text) {
                options.push((name, expression));
            }
        }
        let field = Value::Field(field.clone());
        let made = self.workspace.session.call("plot", vec![field], &options);
        match made {
            Ok(Value::Image(set)) => Ok(set.picture.image.clone()),
            Ok(other) => Err(format!("`plot` gave {}", other.kind())),
            Err(errors) => {
                let first = errors.into_iter().next();
                Err(first.map_or_else(String::new, |error| error.message))
            }
        }
    }

    /// The pixels along the longer side of a picture that there is room for.
    pub(super) fn size(&self, dimension: usize, room: Room) -> usize {
        let [columns, rows] = self.room(room);
        let height = if dimension == 1 { GRAPH_HEIGHT } else { 1.0 };
        let [across, down] = match self.screen.graphics {
            Graphics::Kitty | Graphics::Sixel => {
                let cell = self.screen.cell();
                [columns * cell[0], rows * cell[1]].map(|pixels| pixels.min(MOST_PIXELS))
            }
            Graphics::Blocks | Graphics::None => [columns, 2 * rows],
        };
        across.min((down as f64 / height) as usize).max(1)
    }

    /// Whether the terminal's background is to be seen around the object.
    pub(super) fn leaves_background(&self, dimension: usize) -> bool {
        dimension == 3 || (dimension == 1 && self.screen.colors == Colors::None)
    }

    fn room(&self, room: Room) -> [usize; 2] {
        let [columns, rows] = self.screen.size();
        // In its last column a terminal may begin a new line.
        let columns = columns.saturating_sub(1).clamp(1, WIDEST);
        let rows = rows.saturating_sub(3).max(1);
        match room {
            Room::Full => [columns, rows],
            Room::Small => [columns.min(SMALL[0]), rows.min(SMALL[1])],
        }
    }

    /// Shows an image as the terminal can, made smaller where there is not so much room.
    pub(super) fn show_image(&self, image: &Image, room: Room) {
        let [columns, rows] = self.room(room);
        let cell = self.screen.cell();
        let is_sent = matches!(self.screen.graphics, Graphics::Kitty | Graphics::Sixel);
        let most = match is_sent {
            true => [columns * cell[0], rows * cell[1]],
            false => [columns, 2 * rows],
        };
        let image = shrunk(image, most);
        let sent = match self.screen.graphics {
            Graphics::None => return,
            Graphics::Blocks => {
                let lines = cells::lines(&image, self.screen.colors);
                let is_seen = |line: &String| !line.is_empty();
                let first = lines.iter().position(is_seen).unwrap_or(0);
                let end = lines
                    .iter()
                    .rposition(is_seen)
                    .map_or(first, |last| last + 1);
                lines[first..end].iter().for_each(|line| output::data(line));
                return;
            }
            Graphics::Kitty => {
                let cells = [
                    image.width.div_ceil(cell[0]),
                    image.height.div_ceil(cell[1]),
                ];
                graphics::kitty(&image, cells)
            }
            Graphics::Sixel => graphics::sixel(&image),
        };
        match sent {
            Ok(sent) => output::data(&sent),
            Err(message) => output::data(&format!("no picture: {message}")),
        }
    }
}

/// The picture with at most so many pixels across and down: each is the mean of those that it takes
/// the place of, weighted by their opacity.
fn shrunk(image: &Image, [across, down]: [usize; 2]) -> Image {
    let factor = image
        .width
        .div_ceil(across.max(1))
        .max(image.height.div_ceil(down.max(1)));
    if factor <= 1 {
        return image.clone();
    }
    let [width, height] = [image.width.div_ceil(factor), image.height.div_ceil(factor)];
    let mean = |x: usize, y: usize| {
        let mut sums = [0_usize; 4];
        let mut count = 0;
        for row in y * factor..((y + 1) * factor).min(image.height) {
            for column in x * factor..((x + 1) * factor).min(image.width) {
                let [red, green, blue, opacity] =
                    image.pixels[row * image.width + column].map(usize::from);
                sums[0] += red * opacity;
                sums[1] += green * opacity;
                sums[2] += blue * opacity;
                sums[3] += opacity;
                count += 1;
            }
        }
        let light = |sum: usize| sum.checked_div(sums[3]).unwrap_or(0) as u8;
        let opacity = sums[3].checked_div(count).unwrap_or(0) as u8;
        [light(sums[0]), light(sums[1]), light(sums[2]), opacity]
    };
    Image {
        width,
        height,
        pixels: (0..width * height)
            .map(|place| mean(place % width, place / width))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_made_smaller_by_whole_factors() {
        let pixels = [
            [0, 0, 0, 255],
            [200, 100, 50, 255],
            [0, 0, 0, 0],
            [9, 9, 9, 0],
        ];
        let image = Image {
            width: 4,
            height: 1,
            pixels: pixels.to_vec(),
        };
        assert_eq!(shrunk(&image, [4, 1]), image);
        let half = shrunk(&image, [3, 9]);
        assert_eq!((half.width, half.height), (2, 1));
        assert_eq!(half.pixels, [[100, 50, 25, 255], [0, 0, 0, 0]]);
    }
}
