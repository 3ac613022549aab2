//! The command line.

use std::path::PathBuf;

use imp::engine::Tier;

/// What is measured and how.
pub struct Options {
    /// What executes Imp's programs.
    pub tier: Tier,
    /// Numbers of threads.
    pub threads: Vec<usize>,
    /// How often contenders take turns.
    pub rounds: usize,
    /// The file of the prospero field.
    pub prospero: Option<PathBuf>,
    /// A part of the names of the fields that are measured; all if there is none.
    pub only: Option<String>,
}

impl Options {
    /// Reads the words after the program's name. The error is a message for the user.
    pub fn read(mut words: impl Iterator<Item = String>) -> Result<Options, String> {
        let mut options = Options {
            tier: Tier::Automatic,
            threads: vec![1, 2],
            rounds: 9,
            prospero: std::env::var_os("PROSPERO").map(PathBuf::from),
            only: None,
        };
        while let Some(word) = words.next() {
            let value = words.next().ok_or(format!("`{word}` needs a value"))?;
            let number = |text: &str| match text.parse() {
                Ok(number) if number > 0 => Ok(number),
                _ => Err(format!("`{word}` takes numbers above 0, not `{text}`")),
            };
            match &word[..] {
                "--tier" => options.tier = tier(&value)?,
                "--threads" => {
                    options.threads = value.split(',').map(number).collect::<Result<_, _>>()?;
                }
                "--rounds" => options.rounds = number(&value)?,
                "--prospero" => options.prospero = Some(value.into()),
                "--only" => options.only = Some(value),
                _ => return Err(format!("there is no option `{word}`")),
            }
        }
        Ok(options)
    }
}

fn tier(name: &str) -> Result<Tier, String> {
    Tier::named(name).ok_or_else(|| {
        let names: Vec<&str> = Tier::ALL.iter().map(|(name, _)| *name).collect();
        format!("`--tier` takes {}, not `{name}`", names.join(", "))
    })
}
