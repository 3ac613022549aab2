//! What the terminal can show: its size, its colours, and whether it understands graphics.

use std::env;
use std::time::Duration;

use super::super::arguments::{Color, Common};

/// So long a terminal is waited for that does not say what it understands.
const PATIENCE: Duration = Duration::from_millis(150);

/// Where the size is not known.
const USUAL_SIZE: [usize; 2] = [80, 24];

/// Pixels of a character where the terminal does not say.
const USUAL_CELL: [usize; 2] = [10, 20];

/// The colours that a terminal has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colors {
    /// None: shades are made of characters.
    None,
    /// The 256 of xterm.
    Indexed,
    /// 24 bits.
    True,
}

/// How pictures are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Graphics {
    /// By kitty's protocol.
    Kitty,
    /// By sixels.
    Sixel,
    /// By characters that are half a cell high, or by letters where there are no colours.
    Blocks,
    /// Not at all.
    None,
}

/// What the terminal can show.
#[derive(Clone, Debug)]
pub(super) struct Screen {
    pub(super) colors: Colors,
    pub(super) graphics: Graphics,
    /// Whether the line editor can move about on it.
    pub(super) has_editor: bool,
    /// Whether it is a terminal.
    is_terminal: bool,
    /// Whether it is to be asked what it understands.
    is_unsure: bool,
}

impl Screen {
    /// The terminal that the program runs in, as its environment describes it.
    pub(super) fn of_terminal(common: &Common) -> Screen {
        let environment = Environment::read();
        let is_dumb = environment.is_dumb();
        let colors = match common.color {
            Color::Never => Colors::None,
            Color::Always => environment.colors().max_256(),
            Color::Auto if is_dumb || environment.refuses_color => Colors::None,
            Color::Auto => environment.colors(),
        };
        let chosen = environment.chosen();
        let graphics = match chosen {
            Some(graphics) => graphics,
            None if colors != Colors::None && environment.has_kitty_graphics() => Graphics::Kitty,
            None => Graphics::Blocks,
        };
        Screen {
            colors,
            graphics,
            has_editor: !environment.is_plain(),
            is_terminal: true,
            is_unsure: chosen.is_none()
                && graphics == Graphics::Blocks
                && colors != Colors::None
                && !environment.is_multiplexed,
        }
    }

    /// Where a pipe or a file takes what is shown.
    pub(super) fn without_terminal() -> Screen {
        let graphics = Environment::read().chosen();
        Screen {
            colors: Colors::None,
            graphics: graphics.unwrap_or(Graphics::Blocks),
            has_editor: false,
            is_terminal: false,
            is_unsure: false,
        }
    }

    /// Asks a terminal of which nothing else is known whether it shows sixels; gives what was typed
    /// meanwhile.
    pub(super) fn ask_for_graphics(&mut self) -> String {
        if !std::mem::take(&mut self.is_unsure) {
            return String::new();
        }
        let heard = ask::device_attributes(PATIENCE);
        let (attributes, typed) = split_answer(&heard);
        // Attribute 4 is sixel graphics.
        if attributes.contains(&4) {
            self.graphics = Graphics::Sixel;
        }
        typed
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [usize; 2] {
        match self.is_terminal {
            true => ask::size().unwrap_or(USUAL_SIZE),
            false => USUAL_SIZE,
        }
    }

    /// The pixels of a character, across and down.
    pub(super) fn cell(&self) -> [usize; 2] {
        ask::cell()
            .filter(|_| self.is_terminal)
            .unwrap_or(USUAL_CELL)
    }

    /// Text that is less important than what stands around it.
    pub(super) fn dim(&self, text: &str) -> String {
        match self.colors {
            Colors::None => text.to_string(),
            _ => format!("\u{1b}[2m{text}\u{1b}[22m"),
        }
    }

    /// A value and its kind.
    pub(super) fn with_kind(&self, text: &str, kind: &str) -> String {
        format!("{text} {}", self.dim(&format!(": {kind}")))
    }
}

impl Colors {
    fn max_256(self) -> Colors {
        match self {
            Colors::None => Colors::Indexed,
            other => other,
        }
    }
}

/// What the environment says about the terminal.
struct Environment {
    term: String,
    program: String,
    color_term: String,
    graphics: String,
    is_kitty: bool,
    /// Whether it runs inside of tmux or screen, which let no graphics through.
    is_multiplexed: bool,
    refuses_color: bool,
}

impl Environment {
    fn read() -> Environment {
        let text = |name| env::var(name).unwrap_or_default();
        let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
        let term = text("TERM");
        Environment {
            is_kitty: is_set("KITTY_WINDOW_ID"),
            is_multiplexed: is_set("TMUX")
                || term.starts_with("screen")
                || term.starts_with("tmux"),
            refuses_color: is_set("NO_COLOR"),
            program: text("TERM_PROGRAM").to_lowercase(),
            color_term: text("COLORTERM").to_lowercase(),
            graphics: text("IMP_GRAPHICS").to_lowercase(),
            term,
        }
    }

    /// Whether it is one of those that the line editor takes for a typewriter.
    fn is_plain(&self) -> bool {
        matches!(&*self.term, "dumb" | "cons25" | "emacs")
    }

    fn is_dumb(&self) -> bool {
        self.term.is_empty() || self.is_plain()
    }

    fn colors(&self) -> Colors {
        let has_all = matches!(&*self.color_term, "truecolor" | "24bit")
            || self.term.ends_with("-direct")
            || self.has_kitty_graphics();
        match has_all {
            true => Colors::True,
            false => Colors::Indexed,
        }
    }

