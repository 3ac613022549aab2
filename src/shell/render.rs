//! `imp render`: the language's `plot` with its arguments as flags, and a file for the picture.

use super::arguments::{Direction, Pixels, Render};
use super::make::{Further, make, quoted};

/// Makes a picture of a field; fails with an exit code.
pub(super) fn render(command: &Render) -> Result<(), u8> {
    let size = command.size.map(size);
    let style = command.style.as_deref().map(quoted);
    let view = command.view.as_ref().map(view);
    let perspective = command.perspective.map(|degrees| format!("{degrees}deg"));
    let samples = command.samples.map(|count| count.to_string());
    let switch = |is_on: bool| is_on.then_some("true");
    let flags = [
        ("size", size.as_deref()),
        ("style", style.as_deref()),
        ("step", command.step.as_deref()),
        ("view", view.as_deref()),
        ("perspective", perspective.as_deref()),
        ("whole", switch(command.whole)),
        ("occlusion", switch(command.occlusion)),
        ("samples", samples.as_deref()),
        ("transparent", switch(command.transparent)),
    ];
    make(
        "plot",
        &command.subject,
        &flags,
        &command.common,
        Further::Nothing,
    )
}

/// A size as the language's number or list.
fn size(pixels: Pixels) -> String {
    match pixels {
        Pixels::Longest(longest) => longest.to_string(),
        Pixels::Exact(width, height) => format!("[{width}, {height}]"),
    }
}

/// A view as the language's name or list of two angles.
fn view(direction: &Direction) -> String {
    match direction {
        Direction::Named(name) => quoted(name),
        Direction::Angles(azimuth, elevation) => format!("[{azimuth}deg, {elevation}deg]"),
    }
}
