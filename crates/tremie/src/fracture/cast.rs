//! Fibres out of a finished cast, as a beam sees them.

use std::path::Path;

use tremie_case::{BeamCase, BeamFibres, Cuts};
use tremie_fracture::fibres::Fibre;
use tremie_numerics::DVec3;
use tremie_suspension::Form;
use tremie_suspension::orientation::{Block, pieces};

use super::folder::FIBRES;
use crate::failure::WrongInput;
use crate::fibres::{Cast, kept_cuts};

/// The material and lattice of a beam without a file: those of Svec's thesis.
const THESIS: &str = include_str!("thesis.toml");

/// A beam that was cut out of a cast.
pub(super) struct Piece {
    /// What it is called, and where it is from.
    title: String,
    /// Length, width and height in m.
    size: DVec3,
    /// Its fibres, with its lower corner as origin.
    pub(super) fibres: Vec<Fibre>,
}

/// Cuts the beam `name` out of the cast in the folder of a run.
pub(super) fn cut(run: &Path, name: &str, cuts: Option<&Path>) -> anyhow::Result<Piece> {
    let shown = run.display();
    let kept = kept_cuts(run);
    let path = match cuts {
        Some(path) => path,
        None if kept.is_file() => &kept,
        None => {
            return Err(WrongInput(format!(
                "{shown} does not tell where `{name}` is cut: give --cut FILE, or cut the beams first with\n  tremie fibres {shown} --cut FILE"
            ))
            .into());
        }
    };
    let cuts = Cuts::read(path)?;
    let Some(place) = cuts.beams.iter().position(|beam| beam.name == name) else {
        let names: Vec<&str> = cuts.beams.iter().map(|beam| beam.name.as_str()).collect();
        let known = if names.is_empty() { "no beams".to_owned() } else { names.join(", ") };
        return Err(WrongInput(format!("{} has no beam `{name}`; it has {known}", path.display())).into());
    };
    let beam = &cuts.beams[place];
    let cast = Cast::read(run, false)?;
    let domain = &cast.case.domain;
    let [low, high] = [domain.min, domain.max];
    let slack = DVec3::splat(1e-9);
    if beam.min.cmplt(low - slack).any() || beam.max.cmpgt(high + slack).any() {
        let show = |v: DVec3| (1e3 * v).to_array().map(|x| format!("{}", (1e3 * x).round() / 1e3)).join(", ");
        let problem = format!("beam `{name}` lies outside the cast in {shown}, at least in part");
        let advice = format!("it goes from ({}) mm to ({}) mm", show(low), show(high));
        return Err(cuts.refuse(&format!("beam.{place}.min"), problem, advice).into());
    }
    let bodies = &cast.state.inclusions;
    let block = Block { low: beam.min, high: beam.max };
    let frame = Frame { low: beam.min, high: beam.max, along: beam.along };
    let mut found = pieces(bodies, &block);
    found.sort_unstable_by_key(|piece| bodies.id[piece.body]);
    let fibres: Vec<Fibre> = found
        .iter()
        .filter_map(|piece| match *bodies.form(piece.body) {
            Form::Fibre { diameter, .. } => {
                Some(Fibre { ends: piece.ends.map(|end| frame.of(end)), diameter })
            }
            _ => None,
        })
        .collect();
    if fibres.is_empty() {
        return Err(cuts
            .refuse(
                &format!("beam.{place}"),
                format!("there are no fibres in beam `{name}` of {shown}"),
                "move it to where the concrete is",
            )
            .into());
    }
    let title = format!("Beam {name} of {}", cast.case.title);
    Ok(Piece { title, size: frame.size(), fibres })
}

/// The frame of a beam: x along it, z upwards as in the cast if the beam lies, from its lower corner.
struct Frame {
    low: DVec3,
    high: DVec3,
    along: usize,
}

impl Frame {
    fn of(&self, point: DVec3) -> DVec3 {
        let (p, q) = (point - self.low, self.high - point);
        match self.along {
            0 => p,
            1 => DVec3::new(p.y, q.x, p.z),
            _ => DVec3::new(p.z, p.y, q.x),
        }
    }

    fn size(&self) -> DVec3 {
        let size = self.high - self.low;
        match self.along {
            0 => size,
            1 => DVec3::new(size.y, size.x, size.z),
            _ => DVec3::new(size.z, size.y, size.x),
        }
    }
}

/// The beam file for a piece: that which is given, or the thesis's, with the fibres in a file beside it.
pub(super) fn text(given: Option<&BeamCase>, piece: &Piece) -> anyhow::Result<String> {
    let written = piece.size.to_array().map(|x| format!("\"{} mm\"", (1e6 * x).round() / 1e3)).join(", ");
    let text = match given {
        Some(case) => {
            if case.fibres.is_some() {
                let which = match case.fibres {
                    Some(BeamFibres::Listed(_)) => "fibres.listed",
                    _ => "fibres.random",
                };
                let problem = "the fibres come from the cast, and are said here again";
                return Err(case.refuse(which, problem, "leave the section out, or --from").into());
            }
            if (case.size - piece.size).abs().max_element() > 1e-6 {
                let problem = "the beam that is cut out of the cast has another size";
                return Err(case.refuse("size", problem, format!("write [{written}]")).into());
            }
            case.text.clone()
        }
        None => THESIS
            .replace("\"TITLE\"", &toml::Value::String(piece.title.clone()).to_string())
            .replace("[SIZE]", &format!("[{written}]")),
    };
    Ok(format!(
        "{}\n\n# The fibres of the cast, cut at the faces of the beam.\n[fibres.listed]\nfile = \"{FIBRES}\"\n",
        text.trim_end()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_of_a_beam_is_turned_not_mirrored() {
        let (low, high) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.25, 0.8, 0.45));
        for along in 0..3 {
            let frame = Frame { low, high, along };
            let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|way| frame.of(low + way));
            assert!(((x - o).cross(y - o).dot(z - o) - 1.0).abs() < 1e-12, "{along}");
            let end = frame.of(high);
            assert!((frame.of(low) - end).abs().abs_diff_eq(frame.size(), 1e-12));
        }
        assert_eq!(Frame { low, high, along: 1 }.of(low).z, 0.0);
    }

    #[test]
    fn the_thesis_stands_in_for_a_file() {
        let piece =
            Piece { title: "Beam \"B1\"".into(), size: DVec3::new(0.6, 0.15, 0.15), fibres: Vec::new() };
        let text = text(None, &piece).unwrap();
        assert!(text.contains("[\"600 mm\", \"150 mm\", \"150 mm\"]"), "{text}");
        let alone = text.split("# The fibres of the cast").next().unwrap();
        let case = BeamCase::parse("beam.toml", alone).unwrap();
        assert_eq!((case.title.as_str(), case.matrix.strength), ("Beam \"B1\"", 2e6));
        let other = Piece { size: DVec3::new(0.5, 0.15, 0.15), ..piece };
        let refused = super::text(Some(&case), &other).unwrap_err().to_string();
        assert!(refused.contains("another size"), "{refused}");
    }
}
