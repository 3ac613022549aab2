//! The commands of a session: one table, from which they are found, explained and completed.

use super::super::info::{parameter_lines, setting_lines};
use super::super::output;
use super::echo;
use super::fields;
use super::files;
use super::session::{After, Repl};
use crate::diagnostic::Code;
use crate::diagnostic::suggest::nearest;
use crate::language::reference;
use crate::syntax::tree::StatementKind;

/// One command.
pub(super) struct Command {
    /// Its name, without the colon.
    pub(super) name: &'static str,
    /// What is written behind it.
    pub(super) arguments: &'static str,
    /// What it does, in a few words.
    summary: &'static str,
    /// What else there is to know.
    details: &'static str,
    /// How it is written.
    pub(super) example: &'static str,
    perform: fn(&mut Repl, &str) -> Result<After, u8>,
}

/// All commands, in the order in which `:help` lists them.
pub(super) const COMMANDS: &[Command] = &[
    Command {
        name: "help",
        arguments: "[COMMAND | NAME]",
        summary: "lists the commands, or explains one, or a name",
        details: "Without a word it lists the commands. `help` alone does the same.",
        example: ":help plot",
        perform: |repl, words| done(help(repl, words)),
    },
    Command {
        name: "doc",
        arguments: "NAME",
        summary: "what is said of a function, a field or a definition of the library",
        details: "For what the session defines it is the doc comment, the `##` lines above it.",
        example: ":doc smooth_union",
        perform: |repl, words| done(fields::document(repl, words)),
    },
    Command {
        name: "list",
        arguments: "",
        summary: "all that the session defines, in order",
        details: "What needs samples or meshes is made when it is first asked for.",
        example: ":list",
        perform: |repl, _| done(list(repl)),
    },
    Command {
        name: "params",
        arguments: "",
        summary: "parameters and settings with values and ranges",
        details: "`:set` changes them.",
        example: ":params",
        perform: |repl, _| done(parameters(repl)),
    },
    Command {
        name: "set",
        arguments: "NAME=EXPR | pictures on|off",
        summary: "gives a parameter or setting another value",
        details: "What depends on it is made again, as when its definition is given again. `:set pictures off` shows a field that is the last value without a picture.",
        example: ":set r=0.45",
        perform: |repl, words| done(set(repl, words)),
    },
    Command {
        name: "bounds",
        arguments: "F",
        summary: "a box that provably holds the whole zero set",
        details: "What the field's `over` says does not count, but is shown.",
        example: ":bounds torus",
        perform: |repl, words| done(fields::bounds(repl, words)),
    },
    Command {
        name: "check",
        arguments: "[F]",
        summary: "what is unusual about a field: constant, inside out, singular points",
        details: "Without a name all fields that have a domain are checked.",
        example: ":check torus",
        perform: |repl, words| done(fields::check(repl, words)),
    },
    Command {
        name: "at",
        arguments: "F POINT",
        summary: "value, gradient and Hessian at a point, and bounds in a small box around it",
        details: "The point is a list, or coordinates in parentheses. The bounds are guaranteed: they hold every value of the field in the box.",
        example: ":at torus [1.3, 0, 0.1]",
        perform: |repl, words| done(fields::at(repl, words)),
    },
    Command {
        name: "plot",
        arguments: "F, …",
        summary: "a picture in the terminal: a graph, a map or a lit solid",
        details: "Behind the field stand the arguments of `plot`, such as `view = \"top\"` or `bounds = -1..1`; with `path = \"a.png\"` the picture also goes to a file. It is shown by kitty's graphics or by sixels where the terminal has them, else by coloured half blocks, else by letters; the environment variable IMP_GRAPHICS (kitty, sixel, blocks, none) chooses.",
        example: ":plot torus, view = \"top\"",
        perform: |repl, words| done(fields::plot(repl, words)),
    },
    Command {
        name: "mesh",
        arguments: "F, …, [\"FILE\"]",
        summary: "polygonizes a field: triangles, curves or roots",
        details: "Behind the field stand the arguments of `polygonize`. The properties of what comes of it are shown, and it is written to a file if one is named.",
        example: ":mesh torus, cell = 0.2, \"torus.stl\"",
        perform: |repl, words| done(fields::mesh(repl, words)),
    },
    Command {
        name: "sample",
        arguments: "F, …, [\"FILE\"]",
        summary: "samples the zero set of a field with particles",
        details: "Behind the field stand the arguments of `sample`. The properties of the sample are shown, and it is written to a file if one is named.",
        example: ":sample torus, spacing = 0.3, \"torus.ply\"",
        perform: |repl, words| done(fields::sample(repl, words)),
    },
    Command {
        name: "time",
        arguments: "EXPR",
        summary: "evaluates an expression and says how long it takes",
        details: "Compilations are fields that became machine code for it; evaluations are told by samples, meshes and curves.",
        example: ":time polygonize(torus, cell = 0.2)",
        perform: |repl, words| done(fields::time(repl, words)),
    },
    Command {
        name: "graph",
        arguments: "F",
        summary: "the expression graph of a field",
        details: "Equal expressions are one node of it.",
        example: ":graph torus",
        perform: |repl, words| done(fields::graph(repl, words)),
    },
    Command {
        name: "clif",
        arguments: "F",
        summary: "Cranelift's intermediate representation of a field",
        details: "It is what machine code is made of.",
        example: ":clif torus",
        perform: |repl, words| done(fields::clif(repl, words)),
    },
    Command {
        name: "load",
        arguments: "FILE",
        summary: "begins a new session with the definitions of a file",
        details: "Its definitions are run, and what changes its `var`s; what else it does (print, export) is left out. `:undo` brings the session before it back.",
        example: ":load examples/torus.imp",
        perform: |repl, words| done(files::load(repl, words)),
    },
    Command {
        name: "reload",
        arguments: "",
        summary: "reads the loaded file again",
        details: "The session begins anew with it; `:undo` brings what was typed back.",
        example: ":reload",
        perform: |repl, _| done(files::reload(repl)),
    },
    Command {
        name: "save",
        arguments: "FILE",
        summary: "writes a file that gives the same session when it is loaded",
        details: "A file that is there already is not replaced, except with `:save! FILE`. The comments right above a definition go along.",
        example: ":save session.imp",
        perform: |repl, words| done(files::save(repl, words, false)),
    },
    Command {
        name: "undo",
        arguments: "",
        summary: "takes the last input back",
        details: "Again, it takes the one before back; files that were written stay.",
        example: ":undo",
        perform: |repl, _| done(files::undo(repl)),
    },
    Command {
        name: "quit",
        arguments: "",
        summary: "ends the session",
        details: "`quit`, `exit` and Ctrl-D do the same.",
        example: ":quit",
        perform: |_, _| Ok(After::End),
    },
];

