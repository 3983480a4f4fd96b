//! Fibres whose ends must stay in the fluid.
//!
//! A straight fibre of length L with its centre at a distance d from a wall or the surface, along the axis n, cannot stand steeper against it than
//! `|p.n| <= c = 2 d/L`; so of all fibres that have their centres there `a_nn = <(p.n)^2> <= c^2`. A thin layer lays fibres flat in this way, which
//! no velocity gradient of an orientation field tells (module `folgar_tucker`).

use tremie_numerics::{DMat3, DVec3};

/// The orientation tensor `a` of fibres that are pressed flat as far as they must, for the `room` in each axis: the way to the nearest wall or surface over half of a
/// fibre's length, or 1 where there is more.
///
/// Along each axis where there is more than `room^2` of `a` there is as much then, and the rest goes to the others in proportion to what they have.
pub fn confined(a: &DMat3, room: DVec3) -> DMat3 {
    // Where there is none along any axis, all are as good.
    let room = room.max(DVec3::splat(1e-3));
    let most = (room * room).to_array();
    let before = [a.x_axis.x, a.y_axis.y, a.z_axis.z];
    let (mut shares, mut raised, mut full) = (before, [0.0; 3], [false; 3]);
    // What one axis gives may be too much for another: three turns at most.
    loop {
        let over = [0, 1, 2].map(|n| !full[n] && shares[n] > most[n]);
        if over == [false; 3] {
            break;
        }
        full = [0, 1, 2].map(|n| full[n] || over[n]);
        let sum = |of: &[f64; 3], full_ones: bool| -> f64 {
            (0..3).filter(|n| full[*n] == full_ones).map(|n| of[n]).sum()
        };
        let (left, there) = (1.0 - sum(&most, true), sum(&shares, false));
        let free = full.iter().filter(|full| !**full).count() as f64;
        for n in 0..3 {
            match full[n] {
                true => shares[n] = most[n],
                false if there > 0.0 => shares[n] *= left / there,
                // All stood along one axis: nothing tells which way they fall.
                false => raised[n] = left / free,
            }
        }
    }
    let sum: f64 = shares.iter().chain(&raised).sum();
    let scale = [0, 1, 2].map(|n| if before[n] > 0.0 { (shares[n] / before[n] / sum).sqrt() } else { 0.0 });
    let scale = DMat3::from_diagonal(scale.into());
    scale * *a * scale + DMat3::from_diagonal(DVec3::from(raised) / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::{components, principal};

    const TILTED: DMat3 = DMat3::from_cols_array(&[0.3, 0.1, -0.05, 0.1, 0.2, 0.08, -0.05, 0.08, 0.5]);

    fn shares(a: &DMat3) -> [f64; 3] {
        [a.x_axis.x, a.y_axis.y, a.z_axis.z]
    }

    #[test]
    fn where_there_is_room_nothing_changes() {
        assert_eq!(components(&confined(&TILTED, DVec3::ONE)), components(&TILTED));
        assert_eq!(components(&confined(&TILTED, DVec3::new(1.0, 1.0, 0.71))), components(&TILTED));
    }

    #[test]
    fn a_layer_lays_fibres_flat_as_far_as_it_must() {
        let flat = confined(&TILTED, DVec3::new(1.0, 1.0, 0.5));
        let [x, y, z] = shares(&flat);
        assert!((z - 0.25).abs() < 1e-15 && (x / y - 1.5).abs() < 1e-12 && (x + y + z - 1.0).abs() < 1e-15);
        assert!(principal(&flat).values[2] > 0.0);
        // Once is enough.
        let again = confined(&flat, DVec3::new(1.0, 1.0, 0.5));
        assert!(components(&again).iter().zip(components(&flat)).all(|(a, b)| (a - b).abs() < 1e-15));
        // Some that stood upright may fall any way.
        let upright = confined(&DMat3::from_diagonal(DVec3::Z), DVec3::new(1.0, 1.0, 0.5));
        assert_eq!(components(&upright), [0.375, 0.375, 0.25, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn in_edges_they_lie_along_and_in_corners_they_stay_fibres() {
        let [x, y, z] = shares(&confined(&TILTED, DVec3::new(1.0, 0.3, 0.3)));
        assert!((x - 0.82).abs() < 1e-12 && (y - 0.09).abs() < 1e-12 && (z - 0.09).abs() < 1e-12);
        let corner = confined(&TILTED, DVec3::splat(0.1));
        assert!((shares(&corner).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(principal(&corner).values[2] > 0.0);
        assert!((shares(&confined(&TILTED, DVec3::ZERO)).iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// No more steep ones are left than among as many that are put down at random where they fit.
    #[test]
    fn those_that_fit_are_left_alone() {
        for room in [0.2_f64, 0.5, 0.8] {
            // Uniform in |p.n| up to the room.
            let upright = room * room / 3.0;
            let a = DMat3::from_diagonal(DVec3::new(0.5 * (1.0 - upright), 0.5 * (1.0 - upright), upright));
            assert_eq!(components(&confined(&a, DVec3::new(1.0, 1.0, room))), components(&a));
        }
    }
}