    /// What was asked for by `IMP_GRAPHICS`.
    fn chosen(&self) -> Option<Graphics> {
        Some(match &*self.graphics {
            "kitty" => Graphics::Kitty,
            "sixel" => Graphics::Sixel,
            "blocks" => Graphics::Blocks,
            "none" => Graphics::None,
            _ => return None,
        })
    }

    fn has_kitty_graphics(&self) -> bool {
        let known = ["kitty", "ghostty", "wezterm"];
        let is_known = known
            .iter()
            .any(|name| self.program == *name || self.term == format!("xterm-{name}"));
        (self.is_kitty || is_known) && !self.is_multiplexed
    }
}

/// The attributes in a terminal's answer `ESC [ ? 62 ; 4 c`, and what stands around it.
fn split_answer(heard: &[u8]) -> (Vec<u32>, String) {
    let text = String::from_utf8_lossy(heard);
    let begin = text.find("\u{1b}[?");
    let end = begin.and_then(|begin| text[begin..].find('c').map(|length| begin + length));
    let (attributes, typed) = match (begin, end) {
        (Some(begin), Some(end)) => {
            let numbers = text[begin + 3..end].split(';');
            let attributes = numbers.filter_map(|number| number.parse().ok()).collect();
            (
                attributes,
                format!("{}{}", &text[..begin], &text[end + 1..]),
            )
        }
        _ => (Vec::new(), text.into_owned()),
    };
    let typed = typed
        .chars()
        .filter(|letter| !letter.is_control())
        .collect();
    (attributes, typed)
}

/// What can only be learnt from the terminal itself.
#[cfg(unix)]
mod ask {
    use std::io::Write;
    use std::time::{Duration, Instant};

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::termios::{OptionalActions, tcgetattr, tcgetwinsize, tcsetattr};

    /// Columns and rows; nothing where the terminal does not know.
    pub(super) fn size() -> Option<[usize; 2]> {
        let size = tcgetwinsize(std::io::stdout()).ok()?;
        let [columns, rows] = [size.ws_col, size.ws_row].map(usize::from);
        (columns > 0 && rows > 0).then_some([columns, rows])
    }

    /// Pixels of a character; nothing where the terminal does not know.
    pub(super) fn cell() -> Option<[usize; 2]> {
        let size = tcgetwinsize(std::io::stdout()).ok()?;
        let [width, height] = [size.ws_xpixel, size.ws_ypixel].map(usize::from);
        let cell = [
            width.checked_div(size.ws_col.into())?,
            height.checked_div(size.ws_row.into())?,
        ];
        (cell[0] > 0 && cell[1] > 0).then_some(cell)
    }

    /// What comes when the terminal is asked for its primary device attributes (DA1): the answer,
    /// what is typed meanwhile, or nothing in time.
    pub(super) fn device_attributes(patience: Duration) -> Vec<u8> {
        let stdin = std::io::stdin();
        let Ok(usual) = tcgetattr(&stdin) else {
            return Vec::new();
        };
        let mut raw = usual.clone();
        raw.make_raw();
        if tcsetattr(&stdin, OptionalActions::Now, &raw).is_err() {
            return Vec::new();
        }
        let heard = answer(patience);
        // If this fails the line editor sets what it needs all the same.
        let _ = tcsetattr(&stdin, OptionalActions::Now, &usual);
        heard
    }

    fn answer(patience: Duration) -> Vec<u8> {
        let mut heard = Vec::new();
        let mut stdout = std::io::stdout().lock();
        if stdout
            .write_all(b"\x1b[c")
            .and_then(|()| stdout.flush())
            .is_err()
        {
            return heard;
        }
        let end = Instant::now() + patience;
        let stdin = std::io::stdin();
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let Ok(time) = Timespec::try_from(left) else {
                return heard;
            };
            let mut descriptors = [PollFd::new(&stdin, PollFlags::IN)];
            let is_ready = matches!(poll(&mut descriptors, Some(&time)), Ok(count) if count > 0);
            let mut bytes = [0; 64];
            // Not through the buffer of the standard library, which would keep what it took.
            let count = match is_ready {
                true => rustix::io::read(&stdin, &mut bytes).unwrap_or(0),
                false => 0,
            };
            heard.extend_from_slice(&bytes[..count]);
            let is_whole = heard
                .windows(3)
                .position(|start| start == b"\x1b[?")
                .is_some_and(|start| heard[start..].contains(&b'c'));
            if count == 0 || is_whole {
                return heard;
            }
        }
    }
}

/// What can only be learnt from the terminal itself.
#[cfg(not(unix))]
mod ask {
    use std::time::Duration;

    /// Not known here.
    pub(super) fn size() -> Option<[usize; 2]> {
        None
    }

    /// Not known here.
    pub(super) fn cell() -> Option<[usize; 2]> {
        None
    }

    /// Nothing is asked.
    pub(super) fn device_attributes(_patience: Duration) -> Vec<u8> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terminal_s_answer_is_told_from_what_was_typed() {
        let (attributes, typed) = split_answer(b"1+\x1b[?62;4;22c2\r");
        assert_eq!(attributes, [62, 4, 22]);
        assert_eq!(typed, "1+2");
        assert_eq!(split_answer(b"let"), (Vec::new(), "let".into()));
        assert_eq!(split_answer(b"\x1b[?6"), (Vec::new(), "[?6".into()));
    }
}
