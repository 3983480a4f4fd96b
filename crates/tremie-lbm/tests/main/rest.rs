//! Fluids that have no reason to move, and exact flows that a lattice must get right.

use tremie_simulation::{Cells, Simulation};

use crate::{advance, advanced, case, cells};

#[test]
fn a_tank_at_rest_stays_at_rest() {
    let text = "[material]\ndensity = \"1000 kg/m3\"\n[material.newtonian]\nviscosity = \"1 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.1 m\", \"0.1 m\", \"0.2 m\"]\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"0.1 m\", \"0.1537 m\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\nhydrostatic_error = \"0.05 %\"\n";
    let cells = cells(&*advanced(&case(text), 4000));
    let mut level = 0.0;
    for k in 0..cells.count[2] {
        let n = cells.index(4, 5, k);
        level += cells.fill[n] * cells.size;
        if cells.fill[n] == 1.0 {
            let depth = 0.1537 - (k as f64 + 0.5) * cells.size;
            let exact = 1000.0 * 9.81 * depth;
            assert!((cells.pressure[n] - exact).abs() < 0.005 * 1000.0 * 9.81 * 0.1537, "{depth}");
        }
    }
    assert!((level - 0.1537).abs() < 0.02 * cells.size, "{level}");
    let fastest = cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(fastest < 1e-6 * (9.81f64 * 0.1537).sqrt(), "{fastest}");
}

#[test]
fn a_block_below_its_yield_stress_does_not_flow() {
    // tau0 / (rho g H) = 1.1: far too stiff to flow under its own weight.
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"2500 Pa\"\nplastic_viscosity = \"50 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.2 m\", \"0.15 m\"]\n\
         [[fluid]]\nbox = { min = [\"0.05 m\", \"0.05 m\", \"0 m\"], max = [\"0.15 m\", \"0.15 m\", \"0.1 m\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\n";
    let mut simulation = advanced(&case(text), 0);
    let before = cells(&*simulation);
    advance(&mut *simulation, 4000);
    let after = cells(&*simulation);
    assert_eq!(before.count, after.count);
    for n in 0..before.fill.len() {
        assert!((before.fill[n] - after.fill[n]).abs() < 1e-3, "{n} {} {}", before.fill[n], after.fill[n]);
    }
    // It stands on stresses that its free sides allow: half-way up it is pressed together by much less than the hydrostatic
    // pressure (by a third of it, where sides and foot are far away).
    let middle = before.index(5, 5, 4);
    let share = before.pressure[middle] / (2300.0 * 9.81 * 0.055);
    assert!((0.25..0.6).contains(&share), "{share}");
}

/// A film in a corner, thinner than a cell and held up by its yield stress, above a pool that fills the box.
#[test]
fn a_film_in_a_corner_stops_trembling() {
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"200 Pa\"\nplastic_viscosity = \"30 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"100 mm\", \"100 mm\", \"340 mm\"]\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"100 mm\", \"100 mm\", \"100 mm\"] }\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"100 mm\"], max = [\"18 mm\", \"18 mm\", \"300 mm\"] }\n\
         [lbm]\ncell_size = \"20 mm\"\ntime_step = \"1.16 ms\"\n";
    let mut simulation = advanced(&case(text), 0);
    let fastest = |simulation: &dyn Simulation| {
        let cells = cells(simulation);
        let wet = (0..cells.fill.len()).filter(|n| cells.fill[*n] >= 0.5);
        wet.map(|n| cells.velocity[n].length()).fold(0.0, f64::max)
    };
    // Let go at once it rings, by as much as it falls in a step and more.
    advance(&mut *simulation, 10);
    assert!(fastest(&*simulation) > 5e-3);
    advance(&mut *simulation, 1700);
    assert!(fastest(&*simulation) < 1e-4, "{}", fastest(&*simulation));
}

#[test]
fn what_flows_starts_with_its_hydrostatic_pressure_and_so_does_what_is_confined() {
    let start = |yield_stress: f64, gap: f64| {
        let text = format!(
            "[material]\ndensity = \"2300 kg/m3\"\n\
             [material.bingham]\nyield_stress = \"{yield_stress} Pa\"\nplastic_viscosity = \"50 Pa s\"\n\
             [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.2 m\", \"0.15 m\"]\n\
             [[fluid]]\nbox = {{ min = [\"{gap} m\", \"{gap} m\", \"0 m\"], max = [\"{} m\", \"{} m\", \"0.1 m\"] }}\n\
             [lbm]\ncell_size = \"10 mm\"\n",
            0.2 - gap,
            0.2 - gap
        );
        let cells = cells(&*advanced(&case(&text), 0));
        cells.pressure[cells.index(4, 4, 5)] / (2300.0 * 9.81 * 0.045)
    };
    assert!((start(500.0, 0.05) - 1.0).abs() < 0.01, "{}", start(500.0, 0.05));
    assert!((start(2500.0, 0.0) - 1.0).abs() < 0.01, "{}", start(2500.0, 0.0));
    assert!(start(2500.0, 0.05) < 0.6);
}

