//! The keyboard while something is computed.
//!
//! Between two inputs a terminal would collect what is typed into lines, of which it keeps no more
//! than 4,096 bytes and loses the rest, show it in the midst of what is printed, and take Ctrl-D for
//! an end. So what is typed is made to wait instead, for as long as a session lasts; Ctrl-C stays a signal.

#[cfg(unix)]
mod modes {
    use rustix::termios::{
        LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcsetattr,
    };

    /// Sets the keyboard back to what it was when it goes.
    pub(in super::super) struct Keyboard {
        before: Option<Termios>,
    }

    impl Keyboard {
        /// Lets what is typed wait for the line editor.
        pub(in super::super) fn waiting() -> Keyboard {
            let stdin = std::io::stdin();
            let Ok(before) = tcgetattr(&stdin) else {
                return Keyboard { before: None };
            };
            let mut modes = before.clone();
            modes
                .local_modes
                .remove(LocalModes::ICANON | LocalModes::ECHO);
            modes.special_codes[SpecialCodeIndex::VMIN] = 1;
            modes.special_codes[SpecialCodeIndex::VTIME] = 0;
            let is_set = tcsetattr(&stdin, OptionalActions::Drain, &modes).is_ok();
            Keyboard {
                before: is_set.then_some(before),
            }
        }
    }

    impl Drop for Keyboard {
        fn drop(&mut self) {
            if let Some(before) = &self.before {
                // A terminal that is gone needs no setting back.
                let _ = tcsetattr(std::io::stdin(), OptionalActions::Drain, before);
            }
        }
    }
}

#[cfg(not(unix))]
mod modes {
    /// Nothing needs to be set back here.
    pub(in super::super) struct Keyboard;

    impl Keyboard {
        /// What is typed waits as it is.
        pub(in super::super) fn waiting() -> Keyboard {
            Keyboard
        }
    }
}

pub(super) use modes::Keyboard;
