//! Figures of impedance, bore and performance, and the report, compared by what they say; and what refuses to be drawn.
//!
//! `tests/golden/NAME.json` holds a figure with long curves thinned out. A number may differ by its tolerance, words may
//! not. After a change that is meant, `UPDATE_GOLDEN=1 cargo core --test figures_performance` writes them anew.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use chalumeau_core::analysis::impedance::cutoff_hz;
use chalumeau_core::analysis::overview::{Envelope, Overview, Watcher};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::haptics::{FeelDesign, FeelTable, NoteFeel, RequirementSolver, TorqueLimits, torque_law};
use chalumeau_core::instrument::feel_inputs::played_reed;
use chalumeau_core::instrument::{Clarinet, KeyNotes, Settings};
use chalumeau_core::measure::bifurcation;
use chalumeau_core::reed::ReedTables;
use chalumeau_core::score::Score;
use chalumeau_core::score::breath::BreathCurve;
use chalumeau_core::score::play_probed;
use chalumeau_core::units::{Air, SoundingNote, WrittenNote};
use chalumeau_figure::breath;
use chalumeau_figure::breath::NotePressures;
use chalumeau_figure::felt::{AtContrast, FeltThresholds, Torque, thresholds, torques};
use chalumeau_figure::impedance::{Curve, FingeringImpedance, NotePeaks, chart, fingering};
use chalumeau_figure::performance::{Note, PerformanceFigure, ReedCloseUp, performance};
use chalumeau_figure::{Figure, Layer, Panel, bore};
use chalumeau_knob::wire::message::TorqueLaw;
use serde_json::Value;
use std::convert::Infallible;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Points kept of a long curve.
const KEPT: usize = 40;
/// What numbers may differ by, of themselves and at least: figures are drawn to about a thousandth of their width.
const RELATIVE: f64 = 1e-3;
const ABSOLUTE: f64 = 2e-3;

fn golden_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.json"))
}

/// The figure as JSON, long lists thinned out, of a heat map only where each column is loudest.
fn digest(figure: &Figure) -> Value {
    fn thin(value: &mut Value) {
        match value {
            Value::Object(map) => {
                if let (Some(rows), Some(levels)) =
                    (map.get("rows").and_then(Value::as_u64), map.get("levels").and_then(Value::as_array))
                {
                    let rows = rows as usize;
                    let loudest = levels.chunks(rows).map(|column| {
                        let level = |row: usize| column[row].as_f64().unwrap();
                        (0..rows).max_by(|&a, &b| level(a).total_cmp(&level(b))).unwrap()
                    });
                    let loudest: Vec<usize> = loudest.collect();
                    map.insert("levels".to_owned(), loudest.into());
                }
                map.values_mut().for_each(thin);
            }
            Value::Array(list) => {
                if list.len() > KEPT {
                    let every = list.len().div_ceil(KEPT);
                    let kept = list.iter().step_by(every).cloned().collect::<Vec<_>>();
                    *list = kept;
                }
                list.iter_mut().for_each(thin);
            }
            // Six digits are more than the tolerance needs.
            Value::Number(number) => {
                if let Some(x) = number.as_f64().filter(|x| x.fract() != 0.0) {
                    *value = format!("{x:.6e}").parse::<f64>().unwrap().into();
                }
            }
            _ => {}
        }
    }
    let mut value = serde_json::to_value(figure).unwrap();
    thin(&mut value);
    value
}

fn compare(place: &str, found: &Value, wanted: &Value) {
    match (found, wanted) {
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{place}: fields {:?}, not {:?}", a.keys(), b.keys());
            a.iter().for_each(|(key, value)| compare(&format!("{place}.{key}"), value, &b[key]));
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            for (index, (a, b)) in a.iter().zip(b).enumerate() {
                compare(&format!("{place}[{index}]"), a, b);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!((a - b).abs() <= ABSOLUTE + RELATIVE * b.abs(), "{place}: {a}, not {b}");
        }
        (a, b) => assert_eq!(a, b, "{place}"),
    }
}

