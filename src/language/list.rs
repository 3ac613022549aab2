//! Lists, which know their size: how many elements there are in all their sublists, how deep
//! they are nested, and whether anything in them is symbolic or unknown.
//!
//! `[x, x]` shares x, so a short script can describe a list that no machine could walk; and
//! `[x]` in a loop nests it deeper than any stack. With the size at hand both are refused when
//! they are made.

use std::cell::Cell;
use std::ops::Deref;
use std::rc::Rc;

use super::value::Value;

thread_local! {
    /// Elements of all lists that are alive.
    static ALIVE: Cell<u64> = const { Cell::new(0) };
}

/// A list; cheap to clone. It is a slice of its elements.
#[derive(Clone, Debug)]
pub struct List(Rc<Contents>);

#[derive(Debug)]
struct Contents {
    elements: Vec<Value>,
    /// Elements that are not lists, in all sublists, each as often as it occurs.
    leaves: u64,
    depth: u32,
    symbolic: bool,
    unknown: bool,
    function: bool,
}

impl List {
    /// A list of these elements. Takes time in proportion to their number.
    pub fn new(elements: Vec<Value>) -> List {
        ALIVE.set(ALIVE.get() + elements.len() as u64);
        let mut contents = Contents {
            leaves: 0,
            depth: 1,
            symbolic: false,
            unknown: false,
            function: false,
            elements: Vec::new(),
        };
        for element in &elements {
            contents.count(element);
        }
        contents.elements = elements;
        List(Rc::new(contents))
    }

    /// Changes one element; in place if nobody else has the list. What the list says of its
    /// depth, symbols and unknown elements is then an upper bound.
    pub fn change<T>(&mut self, index: usize, change: impl FnOnce(&mut Value) -> T) -> T {
        let contents = Rc::make_mut(&mut self.0);
        let mut element = std::mem::replace(&mut contents.elements[index], Value::Nothing);
        contents.leaves = contents.leaves.saturating_sub(size(&element).0);
        let result = change(&mut element);
        contents.count(&element);
        contents.elements[index] = element;
        result
    }

    /// Elements that are not lists, in all sublists, each as often as it occurs.
    pub fn leaves(&self) -> u64 {
        self.0.leaves
    }

    /// How deep lists are nested: 1 for a list without sublists.
    pub fn depth(&self) -> u32 {
        self.0.depth
    }

    /// Whether a symbol occurs in it.
    pub fn is_symbolic(&self) -> bool {
        self.0.symbolic
    }

    /// Whether something unknown occurs in it.
    pub fn is_unknown(&self) -> bool {
        self.0.unknown
    }

    /// Whether a function occurs in it.
    pub fn has_function(&self) -> bool {
        self.0.function
    }

    /// Elements of all lists of this thread that are alive.
    pub fn alive() -> u64 {
        ALIVE.get()
    }
}

impl Contents {
    fn count(&mut self, element: &Value) {
        let (leaves, depth) = size(element);
        self.leaves = self.leaves.saturating_add(leaves);
        self.depth = self.depth.max(depth);
        self.symbolic |= element.is_symbolic();
        self.unknown |= element.is_unknown();
        self.function |= element.has_function();
    }
}

/// Leaves of an element, and the depth of a list that holds it.
fn size(element: &Value) -> (u64, u32) {
    match element {
        Value::List(list) => (list.leaves(), list.depth() + 1),
        _ => (1, 1),
    }
}

impl Clone for Contents {
    fn clone(&self) -> Self {
        ALIVE.set(ALIVE.get() + self.elements.len() as u64);
        Contents {
            elements: self.elements.clone(),
            leaves: self.leaves,
            depth: self.depth,
            symbolic: self.symbolic,
            unknown: self.unknown,
            function: self.function,
        }
    }
}

impl Drop for Contents {
    fn drop(&mut self) {
        ALIVE.set(ALIVE.get().saturating_sub(self.elements.len() as u64));
    }
}

impl Deref for List {
    type Target = [Value];

    fn deref(&self) -> &[Value] {
        &self.0.elements
    }
}