#[test]
fn a_channel_carries_its_parabola() {
    // Body force along x between two walls: u = g (z/2)(H - z)/nu, exact in the middle of the cells.
    let text = "[material]\ndensity = \"1000 kg/m3\"\n[material.newtonian]\nviscosity = \"1 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"5 mm\", \"5 mm\", \"0.16 m\"]\n\
         gravity = [\"0.001 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         [domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"5 mm\", \"5 mm\", \"0.16 m\"] }\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\ntime_step = \"0.005 s\"\n";
    let cells = cells(&*advanced(&case(text), 32000));
    for k in 0..32 {
        let z = (k as f64 + 0.5) * 0.005;
        let exact = 0.001 * 0.5 * z * (0.16 - z) / 1e-3;
        let n = cells.index(0, 0, k);
        assert!(
            (cells.velocity[n].x - exact).abs() < 1e-6 * exact,
            "{} against {exact}",
            cells.velocity[n].x
        );
        let (rate, wall) = (0.001 * (0.08 - z).abs() / 1e-3, 0.08);
        assert!((cells.shear_rate[n] - rate).abs() < 1e-6 * wall, "{} against {rate}", cells.shear_rate[n]);
        assert!((cells.stress[n] - rate).abs() < 1e-6 * wall);
    }
}

#[test]
fn a_tank_of_little_yield_stress_comes_to_rest() {
    // Its walls must not take the weight that the pressure carries for traction: a sixth of a cell's weight is 38 Pa here.
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"5 Pa\"\nplastic_viscosity = \"20 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"160 mm\", \"10 mm\", \"200 mm\"]\n\
         [domain.sides]\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"160 mm\", \"10 mm\", \"160 mm\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n";
    let mut simulation = advanced(&case(text), 0);
    while simulation.time() < 4.0 {
        advance(&mut *simulation, 100);
    }
    let cells = cells(&*simulation);
    let speed = cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(speed < 1e-5, "{speed} m/s");
    assert!(cells.shear_rate.iter().all(|rate| *rate == 0.0), "something yields");
}

/// A film of Bingham fluid on an incline, `cells` thick, pulled along x by `load` times its yield stress at the floor.
fn film(cells: f64, load: f64) -> String {
    let (size, density, yield_stress) = (0.005, 2300.0, 50.0);
    let height = cells * size;
    let pull = load * yield_stress / (density * height);
    format!(
        "[material]\ndensity = \"{density} kg/m3\"\n\
         [material.bingham]\nyield_stress = \"{yield_stress} Pa\"\nplastic_viscosity = \"30 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"20 mm\", \"20 mm\", \"40 mm\"]\n\
         gravity = [\"{pull} m/s2\", \"0 m/s2\", \"-9.81 m/s2\"]\n\
         [domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"20 mm\", \"20 mm\", \"{height} m\"] }}\n\
         [lbm]\ncell_size = \"{size} m\"\nprecision = \"f64\"\ntime_step = \"0.2 ms\"\n"
    )
}

#[test]
fn a_film_yields_where_it_should_be_it_thinner_than_a_cell_or_thicker() {
    for thickness in [0.25, 0.6, 1.3, 2.7, 4.5] {
        // Just above the yield stress only a thin layer at the floor shears; the rest slides on it as a plug, with
        // u = rho g h_y^2 / (2 mu), h_y = h (1 - 1/load) its thickness.
        let load = 1.1;
        let sheared = thickness * 0.005 * (1.0 - 1.0 / load);
        let exact = load * 50.0 / (thickness * 0.005) * sheared * sheared / (2.0 * 30.0);
        let flowing = cells(&*advanced(&case(&film(thickness, load)), 6000));
        let speed = flowing.velocity.iter().map(|u| u.x).fold(0.0, f64::max);
        assert!((speed / exact - 1.0).abs() < 0.01, "{thickness} cells: {speed} against {exact}");
        // Just below it stands: single cells of a rigid film still ring a little, but nothing is carried along.
        let mut resting = advanced(&case(&film(thickness, 0.95)), 6000);
        let mut carried = 0.0;
        for _ in 0..40 {
            advance(&mut *resting, 25);
            let seen = cells(&*resting);
            let momentum: f64 = seen.velocity.iter().zip(&seen.fill).map(|(u, fill)| u.x * fill).sum();
            carried += momentum / seen.fill.iter().sum::<f64>() / 40.0;
        }
        assert!(carried.abs() < 0.2 * exact, "{thickness} cells: {carried} against {exact}");
    }
}