#[track_caller]
fn golden(name: &str, figure: &Figure) {
    let found = digest(figure);
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::create_dir_all(golden_path(name).parent().unwrap()).unwrap();
        fs::write(golden_path(name), format!("{}\n", serde_json::to_string(&found).unwrap())).unwrap();
        return;
    }
    let text = fs::read_to_string(golden_path(name)).unwrap();
    compare(name, &found, &serde_json::from_str(&text).unwrap());
}

#[test]
fn golden_comparison_can_fail() {
    let figure = bore::profile(&InstrumentFile::built_in(), None);
    let mut other = figure.clone();
    let Layer::Polygon(body) = &mut other.panels[0].layers[0] else { panic!("the body comes first") };
    body.corners[0][1] += 0.05;
    let said = std::panic::catch_unwind(|| compare("bore", &digest(&other), &digest(&figure)));
    assert!(said.is_err());
    compare("bore", &digest(&figure), &digest(&figure));
}

fn lines(panel: &Panel) -> Vec<&Vec<[f64; 2]>> {
    panel
        .layers
        .iter()
        .filter_map(|layer| if let Layer::Line(line) = layer { Some(&line.pieces) } else { None })
        .flatten()
        .collect()
}

#[test]
fn an_impedance_says_where_its_modes_and_its_cutoff_are() {
    let file = InstrumentFile::built_in();
    let model = TransferMatrix::new(&file, Air::default());
    let written = WrittenNote(65);
    let of = file.fingering(written).unwrap();
    let sounding_hz = written.sounding(2).unwrap().frequency_hz(440.0);
    let first = of.open.iter().zip(&file.holes).position(|(&open, hole)| open && !hole.register).unwrap();
    let figure = fingering(&FingeringImpedance {
        instrument: &file.name,
        notes: vec!["a note".to_owned()],
        fingering: format!("written {written}"),
        sounding_hz,
        pitch: "the note",
        curves: vec![Curve {
            name: "transfer matrices".to_owned(),
            z: (10..=250)
                .map(|n| 10.0 * f64::from(n))
                .map(|hz| (hz, model.impedance(hz, &of.open, 0.0)))
                .collect(),
        }],
        modes: model.peaks(&of.open, 0.0, 8),
        cutoff_hz: cutoff_hz(|hz| model.reflectance_below(hz, &of.open, first)),
    });
    // The modes of the picture are the tops of its curve: nothing within 20 Hz is higher.
    let [magnitude, phase] = &figure.panels[..] else { panic!("{} panels", figure.panels.len()) };
    let curve = lines(magnitude)[0];
    let Some(Layer::Points(modes)) = magnitude.layers.iter().find(|layer| matches!(layer, Layer::Points(_)))
    else {
        panic!("no modes")
    };
    assert_eq!(modes.points.len(), 6, "those up to 2.5 kHz");
    for [hz, db] in &modes.points {
        assert!(curve.iter().filter(|[x, _]| (x - hz).abs() < 20.0).all(|[_, y]| y <= db));
        // And there the phase falls through zero.
        let at =
            lines(phase)[0].iter().min_by(|a, b| (a[0] - hz).abs().total_cmp(&(b[0] - hz).abs())).unwrap();
        assert!(at[1].abs() < 80.0, "{at:?}");
    }
    let Some(Layer::Span(above)) = magnitude.layers.iter().find(|layer| matches!(layer, Layer::Span(_)))
    else {
        panic!("no cut-off")
    };
    assert!(
        (1_000.0..2_000.0).contains(&above.from) && above.name.contains(&format!("{:.0} Hz", above.from))
    );
    let first_multiple = magnitude.top.as_ref().unwrap().ticks[0].at;
    assert!((first_multiple - sounding_hz).abs() < 1e-9);
    golden("impedance_f4", &figure);
}

