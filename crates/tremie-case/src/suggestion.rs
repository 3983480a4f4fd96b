//! "Did you mean": the word the user most likely wanted.

/// The one of `words` that is nearest to `given`, if it is near at all.
pub(crate) fn nearest<'a>(given: &str, words: &[&'a str]) -> Option<&'a str> {
    let distance = |word: &str| strsim::osa_distance(&given.to_lowercase(), &word.to_lowercase());
    let nearest = words.iter().copied().min_by_key(|word| distance(word))?;
    (distance(nearest) <= nearest.chars().count() / 3).then_some(nearest)
}

/// `a, b or c`.
pub(crate) fn either(words: impl IntoIterator<Item = impl ToString>) -> String {
    let mut words: Vec<String> = words.into_iter().map(|word| word.to_string()).collect();
    match words.pop() {
        Some(last) if !words.is_empty() => format!("{} or {last}", words.join(", ")),
        last => last.unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_finger_are_near() {
        let words = ["yield_stress", "plastic_viscosity", "Pa"];
        assert_eq!(nearest("yeild_stress", &words), Some("yield_stress"));
        assert_eq!(nearest("Plastic_Viscosty", &words), Some("plastic_viscosity"));
        assert_eq!(nearest("pa", &words), Some("Pa"));
        assert_eq!(nearest("temperature", &words), None);
        assert_eq!(nearest("anything", &[]), None);
    }

    #[test]
    fn alternatives_read_as_a_sentence() {
        assert_eq!(either(["a", "b", "c"]), "a, b or c");
        assert_eq!(either(["a"]), "a");
    }
}
