fn main() {
    let a: Vec<String> = std::env::args().collect();
    let case = tremie_case::Case::read(a[1].as_ref()).unwrap();
    let n: usize = a[2].parse().unwrap();
    let mut s = tremie_sph::simulation(&case);
    let t = std::time::Instant::now();
    for i in 0..n {
        s.advance().unwrap();
        if i % 20 == 19 {
            println!("{i} t={:.4} dt={:.2e} wall={:.2}", s.time(), s.time_step(), t.elapsed().as_secs_f64());
        }
    }
    let e = t.elapsed().as_secs_f64();
    println!(
        "{} particles, {:.4} s a step, {:.4} M updates/s",
        s.load().wet,
        e / n as f64,
        1e-6 * s.load().updates as f64 / e
    );
    tremie_sph::report();
}