#[test]
fn a_chart_of_peaks_follows_the_notes() {
    let file = InstrumentFile::built_in();
    let model = TransferMatrix::new(&file, Air::default());
    let rows: Vec<NotePeaks> = [52, 60, 72, 84]
        .map(WrittenNote)
        .into_iter()
        .map(|written| {
            let of = file.fingering(written).unwrap();
            NotePeaks {
                written,
                sounding_hz: written.sounding(2).unwrap().frequency_hz(440.0),
                shown: 8,
                peaks: model.peaks(&of.open, 0.0, 4),
            }
        })
        .collect();
    let figure = chart(&file.name, Vec::new(), &rows);
    // The peak that sounds is that of the note within the reed's volume's reach, and lies above it.
    let off = &figure.panels[1];
    let Some(Layer::Points(off)) = off.layers.iter().find(|layer| matches!(layer, Layer::Points(_))) else {
        panic!("no cents")
    };
    assert_eq!(off.points.len(), 4);
    assert!(off.points.iter().all(|[_, cents]| (0.0..60.0).contains(cents)), "{:?}", off.points);
    golden("peaks", &figure);
}

#[test]
fn a_bore_shows_which_holes_are_open() {
    let file = InstrumentFile::built_in();
    let of = file.fingering(WrittenNote(72)).unwrap();
    let figure = bore::profile(&file, Some(of));
    // Each hole once, to scale, as its fingering says.
    let mut shown = Vec::new();
    for panel in &figure.panels[..2] {
        assert!(panel.equal_aspect);
        for layer in &panel.layers[1..] {
            let Layer::Polygon(hole) = layer else { continue };
            let [[left, low], _, [right, high], _] = hole.corners[..] else {
                panic!("a hole has four corners")
            };
            shown.push((0.5 * (left + right), right - left, high - low, hole.opacity < 0.5));
        }
    }
    assert_eq!(shown.len(), file.holes.len());
    for (hole, (&open, (x, wide, tall, shown_open))) in file.holes.iter().zip(of.open.iter().zip(shown)) {
        assert!((x - 1e3 * hole.x_m).abs() < 1e-9 && (wide - 2e3 * hole.radius_m).abs() < 1e-9);
        assert!((tall - 1e3 * hole.chimney_m).abs() < 1e-9);
        assert_eq!(open, shown_open, "{}", hole.name);
    }
    golden("bore_c5", &figure);
}

/// Written G4, then written C5, half a second each, seen in few columns.
fn played() -> (Overview, Envelope, ReedCloseUp, Vec<Note>) {
    let settings = Settings { noise: 0.0, ..Settings::physical() };
    let score = Score::scale(WrittenNote(67), WrittenNote(68), 2, 0.5, false, 48_000).unwrap().blown(
        &BreathCurve::constant(0.6),
        &settings,
        48_000,
    );
    let mut clarinet = Clarinet::built_in(48_000.0).unwrap();
    clarinet.set_settings(&settings);
    clarinet.reset();
    let mut watcher = Watcher::new(score.samples, 48_000.0, 24);
    let mut gamma = Envelope::new(96_000, 24);
    let mut moment = ReedCloseUp { from_s: 0.25, step_s: 1.0 / 96_000.0, probes: Vec::new() };
    let mut seen = 0;
    let mut inside = |probe: chalumeau_core::instrument::Probe| {
        gamma.push(probe.gamma as f32);
        if (24_000..25_400).contains(&seen) {
            moment.probes.push(probe);
        }
        seen += 1;
    };
    play_probed(&mut clarinet, &score, 512, &mut inside, |block| {
        watcher.see(block);
        Ok::<_, Infallible>(())
    })
    .unwrap();
    let notes = score.note_spans(&KeyNotes::default()).into_iter().map(|sounding| Note {
        note: sounding.note,
        from_s: sounding.from as f64 / 48_000.0,
        to_s: sounding.to as f64 / 48_000.0,
    });
    (watcher.finish(), gamma, moment, notes.collect())
}

