//! No text, however broken, makes the reader panic; and every refusal can be shown.

use proptest::prelude::*;
use tremie_case::Case;
use tremie_case::units::{self, Dimension};

use super::SLUMP_FLOW;

fn read_and_show(text: &str) {
    if let Err(error) = Case::parse("random.toml", text) {
        assert!(!error.to_string().is_empty());
        assert!(!error.render(true).is_empty());
        if let tremie_case::CaseError::Invalid(invalid) = error {
            assert!(invalid.line() <= text.matches('\n').count() + 1);
            assert!(invalid.column() >= 1);
        }
    }
}

/// Pieces that case files are made of, and some that they should not be made of.
fn piece() -> impl Strategy<Value = String> {
    let pieces = [
        "\n",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        "=",
        ".",
        ",",
        "\"",
        "'",
        "\"\"\"",
        "#",
        "\\u0000",
        "\t",
        "\r",
        "\u{feff}",
        "é",
        "\u{200d}",
        "漢",
        "fluid",
        "domain",
        "sides",
        "x_min",
        "\"periodic\"",
        "box",
        "sphere",
        "max",
        "min",
        "\"0 m\"",
        "\"-1e308 m\"",
        "\"1e-308 m\"",
        "0x10",
        "1_0",
        "nan",
        "-inf",
        "1979-05-27",
        "true",
        "{}",
        "[]",
        "\"1e999 Pa\"",
        "\"5 mm mm\"",
        "lbm.cell_size",
        "stop.rest = {}\n",
        "time",
    ];
    prop_oneof![proptest::sample::select(pieces.to_vec()).prop_map(str::to_owned), ".{0,3}"]
}

/// The words, numbers, signs and spaces of a text.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    for c in text.chars() {
        match tokens.last_mut() {
            Some(last) if last.ends_with(is_word) && is_word(c) => last.push(c),
            _ => tokens.push(c.to_string()),
        }
    }
    tokens
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Numbers at the ends of what can be written.
const EXTREMES: [&str; 10] = [
    "0",
    "-0",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "9007199254740993",
    "99999999999999999999",
    "nan",
    "inf",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_text_is_read_or_refused(text in "(?s).{0,200}") {
        read_and_show(&text);
    }

    #[test]
    fn any_pieces_are_read_or_refused(pieces in prop::collection::vec(piece(), 0..30)) {
        read_and_show(&pieces.concat());
    }

    #[test]
    fn any_damage_to_a_right_case_is_read_or_refused(
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0usize..20, piece()), 1..4),
    ) {
        let mut text = SLUMP_FLOW.to_owned();
        for (place, length, piece) in damage {
            let start = text.floor_char_boundary(place.index(text.len() + 1));
            let end = text.ceil_char_boundary(start + length);
            text.replace_range(start..end, &piece);
        }
        read_and_show(&text);
    }

    #[test]
    fn any_value_in_place_of_a_right_one_is_read_or_refused(line in 0usize..40, value in piece()) {
        let lines = SLUMP_FLOW.lines().enumerate().map(|(number, text)| match text.split_once(" = ") {
            Some((key, _)) if number == line => format!("{key} = {value}\n"),
            _ => format!("{text}\n"),
        });
        read_and_show(&lines.collect::<String>());
    }

    #[test]
    fn any_change_of_tokens_in_a_right_case_is_read_or_refused(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..6), 1..6),
    ) {
        let mut tokens = tokens(SLUMP_FLOW);
        for (place, other, change) in changes {
            let (place, other) = (place.index(tokens.len()), other.index(tokens.len()));
            match change {
                0 => tokens.swap(place, other),
                1 => tokens[place] = tokens[other].clone(),
                2 => tokens.insert(place, tokens[other].clone()),
                3 => drop(tokens.remove(place)),
                4 => tokens[place] = tokens[place].replace(|c: char| c.is_ascii_digit(), "9"),
                _ => tokens[place] = EXTREMES[other % EXTREMES.len()].to_owned(),
            }
        }
        read_and_show(&tokens.concat());
    }

    #[test]
    fn any_quantity_is_read_or_refused(text in r"[-+]?[0-9.eE]{0,5} ?([a-zA-Zµ%°·/*.^0-9²⁻ -]{0,3}){0,4}") {
        if let Ok(value) = units::parse(&text, Dimension::STRESS) {
            prop_assert!(value.is_finite());
        }
    }
}

#[test]
fn deeply_nested_text_is_refused() {
    for open in ["[", "{a=", "[{a="] {
        read_and_show(&format!("title = {}", open.repeat(20_000)));
    }
    read_and_show(&format!("{}a = 1", "a.".repeat(20_000)));
    read_and_show(&format!("[{}a]", "a.".repeat(20_000)));
}
