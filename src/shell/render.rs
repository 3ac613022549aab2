//! `imp render`: the language's `plot` with its arguments as flags, and a file for the picture.

use super::arguments::Render;
use super::make::{make, quoted};

/// Makes a picture of a field; fails with an exit code.
pub(super) fn render(command: &Render) -> Result<(), u8> {
    let size = command.size.as_deref().map(size);
    let style = command.style.as_deref().map(quoted);
    let view = command.view.as_deref().map(view);
    let perspective = command.perspective.map(|degrees| format!("{degrees}deg"));
    let switch = |is_on: bool| is_on.then_some("true");
    let flags = [
        ("size", size.as_deref()),
        ("style", style.as_deref()),
        ("step", command.step.as_deref()),
        ("view", view.as_deref()),
        ("perspective", perspective.as_deref()),
        ("whole", switch(command.whole)),
        ("occlusion", switch(command.occlusion)),
        ("samples", command.samples.as_deref()),
        ("transparent", switch(command.transparent)),
    ];
    make("plot", &command.subject, &flags, &command.common)
}

/// `800x600` as the language's list; anything else as it is.
fn size(text: &str) -> String {
    match text.split_once(['x', 'X']) {
        Some((width, height)) if is_whole(width) && is_whole(height) => {
            format!("[{width}, {height}]")
        }
        _ => text.to_owned(),
    }
}

fn is_whole(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// `30,20` as the language's list of two angles; anything else as a name.
fn view(text: &str) -> String {
    let angles: Vec<f64> = text
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .collect();
    match (&angles[..], text.split(',').count()) {
        (&[azimuth, elevation], 2) => format!("[{azimuth}deg, {elevation}deg]"),
        _ => quoted(text),
    }
}
