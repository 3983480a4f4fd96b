//! Fibres too many to follow one by one: how they lie is a field that the fluid carries along.

use tremie_suspension::{Closure, Direction, FolgarTucker, Form, interaction_coefficient, shape_factor};

use crate::document::{Bound, Choice, Maybe, Need, Or, Quantity, Section, WordOr, maybe, need, or};
use crate::inclusions::{DIRECTIONS, FIBRE};
use crate::schema::{LENGTH, quantity};
use crate::units::Dimension;

/// Fibres that are everywhere in the fluid, as an orientation tensor at each place. They do nothing to the fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FibreField {
    /// Their form.
    pub form: Form,
    /// Share that they take of the volume, of fluid and fibres together.
    pub share: f64,
    /// How they lie at the start and where fluid comes in.
    pub direction: Direction,
    /// How the flow turns them.
    pub law: FolgarTucker,
    /// Edge in m of the squares over which their orientation is gathered.
    pub region: f64,
}

pub(crate) const FIBRE_FIELD: Section<FibreField> = {
    const FIBRE_KEY: Need<Section<Form>> = need("fibre", "their form: straight fibres", FIBRE);
    const SHARE: Need<Quantity> = need(
        "volume_fraction",
        "share of the volume that they take",
        quantity(Dimension::NUMBER, Bound::UpTo(0.6), "0.005"),
    );
    const DIRECTION: Or<WordOr<Direction>> =
        or("direction", "\"isotropic\"", "how they lie at the start and where fluid comes in", DIRECTIONS);
    const INTERACTION: Maybe<Quantity> = maybe(
        "interaction",
        "interaction coefficient C_I: how much fibres disturb each other; if absent, 0.03 (1 - exp(-0.224 volume_fraction length/diameter)) (Phan-Thien et al. 2002)",
        quantity(Dimension::NUMBER, Bound::NotNegative, "0.01"),
    );
    const CLOSURE: Or<Choice<Closure>> = or(
        "closure",
        "\"ibof\"",
        "what stands for the mean of four directions",
        Choice(&[
            ("ibof", "fitted to flows that are known (Chung and Kwon 2002)", Closure::Ibof),
            (
                "hybrid",
                "the older one, by which fibres align too fast (Advani and Tucker 1990)",
                Closure::Hybrid,
            ),
        ]),
    );
    const REGION: Maybe<Quantity> = maybe(
        "region",
        "edge of the squares over which their orientation is gathered, rounded to whole cells; their length if absent",
        LENGTH,
    );
    Section {
        keys: &[&FIBRE_KEY, &SHARE, &DIRECTION, &INTERACTION, &CLOSURE, &REGION],
        example: &["fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }", "volume_fraction = 0.005"],
        read: |t| {
            let form = t.need(&FIBRE_KEY)?;
            let Form::Fibre { length, diameter } = form else {
                let fault =
                    t.itself().fault("has no fibre", "write fibre = { length = ..., diameter = ... }");
                return Err(fault);
            };
            let share = t.need(&SHARE)?;
            let interaction = t.maybe(&INTERACTION)?;
            let (.., closure) = *t.or(&CLOSURE)?;
            let law = FolgarTucker {
                shape: shape_factor(length, diameter),
                interaction: interaction.unwrap_or(interaction_coefficient(share, length / diameter)),
                closure,
            };
            let region = t.maybe(&REGION)?.unwrap_or(length);
            Ok(FibreField { form, share, direction: t.or(&DIRECTION)?, law, region })
        },
    }
};
