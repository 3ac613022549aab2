//! Documents that know where their lines may end, and the choice of where they do.
//!
//! A document is a flat list of items, made in the order of the text: words, places where a line may
//! end, and the ends of groups. The lines of a group end at all of its places or at none, depending
//! on whether it fits on the rest of the line (the algebra of P. Wadler, "A prettier printer", 2003,
//! printed from left to right as by D. Oppen, "Pretty printing", 1980). Widths are summed once from
//! the end to the start, so that every choice takes constant time and the whole linear time,
//! without recursion.
//!
//! A comment behind code ends its line, whatever follows, and so it breaks the groups around it.

/// Columns of a line; what cannot be broken may be longer.
pub(super) const WIDTH: usize = 100;

/// Spaces of one step to the right.
const STEP: usize = 4;

/// One step in a document.
#[derive(Clone, Copy, Debug)]
enum Item<'text> {
    /// A word that begins on a new line if the line at hand has a comment already.
    Word(&'text str),
    /// Characters that may follow before the comment of their line: an operator or a comma.
    Attached(&'text str),
    /// A space, except at the start of a line.
    Space,
    /// The end of a line where the group around it is broken, else `flat`.
    Line { flat: &'static str, blank: bool },
    /// The end of a line where the group around it is broken and what comes up to `until` does not
    /// fit on this line, else `flat`.
    Fill { flat: &'static str, until: usize },
    /// The end of a line, and an empty line where there is one already written.
    Break { blank: bool },
    /// Text where the group around it is broken.
    IfBroken(&'static str),
    /// A comment behind code.
    Trailing(&'text str),
    /// A comment on a line of its own.
    OwnLine(&'text str),
    /// Begins a group, which is broken if that helps it or what comes to stand behind it.
    Open(Extent),
    /// Ends the innermost group.
    Close,
    /// Lines from here on begin one step further right if the group around this is broken.
    Indent,
    /// Ends the innermost [`Item::Indent`].
    Dedent,
}

/// What decides whether a group is broken.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    /// What comes up to here, by its index, must fit.
    head: usize,
    /// The part that may have lines of its own begins here, or before `head`.
    until: usize,
    /// Between `head` and here lines of its own may stand, but not from here to `end`.
    resumes: usize,
    end: usize,
    /// It is broken in any case.
    forced: bool,
    /// It is broken only if all of it fits on the next line.
    shy: bool,
}

/// A group of a document that is being made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group(usize);

/// A place in a document where a line may end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place(usize);

/// A document, made from start to end.
#[derive(Debug, Default)]
pub(super) struct Document<'text> {
    items: Vec<Item<'text>>,
    /// A comment that goes behind the groups that end here.
    trailing: Option<&'text str>,
}

impl<'text> Document<'text> {
    fn push(&mut self, item: Item<'text>) {
        if let Some(comment) = self.trailing.take() {
            self.items.push(Item::Trailing(comment));
        }
        self.items.push(item);
    }

    /// A word of the program.
    pub(super) fn word(&mut self, text: &'text str) {
        self.push(Item::Word(text));
    }

    /// An operator, which may stand before the comment of its line.
    pub(super) fn attached(&mut self, text: &'text str) {
        self.push(Item::Attached(text));
    }

    /// A comma, before the comment that stands behind what was written last.
    pub(super) fn comma(&mut self) {
        self.items.push(Item::Attached(","));
    }

    /// A space.
    pub(super) fn space(&mut self) {
        self.push(Item::Space);
    }

    /// What separates words on a line, at most one space.
    pub(super) fn gap(&mut self, gap: &'static str) {
        if !gap.is_empty() {
            self.space();
        }
    }

    /// A place where the line ends if the innermost group is broken, and an empty line follows if
    /// asked for; else `flat` stands there.
    pub(super) fn line(&mut self, flat: &'static str, blank: bool) {
        self.push(Item::Line { flat, blank });
    }

    /// The end of a line in any case, and an empty line if asked for.
    pub(super) fn end_line(&mut self, blank: bool) {
        self.push(Item::Break { blank });
    }

    /// A place where the line ends if that is needed; [`Document::filled`] says up to where.
    pub(super) fn fill(&mut self, flat: &'static str) -> Place {
        self.push(Item::Fill { flat, until: 0 });
        Place(self.items.len() - 1)
    }

    /// What comes up to here belongs on one line with the place before it.
    pub(super) fn filled(&mut self, place: Place) {
        let end = self.items.len();
        if let Item::Fill { until, .. } = &mut self.items[place.0] {
            *until = end;
        }
    }

    /// Text that stands only where the innermost group is broken.
    pub(super) fn if_broken(&mut self, text: &'static str) {
        self.push(Item::IfBroken(text));
    }

    /// A comment behind what was written last: behind the groups that end there, too.
    pub(super) fn trailing_comment(&mut self, text: &'text str) {
        if let Some(before) = self.trailing.replace(text) {
            self.items.push(Item::Trailing(before));
        }
    }

    /// A comment on a line of its own.
    pub(super) fn own_line_comment(&mut self, text: &'text str) {
        self.push(Item::OwnLine(text));
    }

    /// Begins a group.
    pub(super) fn open(&mut self) -> Group {
        self.push(Item::Open(Extent::default()));
        Group(self.items.len() - 1)
    }

    /// Begins a group that is broken only where all of it fits on the next line.
    pub(super) fn open_shy(&mut self) -> Group {
        self.push(Item::Open(Extent {
            shy: true,
            ..Extent::default()
        }));
        Group(self.items.len() - 1)
    }

    fn change(&mut self, group: Group, change: impl FnOnce(&mut Extent)) {
        if let Item::Open(extent) = &mut self.items[group.0] {
            change(extent);
        }
    }

    /// The group is broken in any case.
    pub(super) fn force(&mut self, group: Group) {
        self.change(group, |extent| extent.forced = true);
    }

    /// From here on the group may have lines of its own without being broken.
    pub(super) fn measure_to_here(&mut self, group: Group) {
        let here = self.items.len();
        self.change(group, |extent| (extent.until, extent.head) = (here, here));
    }

    /// Only from here on it may, though the part that does has begun.
    pub(super) fn measure_head_to_here(&mut self, group: Group) {
        let here = self.items.len();
        self.change(group, |extent| extent.head = here);
    }

    /// From here on the group may not have lines of its own again.
    pub(super) fn measure_from_here(&mut self, group: Group) {
        let here = self.items.len();
        self.change(group, |extent| extent.resumes = here);
    }

    /// Ends a group.
    pub(super) fn close(&mut self, group: Group) {
        let here = self.items.len();
        self.change(group, |extent| {
            if extent.until == 0 {
                (extent.until, extent.head) = (here, here);
            }
            if extent.resumes == 0 {
                extent.resumes = here;
            }
            extent.end = here;
        });
        self.items.push(Item::Close);
    }

    /// Lines go one step further right from here on, if the innermost group is broken.
    pub(super) fn indent(&mut self) {
        self.push(Item::Indent);
    }

    /// Ends the innermost indentation.
    pub(super) fn dedent(&mut self) {
        self.items.push(Item::Dedent);
    }

    /// The text, each line with its end. Takes time linear in the document.
    pub(super) fn print(mut self) -> String {
        if let Some(comment) = self.trailing.take() {
            self.items.push(Item::Trailing(comment));
        }
        let widths = Widths::of(&self.items);
        let mut page = Page::default();
        for (index, item) in self.items.iter().enumerate() {
            page.put(index, *item, &widths);
        }
        page.finish()
    }
}

/// How wide the parts of a document are where no group is broken.
struct Widths {
    /// Columns before each item.
    before: Vec<usize>,
    /// Ends of lines before each item that must be.
    ends_before: Vec<usize>,
    /// Columns from each item to the next place where a line may end.
    to_line: Vec<usize>,
}

impl Widths {
    fn of(items: &[Item<'_>]) -> Widths {
        let (mut columns, mut ends) = (0, 0);
        let mut widths = Widths {
            before: Vec::with_capacity(items.len() + 1),
            ends_before: Vec::with_capacity(items.len() + 1),
            to_line: vec![0; items.len() + 1],
        };
        for item in items {
            widths.before.push(columns);
            widths.ends_before.push(ends);
            match item {
                Item::Break { .. }
                | Item::Trailing(_)
                | Item::OwnLine(_)
                | Item::Open(Extent { forced: true, .. }) => ends += 1,
                _ => columns += width(item),
            }
        }
        widths.before.push(columns);
        widths.ends_before.push(ends);
        for (index, item) in items.iter().enumerate().rev() {
            let behind = widths.to_line[index + 1];
            widths.to_line[index] = match item {
                Item::Line { .. } | Item::Fill { .. } => 0,
                Item::Break { .. } | Item::OwnLine(_) => 0,
                Item::IfBroken(text) => text.len() + behind,
                _ => width(item) + behind,
            };
        }
        widths
    }

    /// Whether no line must end in a part of a document.
    fn is_one_line(&self, start: usize, end: usize) -> bool {
        self.ends_before[start] == self.ends_before[end]
    }

    /// Whether the items `start..end` fit on one line of so many columns, with what cannot be
    /// separated from them.
    fn fit(&self, start: usize, end: usize, columns: usize) -> bool {
        let width = self.before[end] - self.before[start] + self.to_line[end];
        self.is_one_line(start, end) && width <= columns
    }
}

/// Columns of an item on an unbroken line.
fn width(item: &Item<'_>) -> usize {
    match item {
        Item::Word(text) | Item::Attached(text) => text.chars().count(),
        Item::Space => 1,
        Item::Line { flat, .. } | Item::Fill { flat, .. } => flat.len(),
        _ => 0,
    }
}

/// A line that is written.
#[derive(Debug, Default)]
struct Line<'text> {
    code: String,
    columns: usize,
    comment: Option<&'text str>,
}

/// The lines so far, and where the next goes on.
#[derive(Debug, Default)]
struct Page<'text> {
    lines: Vec<Line<'text>>,
    line: Line<'text>,
    /// Whether each open group is broken.
    broken: Vec<bool>,
    /// Whether each open indentation counts, and how many do.
    indents: Vec<bool>,
    steps: usize,
}

impl<'text> Page<'text> {
    fn put(&mut self, index: usize, item: Item<'text>, widths: &Widths) {
        match item {
            Item::Word(text) => {
                if self.line.comment.is_some() {
                    self.end_line();
                }
                self.write(text);
            }
            Item::Attached(text) => self.write(text),
            Item::Space => self.write_between(" "),
            Item::Line { flat, blank } => match self.is_broken() {
                true => self.end_lines(blank),
                false => self.write_between(flat),
            },
            Item::Fill { flat, until } => {
                let fits = widths.fit(index, until, self.columns_left());
                match self.line.comment.is_some() || (self.is_broken() && !fits) {
                    true => self.end_line(),
                    false => self.write_between(flat),
                }
            }
            Item::Break { blank } => self.end_lines(blank),
            Item::IfBroken(text) => {
                if self.is_broken() {
                    self.write(text);
                }
            }
            Item::Trailing(comment) if self.line.code.is_empty() => self.own_line(comment),
            Item::Trailing(comment) if self.line.comment.is_some() => self.own_line(comment),
            Item::Trailing(comment) => self.line.comment = Some(comment),
            Item::OwnLine(comment) => self.own_line(comment),
            Item::Open(extent) => {
                let broken = self.breaks(index, extent, widths);
                self.broken.push(broken);
            }
            Item::Close => drop(self.broken.pop()),
            Item::Indent => {
                let counts = self.is_broken();
                self.steps += usize::from(counts);
                self.indents.push(counts);
            }
            Item::Dedent => {
                let counts = self.indents.pop().unwrap_or(false);
                self.steps -= usize::from(counts);
            }
        }
    }

    /// Whether the group that begins with this item is broken.
    fn breaks(&self, index: usize, extent: Extent, widths: &Widths) -> bool {
        // Nothing more can stand on a line with a comment.
        if extent.forced || self.line.comment.is_some() {
            return true;
        }
        let columns = self.columns_left();
        if widths.fit(index, extent.end, columns) || self.hugs(index, extent, widths) {
            return false;
        }
        !extent.shy || widths.fit(index, extent.end, self.next_line())
    }

    /// Whether a group that does not fit need not be broken, because a part of it has lines of its
    /// own, and what stands before and behind that part fits on the first and last of them.
    fn hugs(&self, index: usize, extent: Extent, widths: &Widths) -> bool {
        let last_line = WIDTH.saturating_sub(self.steps * STEP + 1);
        extent.until < extent.end
            && widths.fit(index, extent.head, self.columns_left())
            && widths.fit(extent.resumes, extent.end, last_line)
            && !widths.fit(extent.until, extent.resumes, self.next_line())
    }

    /// The columns of a line that is one step further right.
    fn next_line(&self) -> usize {
        WIDTH.saturating_sub((self.steps + 1) * STEP)
    }

    fn is_broken(&self) -> bool {
        self.broken.last().copied().unwrap_or(true)
    }

    fn columns_left(&self) -> usize {
        let used = match self.line.columns {
            0 => self.steps * STEP,
            columns => columns,
        };
        WIDTH.saturating_sub(used)
    }

    fn write(&mut self, text: &str) {
        if self.line.columns == 0 {
            let indent = self.steps * STEP;
            self.line.code.extend(std::iter::repeat_n(' ', indent));
            self.line.columns = indent;
        }
        self.line.code.push_str(text);
        self.line.columns += text.chars().count();
    }

    /// Writes what separates words: at the start of a line nothing is to be separated.
    fn write_between(&mut self, text: &str) {
        if !self.line.code.is_empty() {
            self.write(text);
        }
    }

    fn own_line(&mut self, comment: &'text str) {
        self.end_line();
        self.write(comment);
        self.end_line();
    }

    /// Ends a line that has begun.
    fn end_line(&mut self) {
        let mut line = std::mem::take(&mut self.line);
        let code = line.code.trim_end().len();
        line.columns -= line.code.len() - code;
        line.code.truncate(code);
        if !line.code.is_empty() {
            self.lines.push(line);
        }
    }

    fn end_lines(&mut self, blank: bool) {
        self.end_line();
        if blank && self.lines.last().is_some_and(|line| !line.code.is_empty()) {
            self.lines.push(Line::default());
        }
    }

    /// The lines as one text; comments behind neighbouring lines begin in one column.
    fn finish(mut self) -> String {
        self.end_line();
        let mut text = String::new();
        for run in self
            .lines
            .chunk_by(|line, next| line.comment.is_some() == next.comment.is_some())
        {
            let longest = run.iter().map(|line| line.columns).max().unwrap_or(0);
            for line in run {
                text.push_str(&line.code);
                if let Some(comment) = line.comment {
                    let gap = longest - line.columns + 1;
                    text.extend(std::iter::repeat_n(' ', gap));
                    text.push_str(comment);
                }
                text.push('\n');
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `f(words, …)`, with the words one a line where they do not fit.
    fn call<'text>(document: &mut Document<'text>, words: &[&'text str]) {
        let group = document.open();
        document.word("f(");
        document.indent();
        document.line("", false);
        for (index, word) in words.iter().enumerate() {
            document.word(word);
            if index + 1 < words.len() {
                document.attached(",");
                document.line(" ", false);
            }
        }
        document.if_broken(",");
        document.dedent();
        document.line("", false);
        document.word(")");
        document.close(group);
    }

    #[test]
    fn a_group_is_broken_when_it_is_one_column_too_wide() {
        let word = "x".repeat(WIDTH - 6);
        for (word, expected) in [
            (&word[..], format!("f({word}, y)\n").replace(", y", ",y")),
            (
                &format!("{word}x"),
                format!("f(\n    {word}x,\n    y,\n)\n"),
            ),
        ] {
            let mut document = Document::default();
            let group = document.open();
            document.word("f(");
            document.indent();
            document.line("", false);
            document.word(word);
            document.attached(",");
            document.line("", false);
            document.word("y");
            document.if_broken(",");
            document.dedent();
            document.line("", false);
            document.word(")");
            document.close(group);
            // The unbroken call takes the word and 5 columns more, and `;` must stay with it.
            document.word(";");
            assert_eq!(document.print(), expected.replace(")\n", ");\n"));
        }
    }

    #[test]
    fn the_outer_group_breaks_before_the_inner_one() {
        let long = "y".repeat(80);
        let mut document = Document::default();
        let group = document.open();
        document.word("g(");
        document.indent();
        document.line("", false);
        call(&mut document, &["a", &long]);
        document.dedent();
        document.line("", false);
        document.word(&long[..20]);
        document.close(group);
        let expected = format!("g(\n    f(a, {long})\n{}\n", &long[..20]);
        assert_eq!(document.print(), expected);
    }

    #[test]
    fn a_comment_breaks_the_groups_around_it_but_not_those_that_end_before_it() {
        let mut document = Document::default();
        call(&mut document, &["a", "b"]);
        document.trailing_comment("# behind");
        document.end_line(true);
        let group = document.open();
        document.word("a");
        document.trailing_comment("# one");
        document.attached(",");
        document.line(" ", false);
        document.word("bcd");
        document.close(group);
        document.trailing_comment("# two");
        assert_eq!(
            document.print(),
            "f(a, b) # behind\n\na,  # one\nbcd # two\n"
        );
    }

    #[test]
    fn a_fill_ends_a_line_only_where_it_must() {
        let word = "w".repeat(38);
        let mut document = Document::default();
        let group = document.open();
        document.word(&word);
        document.indent();
        for _ in 0..4 {
            let place = document.fill(" ");
            document.word(&word);
            document.filled(place);
        }
        document.dedent();
        document.close(group);
        let expected = format!("{word} {word}\n    {word} {word}\n    {word}\n");
        assert_eq!(document.print(), expected);
    }
}
