//! The JSON Schema and the reader know the same keys. That the ready cases are valid by it, `.ci/run` checks with Python's
//! `jsonschema`.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use serde_json::{Map, Value, json};
use tremie_case::{Case, json_schema};

use super::SLUMP_FLOW;

/// All keys of a table's schema and of the tables in it, as paths.
fn paths(schema: &Value, path: &[String], found: &mut Vec<Vec<String>>) {
    if let Some(properties) = schema["properties"].as_object() {
        for (key, inner) in properties {
            let path = [path, std::slice::from_ref(key)].concat();
            paths(inner, &path, found);
            found.push(path);
        }
    }
    if schema["type"] == "array" && schema["items"]["type"] == "object" {
        paths(&schema["items"], &[path, &["0".to_owned()]].concat(), found);
    }
    for one in schema["anyOf"].as_array().into_iter().flatten() {
        paths(one, path, found);
    }
}

fn all_paths() -> Vec<Vec<String>> {
    let mut found = Vec::new();
    paths(&json_schema(), &[], &mut found);
    found
}

/// Where a path leads in the schema.
fn at<'a>(mut schema: &'a Value, path: &[String]) -> &'a Value {
    for step in path {
        schema = match schema {
            array if array["type"] == "array" => &array["items"],
            either if either["anyOf"].is_array() => &either["anyOf"][1]["properties"][step],
            table => &table["properties"][step],
        };
    }
    schema
}

/// A value that the schema allows: the default, an example, the first of the words, or a table with all its needs.
fn instance(schema: &Value) -> Value {
    if let Some(given) = schema.get("default").or_else(|| schema["examples"].get(0)) {
        return given.clone();
    }
    if let Some(words) = schema.get("oneOf").or_else(|| schema.get("anyOf")) {
        return words[0].get("const").cloned().unwrap_or_else(|| instance(&words[0]));
    }
    if schema["type"] == "array" {
        return json!([instance(&schema["items"])]);
    }
    let mut keys: Vec<&Value> = schema["required"].as_array().into_iter().flatten().collect();
    for rule in schema["allOf"].as_array().into_iter().flatten() {
        let one = if rule["oneOf"].is_array() { &rule["oneOf"][0] } else { &rule["then"] };
        keys.push(&one["required"][0]);
    }
    let keys = keys.into_iter().map(|key| key.as_str().unwrap());
    Value::Object(keys.map(|key| (key.to_owned(), instance(&schema["properties"][key]))).collect())
}

/// Puts a value where a path leads, on tables that the schema allows.
fn put(root: &mut Value, path: &[String], value: Value) {
    let schema = json_schema();
    let mut place = root;
    for (n, step) in path.iter().enumerate() {
        if !place.is_object() && !place.is_array() {
            *place = json!({});
        }
        place = match step.parse::<usize>() {
            Ok(index) => &mut place[index],
            Err(_) => {
                let table = place.as_object_mut().unwrap();
                let before = instance(at(&schema, &path[..=n]));
                exclusive(table, at(&schema, &path[..n]), step);
                table.entry(step.as_str()).or_insert(before)
            }
        };
    }
    *place = value;
}

/// Takes away what cannot stand beside a key.
fn exclusive(table: &mut Map<String, Value>, schema: &Value, key: &str) {
    for rule in schema["allOf"].as_array().into_iter().flatten() {
        let variants = rule["oneOf"].as_array().into_iter().flatten();
        let names: Vec<&str> = variants.map(|one| one["required"][0].as_str().unwrap()).collect();
        if names.contains(&key) {
            table.retain(|other, _| other == key || !names.contains(&other.as_str()));
        }
    }
}

fn read(case: &Value) -> Result<Case, String> {
    let text = toml::to_string(case).unwrap();
    // Beside it lie the `form.stl`, the `cage.csv` and the `fibres.csv` that the schema's examples name.
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/main/case.toml");
    Case::parse(name, &text).map_err(|error| format!("{error}\n{text}"))
}

fn slump_flow() -> Value {
    toml::from_str(SLUMP_FLOW).unwrap()
}

#[test]
fn every_key_of_the_schema_is_read() {
    let paths = all_paths();
    assert!(paths.len() > 50, "{}", paths.len());
    for path in paths {
        let schema = json_schema();
        let place = at(&schema, &path);
        let mut case = slump_flow();
        put(&mut case, &path, instance(place));
        if let Err(error) = read(&case) {
            // Right by itself, the value may contradict the rest of the case.
            let by_itself =
                ["there is no key", "is missing", "has no ", "is a second", "cannot be", "expected"];
            assert!(!by_itself.iter().any(|word| error.contains(word)), "{path:?}: {error}");
        }
        put(&mut case, &path, json!({ "nonsense": 1 }));
        assert!(read(&case).is_err(), "{path:?}");
    }
}

#[test]
fn what_the_schema_needs_the_reader_needs() {
    for path in all_paths() {
        let schema = json_schema();
        let (key, table) = path.split_last().unwrap();
        let section = match at(&schema, table) {
            either if either["anyOf"].is_array() => &either["anyOf"][1],
            section => section,
        };
        // Another method's section is needed for that method.
        let method = |rule: &Value| rule["if"]["properties"]["method"]["const"].clone();
        let other = |rule: &&Value| method(rule) == "isph" || method(rule) == "ldd";
        let rules = section["allOf"].as_array().into_iter().flatten().filter(|rule| !other(rule));
        let rules = rules.map(|rule| &rule["then"]);
        let needed = [section]
            .into_iter()
            .chain(rules)
            .any(|section| section["required"].as_array().is_some_and(|keys| keys.contains(&json!(key))));
        let mut case = slump_flow();
        put(&mut case, &path, instance(at(&schema, &path)));
        let place = table.iter().fold(&mut case, |place, step| match step.parse::<usize>() {
            Ok(index) => &mut place[index],
            Err(_) => &mut place[step],
        });
        place.as_object_mut().unwrap().remove(key);
        let missing = read(&case).err().is_some_and(|error| {
            error.contains(&format!("{key}` is missing")) || error.contains("` is missing") && key == "method"
        });
        assert_eq!(needed, missing, "{path:?}");
    }
}

#[test]
fn every_key_is_described_and_no_other_is_allowed() {
    let schema = json_schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    for path in all_paths() {
        let (_, table) = path.split_last().unwrap();
        let about = at(&schema, &path)["description"].as_str().unwrap_or_default();
        assert!(about.len() > 5, "{path:?}: {about}");
        let table = at(&schema, table);
        let closed = |table: &Value| table["additionalProperties"] == json!(false);
        assert!(closed(table) || closed(&table["items"]) || closed(&table["anyOf"][1]), "{path:?}");
    }
    assert_eq!(schema["properties"]["lbm"]["properties"]["hydrostatic_error"]["default"], json!(0.02));
    let bingham = &schema["properties"]["material"]["properties"]["bingham"]["properties"];
    assert_eq!(bingham["yield_stress"]["examples"], json!(["50 Pa"]));
}