#[test]
fn a_performance_is_seen_in_tune_and_in_time() {
    let (overview, gamma, moment, score) = played();
    let figure = performance(&PerformanceFigure {
        title: "two notes",
        notes: vec![],
        overview: &overview,
        score: &score,
        a4_hz: 440.0,
        gamma: &gamma,
        closing_pa: 6_000.0,
        moment: Some(&moment),
    });
    let [wave, spectrum, pitch, breath, reed] = &figure.panels[..] else { panic!("{}", figure.panels.len()) };
    assert!([wave, spectrum, pitch, breath].iter().all(|panel| panel.x.range == Some([0.0, 1.0])));
    // While a note sounds, the line of its pitch lies on its bar.
    let track: Vec<[f64; 2]> = lines(pitch).into_iter().flatten().copied().collect();
    for note in &score {
        let sounding = track.iter().filter(|[t, _]| (note.from_s + 0.15..note.to_s - 0.05).contains(t));
        let keys: Vec<f64> = sounding.map(|&[_, key]| key).collect();
        assert!(keys.len() > 2, "{note:?}");
        assert!(keys.iter().all(|key| (key - f64::from(note.note.0)).abs() < 0.15), "{note:?}: {keys:?}");
    }
    // The loudest row of the spectrogram is an odd harmonic of the note.
    let Layer::Heat(heat) = &spectrum.layers[0] else { panic!("no heat") };
    let hz = SoundingNote(65).frequency_hz(440.0);
    let column = &heat.levels[6 * heat.rows..7 * heat.rows];
    let loudest = (0..heat.rows).max_by(|&a, &b| column[a].total_cmp(&column[b])).unwrap();
    let harmonic = loudest as f64 * overview.row_hz / hz;
    assert!([1.0, 3.0].iter().any(|odd| (harmonic - odd).abs() < 0.1), "{harmonic}");
    // Five periods of reed, mouth pressure as it was blown.
    let shown = lines(reed)[0];
    assert!((shown[shown.len() - 1][0] - 1_399.0 / 96.0).abs() < 1e-6);
    let [low, high] = gamma.bins()[8];
    assert!((low - 0.6).abs() < 0.01 && (high - 0.6).abs() < 0.01, "{low} {high}");
    golden("performance", &figure);
}

#[test]
fn nothing_played_is_a_picture_too() {
    let overview = Watcher::new(0, 48_000.0, 100).finish();
    let figure = performance(&PerformanceFigure {
        title: "",
        notes: vec![],
        overview: &overview,
        score: &[],
        a4_hz: 440.0,
        gamma: &Envelope::new(0, 100),
        closing_pa: 6_000.0,
        moment: None,
    });
    assert_eq!(figure.panels.len(), 4);
    let png = chalumeau_figure::draw::png(&figure, Some("400x700".parse().unwrap())).unwrap();
    assert_eq!(&png[1..4], b"PNG");
}