#[test]
fn a_film_without_liquid_slides_over_a_floor_without_friction() {
    // Stiff, and thinner than a cell: a rigid plate.
    let (width, speed, time) = (0.05, 0.1, 0.1);
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"200 Pa\"\nplastic_viscosity = \"30 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"120 mm\", \"20 mm\", \"40 mm\"]\n\
         [domain.sides]\nx_min = \"open\"\nx_max = \"open\"\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         z_min = { surface = \"free_slip\" }\n\
         [[fluid]]\nbox = { min = [\"30 mm\", \"0 m\", \"0 m\"], max = [\"80 mm\", \"20 mm\", \"3 mm\"] }\n\
         velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\ntime_step = \"0.2 ms\"\n";
    let film = cells(&*advanced(&case(text), (time / 0.2e-3) as usize));
    let volume: f64 = film.fill.iter().sum();
    let share = volume * film.size.powi(3) / (width * 0.02 * 0.003);
    assert!((share - 1.0).abs() < 1e-3, "{share} of it is there");
    let at = |n: usize| film.origin.x + (n % film.count[0]) as f64 * film.size + 0.5 * film.size;
    let middle = film.fill.iter().enumerate().map(|(n, fill)| fill * at(n)).sum::<f64>() / volume;
    // The film's ends are known to half a cell.
    let went = middle - 0.055;
    assert!((went - speed * time).abs() < 0.5 * film.size, "{went} m");
}

#[test]
fn a_front_leaves_no_void_behind() {
    // A block that collapses over a floor without slip: the front rolls over the floor, and must fill it.
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"50 Pa\"\nplastic_viscosity = \"30 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.6 m\", \"10 mm\", \"0.22 m\"]\n\
         [domain.sides]\nx_min = \"symmetry\"\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.2 m\", \"10 mm\", \"0.2 m\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\n";
    let cells = cells(&*advanced(&case(text), 6000));
    assert!(cells.count[0] > 50, "the block has spread");
    let mut hidden = 0.0;
    for i in 0..cells.count[0] {
        for k in 0..cells.count[2] - 1 {
            if cells.fill[cells.index(i, 0, k + 1)] == 1.0 {
                hidden += 1.0 - cells.fill[cells.index(i, 0, k)];
            }
        }
    }
    let volume: f64 = cells.fill.iter().sum();
    assert!(hidden < 0.01 * volume, "{hidden} of {volume}");
}

#[test]
fn a_front_lower_than_a_cell_moves_on_and_comes_to_rest() {
    // A film of half a cell with a front, pulled along by three times what it can hold, then by half of it.
    let film = |load: f64| {
        let pull = load * 20.0 / (2300.0 * 0.005);
        format!(
            "[material]\ndensity = \"2300 kg/m3\"\n\
             [material.bingham]\nyield_stress = \"20 Pa\"\nplastic_viscosity = \"20 Pa.s\"\n\
             [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"10 mm\", \"0.05 m\"]\n\
             gravity = [\"{pull} m/s2\", \"0 m/s2\", \"-9.81 m/s2\"]\n\
             [domain.sides]\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
             [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"10 mm\", \"5 mm\"] }}\n\
             [lbm]\ncell_size = \"10 mm\"\ntime_step = \"0.5 ms\"\n"
        )
    };
    let front = |load: f64| {
        let cells = cells(&*advanced(&case(&film(load)), 30_000));
        assert!((cells.fill.iter().sum::<f64>() / 5.0 - 1.0).abs() < 0.02, "the film's volume is kept");
        let reach = (0..cells.count[0]).rev().find(|i| cells.fill[cells.index(*i, 0, 0)] > 0.05);
        cells.origin.x + cells.size * (1 + reach.expect("there is a film")) as f64
    };
    assert!(front(3.0) > 0.135, "{}", front(3.0));
    assert!(front(0.5) < 0.115, "{}", front(0.5));
}

#[test]
fn crumbs_that_nothing_holds_are_taken_up() {
    // Half a cell high over a pool, beside a plane of symmetry, and at the upper edge of a bar: there they cannot fall, nor may they go ever faster.
    let text = "[material]\ndensity = \"2300 kg/m3\"\nnewtonian.viscosity = \"30 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"80 mm\", \"120 mm\"]\n\
         sides = { x_min = \"symmetry\", y_min = \"symmetry\" }\n\
         [[solid]]\nbox = { min = [\"40 mm\", \"0 m\", \"0 m\"], max = [\"60 mm\", \"20 mm\", \"70 mm\"] }\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"80 mm\", \"80 mm\", \"33 mm\"] }\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"60 mm\", \"90 mm\"], max = [\"10 mm\", \"70 mm\", \"95 mm\"] }\n\
         [[fluid]]\nbox = { min = [\"60 mm\", \"0 mm\", \"70 mm\"], max = [\"70 mm\", \"10 mm\", \"75 mm\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n";
    let mut simulation = advanced(&case(text), 0);
    let wet_above = |cells: &Cells| {
        let layer = cells.count[0] * cells.count[1];
        cells.fill.iter().skip(5 * layer).filter(|fill| **fill > 0.0).count()
    };
    let before = cells(&*simulation);
    assert_eq!(wet_above(&before), 2);
    advance(&mut *simulation, 400);
    let after = cells(&*simulation);
    assert_eq!(wet_above(&after), 0);
    let volume = |cells: &Cells| cells.fill.iter().sum::<f64>();
    assert!((volume(&after) / volume(&before) - 1.0).abs() < 1e-3);
}
