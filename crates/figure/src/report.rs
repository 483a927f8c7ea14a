//! A rendering as one page of HTML that needs nothing else: sound, figures, tables.
//!
//! Everything is in the page or lies beside it; nothing is fetched. It follows the reader's choice of light or dark, has
//! headings in order, texts for all figures and heads for all tables, and no script.

use crate::Figure;
use crate::draw::{self, DrawError, escaped};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io;
use std::io::Write;

/// Where the sound is.
pub enum Sound {
    /// A WAV file inside the page.
    Inside(Vec<u8>),
    /// Name of a WAV file beside the page.
    Beside(String),
}

/// A figure with words for those who cannot see it.
pub struct Plate {
    /// What is drawn.
    pub figure: Figure,
    /// Under the figure.
    pub caption: String,
    /// Instead of the figure.
    pub alternative: String,
}

/// A sound with a title.
pub struct Track {
    /// What it is.
    pub title: String,
    /// What to listen for.
    pub words: String,
    /// The sound.
    pub sound: Sound,
}

/// A table.
pub struct ReportTable {
    /// Heading above it.
    pub title: String,
    /// Words under the heading, may be empty.
    pub about: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Cells; numbers stand to the right.
    pub rows: Vec<Vec<TableCell>>,
}

/// A part of the page with words, sounds, figures and tables of its own.
#[derive(Default)]
pub struct Chapter {
    /// Heading.
    pub title: String,
    /// Paragraphs under it.
    pub words: Vec<String>,
    /// Sounds, each under a smaller heading.
    pub tracks: Vec<Track>,
    /// Figures.
    pub plates: Vec<Plate>,
    /// Tables, each under a smaller heading.
    pub tables: Vec<ReportTable>,
}

/// A cell of a table.
pub enum TableCell {
    /// Words.
    Word(String),
    /// A number, with as many digits as it deserves.
    Number(String),
}

/// What the page says.
pub struct Report {
    /// What was played.
    pub title: String,
    /// A few words on how.
    pub about: Vec<String>,
    /// The sound, if there is one for the whole page.
    pub sound: Option<Sound>,
    /// Figures, most telling first.
    pub plates: Vec<Plate>,
    /// Between the figures and the tables.
    pub chapters: Vec<Chapter>,
    /// Tables.
    pub tables: Vec<ReportTable>,
    /// Program and version, and the command that makes the page again.
    pub made_by: String,
}

/// Why a page cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// Writing ended early.
    #[error("cannot write the page: {0}")]
    Write(#[from] io::Error),
}

/// Looks of the page. Numbers in tables share one width; figures are made for paper and turn with their page.
const STYLE: &str = "\
:root { color-scheme: light dark; --paper: #fff; --ink: #22262e; --quiet: #5e636c; --line: #d9dde3; --stripe: #f5f6f8; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #141414; --ink: #e6e8ec; --quiet: #a4aab4; --line: #363b44; --stripe: #1c1f25; }
  /* White paper becomes the colour of the page; hues come back to where they were. */
  img { filter: invert(0.935) hue-rotate(180deg) brightness(1.2); }
}
body { margin: 0 auto; padding: 2rem 1.25rem 3rem; max-width: 66rem; background: var(--paper); color: var(--ink);
  font: 1rem/1.5 system-ui, sans-serif; }
h1 { margin: 0 0 0.25rem; font-size: 1.9rem; line-height: 1.2; overflow-wrap: anywhere; }
h2 { margin: 2.25rem 0 0.5rem; font-size: 1.3rem; }
h3 { margin: 1.5rem 0 0.5rem; font-size: 1.1rem; }
p { margin: 0.25rem 0; max-width: 46rem; }
.quiet, figcaption, footer { color: var(--quiet); }
audio { display: block; width: 100%; margin: 1rem 0; }
figure { margin: 1rem 0 2rem; }
img { display: block; width: 100%; min-width: 40rem; height: auto; }
.scroll { overflow-x: auto; }
.scroll.table { max-height: 34rem; overflow-y: auto; }
@media print { .scroll.table { max-height: none; } }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.9rem 0.25rem 0; text-align: left; border-bottom: 1px solid var(--line); }
th { position: sticky; top: 0; background: var(--paper); white-space: nowrap; }
td.number, th.number { text-align: right; white-space: nowrap; }
tbody tr:nth-child(even) { background: var(--stripe); }
footer { margin-top: 3rem; font-size: 0.9rem; overflow-wrap: anywhere; }
code { font-size: 0.95em; }
";

/// A file name as a link: bytes that mean something in a URL in per cent.
fn link(name: &str) -> String {
    name.bytes()
        .map(|byte| match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => {
                char::from(byte).to_string()
            }
            byte => format!("%{byte:02X}"),
        })
        .collect()
}

/// Writes the page. Allocates the sound in base64 a piece at a time.
pub fn write(report: &Report, out: &mut impl Write) -> Result<(), ReportError> {
    let title = escaped(&report.title);
    write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{title} - Chalumeau</title>\n<style>\n{STYLE}</style>\n\
         </head>\n<body>\n<main>\n<h1>{title}</h1>\n"
    )?;
    for line in &report.about {
        writeln!(out, "<p class=\"quiet\">{}</p>", escaped(line))?;
    }
    if let Some(sound) = &report.sound {
        writeln!(out, "<h2>Listen</h2>")?;
        write_sound(sound, &title, out)?;
    }
    if !report.plates.is_empty() {
        writeln!(out, "<h2>Figures</h2>")?;
    }
    write_plates(&report.plates, out)?;
    let mut tables = 0;
    let mut write_tables = |all: &[ReportTable], level: u8, out: &mut _| {
        all.iter().try_for_each(|table| {
            tables += 1;
            write_table(table, tables, level, out)
        })
    };
    for chapter in &report.chapters {
        writeln!(out, "<h2>{}</h2>", escaped(&chapter.title))?;
        for line in &chapter.words {
            writeln!(out, "<p>{}</p>", escaped(line))?;
        }
        for Track { title, words, sound } in &chapter.tracks {
            let title = escaped(title);
            writeln!(out, "<h3>{title}</h3>\n<p>{}</p>", escaped(words))?;
            write_sound(sound, &title, out)?;
        }
        write_plates(&chapter.plates, out)?;
        write_tables(&chapter.tables, 3, out)?;
    }
    write_tables(&report.tables, 2, out)?;
    writeln!(out, "</main>\n<footer><p>{}</p></footer>\n</body>\n</html>", escaped(&report.made_by))?;
    Ok(())
}

