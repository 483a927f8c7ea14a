use chalumeau::bore::{cells::Cells, fit, instrument_file::InstrumentFile, lattice::LatticeCoeffs, transfer_matrix::{TransferMatrix, find_peaks}};
use chalumeau::units::{Air, cents};
fn eval(file: &InstrumentFile, cells: &Cells, air: &Air, label: &str) {
    let c = LatticeCoeffs::new(cells, &fit::networks(file, air), 6000.0, air);
    let tm = TransferMatrix::new(file, *air);
    for (lo, hi) in [(52u8, 84u8), (85, 97)] {
    let mut acc = vec![(0.0f64,0.0f64,0.0f64,0.0f64,0); 5];
    for f in file.fingerings.iter().filter(|f| f.written.0 >= lo && f.written.0 <= hi) {
        let op: Vec<f64> = f.open.iter().map(|&o| o as u8 as f64).collect();
        let pl = find_peaks(|x| c.impedance(x, &op), 14);
        for (n, t) in tm.peaks(&f.open, 0.0, 5).iter().enumerate() {
            let p = pl.iter().min_by(|a, b| (a.f_hz / t.f_hz).ln().abs().total_cmp(&(b.f_hz / t.f_hz).ln().abs())).unwrap();
            let (ce, db) = (cents(p.f_hz, t.f_hz).abs(), (20.0 * (p.mag_over_zc / t.mag_over_zc).log10()).abs());
            let a = &mut acc[n]; a.0 += ce; a.1 = a.1.max(ce); a.2 += db; a.3 = a.3.max(db); a.4 += 1;
        }
    }
    println!("{label} {lo}..{hi}: {}", acc.iter().map(|a| format!("{:.2}/{:.1}c {:.2}/{:.2}dB", a.0/a.4 as f64, a.1, a.2/a.4 as f64, a.3)).collect::<Vec<_>>().join(" | "));
    }
}
fn main() {
    let file = InstrumentFile::built_in(); let air = Air::default();
    for rate in [96000.0, 88200.0] {
        let t = std::time::Instant::now();
        let cut = Cells::cut(&file, &air, rate).unwrap();
        println!("{:?}", cut.cells.iter().map(|c| c.ticks).collect::<Vec<_>>());
        eval(&file, &cut, &air, "cut");
        println!("{:?}", t.elapsed());
        let t = std::time::Instant::now();
        let f = fit::fit(&file, &air, rate).unwrap();
        println!("fit {:?}", t.elapsed());
        eval(&file, &f, &air, "fit");
        println!("radii change % {:?}", f.cells.iter().zip(&cut.cells).map(|(a,b)| ((a.radius_m/b.radius_m-1.0)*1000.0).round()/10.0).collect::<Vec<_>>());
        println!("end {} loss {:?}", f.end_radius_m, f.loss_strengths);
    }
}
