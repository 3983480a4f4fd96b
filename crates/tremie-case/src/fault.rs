//! What is wrong with a case file, and how it is told.
//!
//! Reading and checking return a `Fault`, a complaint about a range of bytes; [`InvalidCase`] adds the text and shows
//! both together.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet, normalize_untrusted_str};

/// Why there is no case.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file cannot be read.
    #[error("cannot read the case file {}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file of cuts cannot be read.
    #[error("cannot read the file of cuts {}", .path.display())]
    ReadCuts {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file can be read, but something is wrong in it.
    #[error(transparent)]
    Invalid(#[from] InvalidCase),
}

impl CaseError {
    /// The message, with the lines it speaks of; with ANSI colour codes if `colour`.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        match self {
            Self::Read { source, .. } | Self::ReadCuts { source, .. } => {
                let title = Level::ERROR.primary_title(format!("{self}: {source}"));
                renderer.render(&[annotate_snippets::Group::with_title(title)])
            }
            Self::Invalid(invalid) => invalid.render(&renderer),
        }
    }
}

/// A case file with a mistake in it; displays as a message with file, line and column, without colours.
#[derive(Debug)]
pub struct InvalidCase {
    name: String,
    text: String,
    fault: Fault,
}

impl InvalidCase {
    pub(crate) fn new(name: &str, text: &str, fault: Fault) -> Self {
        Self { name: name.to_owned(), text: text.to_owned(), fault }
    }

    /// What is wrong, in one line.
    pub fn problem(&self) -> &str {
        &self.fault.0.problem
    }

    /// Line of the mistake, from 1.
    pub fn line(&self) -> usize {
        self.before().matches('\n').count() + 1
    }

    /// Column of the mistake in characters, from 1.
    pub fn column(&self) -> usize {
        self.before().chars().rev().take_while(|&c| c != '\n').count() + 1
    }

    fn before(&self) -> &str {
        &self.text[..self.shown(&self.fault.0.span).start]
    }

    /// The part of `span` on its first line, on character boundaries: all that a message needs to show, and a range
    /// that is safe to show whatever the TOML parser said.
    fn shown(&self, span: &Range<usize>) -> Range<usize> {
        let text = &self.text;
        let start = text.floor_char_boundary(span.start);
        let end = text.ceil_char_boundary(span.end).max(start);
        let line = text[start..end].find(['\n', '\r']).map_or(end, |length| start + length);
        start..line
    }

    fn render(&self, renderer: &Renderer) -> String {
        let fault = &self.fault.0;
        let mut snippet = Snippet::source(&self.text)
            .path(&self.name)
            .annotation(AnnotationKind::Primary.span(self.shown(&fault.span)).label(&fault.label));
        if let Some((span, label)) = &fault.related {
            snippet = snippet.annotation(AnnotationKind::Context.span(self.shown(span)).label(label));
        }
        let help = fault.help.as_ref().map(|help| {
            let lines: Vec<String> = help.lines().map(normalize_untrusted_str).collect();
            Level::HELP.message(lines.join("\n"))
        });
        renderer.render(&[Level::ERROR.primary_title(&fault.problem).element(snippet).elements(help)])
    }
}

impl fmt::Display for InvalidCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(&Renderer::plain()))
    }
}

impl std::error::Error for InvalidCase {}

/// A complaint about a range of bytes of the case file.
#[derive(Debug)]
pub(crate) struct Fault(Box<Complaint>);

#[derive(Debug)]
struct Complaint {
    span: Range<usize>,
    problem: String,
    label: String,
    related: Option<(Range<usize>, String)>,
    help: Option<String>,
}

impl Fault {
    /// `problem` says what is wrong at `span`, `label` (beside the marked text) what to write instead.
    pub(crate) fn new(span: Range<usize>, problem: impl Into<String>, label: impl Into<String>) -> Self {
        Self(Box::new(Complaint {
            span,
            problem: problem.into(),
            label: label.into(),
            related: None,
            help: None,
        }))
    }

    /// Marks a second place that has to do with it, if there is one.
    pub(crate) fn related(mut self, span: Option<Range<usize>>, label: impl Into<String>) -> Self {
        self.0.related = span.map(|span| (span, label.into()));
        self
    }

    /// Adds a line or more below.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }
}
