//! What figures say, compared as data; and that they can be drawn.

use chalumeau::picture_file::{self, PictureError, PictureFile};
use chalumeau_figure::draw;
use chalumeau_figure::{Axis, Direction, Figure, Layer, Line, Mark, Panel, SecondAxis};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn example() -> Figure {
    let curve = (0..200).map(|n| (f64::from(n) / 100.0, 100.0 + f64::from(n * n) / 10.0));
    Figure::new("Frequency <against> pressure").note("a note").size(600, 400).panel(
        Panel::new("Panel", Axis::linear("pressure, kPa"), Axis::log("frequency, Hz"))
            .with(Mark::new(Direction::X, 0.33, "threshold"))
            .with(Mark::new(Direction::Y, 440.0, "A4"))
            .with(Line::new("curve", curve))
            .top(SecondAxis::times(10.0, "ten times")),
    )
}

#[test]
fn a_figure_becomes_a_png_or_an_svg_of_its_size() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    picture_file::write(&example(), &path("a.png"), None, false).unwrap();
    let png = fs::read(path("a.png")).unwrap();
    assert_eq!(&png[1..4], b"PNG");
    assert_eq!((png[18..20].to_vec(), png[22..24].to_vec()), (vec![2, 88], vec![1, 144]), "600 x 400");
    picture_file::write(&example(), &path("a.SVG"), Some("800x500".parse().unwrap()), false).unwrap();
    let svg = fs::read_to_string(path("a.SVG")).unwrap();
    assert!(svg.contains("viewBox=\"0 0 800 500\"") && svg.contains("aria-label=\"pressure, kPa\""));
    assert!(svg.contains("<title>Frequency &lt;against&gt; pressure</title>"));
    assert!(!svg.contains("<text"), "words are outlines: no font is needed");
    assert!(matches!(
        picture_file::write(&example(), &path("a.png"), None, false),
        Err(PictureError::Output(_))
    ));
    for name in ["a.jpg", "a", "a.gif"] {
        let refused = picture_file::write(&example(), &path(name), None, false).unwrap_err().to_string();
        assert!(refused.contains(".png or .svg"), "{refused}");
    }
    let refused = PictureFile::moving(&path("a.png"), true, None).err().unwrap().to_string();
    assert!(refused.contains(".gif"), "{refused}");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2, "nothing else is left");
}

/// In a small size words shrink with everything else: the curves keep their room.
#[test]
fn a_small_figure_is_the_same_figure() {
    let own = draw::svg(&tall(), None).unwrap();
    let (_, words) = own.split_once("viewBox=\"0 0 1600 1500\"").unwrap();
    let small = draw::svg(&tall(), Some("400x400".parse().unwrap())).unwrap();
    // 400 over 1600 is less than 400 over 1500: there is a little more room down.
    let (head, shrunk) = small.split_once("viewBox=\"0 0 1600 1600\"").unwrap();
    assert!(head.contains("width=\"400\" height=\"400\""), "{head}");
    let said = |svg: &str| svg.matches("aria-label").count();
    assert_eq!(said(words), said(shrunk));
    // Where there is more room, words stay as they are.
    assert!(
        draw::svg(&tall(), Some("3200x3000".parse().unwrap())).unwrap().contains("viewBox=\"0 0 3200 3000\"")
    );
    let half: draw::Size = "800x750".parse().unwrap();
    assert_eq!(half.too_small_for(&tall()), None);
    let least = "800x500".parse::<draw::Size>().unwrap().too_small_for(&tall());
    assert_eq!(least.unwrap().to_string(), "640x600");
}

/// As the figure of a bifurcation: three rows.
fn tall() -> Figure {
    let figure = Figure::new("Three rows").note("a note").size(1_600, 1_500);
    ["rms", "shut", "gamma"].into_iter().fold(figure, |figure, name| {
        let curve = (0..200).map(|n| (f64::from(n) / 100.0, f64::from(n * n)));
        let panel = Panel::new(name, Axis::linear("pressure, kPa"), Axis::linear("value"));
        figure.panel(panel.with(Line::new(name, curve)))
    })
}

#[test]
fn figures_survive_json() {
    let text = serde_json::to_string(&example()).unwrap();
    assert_eq!(serde_json::from_str::<Figure>(&text).unwrap(), example());
}

