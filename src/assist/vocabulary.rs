//! The language's own names: functions, constants, the library, what can stand behind a point and
//! in the strings that a function understands.

use std::sync::{Arc, LazyLock};

use rustc_hash::FxHashMap;

use super::complete::Kind;
use super::highlight::Class;
use super::surroundings::{Known, parameters};
use crate::language::builtin;
use crate::language::product;
use crate::language::reference;
use crate::library::{self, Entry};

static ALL: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let functions = builtin::all().iter().map(|function| Known {
        documentation: Some(Arc::from(function.documentation)),
        parameters: function.parameters.iter().map(|&one| one.into()).collect(),
        ..Known::new(function.name, Kind::Function, function.signature())
    });
    let constants = builtin::CONSTANTS
        .iter()
        .map(|(name, value)| Known::new(*name, Kind::Constant, format!("a number = {value}")));
    let namespaces = library::namespaces().map(|namespace| Known {
        documentation: Some(Arc::from(namespace.title)),
        members: entries(Some(namespace.name)).collect(),
        ..Known::new(namespace.name, Kind::Module, "a module of the library")
    });
    let mut all: Vec<Known> = functions
        .chain(constants)
        .chain(namespaces)
        .chain(entries(None))
        .collect();
    all.sort_by(|left, right| left.name.cmp(&right.name));
    all
});

static PLACES: LazyLock<FxHashMap<&'static str, usize>> = LazyLock::new(|| {
    let names = ALL.iter().map(|known| &*known.name);
    names.zip(0..).collect()
});

static PROPERTIES: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let mut properties: Vec<Known> = Vec::new();
    for (kind, name) in product::all_properties() {
        match properties.iter_mut().find(|known| &*known.name == name) {
            Some(known) => known.detail = format!("{}, {kind}", known.detail),
            None => properties.push(Known::new(name, Kind::Property, format!("of {kind}"))),
        }
    }
    properties
});

/// All names of the language, in alphabetical order.
pub fn all() -> &'static [Known] {
    &ALL
}

/// What is known of one of them; a member of a namespace is written with its point.
pub fn find(name: &str) -> Option<&'static Known> {
    match name.split_once('.') {
        Some((namespace, member)) => {
            let members = &find(namespace)?.members;
            members.iter().find(|known| &*known.name == member)
        }
        None => PLACES.get(name).map(|&place| &ALL[place]),
    }
}

/// The class of one of them.
pub(super) fn class(name: &str) -> Option<Class> {
    Some(find(name)?.kind.class())
}

/// Everything that can be a property of something.
pub(super) fn properties() -> &'static [Known] {
    &PROPERTIES
}

/// The strings that a function takes for a parameter.
pub(super) fn choices(function: &str, parameter: &str) -> Vec<&'static str> {
    builtin::find(function).map_or_else(Vec::new, |function| builtin::choices(function, parameter))
}

fn entries(namespace: Option<&'static str>) -> impl Iterator<Item = Known> {
    let entries = library::entries().iter();
    entries
        .filter(move |entry| entry.namespace == namespace)
        .map(of_entry)
}

fn of_entry(entry: &Entry) -> Known {
    let signature = reference::signature(entry);
    let is_field = entry.text.lines().any(|line| line.starts_with("field "));
    let kind = match (is_field, signature.contains('(')) {
        (true, _) => Kind::Field,
        (_, true) => Kind::Function,
        _ => Kind::Constant,
    };
    let documentation: Vec<&str> = entry.documentation().collect();
    Known {
        parameters: match kind {
            Kind::Function => parameters(&signature),
            _ => Vec::new(),
        },
        documentation: Some(Arc::from(documentation.join("\n"))),
        ..Known::new(Arc::clone(&entry.name), kind, signature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_all_sorts_are_known() {
        let kind = |name| find(name).map(|known| known.kind);
        assert_eq!(kind("polygonize"), Some(Kind::Function));
        assert_eq!(kind("sin"), Some(Kind::Function));
        assert_eq!(kind("sphere"), Some(Kind::Function));
        assert_eq!(kind("pi"), Some(Kind::Constant));
        assert_eq!(kind("ease"), Some(Kind::Module));
        assert_eq!(kind("no_such_name"), None);
        assert_eq!(kind("ease.no_such_name"), None);
        let members = find("ease").map_or(0, |known| known.members.len());
        assert!(members > 3);
    }

    #[test]
    fn every_name_of_the_reference_is_known() {
        for name in reference::names() {
            assert!(find(&name).is_some(), "{name}");
        }
    }
}