/// Words that are commands without a colon.
const WORDS: &[&str] = &["help", "quit", "exit"];

fn done(result: Result<(), u8>) -> Result<After, u8> {
    result.map(|()| After::Next)
}

/// Whether a line is a command: it begins with a colon, or is one of a few words.
pub(super) fn is_command(line: &str) -> bool {
    let line = line.trim();
    line.starts_with(':') || WORDS.contains(&line)
}

/// Performs a command.
pub(super) fn perform(repl: &mut Repl, line: &str) -> Result<After, u8> {
    let line = line.strip_prefix(':').unwrap_or(line);
    let (name, words) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let words = words.trim();
    if let Some(command) = find(name) {
        return (command.perform)(repl, words);
    }
    match name {
        "save!" => return done(files::save(repl, words, true)),
        "exit" => return Ok(After::End),
        _ => {}
    }
    let shown = crate::diagnostic::shorten(name);
    let message = match name {
        "" => "a command is needed behind the colon".into(),
        _ => format!("there is no command `:{shown}`"),
    };
    let names = COMMANDS.iter().map(|command| command.name);
    let help = match nearest(name, names) {
        Some(near) => format!("did you mean `:{near}`?"),
        None => "`:help` lists the commands".into(),
    };
    Err(repl.refuse(Code::UnknownName, message, &help))
}

/// The command of that name, or the only one that begins so.
fn find(name: &str) -> Option<&'static Command> {
    let exact = COMMANDS.iter().find(|command| command.name == name);
    exact.or_else(|| {
        let mut near = COMMANDS
            .iter()
            .filter(|command| !name.is_empty() && command.name.starts_with(name));
        near.next().filter(|_| near.next().is_none())
    })
}