fn chalumeau(directory: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(directory)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

#[track_caller]
fn succeeds(directory: &TempDir, line: &str) {
    let output = chalumeau(directory.path(), line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

fn read(directory: &TempDir, name: &str) -> Vec<u8> {
    fs::read(directory.path().join(name)).unwrap()
}

const NOTE: &str = "render --written 67 --seconds 0.2 --out a.wav";

#[test]
fn a_render_is_the_same_with_a_figure_beside_it() {
    let d = tempfile::tempdir().unwrap();
    succeeds(&d, NOTE);
    let plain = read(&d, "a.wav");
    succeeds(&d, &format!("{NOTE} --force --plot a.svg --plot-size 900x1200 --probe a.csv --plot-at 0.1"));
    assert!(read(&d, "a.wav") == plain);
    let svg = String::from_utf8(read(&d, "a.svg")).unwrap();
    for said in ["width=\"900\" height=\"1200\"", "Spectrogram", "written G4", "from 0.100 s on"] {
        assert!(svg.contains(said), "{said}");
    }
    succeeds(&d, "impedance --written 65 --step 20 --plot z.png --csv z.csv");
    succeeds(&d, "impedance --written 65 --temperature 20 --model tmm --step 20 --plot t.svg --csv t.csv");
    succeeds(&d, "impedance --all --peaks 2 --plot p.png --csv p.csv");
    succeeds(&d, "bore --written C5 --plot b.svg --csv b.csv");
    let table = String::from_utf8(read(&d, "b.csv")).unwrap();
    let file = InstrumentFile::built_in();
    let holes: Vec<&str> = table.lines().filter(|line| line.starts_with("hole,")).collect();
    assert!(table.starts_with("kind,name,x_mm,diameter_mm,chimney_mm,open\n# "));
    assert_eq!(holes.len(), file.holes.len());
    let open = holes.iter().map(|line| line.ends_with(",1"));
    assert!(open.eq(file.fingering(WrittenNote(72)).unwrap().open.iter().copied()));
    assert!(table.lines().any(|line| line == "bore,mouthpiece,39.787,13.8,,"), "{table}");
    for name in ["z.png", "p.png"] {
        assert_eq!(&read(&d, name)[1..4], b"PNG");
    }
}

/// The sounds of a page: title, and root mean square in dB re full scale of its first channel.
fn tracks(page: &str) -> Vec<(String, f64)> {
    let of = |part: &str| {
        let title = part[..part.find('<').unwrap()].to_owned();
        let from = part.find("data:audio/wav;base64,").unwrap() + 22;
        let wav = STANDARD.decode(&part[from..from + part[from..].find('"').unwrap()]).unwrap();
        let reader = hound::WavReader::new(std::io::Cursor::new(wav)).unwrap();
        let channels = usize::from(reader.spec().channels);
        let samples: Vec<f64> = reader
            .into_samples::<i16>()
            .step_by(channels)
            .map(|x| f64::from(x.unwrap()) / 32_768.0)
            .collect();
        assert!(samples.iter().all(|x| x.abs() < 0.99), "{title} reaches full scale");
        let power = samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64;
        (title, 10.0 * power.log10())
    };
    page.split("<h3>").skip(1).map(of).collect()
}

#[test]
fn a_tour_plays_what_it_says_on_any_instrument() {
    let d = tempfile::tempdir().unwrap();
    succeeds(&d, "report --tour --out tour.html");
    let page = String::from_utf8(read(&d, "tour.html")).unwrap();
    assert!(
        !page.contains("http:")
            && !page.contains("https:")
            && !page.contains("<script")
            && page.contains("<h2>Rooms</h2>")
    );
    let sounds = tracks(&page);
    assert_eq!(sounds.len(), 22);
    for (title, level_db) in &sounds {
        assert!(*level_db > -40.0, "{title} is silent: {level_db:.1} dB");
    }
    let level = |title: &str| sounds.iter().find(|(other, _)| other == title).unwrap().1;
    let steps = [level("Scale, mf") - level("Scale, pp"), level("Scale, ff") - level("Scale, mf")];
    assert!(steps.iter().all(|step| (6.0..18.0).contains(step)), "{steps:.1?} dB from pp to mf to ff");
    assert!(level("Subtone") < level("A phrase, plain") - 1.0);
    // An instrument of three notes leaves the others out.
    let cylinder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/instruments/cylinder.toml");
    succeeds(&d, &format!("report --tour --untuned --instrument {} --out c.html", cylinder.display()));
    let page = String::from_utf8(read(&d, "c.html")).unwrap();
    assert_eq!(page.matches("<audio ").count(), 22);
    let output = chalumeau(d.path(), "report --tour --gamma 0.5 --out b.html");
    assert!(!output.status.success() && String::from_utf8_lossy(&output.stderr).contains("--tour"));
}

#[test]
fn a_report_holds_the_sound_the_cents_and_the_settings() {
    let d = tempfile::tempdir().unwrap();
    let play = "--scale 60:64 --seconds 0.4 --gamma 0.55 --no-noise --strength 3";
    succeeds(&d, &format!("report {play} --out r.html"));
    succeeds(&d, &format!("render {play} --bits 16 --out r.wav"));
    let page = String::from_utf8(read(&d, "r.html")).unwrap();
    // The sound of the page is the file that `render` writes.
    let from = page.find("data:audio/wav;base64,").unwrap() + 22;
    let sound = &page[from..from + page[from..].find('"').unwrap()];
    assert!(STANDARD.decode(sound).unwrap() == read(&d, "r.wav"));
    // Nothing is fetched; every figure has words; headings come in order.
    assert!(
        !page.contains("http:")
            && !page.contains("https:")
            && !page.contains("<script")
            && !page.contains("<link")
    );
    assert_eq!((page.matches("<img ").count(), page.matches("<img alt=\"").count()), (8, 8));
    assert!(!page.contains("alt=\"\""));
    assert_eq!(page.matches("<h1>").count(), 1);
    for said in [
        "<html lang=\"en\">",
        "prefers-color-scheme: dark",
        "scale C4 to E4",
        "5 of 5 notes have a pitch",
        // All settings, and the default beside one that is not.
        "<td>Reed strength</td><td>stren</td><td class=\"number\">3.00</td><td class=\"number\">2.50</td>",
        "<td>Embouchure</td><td>zeta</td><td class=\"number\">0.300</td><td class=\"number\"></td>",
        "<td>Tuning</td><td>tune</td><td class=\"number\">Natural</td>",
        concat!("Chalumeau ", env!("CARGO_PKG_VERSION")),
        "chalumeau report --scale 60:64",
        "B flat clarinet, Boehm system",
        // Breath: the last of the longest notes, as `threshold` and the player have it.
        "<h2>Breath</h2>",
        "Written E4 begins at",
        "<h3 id=\"table-1\">Mouth pressures</h3>",
        // Haptics, and what would be too much of it.
        "<h2>Haptics</h2>",
        "The mark of the torque lies within 0.",
        "Feel sent to the knob",
        "<td>flow</td><td class=\"number\">3</td><td>accepted</td>",
        "<td>flow</td><td class=\"number\">5</td><td>refused: C#7 would need",
    ] {
        assert!(page.contains(said), "{said}");
    }
    let notes =
        page.matches("<td>A#3</td><td>C4</td>").count() + page.matches("<td>D4</td><td>E4</td>").count();
    assert_eq!(notes, 2, "sounding and written notes");
    // Beside the page, the sound is a file.
    succeeds(&d, &format!("report {play} --out s.html --wav ./s.wav"));
    let page = String::from_utf8(read(&d, "s.html")).unwrap();
    assert!(page.contains("src=\"s.wav\"") && !page.contains("data:audio"));
    assert!(read(&d, "s.wav") == read(&d, "r.wav"));
}

/// A feel that a knob would refuse is no reason to withhold the page: it says so, with the way out.
#[test]
fn a_report_says_which_feel_a_knob_would_refuse() {
    let d = tempfile::tempdir().unwrap();
    succeeds(&d, "report --written 67 --seconds 0.1 --torque 80 --contrast 5 --out r.html");
    let page = String::from_utf8(read(&d, "r.html")).unwrap();
    for said in
        ["The feel asked for is refused: C#7 would need", "the ceiling is 100", "Contrast 5: C#7 would need"]
    {
        assert!(page.contains(said), "{said}");
    }
    assert!(!page.contains("Feel sent to the knob"));
    succeeds(&d, "report --written 67 --seconds 0.1 --torque 60 --travel 120 --out s.html");
    let page = String::from_utf8(read(&d, "s.html")).unwrap();
    assert!(page.contains("N m/rad; above"), "the slope has its words too");
}

/// Mouth pressure over angle for a few notes; closure lies at the closing pressure.
fn turns_of(table: &FeelTable, closing_kpa: f64) -> Figure {
    let turn = |note: &NoteFeel| {
        let at = |deg: f64| (deg, 1e-3 * note.map.pressure_pa(deg));
        let closes = at(note.landmarks.a_close_deg);
        assert!((closes.1 - closing_kpa).abs() < 1e-9, "{}: {closes:?}", note.written);
        breath::Turn {
            name: note.written.to_string(),
            map: (0..=60).map(|step| at(10.0 * f64::from(step))).collect(),
            speaks: at(note.landmarks.a_on_deg),
            closes,
        }
    };
    let turns: Vec<breath::Turn> = table.notes().iter().step_by(20).map(turn).collect();
    breath::turns("", closing_kpa, &turns)
}

#[test]
fn breath_and_feel_are_figures_of_one_instrument() {
    let (file, settings) = (InstrumentFile::built_in(), Settings { noise: 0.0, ..Settings::physical() });
    let bore = RequirementSolver::new(&file, Air::default(), 440.0).unwrap();
    let reed = played_reed(&file, 440.0, &settings);
    let closing_kpa = 1e-3 * reed.closing_pa();
    let asked = bore.with(&reed);
    let changes: Vec<NotePressures> = bore
        .written()
        .zip(&asked)
        .map(|(written, asked)| {
            let asked = asked.unwrap();
            NotePressures {
                written: written.0,
                speaks_kpa: closing_kpa * asked.gamma_sounding,
                beats_kpa: closing_kpa * asked.gamma_beat,
                chokes_kpa: closing_kpa * asked.gamma_off,
            }
        })
        .collect();
    assert!(changes.iter().all(|note| {
        note.speaks_kpa < note.beats_kpa && note.beats_kpa < closing_kpa && closing_kpa < note.chokes_kpa
    }));
    golden("breath_notes", &breath::pressures("clarinet", "", closing_kpa, &changes));

    let mut felt = Vec::new();
    for (law, name) in [(TorqueLaw::Flow, "flow"), (TorqueLaw::Pressure, "pressure")] {
        let (mut all, mut on_deg) = (Vec::new(), Vec::new());
        for contrast in [1.0, 5.0] {
            let design = FeelDesign { law, contrast, place: contrast, ..FeelDesign::default() };
            let table = FeelTable::new(&bore, &design, &reed, &TorqueLimits::default()).unwrap();
            let notes = table.notes().iter().step_by(20).map(|note| {
                let at = |deg: f64| (deg, torque_law::torque_mnm(&note.feel, ReedTables::reference(), deg));
                Torque {
                    name: note.written.to_string(),
                    curve: (-30..=120).map(|step| at(4.0 * f64::from(step))).collect(),
                    on: at(note.landmarks.a_on_deg),
                    close: at(note.landmarks.a_close_deg),
                }
            });
            all.push(AtContrast { contrast, notes: Ok(notes.collect()) });
            let on = table.notes().iter().map(|note| (note.written.0, note.landmarks.a_on_deg));
            on_deg.push((contrast, on.collect()));
            if contrast == 5.0 && law == TorqueLaw::Flow {
                golden("turns", &turns_of(&table, closing_kpa));
            }
        }
        let at_kpa = changes.iter().map(|note| (note.written, note.speaks_kpa)).collect();
        felt.push(FeltThresholds { law: name.to_owned(), at_kpa, on_deg });
        all.push(AtContrast { contrast: 9.0, notes: Err("too much".to_owned()) });
        let figure = torques(name, "", 100.0, &all);
        // What is refused is said where it would be drawn, and the same scale serves all.
        assert!(figure.panels.iter().all(|panel| panel.y.range == figure.panels[0].y.range));
        assert!(figure.panels[2].title.ends_with("refused") && lines(&figure.panels[2]).is_empty());
        // Under the flow law the felt threshold is the top of the curve up to closure. The curve has a point every four degrees,
        // so it may miss the tip of the mark: 3 % of the torque.
        if law == TorqueLaw::Flow {
            for note in all.iter().filter_map(|at| at.notes.as_ref().ok()).flatten() {
                let up_to_closure = note.curve.iter().filter(|(deg, _)| *deg < note.close.0);
                let top = up_to_closure.map(|&(_, mnm)| mnm).fold(0.0, f64::max);
                assert!(
                    top <= note.on.1 + 1e-3 && top > 0.97 * note.on.1,
                    "{}: {top} {:?}",
                    note.name,
                    note.on
                );
            }
        }
        golden(&format!("torque_{name}"), &figure);
    }
    let sounds: Vec<(u8, f64)> = changes.iter().map(|note| (note.written, note.speaks_kpa)).collect();
    golden("felt_thresholds", &thresholds("", &sounds, &felt));
}

#[test]
fn a_swell_shows_where_it_sounds() {
    let settings = Settings { noise: 0.0, ..Settings::physical() };
    let model = std::sync::Arc::new(chalumeau_core::instrument::Model::built_in(48_000.0).unwrap());
    let played = bifurcation::measure(&model, &settings, SoundingNote(58), 0.9, 1.0, 48_000, |_| {});
    let course: Vec<[f64; 4]> = played
        .up
        .iter()
        .map(|point| (point.gamma / 0.9, point))
        .chain(played.down.iter().map(|point| (2.0 - point.gamma / 0.9, point)))
        .map(|(t_s, point)| [t_s, 6.0 * point.gamma, 6.0 * point.rms, point.shut])
        .collect();
    let swell = breath::Swell {
        title: "written C4".to_owned(),
        note: String::new(),
        closing_kpa: 6.0,
        changes: None,
        course,
        sounds_kpa: 0.06,
    };
    let figure = swell.figure();
    let spans: Vec<(f64, f64)> = figure.panels[0]
        .layers
        .iter()
        .filter_map(|layer| if let Layer::Span(span) = layer { Some((span.from, span.to)) } else { None })
        .collect();
    let (first, last) = (spans[0], spans[spans.len() - 1]);
    assert!((0.4..0.8).contains(&first.0) && (1.4..1.9).contains(&last.1), "{spans:?}");
    assert!(spans.len() <= 5, "no flicker: {spans:?}");
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_nothing() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("there.svg"), "mine").unwrap();
    fs::write(d.path().join("there.html"), "mine").unwrap();
    let report = "report --written 67 --seconds 0.1";
    for (line, says) in [
        (format!("{NOTE} --plot a.jpg"), ".png or .svg"),
        (format!("{NOTE} --plot there.svg"), "exists already"),
        (format!("{NOTE} --plot none/a.svg"), "directory none does not exist"),
        (format!("{NOTE} --plot a.svg --plot-size 10x10"), "WIDTHxHEIGHT"),
        (format!("{NOTE} --plot a.svg --plot-at 5"), "after the end; the sound is 0.200 s long"),
        (format!("{NOTE} --plot-at 0.1"), "--plot"),
        ("impedance --all --plot z.png".to_owned(), "--peaks 8"),
        ("impedance --written 65 --peaks 3 --from 100 --to 50 --plot z.png".to_owned(), "--to above --from"),
        ("impedance --written 40 --peaks 3 --plot z.png".to_owned(), "has no fingering"),
        ("impedance --written 65 --plot z.gif --csv z.csv".to_owned(), ".png or .svg"),
        ("bore --written 40 --plot b.png".to_owned(), "written 40 (E2) has no fingering"),
        ("bore --plot b.pdf --csv b.csv".to_owned(), ".png or .svg"),
        ("bore --instrument none.toml".to_owned(), "none.toml"),
        (format!("{report} --out r.pdf"), "ends in .html"),
        (format!("{report} --out there.html"), "exists already"),
        (format!("{report} --out none/r.html"), "directory none does not exist"),
        (format!("{report} --out r.html --wav r.ogg"), "must end in .wav"),
        (format!("{report} --out r.html --wav sub/r.wav"), "one directory"),
        (format!("{report} --out r.html --plot-at 3"), "after the end"),
        ("report --out r.html".to_owned(), "--written"),
        ("report --written 67 --seconds 3600 --out r.html".to_owned(), "--wav FILE"),
        ("report none.mid --out r.html".to_owned(), "cannot read none.mid"),
    ] {
        let output = chalumeau(d.path(), &line);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}: {message}");
        assert!(message.contains(says) && !message.contains("panicked"), "{line}: {message}");
        let mut left: Vec<_> =
            fs::read_dir(d.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["there.html", "there.svg"], "{line}");
        assert_eq!((read(&d, "there.svg"), read(&d, "there.html")), (b"mine".to_vec(), b"mine".to_vec()));
    }
}

#[test]
fn the_citation_names_this_version() {
    let citation = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/CITATION.cff")).unwrap();
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(citation.contains(&version), "CITATION.cff should say {version}");
}

/// Everything that `docs/model.md` calls by a path is somewhere in the sources under these names.
#[test]
fn the_page_of_the_model_names_what_there_is() {
    fn sources(directory: &Path, text: &mut String) {
        for entry in fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                sources(&entry, text);
            } else {
                text.push_str(&fs::read_to_string(entry).unwrap());
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    sources(&root.join("src"), &mut text);
    for member in fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path()) {
        sources(&member.join("src"), &mut text);
    }
    let known: std::collections::HashSet<&str> =
        text.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let page = fs::read_to_string(root.join("docs/model.md")).unwrap();
    let named: Vec<&str> = page.split('`').skip(1).step_by(2).filter(|code| code.contains("::")).collect();
    assert!(named.len() > 40, "{}", named.len());
    for path in named {
        for name in path.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|name| !name.is_empty()) {
            assert!(known.contains(name), "docs/model.md: `{path}`: there is no {name}");
        }
    }
}