fn chalumeau<A: AsRef<OsStr>>(directory: &Path, args: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(directory)
        .args(args)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// What a command draws, as data: run with `FIGURE` replaced by the name of a file.
fn drawn(command: &str) -> Figure {
    let directory = tempfile::tempdir().unwrap();
    let args = command.split_whitespace().map(|arg| if arg == "FIGURE" { "figure.json" } else { arg });
    let output = chalumeau(directory.path(), args);
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&fs::read(directory.path().join("figure.json")).unwrap()).unwrap()
}

/// One line of a golden file: where in the figure, what it says in words (numbers left out), and a few of its numbers.
#[derive(Debug, PartialEq)]
struct Said {
    place: String,
    words: String,
    numbers: Vec<f64>,
    /// What the numbers are compared to: the height of what is drawn.
    span: f64,
}

/// Every word, and of every curve nine points evenly along it.
fn said(figure: &Figure) -> Vec<Said> {
    let mut all = Vec::new();
    let mut say = |place: String, words: &str, numbers: Vec<f64>, span: f64| {
        let mut masked = String::new();
        for c in words.chars() {
            let part_of_number = c.is_ascii_digit() || (c == '.' && masked.ends_with('#'));
            match part_of_number {
                true if masked.ends_with('#') => {}
                true => masked.push('#'),
                false => masked.push(c),
            }
        }
        all.push(Said { place, words: masked.replace(',', ";"), numbers, span });
    };
    say("title".to_owned(), &figure.title, figure.size.map(f64::from).to_vec(), 1.0);
    for note in &figure.notes {
        say("note".to_owned(), note, Vec::new(), 1.0);
    }
    for (index, panel) in figure.panels.iter().enumerate() {
        let place = |what: &str| format!("{index} {what}");
        say(place("title"), &panel.title, vec![panel.weight], 1.0);
        for (name, axis) in [("x", &panel.x), ("y", &panel.y)] {
            let range = axis.range.map_or(Vec::new(), |range| range.to_vec());
            let span = axis.range.map_or(1.0, |[low, high]| high - low);
            say(place(name), &axis.label, range, span);
        }
        for (name, axis) in [("top", &panel.top), ("right", &panel.right)] {
            if let Some(axis) = axis {
                say(place(name), &axis.label, vec![axis.factor], axis.factor.abs());
            }
        }
        for layer in &panel.layers {
            match layer {
                Layer::Line(line) => {
                    let points: Vec<[f64; 2]> = line.pieces.iter().flatten().copied().collect();
                    let (few, span) = few(&points);
                    say(place("line"), &line.name, few, span);
                }
                Layer::Points(points) => {
                    let (few, span) = few(&points.points);
                    say(place("points"), &points.name, few, span);
                }
                Layer::Mark(mark) => say(place("mark"), &mark.name, vec![mark.at], mark.at.abs().max(1e-3)),
                Layer::Span(band) => {
                    let size = band.from.abs().max(band.to.abs());
                    say(place("span"), &band.name, vec![band.from, band.to], size);
                }
                other => panic!("these figures have no {other:?}"),
            }
        }
    }
    all
}

fn few(points: &[[f64; 2]]) -> (Vec<f64>, f64) {
    if points.is_empty() {
        return (Vec::new(), 1.0);
    }
    let at = |part: usize| points[(part * (points.len() - 1) + 4) / 8];
    let span = points.iter().flatten().fold(0.0_f64, |span, x| span.max(x.abs()));
    ((0..=8).flat_map(at).collect(), span.max(1e-9))
}

/// Golden figures: name, command, and how far numbers may be off, of what is drawn.
///
/// What follows from formulas is held to rounding; what is played to what another processor's rounding or a better fit
/// of the bore may do. Written anew by `UPDATE_GOLDEN=1 cargo core --test figures`.
const GOLDEN: [(&str, &str, f64); 13] = [
    ("reed-unit", "reed --figure unit --out FIGURE", 1e-6),
    ("reed-angle", "reed --figure angle --out FIGURE", 1e-6),
    ("reed-family-h", "reed --figure family-h --out FIGURE", 1e-6),
    ("reed-family-k", "reed --figure family-k --out FIGURE", 1e-6),
    ("reed-coupled", "reed --figure coupled --out FIGURE", 1e-6),
    ("reed-amplitude", "reed --figure amplitude --out FIGURE", 1e-6),
    ("reed-negative", "reed --figure negative --out FIGURE", 1e-6),
    ("reed-physical", "reed --figure physical --out FIGURE", 1e-6),
    ("reed-orbit", "reed --figure orbit --written C4 --gamma 0.8 --out FIGURE", 0.02),
    ("threshold", "threshold --plot FIGURE", 1e-3),
    ("threshold-one", "threshold --written G4 --zeta 0.25 --plot FIGURE", 1e-3),
    ("tune", "tune --written G4 --gamma 0.7 --plot FIGURE", 0.05),
    ("bifurcation", "bifurcation --written F3 --seconds 5 --no-noise --plot FIGURE", 0.03),
];

