//! A parsed TOML document in which every value knows its name and where it stands.
//!
//! A table is a [`Section`]: its keys, and how they make a value. A key that must be there is a [`Need`], one that may
//! a [`Maybe`], one that has a default an [`Or`]; of [`Variants`] one must be there, and a [`Switch`] says by a word
//! which. What may stand under a key is a [`Kind`]: a [`Quantity`], a [`Vector`], a [`Text`], a [`Choice`] of words, a
//! section, a [`List`]. A kind refuses what does not fit, at the place where it stands, and describes itself
//! for the JSON Schema.

use std::ops::Range;
use std::path::Path;

use serde_json::{Map, json};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::describe::{Description, from_toml, object};
use crate::fault::Fault;
use crate::files::Files;
use crate::suggestion::{either, nearest};
use crate::units::{self, Dimension};

/// A syntactically correct TOML document.
pub(crate) struct Document<'a> {
    node: Spanned<DeValue<'a>>,
    /// The files that it names.
    pub(crate) files: Files,
}

impl<'a> Document<'a> {
    /// Parses `text`; the first syntax error is the fault. The files that it names lie in `folder`.
    pub(crate) fn parse(text: &'a str, folder: &Path) -> Result<Self, Fault> {
        match DeTable::parse(text) {
            Ok(table) => Ok(Self {
                node: Spanned::new(table.span(), DeValue::Table(table.into_inner())),
                files: Files::new(folder),
            }),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                Err(Fault::new(span, format!("not valid TOML: {}", error.message()), ""))
            }
        }
    }

    /// The whole document as a value, without a name.
    pub(crate) fn root(&self) -> Value<'_> {
        Value { name: String::new(), node: &self.node, files: &self.files }
    }

    /// Where the value stands that is reached by the keys and indices in `path`, such as `domain.max.2`.
    pub(crate) fn find(&self, path: &str) -> Option<Range<usize>> {
        let node = path.split('.').try_fold(&self.node, |node, step| child(node, step));
        node.map(Spanned::span)
    }

    /// The same, or where the innermost table stands that should hold it.
    pub(crate) fn locate(&self, path: &str) -> Range<usize> {
        let mut node = &self.node;
        for step in path.split('.') {
            match child(node, step) {
                Some(child) => node = child,
                None => break,
            }
        }
        node.span()
    }
}

fn child<'n, 'a>(node: &'n Spanned<DeValue<'a>>, step: &str) -> Option<&'n Spanned<DeValue<'a>>> {
    match node.get_ref() {
        DeValue::Table(table) => table.get(step),
        DeValue::Array(array) => array.get(step.parse::<usize>().ok()?),
        _ => None,
    }
}

/// A value with its name, such as `domain.max`.
pub(crate) struct Value<'a> {
    name: String,
    node: &'a Spanned<DeValue<'a>>,
    /// The files that the document names.
    pub(crate) files: &'a Files,
}

impl<'a> Value<'a> {
    pub(crate) fn get(&self) -> &'a DeValue<'a> {
        self.node.get_ref()
    }

    pub(crate) fn fault(&self, problem: impl std::fmt::Display, label: impl Into<String>) -> Fault {
        Fault::new(self.node.span(), format!("`{}` {problem}", self.name), label)
    }

    /// Where it stands.
    pub(crate) fn span(&self) -> Range<usize> {
        self.node.span()
    }

    pub(crate) fn wrong_type(&self, expected: impl std::fmt::Display) -> Fault {
        let found = match self.get() {
            DeValue::String(_) => "a text".to_owned(),
            DeValue::Integer(_) | DeValue::Float(_) => "a number".to_owned(),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(array) => format!("an array of {} values", array.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        self.fault(format!("is {found}"), format!("expected {expected}"))
    }

    /// Component of an array; the value itself if there is none.
    pub(crate) fn component(&self, index: usize) -> Value<'a> {
        let node = self.get().as_array().and_then(|array| array.get(index)).unwrap_or(self.node);
        Value { name: self.name.clone(), node, files: self.files }
    }
}

/// What may stand under a key.
pub(crate) trait Kind {
    type Out;
    fn read(&self, value: &Value<'_>) -> Result<Self::Out, Fault>;
    /// A sentence that says what to write where it is missing; `name` is the full name of the key, `key` its last part.
    fn example(&self, name: &str, key: &str) -> String;
    /// What may stand there, as JSON Schema.
    fn describe(&self) -> Map<String, serde_json::Value>;
}

/// A table whose keys are all known.
pub(crate) struct Table<'a> {
    value: &'a Value<'a>,
    entries: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    fn open(value: &'a Value<'a>, keys: &[&dyn Keys], example: &str) -> Result<Self, Fault> {
        let DeValue::Table(entries) = value.get() else {
            return Err(value.wrong_type(format!("{{ {example} }}")));
        };
        let known: Vec<&str> = keys.iter().flat_map(|keys| keys.names()).collect();
        let unknown = entries.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        if let Some(key) = unknown.min_by_key(|key| key.span().start) {
            let place = if value.name.is_empty() { String::new() } else { format!(" in `{}`", value.name) };
            let label = match nearest(key.get_ref(), &known) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => "not known here".to_owned(),
            };
            return Err(Fault::new(key.span(), format!("there is no key `{}`{place}", key.get_ref()), label)
                .help(format!("known keys: {}", known.join(", "))));
        }
        Ok(Self { value, entries })
    }

