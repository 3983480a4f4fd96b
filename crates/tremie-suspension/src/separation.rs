//! Bodies that overlap are moved apart.
//!
//! Each pair in turn is moved along its normal until it only touches, as far as each answers to a push, with the distance between
//! them asked for anew (non-linear Gauss-Seidel). Velocities stay as they are.

use tremie_numerics::{DQuat, DVec3};

use crate::distance::{Outline, gap};
use crate::impulse::WALL;
use crate::near_wall::near_walls;
use crate::{Inclusions, Periods, Response, Walls};

/// Overlaps up to this share of the lesser diameter are left alone.
pub(crate) const ALLOWED: f64 = 2e-3;

/// Most times that pairs are looked for.
pub(crate) const ROUNDS: u32 = 8;

/// Most turns through the pairs of one round.
const TURNS: u32 = 50;

/// Moves apart what overlaps among some pairs of bodies, or of a body and the walls, and says of each body whether it was moved.
pub(crate) fn push_apart(
    pairs: &[(u32, u32)],
    bodies: &mut Inclusions,
    outlines: &mut [Outline],
    responses: &[Response],
    walls: &impl Walls,
    periods: &Periods,
) -> Vec<bool> {
    // When bodies were last moved, and pairs last seen.
    const UNMOVED: u32 = 1;
    let (mut moved, mut seen, mut clock) = (vec![UNMOVED; outlines.len()], vec![0_u32; pairs.len()], UNMOVED);
    let mut touches = Vec::new();
    let overlap = |distance: f64, thickness: f64| distance < -ALLOWED * thickness;
    let mut push =
        |n: usize, arm: DVec3, impulse: DVec3, outlines: &mut [Outline], moved: &mut [u32], clock: u32| {
            let (way, turn) = responses[n].to(arm, impulse);
            bodies.position[n] += way;
            bodies.orientation[n] = (DQuat::from_scaled_axis(turn) * bodies.orientation[n]).normalize();
            outlines[n] = Outline::of(bodies, n);
            moved[n] = clock;
        };
    for _ in 0..TURNS {
        let mut busy = false;
        for (pair, last) in pairs.iter().zip(&mut seen) {
            let (a, b) = (pair.0 as usize, pair.1 as usize);
            let changed = moved[a].max(moved.get(b).copied().unwrap_or(0));
            if changed <= *last {
                continue;
            }
            *last = clock;
            if pair.1 == WALL {
                near_walls(&outlines[a], walls, 0.0, &mut touches);
                let nearest = touches.iter().min_by(|s, t| s.distance.total_cmp(&t.distance));
                let Some(touch) = nearest.filter(|touch| overlap(touch.distance, outlines[a].thickness))
                else {
                    continue;
                };
                let answer = touch.normal.dot(responses[a].at(touch.at) * touch.normal);
                if answer > 0.0 {
                    clock += 1;
                    busy = true;
                    push(a, touch.at, -touch.distance / answer * touch.normal, outlines, &mut moved, clock);
                }
            } else {
                let way = periods.shortest(outlines[b].centre - outlines[a].centre);
                let met = gap(&outlines[a], &outlines[b], way);
                if !overlap(met.distance, outlines[a].thickness.min(outlines[b].thickness)) {
                    continue;
                }
                let (at_a, at_b) = (met.at, met.at - way);
                let answer = met.normal.dot((responses[a].at(at_a) + responses[b].at(at_b)) * met.normal);
                if answer > 0.0 {
                    clock += 1;
                    busy = true;
                    let impulse = -met.distance / answer * met.normal;
                    push(a, at_a, -impulse, outlines, &mut moved, clock);
                    push(b, at_b, impulse, outlines, &mut moved, clock);
                }
            }
        }
        if !busy {
            break;
        }
    }
    moved.into_iter().map(|when| when > UNMOVED).collect()
}