/// Each figure in a frame that a narrow screen can scroll sideways.
fn write_plates(plates: &[Plate], out: &mut impl Write) -> Result<(), ReportError> {
    for Plate { figure, caption, alternative } in plates {
        let picture = draw::svg(figure, None)?;
        let title = escaped(&figure.title);
        write!(
            out,
            "<figure>\n<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{title}\">\n<img alt=\"{}\" \
             src=\"data:image/svg+xml;base64,",
            escaped(alternative)
        )?;
        write_base64(picture.as_bytes(), out)?;
        writeln!(out, "\">\n</div>\n<figcaption>{}</figcaption>\n</figure>", escaped(caption))?;
    }
    Ok(())
}

fn write_sound(sound: &Sound, title: &str, out: &mut impl Write) -> Result<(), ReportError> {
    match sound {
        Sound::Inside(wav) => {
            write!(out, "<audio controls aria-label=\"{title}\" src=\"data:audio/wav;base64,")?;
            write_base64(wav, out)?;
            writeln!(out, "\"></audio>")?;
        }
        Sound::Beside(name) => {
            let (address, name) = (link(name), escaped(name));
            writeln!(out, "<audio controls aria-label=\"{title}\" src=\"{address}\"></audio>")?;
            writeln!(
                out,
                "<p class=\"quiet\">The sound is in <a href=\"{address}\">{name}</a>, which must lie beside this page.</p>"
            )?;
        }
    }
    Ok(())
}

/// In pieces of three bytes' multiples, which join without padding.
fn write_base64(bytes: &[u8], out: &mut impl Write) -> io::Result<()> {
    for piece in bytes.chunks(3 << 14) {
        out.write_all(STANDARD.encode(piece).as_bytes())?;
    }
    Ok(())
}

fn write_table(
    table: &ReportTable,
    index: usize,
    level: u8,
    out: &mut impl Write,
) -> Result<(), ReportError> {
    let heading = format!("table-{index}");
    writeln!(out, "<h{level} id=\"{heading}\">{}</h{level}>", escaped(&table.title))?;
    if !table.about.is_empty() {
        writeln!(out, "<p>{}</p>", escaped(&table.about))?;
    }
    write!(
        out,
        "<div class=\"scroll table\" role=\"region\" tabindex=\"0\" aria-labelledby=\"{heading}\">\n<table>\n<thead><tr>"
    )?;
    let is_number =
        |column: usize| table.rows.iter().any(|row| matches!(row.get(column), Some(TableCell::Number(_))));
    for (column, name) in table.head.iter().enumerate() {
        let class = if is_number(column) { " class=\"number\"" } else { "" };
        write!(out, "<th scope=\"col\"{class}>{}</th>", escaped(name))?;
    }
    writeln!(out, "</tr></thead>\n<tbody>")?;
    for row in &table.rows {
        write!(out, "<tr>")?;
        for cell in row {
            match cell {
                TableCell::Word(text) => write!(out, "<td>{}</td>", escaped(text))?,
                TableCell::Number(text) => write!(out, "<td class=\"number\">{}</td>", escaped(text))?,
            }
        }
        writeln!(out, "</tr>")?;
    }
    writeln!(out, "</tbody>\n</table>\n</div>")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(report: &Report) -> String {
        let mut out = Vec::new();
        write(report, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    fn report(sound: Sound) -> Report {
        Report {
            title: "<a> & \"b\"\u{7}".to_owned(),
            about: Vec::new(),
            sound: Some(sound),
            plates: Vec::new(),
            chapters: Vec::new(),
            tables: vec![ReportTable {
                title: "T".to_owned(),
                about: String::new(),
                head: vec!["note".to_owned(), "cents".to_owned()],
                rows: vec![vec![TableCell::Word("C<4".to_owned()), TableCell::Number("+0.1".to_owned())]],
            }],
            made_by: String::new(),
        }
    }

    #[test]
    fn names_cannot_become_markup() {
        let page = page(&report(Sound::Beside("a b\"&%#.wav".to_owned())));
        assert!(page.contains("<h1>&lt;a&gt; &amp; &quot;b&quot;\u{fffd}</h1>"), "{page}");
        assert!(page.contains("src=\"a%20b%22%26%25%23.wav\"") && page.contains("a b&quot;&amp;%#.wav</a>"));
        assert!(page.contains("<td>C&lt;4</td><td class=\"number\">+0.1</td>"));
        assert!(page.contains("<th scope=\"col\">note</th><th scope=\"col\" class=\"number\">cents</th>"));
    }

    #[test]
    fn sound_comes_back_out_of_the_page() {
        let wav: Vec<u8> = (0..100_001u32).map(|n| (n * 7 % 251) as u8).collect();
        let page = page(&report(Sound::Inside(wav.clone())));
        let from = page.find("data:audio/wav;base64,").unwrap() + 22;
        let text = &page[from..from + page[from..].find('"').unwrap()];
        assert_eq!(STANDARD.decode(text).unwrap(), wav);
    }
}