#[test]
fn figures_say_what_they_said() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let mut wrong = Vec::new();
    for (name, command, tolerance) in GOLDEN {
        let path = directory.join(format!("figure-{name}.csv"));
        let now = said(&drawn(command));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            let mut text = format!("# chalumeau {command}\n# place,words,numbers\n");
            for Said { place, words, numbers, .. } in &now {
                let numbers: String = numbers.iter().map(|x| format!(",{x:.7e}")).collect();
                text.push_str(&format!("{place},{words}{numbers}\n"));
            }
            fs::create_dir_all(&directory).unwrap();
            fs::write(&path, text).unwrap();
            continue;
        }
        let golden = fs::read_to_string(&path).unwrap();
        let golden: Vec<&str> = golden.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(golden.len(), now.len(), "{name}: something is new or missing");
        for (golden, Said { place, words, numbers, span }) in golden.into_iter().zip(now) {
            let mut fields = golden.split(',');
            let (was, said) = (fields.next().unwrap_or(""), fields.next().unwrap_or(""));
            let were: Vec<f64> = fields.map(|field| field.parse().unwrap()).collect();
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= tolerance * span;
            let same = were.len() == numbers.len() && were.iter().zip(&numbers).all(near);
            if !same || was != place || said != words {
                wrong.push(format!("{name}: was {golden}\n  is {place},{words} {numbers:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn lines(figure: &Figure) -> Vec<&Line> {
    let layers = figure.panels.iter().flat_map(|panel| &panel.layers);
    layers.filter_map(|layer| if let Layer::Line(line) = layer { Some(line) } else { None }).collect()
}

#[test]
fn every_axis_has_its_quantity() {
    for (name, command, _) in GOLDEN {
        let figure = drawn(command);
        assert!(!figure.title.is_empty(), "{name}");
        for panel in &figure.panels {
            assert!(!panel.x.label.is_empty() && !panel.y.label.is_empty(), "{name}: {}", panel.title);
            assert!(!panel.layers.is_empty(), "{name}: {}", panel.title);
        }
    }
}

/// The notebook's point: with k = 27 / (4 H^3) every opening has a peak flow of 1.
#[test]
fn coupled_family_peaks_at_one_in_every_curve() {
    let figure = drawn("reed --figure coupled --out FIGURE");
    assert!(lines(&figure).len() >= 5);
    for line in lines(&figure) {
        let peak = line.pieces.iter().flatten().map(|point| point[1]).fold(f64::MIN, f64::max);
        assert!((peak - 1.0).abs() < 1e-4, "{}: {peak}", line.name);
    }
}

#[test]
fn sweep_is_ten_seconds_of_moving_reed() {
    let directory = tempfile::tempdir().unwrap();
    let args = ["reed", "--figure", "sweep", "--out", "sweep.gif", "--size", "400x400"];
    let output = chalumeau(directory.path(), args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(directory.path().join("sweep.gif")).unwrap()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (400, 400));
    let (mut frames, mut hundredths, mut moved) = (0, 0, 0);
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        frames += 1;
        hundredths += u32::from(frame.delay);
        moved += u32::from(frame.width > 1);
    }
    assert_eq!((frames, hundredths), (199, 995));
    assert_eq!(moved, 199, "every frame shows another opening");
}

#[test]
fn thresholds_lie_above_a_third_and_fall_with_a_looser_lip() {
    let figure = drawn("threshold --plot FIGURE");
    let notes: Vec<&Line> = figure.panels[0]
        .layers
        .iter()
        .filter_map(|layer| if let Layer::Line(line) = layer { Some(line) } else { None })
        .collect();
    assert!(notes.len() >= 4);
    for pair in notes.windows(2) {
        for (firm, loose) in pair[0].pieces.iter().flatten().zip(pair[1].pieces.iter().flatten()) {
            assert!(firm[0] == loose[0] && firm[1] > loose[1] && loose[1] > 1.0 / 3.0, "{firm:?} {loose:?}");
        }
    }
}

/// A reed that beats stays on its curve's closed part, and the air goes round the orbit once.
#[test]
fn orbit_closes_and_beats_when_blown_hard() {
    let figure = drawn("reed --figure orbit --written C4 --gamma 0.8 --out FIGURE");
    let all = lines(&figure);
    let orbit = &all.iter().find(|line| line.name == "one period of the note").unwrap().pieces[0];
    assert_eq!(orbit.first(), orbit.last());
    assert!(all.iter().any(|line| line.name.starts_with("reed shut")), "it beats");
    let highest = orbit.iter().map(|point| point[0]).fold(f64::MIN, f64::max);
    assert!((6.0..12.0).contains(&highest), "{highest} kPa: beyond the closing pressure of 6 kPa");
    let soft = drawn("reed --figure orbit --written C4 --gamma 0.4 --out FIGURE");
    assert!(!lines(&soft).iter().any(|line| line.name.starts_with("reed shut")), "soft it does not");
}

#[test]
fn haptic_draws_the_note_that_is_asked_for_or_those_that_stand_for_all() {
    let names = |command: &str| -> Vec<String> {
        lines(&drawn(command))
            .into_iter()
            .map(|line| line.name.clone())
            .filter(|name| name.contains(" mNm at "))
            .collect()
    };
    for command in ["haptic --written E3 --plot FIGURE", "haptic --written E3 --curve --plot FIGURE"] {
        let one = names(command);
        assert!(one.len() == 1 && one[0].starts_with("E3: "), "{command}: {one:?}");
    }
    let few = names("haptic --all --law pressure --contrast 1 --plot FIGURE");
    assert!((2..=4).contains(&few.len()), "{few:?}");
    assert!(few.iter().any(|name| name.starts_with("E3: ")), "the lowest: {few:?}");
    assert!(few.iter().any(|name| name.starts_with("C5: ")), "the reference: {few:?}");
}

#[test]
fn what_cannot_be_drawn_is_refused_with_the_remedy_and_leaves_nothing() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("there.png"), "mine").unwrap();
    for (command, says) in [
        ("reed --figure unit --out a.bmp", ".png or .svg"),
        ("reed --figure unit --out nowhere/a.png", "does not exist"),
        ("reed --figure unit --out there.png", "--force"),
        ("reed --figure unit", "--out"),
        ("reed --figure moon --out a.png", "possible values"),
        ("reed --figure sweep --out a.png", ".gif"),
        ("reed --figure all --out a.png", "directory"),
        ("reed --figure unit --out a.png --size 10x10", "400..4000"),
        ("reed --figure unit --out a.png --csv b.csv", "--csv goes with"),
        ("reed --figure orbit --written C9 --out a.png", "has no fingering"),
        ("reed --figure orbit --gamma 0.1 --out a.png", "does not sound"),
        ("threshold --plot a.gif", ".png or .svg"),
        ("threshold --plot a.png --plot-size big", "WIDTHxHEIGHT"),
        ("threshold --plot-size 800x600", "--plot"),
        ("tune --written H4 --plot a.png", "name like E3"),
        ("tune --written G4 --plot there.png", "--force"),
        ("bifurcation --plot a.png", "--written"),
        ("bifurcation --written C9 --plot a.png", "has no fingering"),
        ("bifurcation --written G4 --plot nowhere/a.svg", "does not exist"),
        ("bifurcation --written G4 --seconds 0 --plot a.png", "0.5..600"),
        ("bifurcation --written G4 --to 3 --strength 5 --plot a.png", "kPa"),
    ] {
        let output = chalumeau(directory.path(), command.split_whitespace());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command}: {error}");
        assert!(error.contains(says), "{command}: {error}");
    }
    let left: Vec<_> = fs::read_dir(directory.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["there.png"]);
    assert_eq!(fs::read(directory.path().join("there.png")).unwrap(), b"mine");
}
