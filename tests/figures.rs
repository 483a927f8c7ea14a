//! What figures say, compared as data; and that they can be drawn.

use chalumeau::figure::draw::{self, DrawError, Sheet};
use chalumeau::figure::{Axis, Direction, Figure, Line, Mark, Panel, SecondAxis};
use std::fs;

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
    draw::write(&example(), &path("a.png"), None, false).unwrap();
    let png = fs::read(path("a.png")).unwrap();
    assert_eq!(&png[1..4], b"PNG");
    assert_eq!((png[18..20].to_vec(), png[22..24].to_vec()), (vec![2, 88], vec![1, 144]), "600 x 400");
    draw::write(&example(), &path("a.SVG"), Some("800x500".parse().unwrap()), false).unwrap();
    let svg = fs::read_to_string(path("a.SVG")).unwrap();
    assert!(svg.contains("viewBox=\"0 0 800 500\"") && svg.contains("aria-label=\"pressure, kPa\""));
    assert!(svg.contains("<title>Frequency &lt;against> pressure</title>"));
    assert!(!svg.contains("<text"), "words are outlines: no font is needed");
    assert!(matches!(draw::write(&example(), &path("a.png"), None, false), Err(DrawError::Output(_))));
    for name in ["a.jpg", "a", "a.gif"] {
        let refused = draw::write(&example(), &path(name), None, false).unwrap_err().to_string();
        assert!(refused.contains(".png or .svg"), "{refused}");
    }
    let refused = Sheet::moving(&path("a.png"), true, None).err().unwrap().to_string();
    assert!(refused.contains(".gif"), "{refused}");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2, "nothing else is left");
}

#[test]
fn figures_survive_json() {
    let text = serde_json::to_string(&example()).unwrap();
    assert_eq!(serde_json::from_str::<Figure>(&text).unwrap(), example());
}