fn help(repl: &mut Repl, words: &str) -> Result<(), u8> {
    if words.is_empty() {
        let width = COMMANDS.iter().map(|command| command.name.len()).max();
        let width = width.unwrap_or(0) + 1;
        for command in COMMANDS {
            let name = format!(":{}", command.name);
            output::data(&format!("{name:width$}  {}", command.summary));
        }
        output::data(&format!(
            "{:width$}  what is typed without a colon is run; `ans` is the last value",
            ""
        ));
        return Ok(());
    }
    match find(words.trim_start_matches(':')) {
        Some(command) => {
            output::data(format!(":{} {}", command.name, command.arguments).trim_end());
            output::data(command.summary);
            output::data(command.details);
            output::data(&format!("Example: {}", command.example));
            Ok(())
        }
        None => fields::document(repl, words),
    }
}

fn list(repl: &mut Repl) -> Result<(), u8> {
    let statements = repl.workspace.session.statements();
    let mut lines = Vec::new();
    for statement in &statements {
        lines.extend(echo::of_definition(repl, statement));
    }
    if lines.is_empty() {
        lines.push("nothing is defined yet".into());
    }
    lines.iter().for_each(|line| output::data(line));
    Ok(())
}

fn parameters(repl: &mut Repl) -> Result<(), u8> {
    let mut lines = parameter_lines(&repl.workspace);
    lines.extend(setting_lines(&repl.workspace));
    if lines.is_empty() {
        lines.push("no parameters and no settings".into());
    }
    lines.iter().for_each(|line| output::data(line));
    Ok(())
}

fn set(repl: &mut Repl, words: &str) -> Result<(), u8> {
    match words.split_whitespace().collect::<Vec<_>>()[..] {
        ["pictures"] => {
            output::data(match repl.pictures {
                true => "pictures on",
                false => "pictures off",
            });
            return Ok(());
        }
        ["pictures", "on"] => repl.pictures = true,
        ["pictures", "off"] => repl.pictures = false,
        _ => {
            let Some((name, text)) = words.split_once('=') else {
                let help = "write `:set NAME=EXPR`, or `:set pictures off`";
                return Err(repl.refuse(Code::Usage, "nothing is said to be set", help));
            };
            return set_value(repl, name.trim(), text.trim());
        }
    }
    Ok(())
}

/// Gives a parameter or setting of the session another value: its definition is given again with
/// the same range and documentation.
pub(super) fn set_value(repl: &mut Repl, name: &str, text: &str) -> Result<(), u8> {
    let statements = repl.workspace.session.statements();
    let found = statements
        .iter()
        .find_map(|statement| match &statement.kind {
            StatementKind::Parameter {
                name: own, value, ..
            }
            | StatementKind::Setting {
                name: own, value, ..
            } if *own.text == *name => Some((statement, value.span)),
            _ => None,
        });
    let Some((statement, value)) = found else {
        let names = reference_names(repl);
        let help = match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => "the session has no parameters and no settings".into(),
            None => format!("what can be set is {}", names.join(", ")),
        };
        let name = crate::diagnostic::shorten(name);
        let message = format!("there is no parameter or setting `{name}` to set");
        return Err(repl.refuse(Code::UnknownParameter, message, &help));
    };
    // The value is checked alone first, so that it cannot become part of something else.
    repl.expression(text)?;
    let documentation = statement.documentation.as_deref().unwrap_or_default();
    let above: String = documentation
        .lines()
        .map(|line| format!("## {line}\n"))
        .collect();
    let written = {
        let sources = repl.workspace.heard.sources.borrow();
        let source = &sources.get(statement.span.source).text;
        let [begin, end] = [statement.span.start, statement.span.end].map(|at| at as usize);
        let [value_begin, value_end] = [value.start, value.end].map(|at| at as usize);
        format!(
            "{above}{}{text}{}",
            &source[begin..value_begin],
            &source[value_end..end]
        )
    };
    repl.enter(&written)
}

/// The names of parameters and settings.
fn reference_names(repl: &Repl) -> Vec<String> {
    let session = &repl.workspace.session;
    let parameters = session
        .parameters()
        .iter()
        .map(|(name, _)| name.to_string());
    let settings = session.settings().iter().map(|(name, _)| name.to_string());
    parameters.chain(settings).collect()
}

/// All names that something is said of.
pub(super) fn documented_names() -> Vec<String> {
    reference::names()
}
