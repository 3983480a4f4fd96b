//! The case file as JSON Schema (draft 2020-12), for editors: made from the keys themselves, so that it knows what the
//! reader knows.
//!
//! What is wrong only in combination, and whether a unit fits its quantity, the schema does not see.

use serde_json::{Map, Value, json};

/// What is known about a table: its keys, and rules between them.
#[derive(Default)]
pub(crate) struct Description {
    properties: Map<String, Value>,
    required: Vec<&'static str>,
    rules: Vec<Value>,
}

impl Description {
    /// A key, what it means, and what may stand there.
    pub(crate) fn key(&mut self, name: &str, about: &str, mut kind: Map<String, Value>) {
        let about = match kind.get("description").and_then(Value::as_str) {
            Some(kind) => format!("{about}: {kind}"),
            None => about.to_owned(),
        };
        kind.insert("description".to_owned(), about.into());
        self.properties.insert(name.to_owned(), kind.into());
    }

    pub(crate) fn require(&mut self, name: &'static str) {
        self.required.push(name);
    }

    /// Something that must hold besides.
    pub(crate) fn rule(&mut self, rule: Value) {
        self.rules.push(rule);
    }

    pub(crate) fn object(self) -> Map<String, Value> {
        let mut described = object(json!({
            "type": "object",
            "properties": self.properties,
            "additionalProperties": false,
        }));
        if !self.required.is_empty() {
            described.insert("required".to_owned(), self.required.into());
        }
        if !self.rules.is_empty() {
            described.insert("allOf".to_owned(), self.rules.into());
        }
        described
    }
}

/// The members of an object.
pub(crate) fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(members) => members,
        _ => Map::new(),
    }
}

/// A value written as in the case file; null if it is none.
pub(crate) fn from_toml(text: &str) -> Value {
    let table = toml::from_str::<Map<String, Value>>(&format!("value = {text}"));
    table.ok().and_then(|mut table| table.remove("value")).unwrap_or_default()
}
