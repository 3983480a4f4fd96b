//! What a formula tells: inputs and results with their units, the equation, where it is from and where it holds.

use serde_json::{Map, Value, json};

use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::terminal;

/// A unit in which people read a quantity.
pub(super) struct Unit {
    name: &'static str,
    /// Its size in SI units.
    size: f64,
}

pub(super) const ONE: Unit = Unit { name: "", size: 1.0 };
pub(super) const MM: Unit = Unit { name: "mm", size: 1e-3 };
pub(super) const M: Unit = Unit { name: "m", size: 1.0 };
pub(super) const MM2_PER_M: Unit = Unit { name: "mm2/m", size: 1e-6 };
pub(super) const LITRE: Unit = Unit { name: "l", size: 1e-3 };
pub(super) const PA: Unit = Unit { name: "Pa", size: 1.0 };
pub(super) const KPA: Unit = Unit { name: "kPa", size: 1e3 };
pub(super) const PA_S: Unit = Unit { name: "Pa s", size: 1.0 };
pub(super) const PA_PER_S: Unit = Unit { name: "Pa/s", size: 1.0 };
pub(super) const KG_PER_M3: Unit = Unit { name: "kg/m3", size: 1.0 };
pub(super) const M_PER_S: Unit = Unit { name: "m/s", size: 1.0 };
pub(super) const M_PER_H: Unit = Unit { name: "m/h", size: 1.0 / 3600.0 };
pub(super) const M3_PER_H: Unit = Unit { name: "m3/h", size: 1.0 / 3600.0 };
pub(super) const MINUTE: Unit = Unit { name: "min", size: 60.0 };
pub(super) const NEWTON: Unit = Unit { name: "N", size: 1.0 };
pub(super) const NEWTON_METRE: Unit = Unit { name: "N m", size: 1.0 };
pub(super) const NEWTON_METRE_SECOND: Unit = Unit { name: "N m s", size: 1.0 };

/// A number with its name, for people, and its key with the SI unit in it, for programs.
pub(super) struct Quantity {
    name: &'static str,
    key: &'static str,
    /// In SI units.
    value: f64,
    unit: Unit,
}

/// The quantity `name`, whose value is in SI units; `key` is its name for programs and ends in the SI unit.
pub(super) fn quantity(name: &'static str, key: &'static str, value: f64, unit: Unit) -> Quantity {
    Quantity { name, key, value, unit }
}

impl Quantity {
    fn row(&self) -> (&'static str, String) {
        let text = format!("{} {}", significant(self.value / self.unit.size), self.unit.name);
        (self.name, text.trim_end().to_owned())
    }
}

/// A formula worked out.
pub(super) struct Answer {
    pub(super) title: &'static str,
    pub(super) inputs: Vec<Quantity>,
    pub(super) results: Vec<Quantity>,
    /// One line each; the symbols are explained with them.
    pub(super) equation: &'static [&'static str],
    pub(super) source: &'static str,
    /// Where it holds, one line each.
    pub(super) validity: &'static [&'static str],
    /// What is out of that range now.
    pub(super) warnings: Vec<String>,
}

impl Answer {
    /// Refuses results that are no numbers: inputs beyond all measure.
    pub(super) fn checked(self) -> Result<Self, WrongInput> {
        match self.results.iter().find(|result| !result.value.is_finite()) {
            Some(result) => Err(WrongInput(format!(
                "the {} cannot be computed: the inputs are too large or too small; check their units",
                result.name
            ))),
            None => Ok(self),
        }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let mut rows: Vec<(&str, String)> = self.inputs.iter().map(Quantity::row).collect();
        rows.push(("", String::new()));
        rows.extend(self.results.iter().map(Quantity::row));
        rows.push(("", String::new()));
        for (name, lines) in
            [("equation", self.equation), ("source", &[self.source][..]), ("holds for", self.validity)]
        {
            rows.extend(
                lines
                    .iter()
                    .enumerate()
                    .map(|(n, line)| (if n == 0 { name } else { "" }, (*line).to_owned())),
            );
        }
        format!("{}\n{}", self.title, terminal::columns(&rows))
    }

    /// For programs, in SI units.
    pub(super) fn json(&self) -> Value {
        let object = |quantities: &[Quantity]| -> Map<String, Value> {
            quantities.iter().map(|quantity| (quantity.key.to_owned(), json!(quantity.value))).collect()
        };
        json!({
            "title": self.title,
            "inputs": object(&self.inputs),
            "results": object(&self.results),
            "equation": self.equation.join("\n"),
            "source": self.source,
            "validity": self.validity.join(" "),
            "warnings": self.warnings,
        })
    }
}

/// The warnings whose conditions are true.
pub(super) fn warnings<const N: usize>(candidates: [(bool, String); N]) -> Vec<String> {
    candidates.into_iter().filter_map(|(wrong, text)| wrong.then_some(text)).collect()
}