    /// The value under a key, as written.
    pub(crate) fn value(&self, key: &str) -> Option<Value<'a>> {
        self.entries.get(key).map(|node| Value { name: self.name(key), node, files: self.value.files })
    }

    /// The table as a value.
    pub(crate) fn itself(&self) -> Value<'a> {
        Value { name: self.value.name.clone(), node: self.value.node, files: self.value.files }
    }

    /// Reads a key that must be there.
    pub(crate) fn need<K: Kind>(&self, key: &Need<K>) -> Result<K::Out, Fault> {
        self.required(key.name, &key.kind)
    }

    /// Reads a key that may be there.
    pub(crate) fn maybe<K: Kind>(&self, key: &Maybe<K>) -> Result<Option<K::Out>, Fault> {
        self.value(key.name).map(|value| key.kind.read(&value)).transpose()
    }

    /// Reads a key that has a default.
    pub(crate) fn or<K: Kind>(&self, key: &Or<K>) -> Result<K::Out, Fault> {
        match self.value(key.name) {
            Some(value) => key.kind.read(&value),
            None => key.absent(),
        }
    }

    fn required<K: Kind>(&self, key: &str, kind: &K) -> Result<K::Out, Fault> {
        match self.value(key) {
            Some(value) => kind.read(&value),
            None => {
                let name = self.name(key);
                Err(Fault::new(self.value.node.span(), format!("`{name}` is missing"), "")
                    .help(kind.example(&name, key)))
            }
        }
    }

    /// Reads the one of the variants that is there.
    pub(crate) fn one_of<T>(&self, variants: &Variants<T>) -> Result<T, Fault> {
        let what = variants.what;
        let mut present =
            variants.sections.iter().filter_map(|(key, _, section)| Some((self.value(key)?, section)));
        match (present.next(), present.next()) {
            (Some((value, section)), None) => section.read(&value),
            (Some((first, _)), Some((second, _))) => Err(second
                .fault(format!("is a second {what}"), "keep only one of them")
                .related(Some(first.node.span()), format!("`{}` is the first", first.name))),
            (None, _) => {
                let lines: Vec<String> = variants
                    .sections
                    .iter()
                    .map(|(key, _, section)| format!("\n  {key} = {{ {} }}", section.example.join(", ")))
                    .collect();
                Err(self
                    .value
                    .fault(format!("has no {what}"), "")
                    .help(format!("add one of{}", lines.concat())))
            }
        }
    }

    /// Reads the section that the word says. The others that are there must be right, too.
    pub(crate) fn switch<T>(&self, switch: &Switch<T>) -> Result<T, Fault> {
        let (word, _, section) = self.required(switch.name, &Choice(switch.sections))?;
        for (key, _, section) in switch.sections {
            if let Some(value) = self.value(key) {
                section.read(&value)?;
            }
        }
        self.required(word, section)
    }

    fn name(&self, key: &str) -> String {
        if self.value.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.value.name) }
    }
}

/// A key or several that a table may have.
pub(crate) trait Keys: Sync {
    fn names(&self) -> Vec<&'static str>;
    /// Adds what there is to know about them.
    fn describe(&self, section: &mut Description);
}

/// A key that must be there.
pub(crate) struct Need<K> {
    name: &'static str,
    about: &'static str,
    kind: K,
}

pub(crate) const fn need<K>(name: &'static str, about: &'static str, kind: K) -> Need<K> {
    Need { name, about, kind }
}

/// A key that may be there.
pub(crate) struct Maybe<K> {
    name: &'static str,
    about: &'static str,
    kind: K,
}

pub(crate) const fn maybe<K>(name: &'static str, about: &'static str, kind: K) -> Maybe<K> {
    Maybe { name, about, kind }
}

/// A key with a default, which is written as one would write it in the file.
pub(crate) struct Or<K> {
    name: &'static str,
    about: &'static str,
    kind: K,
    default: &'static str,
}

pub(crate) const fn or<K>(name: &'static str, default: &'static str, about: &'static str, kind: K) -> Or<K> {
    Or { name, about, kind, default }
}

impl<K: Kind> Or<K> {
    fn absent(&self) -> Result<K::Out, Fault> {
        let text = format!("{} = {}", self.name, self.default);
        let document = Document::parse(&text, Path::new(""))?;
        let node = child(&document.node, self.name).unwrap_or(&document.node);
        self.kind.read(&Value { name: self.name.to_owned(), node, files: &document.files })
    }
}

impl<K: Kind + Sync> Keys for Need<K> {
    fn names(&self) -> Vec<&'static str> {
        vec![self.name]
    }

    fn describe(&self, section: &mut Description) {
        section.key(self.name, self.about, self.kind.describe());
        section.require(self.name);
    }
}

impl<K: Kind + Sync> Keys for Maybe<K> {
    fn names(&self) -> Vec<&'static str> {
        vec![self.name]
    }

    fn describe(&self, section: &mut Description) {
        section.key(self.name, self.about, self.kind.describe());
    }
}

impl<K: Kind + Sync> Keys for Or<K> {
    fn names(&self) -> Vec<&'static str> {
        vec![self.name]
    }

    fn describe(&self, section: &mut Description) {
        let mut kind = self.kind.describe();
        kind.insert("default".to_owned(), from_toml(self.default));
        section.key(self.name, self.about, kind);
    }
}

impl<K: Keys, const N: usize> Keys for [K; N] {
    fn names(&self) -> Vec<&'static str> {
        self.iter().flat_map(Keys::names).collect()
    }

    fn describe(&self, section: &mut Description) {
        self.iter().for_each(|key| key.describe(section));
    }
}

/// A table with keys of its own.
pub(crate) struct Section<T> {
    /// All the keys that there may be.
    pub(crate) keys: &'static [&'static dyn Keys],
    /// Lines that make a valid section.
    pub(crate) example: &'static [&'static str],
    pub(crate) read: fn(&Table<'_>) -> Result<T, Fault>,
}

impl<T> Kind for Section<T> {
    type Out = T;

    fn read(&self, value: &Value<'_>) -> Result<T, Fault> {
        (self.read)(&Table::open(value, self.keys, &self.example.join(", "))?)
    }

    fn example(&self, name: &str, key: &str) -> String {
        if name == key {
            format!("add\n  [{name}]\n  {}", self.example.join("\n  "))
        } else {
            format!("add {key} = {{ {} }}", self.example.join(", "))
        }
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        let mut description = Description::default();
        self.keys.iter().for_each(|keys| keys.describe(&mut description));
        description.object()
    }
}

/// A few words, what each means, and what it stands for.
pub(crate) type Words<T> = &'static [(&'static str, &'static str, T)];

/// Sections of which one must be there, and only one.
pub(crate) struct Variants<T: 'static> {
    /// What they are, in a word.
    pub(crate) what: &'static str,
    pub(crate) sections: Words<Section<T>>,
}

impl<T> Keys for Variants<T> {
    fn names(&self) -> Vec<&'static str> {
        self.sections.iter().map(|(key, ..)| *key).collect()
    }

    fn describe(&self, section: &mut Description) {
        for (key, about, kind) in self.sections {
            section.key(key, about, kind.describe());
        }
        let one = self.names().into_iter().map(|key| json!({ "required": [key] }));
        section.rule(json!({ "oneOf": one.collect::<Vec<_>>() }));
    }
}

/// Keys of which the first word says how many must be there: `oneOf` or `anyOf`. The reader sees to it itself.
pub(crate) struct Rule(pub(crate) &'static str, pub(crate) &'static [&'static str]);

impl Keys for Rule {
    fn names(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn describe(&self, section: &mut Description) {
        let one = self.1.iter().map(|key| json!({ "required": [key] }));
        section.rule(json!({ (self.0): one.collect::<Vec<_>>() }));
    }
}

/// A key whose word says which section must be there; the others may, and are read but not used.
pub(crate) struct Switch<T: 'static> {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) sections: Words<Section<T>>,
}

impl<T> Keys for Switch<T> {
    fn names(&self) -> Vec<&'static str> {
        [self.name].into_iter().chain(self.sections.iter().map(|(key, ..)| *key)).collect()
    }

    fn describe(&self, section: &mut Description) {
        section.key(self.name, self.about, Choice(self.sections).describe());
        section.require(self.name);
        for (key, about, kind) in self.sections {
            section.key(key, about, kind.describe());
            section.rule(json!({
                "if": { "properties": { self.name: { "const": key } } },
                "then": { "required": [key] },
            }));
        }
    }
}

/// One or more of a kind, written `[[key]]`.
pub(crate) struct List<K>(pub(crate) K);

impl<T> Kind for List<Section<T>> {
    type Out = Vec<T>;

    fn read(&self, value: &Value<'_>) -> Result<Vec<T>, Fault> {
        match value.get() {
            DeValue::Array(array) if !array.is_empty() => {
                (0..array.len()).map(|index| self.0.read(&value.component(index))).collect()
            }
            DeValue::Array(_) => {
                Err(value.fault("is empty", "").help(self.example(&value.name, &value.name)))
            }
            _ => Err(value.wrong_type(format!("[[{}]] with double brackets", value.name))),
        }
    }

    fn example(&self, name: &str, _: &str) -> String {
        format!("add\n  [[{name}]]\n  {}", self.0.example.join("\n  "))
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        object(json!({ "type": "array", "minItems": 1, "items": self.0.describe() }))
    }
}

/// A number with a unit.
#[derive(Clone, Copy)]
pub(crate) struct Quantity {
    pub(crate) dimension: Dimension,
    pub(crate) range: Bound,
    /// As one would write it.
    pub(crate) example: &'static str,
}

/// Which values a quantity may have.
#[derive(Clone, Copy)]
pub(crate) enum Bound {
    Any,
    NotNegative,
    Positive,
    /// Positive and at most this.
    UpTo(f64),
}

impl Quantity {
    fn written(&self) -> String {
        if self.dimension == Dimension::NUMBER {
            self.example.to_owned()
        } else {
            format!("\"{}\"", self.example)
        }
    }

    /// What it is, such as `a stress, not negative`.
    fn meaning(&self) -> String {
        match self.range {
            Bound::Any => self.dimension.to_string(),
            Bound::NotNegative => format!("{}, not negative", self.dimension),
            Bound::Positive => format!("{}, positive", self.dimension),
            Bound::UpTo(most) => format!("{}, positive and at most {most}", self.dimension),
        }
    }
}

impl Kind for Quantity {
    type Out = f64;

    fn read(&self, value: &Value<'_>) -> Result<f64, Fault> {
        let text = match value.get() {
            DeValue::String(text) => text.to_string(),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.as_str().to_owned(),
            _ => return Err(value.wrong_type(format!("{}, such as {}", self.dimension, self.written()))),
        };
        let number = units::parse(&text, self.dimension).map_err(|error| {
            let problem = format!("cannot be read: {}", error.problem());
            value.fault(problem, error.remedy())
        })?;
        let refusal = match self.range {
            Bound::Any => None,
            Bound::NotNegative => (number < 0.0).then(|| "must not be negative".to_owned()),
            Bound::Positive => (number <= 0.0).then(|| "must be positive".to_owned()),
            Bound::UpTo(most) => {
                (number <= 0.0 || number > most).then(|| format!("must be positive and at most {most}"))
            }
        };
        match refusal {
            None => Ok(number),
            Some(problem) => Err(value.fault(problem, format!("write for example {}", self.written()))),
        }
    }

    fn example(&self, _: &str, key: &str) -> String {
        format!("add {key} = {}", self.written())
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        let sign = if matches!(self.range, Bound::Any) { "[-+]?" } else { "\\+?" };
        let number = format!("^\\s*{sign}([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?");
        let mut described = object(json!({
            "description": self.meaning(),
            "examples": [from_toml(&self.written())],
        }));
        if self.dimension == Dimension::NUMBER {
            described.insert("type".to_owned(), json!(["number", "string"]));
            described.insert("pattern".to_owned(), json!(number));
            let bounds = match self.range {
                Bound::Any => json!({}),
                Bound::NotNegative => json!({ "minimum": 0 }),
                Bound::Positive => json!({ "exclusiveMinimum": 0 }),
                Bound::UpTo(most) => json!({ "exclusiveMinimum": 0, "maximum": most }),
            };
            described.extend(object(bounds));
        } else {
            described.insert("type".to_owned(), json!("string"));
            // Followed by a unit; which one is for the reader to judge.
            described.insert("pattern".to_owned(), json!(format!("{number}(\\s*[^\\s0-9.].*|\\s+\\S.*)$")));
        }
        described
    }
}

/// Components of the same kind.
pub(crate) struct Vector<const N: usize>(pub(crate) Quantity);

impl<const N: usize> Vector<N> {
    fn written(&self) -> String {
        format!("[{}]", vec![self.0.written(); N].join(", "))
    }
}

impl<const N: usize> Kind for Vector<N> {
    type Out = [f64; N];

    fn read(&self, value: &Value<'_>) -> Result<[f64; N], Fault> {
        if value.get().as_array().is_none_or(|array| array.len() != N) {
            return Err(value.wrong_type(format!("{N} components, such as {}", self.written())));
        }
        let mut components = [0.0; N];
        for (index, component) in components.iter_mut().enumerate() {
            *component = self.0.read(&value.component(index))?;
        }
        Ok(components)
    }

    fn example(&self, _: &str, key: &str) -> String {
        format!("add {key} = {}", self.written())
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        object(json!({
            "description": format!("{N} components, each {}", self.0.meaning()),
            "type": "array",
            "minItems": N,
            "maxItems": N,
            "items": self.0.describe(),
            "examples": [from_toml(&self.written())],
        }))
    }
}

/// Any text.
pub(crate) struct Text {
    pub(crate) example: &'static str,
}

impl Kind for Text {
    type Out = String;

    fn read(&self, value: &Value<'_>) -> Result<String, Fault> {
        match value.get() {
            DeValue::String(text) => Ok(text.to_string()),
            _ => Err(value.wrong_type(format!("a text, such as \"{}\"", self.example))),
        }
    }

    fn example(&self, _: &str, key: &str) -> String {
        format!("add {key} = \"{}\"", self.example)
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        object(json!({ "type": "string", "examples": [self.example] }))
    }
}

/// What something is called, as a part of names in files.
pub(crate) struct Name {
    pub(crate) example: &'static str,
}

impl Kind for Name {
    type Out = String;

    fn read(&self, value: &Value<'_>) -> Result<String, Fault> {
        let text = Text { example: self.example }.read(value)?;
        let fits = text.starts_with(|c: char| c.is_ascii_alphabetic())
            && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if fits {
            Ok(text)
        } else {
            Err(value.fault(
                format!("cannot be \"{text}\": it becomes a part of names in results"),
                format!("write a letter, then letters, digits and _, such as \"{}\"", self.example),
            ))
        }
    }

    fn example(&self, name: &str, key: &str) -> String {
        Text { example: self.example }.example(name, key)
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        let mut described = Text { example: self.example }.describe();
        described.insert("pattern".to_owned(), json!("^[A-Za-z][A-Za-z0-9_]*$"));
        described
    }
}

/// One of a few words, each of which stands for something.
pub(crate) struct Choice<T: 'static>(pub(crate) Words<T>);

impl<T> Choice<T> {
    /// The words, as one would write them.
    pub(crate) fn written(&self) -> String {
        either(self.0.iter().map(|(word, ..)| format!("\"{word}\"")))
    }
}

impl<T> Kind for Choice<T> {
    type Out = &'static (&'static str, &'static str, T);

    fn read(&self, value: &Value<'_>) -> Result<Self::Out, Fault> {
        let DeValue::String(text) = value.get() else {
            return Err(value.wrong_type(self.written()));
        };
        let words: Vec<&str> = self.0.iter().map(|(word, ..)| *word).collect();
        self.0.iter().find(|(word, ..)| *word == text.as_ref()).ok_or_else(|| {
            let label = match nearest(text, &words) {
                Some(meant) => format!("did you mean \"{meant}\"?"),
                None => format!("write {}", self.written()),
            };
            value.fault(format!("cannot be \"{text}\""), label)
        })
    }

    fn example(&self, _: &str, key: &str) -> String {
        format!("add {key} = {}", self.written())
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        let words = self.0.iter().map(|(word, about, _)| json!({ "const": word, "description": about }));
        object(json!({ "oneOf": words.collect::<Vec<_>>() }))
    }
}

/// One of a few words, or a table where words do not tell enough.
pub(crate) struct WordOr<T: 'static> {
    pub(crate) words: Choice<T>,
    pub(crate) table: Section<T>,
}

impl<T: Copy> Kind for WordOr<T> {
    type Out = T;

    fn read(&self, value: &Value<'_>) -> Result<T, Fault> {
        match value.get() {
            DeValue::Table(_) => self.table.read(value),
            DeValue::String(_) => self.words.read(value).map(|(.., meant)| *meant),
            _ => {
                let table = self.table.example.join(", ");
                Err(value.wrong_type(format!("{}, or {{ {table} }}", self.words.written())))
            }
        }
    }

    fn example(&self, name: &str, key: &str) -> String {
        self.words.example(name, key)
    }

    fn describe(&self) -> Map<String, serde_json::Value> {
        object(json!({ "anyOf": [self.words.describe(), self.table.describe()] }))
    }
}
