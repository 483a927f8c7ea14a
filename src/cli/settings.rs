//! The player's settings as arguments: a flag for each number of the parameter table, and `--set` for all of it.

use crate::cli::Failure;
use crate::cli::controllers::OF_THE_DECODER;
use crate::cli::reed_physical::PhysicalReedArgs;
use crate::cli::shared_args::whole;
use crate::parameters::spelling::nearest;
use crate::parameters::{self, Kind, Number, PARAMETERS, Parameter, Sets, Value};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::{BreathResponse, Settings};
use chalumeau_core::score;
use chalumeau_core::score::breath::BreathCurve;
use chalumeau_core::units::REFERENCE_RADIUS_M;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};

/// What a player can set; what is not given stays as the reference clarinet has it.
#[derive(Args)]
#[command(next_help_heading = "Player, reed and instrument")]
pub struct SettingsArgs {
    #[command(flatten)]
    numbers: NumberFlags,
    /// No breath noise, for measurements
    #[arg(long, conflicts_with = "noise")]
    no_noise: bool,
    /// Keep every note in tune at every breath (the default where the breath is played)
    #[arg(long, conflicts_with = "natural")]
    tempered: bool,
    /// Let the pitch drift with the breath as the bore does (the default where the breath is a pressure)
    #[arg(long)]
    natural: bool,
    /// What breath sets: played (the dynamic, as a player does) or physical (the mouth pressure) [default: physical where
    /// gamma is given, else played]
    #[arg(long, value_name = "RESPONSE", value_parser = breath_response)]
    breath_response: Option<Given>,
    /// How many players play, 1..16; keys that are held together are played by different players [default: 1]
    #[arg(long, value_name = "N", value_parser = |s: &str| whole::<u8>(s, 1, 16))]
    players: Option<u8>,
    /// All players play every note
    #[arg(long)]
    unison: bool,
    /// Any parameter of the sound by its id, with the text a host would show, such as vent=2 or "temp=20 °C"; may be
    /// repeated. `chalumeau parameters` lists them
    #[arg(long = "set", value_name = "ID=VALUE", value_parser = assignment)]
    set: Vec<Given>,
    #[command(flatten)]
    measured: PhysicalReedArgs,
}

/// The numbers of the settings, each with the flag that the table gives it.
struct NumberFlags(Vec<Given>);

/// A value that the user has given.
#[derive(Clone, Debug)]
struct Given {
    parameter: &'static Parameter,
    value: Value,
    /// As it was typed: the flag, or `--set` and the id.
    typed: String,
}

/// Defaults that a command works out, by id.
const WORKED_OUT: [(&str, &str); 2] =
    [("full", "6, more if gamma needs it"), ("reedk", "27/(4 H^3), following H")];

/// Numbers of the settings that have a flag.
fn flagged() -> impl Iterator<Item = (&'static Parameter, Number)> {
    PARAMETERS.iter().filter_map(|parameter| match (parameter.kind, parameter.sets) {
        (Kind::Number(number), Some(Sets::Number(_))) if !parameter.flag.is_empty() => {
            Some((parameter, number))
        }
        _ => None,
    })
}

/// The flag without its dashes.
fn long(parameter: &Parameter) -> &'static str {
    parameter.flag.trim_start_matches('-')
}

/// The id by which clap knows the flag: as a field of that name would have it, for conflicts with the measured reed.
fn arg_id(parameter: &Parameter) -> &'static str {
    match long(parameter) {
        "H" => "h",
        long => long,
    }
}

impl NumberFlags {
    fn arg((parameter, number): (&'static Parameter, Number)) -> Arg {
        let Number { min, max, default, .. } = number;
        let range =
            if is_share(&number) { format!("{min}..{max} or {}", number.range()) } else { number.range() };
        let worked_out = WORKED_OUT.iter().find(|(id, _)| *id == parameter.id);
        let default = worked_out.map_or_else(|| rounded(default), |(_, text)| (*text).to_owned());
        let value_name = match parameter.unit() {
            "kPa" => "KPA",
            "ms" => "MS",
            "Hz" => "HZ",
            "\u{b0}C" => "C",
            "dB" => "DB",
            _ => "X",
        };
        Arg::new(arg_id(parameter))
            .long(long(parameter))
            .value_name(value_name)
            .help(format!("{}, {range} [default: {default}]", parameters::plain(parameter.meaning)))
            .action(ArgAction::Set)
            .value_parser(move |text: &str| flag_value(&number, text))
    }
}

/// A default as a reader needs it: the end of *Breath softest* is 4 of 127.
fn rounded(default: f32) -> String {
    ((1e4 * f64::from(default)).round() / 1e4).to_string()
}

/// Whether a flag takes it as a share, and texts show it as a percentage.
fn is_share(number: &Number) -> bool {
    number.scale != 1.0
}

/// Reads the value of a flag: a plain number, which is a share of what texts show as a percentage, or a percentage with its sign.
fn flag_value(number: &Number, text: &str) -> Result<f32, String> {
    let Number { min, max, scale, .. } = number;
    if is_share(number) && text.ends_with('%') {
        let value = number.parse(text).filter(|&value| number.contains(value));
        return value.ok_or_else(|| format!("must lie in {}", number.range()));
    }
    match text.parse::<f32>() {
        Ok(value) if number.contains(value) => Ok(value),
        Ok(value) if is_share(number) && number.contains(value / scale) => Err(format!(
            "must lie in {min}..{max}; a percentage has its sign: {}, or {value}%",
            value / scale
        )),
        Ok(_) => Err(format!("must lie in {min}..{max}")),
        Err(_) => Err(format!("must be a number in {min}..{max}")),
    }
}

/// Fails for a number that may be a share or a percentage, where a percentage is meant.
fn doubtful(id: &str, parameter: &Parameter, text: &str) -> Result<(), String> {
    match (parameter.kind, text.trim().parse::<f32>()) {
        (Kind::Number(number), Ok(value)) if is_share(&number) && value > 0.0 && value <= 1.0 => {
            // Single precision has no 30 % of its own.
            let percent = (1e3 * number.scale * value).round() / 1e3;
            Err(format!(
                "{id}={value} may mean {value} % or {percent} %: write {id}={value}% or {id}={percent}%"
            ))
        }
        _ => Ok(()),
    }
}

impl Args for NumberFlags {
    fn augment_args(command: Command) -> Command {
        command.args(flagged().map(Self::arg))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for NumberFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = flagged().filter_map(|(parameter, _)| {
            let value = Value::Number(*matches.get_one::<f32>(arg_id(parameter))?);
            Some(Given { parameter, value, typed: parameter.flag.to_owned() })
        });
        Ok(Self(given.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Reads `played` or `physical`.
fn breath_response(text: &str) -> Result<Given, String> {
    let parameter = parameters::find("resp").ok_or("no such parameter")?;
    Ok(Given { parameter, value: parameter.read(text)?, typed: "--breath-response".to_owned() })
}

/// Reads `id=value`.
fn assignment(text: &str) -> Result<Given, String> {
    let (id, value) = text.split_once('=').ok_or("must be id=value, for example vent=2")?;
    let id = id.trim();
    let named = |parameter: &&Parameter| parameter.name.eq_ignore_ascii_case(id);
    let known = parameters::find(id).or_else(|| PARAMETERS.iter().find(named));
    if let Some(parameter) = known.filter(|parameter| parameter.sets.is_some()) {
        doubtful(id, parameter, value)?;
        let typed = format!("--set {id}");
        return Ok(Given { parameter, value: parameter.read(value)?, typed });
    }
    Err(match known {
        Some(Parameter { id, name, flag: "", .. }) if OF_THE_DECODER.contains(id) => format!(
            "{id} ({name}) belongs to a controller; for a MIDI file, [parameters] of a --controllers file sets it"
        ),
        Some(Parameter { name, flag: "", .. }) => format!("{id} ({name}) is only in the plugin"),
        Some(Parameter { name, flag, .. }) => format!("{id} ({name}) is not set so; the flag is {flag}"),
        None => {
            let all = || PARAMETERS.iter().filter(|parameter| parameter.sets.is_some());
            let near = nearest(id, all().flat_map(|parameter| [parameter.id, parameter.name]));
            let near = all()
                .find(|parameter| near.is_some_and(|near| [parameter.id, parameter.name].contains(&near)));
            let near = near.map_or_else(
                || ";".to_owned(),
                |Parameter { id, name, .. }| format!(": did you mean {id} ({name})?"),
            );
            format!("no parameter {id:?}{near} `chalumeau parameters` lists them")
        }
    })
}

/// Flags such as `--no-noise` and `--tempered` as values of the table.
fn shorthand(id: &str, text: &str, typed: &str) -> Option<Given> {
    let parameter = parameters::find(id)?;
    Some(Given { parameter, value: parameter.read(text).ok()?, typed: typed.to_owned() })
}

impl SettingsArgs {
    /// All that was given, each parameter once.
    fn given(&self) -> Result<Vec<Given>, Failure> {
        let no_noise = self.no_noise.then(|| shorthand("noise", "0", "--no-noise")).flatten();
        let tempered = self.tempered.then(|| shorthand("tune", "Tempered", "--tempered")).flatten();
        let natural = self.natural.then(|| shorthand("tune", "Natural", "--natural")).flatten();
        let players = self.players.and_then(|count| shorthand("player", &count.to_string(), "--players"));
        let unison = self.unison.then(|| shorthand("split", "Unison", "--unison")).flatten();
        let short = [&no_noise, &tempered, &natural, &self.breath_response, &players, &unison];
        let short = short.into_iter().flatten();
        let all: Vec<Given> = self.numbers.0.iter().chain(short).chain(&self.set).cloned().collect();
        for (at, later) in all.iter().enumerate() {
            if let Some(earlier) = all[..at].iter().find(|other| other.parameter.id == later.parameter.id) {
                return Err(Failure::Usage(format!(
                    "{} and {} both set {}; give one of them",
                    earlier.typed, later.typed, later.parameter.name
                )));
            }
        }
        Ok(all)
    }

    /// The ids of all that was given, and as what it was typed.
    pub fn typed(&self) -> Result<Vec<(&'static str, String)>, Failure> {
        Ok(self.given()?.into_iter().map(|given| (given.parameter.id, given.typed)).collect())
    }

    /// What was given, for the remarks of a table; nothing if nothing was.
    pub fn given_in_words(&self) -> Result<String, Failure> {
        let given = self.given()?;
        let words =
            given.iter().map(|given| format!("{} {}", given.typed, given.parameter.text(given.value)));
        let words = words.collect::<Vec<_>>().join(", ");
        Ok(if words.is_empty() { words } else { format!("; given {words}") })
    }

    fn has(&self, id: &str) -> bool {
        self.numbers.0.iter().chain(&self.set).any(|given| given.parameter.id == id)
    }

    /// Whether the user has chosen an amount of breath noise.
    pub fn noise_given(&self) -> bool {
        self.has("noise")
    }

    /// Refuses a room, several players and what keys play, where notes of one instrument are measured.
    pub fn refuse_room_players_and_keys(&self) -> Result<(), Failure> {
        let idle = ["player", "split", "room", "transp", "beyond", "keysw"];
        match self.given()?.iter().find(|given| idle.contains(&given.parameter.id)) {
            Some(Given { typed, .. }) => Err(Failure::Usage(format!(
                "{typed} does nothing here: this command measures notes of one instrument, without a room and without keys; leave it out"
            ))),
            None => Ok(()),
        }
    }

    /// As what the user typed that all players play every note.
    pub fn unison_given(&self) -> Result<Option<String>, Failure> {
        let given = self.given()?.into_iter().find(|given| given.parameter.id == "split");
        Ok(given.filter(|given| given.value == Value::Choice(1)).map(|given| given.typed))
    }

    /// Whether the user has chosen how many players play, or what they do with the notes.
    pub fn players_given(&self) -> bool {
        self.players.is_some() || self.unison || self.has("player") || self.has("split")
    }

    /// Whether the user has chosen that breath is played.
    pub fn is_played_chosen(&self) -> Result<bool, Failure> {
        Ok(self.response()?.is_some_and(|(response, _)| response == BreathResponse::Played))
    }

    /// The response to breath that the user has chosen, and as what it was typed.
    fn response(&self) -> Result<Option<(BreathResponse, String)>, Failure> {
        let given = self.given()?.into_iter().find(|given| given.parameter.id == "resp");
        Ok(given.map(|Given { parameter, value, typed }| {
            let mut settings = Settings::default();
            parameter.set(&mut settings, value);
            (settings.breath_response, typed)
        }))
    }

    /// What was given, over `base`.
    fn over(&self, base: Settings, file: &InstrumentFile) -> Result<Settings, Failure> {
        let given = self.given()?;
        let find = |id: &str| given.iter().find(|given| given.parameter.id == id);
        let mut settings = base;
        for Given { parameter, value, .. } in &given {
            parameter.set(&mut settings, *value);
        }
        if let Some(k) = find("reedk") {
            if let Some(Given { value: Value::Switch(true), typed, .. }) = find("reedc") {
                return Err(Failure::Usage(format!(
                    "{typed} makes k follow H, so {} has no effect; give one of them",
                    k.typed
                )));
            }
            settings.coupled = false;
        }
        self.measured_with(&given, file.nominal_radius_m)?.over(settings, file.nominal_radius_m)
    }

    /// The measured reed of flags and `--set`. Flags have the lengths of this instrument's reed; parameters, as in the plugin and in
    /// presets, those that the reed would have on a B flat clarinet.
    fn measured_with(&self, given: &[Given], nominal_radius_m: f64) -> Result<PhysicalReedArgs, Failure> {
        let mut measured = self.measured;
        for Given { parameter, value, typed } in given {
            match (parameter.sets, value) {
                (Some(Sets::ReedDescription), Value::Choice(1)) => measured.is_used = true,
                (Some(Sets::Reed(..)), Value::Number(value))
                    if measured.replace(parameter.id, f64::from(*value), nominal_radius_m).is_some() =>
                {
                    let Parameter { flag, name, .. } = parameter;
                    return Err(Failure::Usage(format!(
                        "{flag} and {typed} both set {name}; give one of them"
                    )));
                }
                _ => {}
            }
        }
        let other = given.iter().find(|Given { parameter, value, .. }| match parameter.sets {
            Some(Sets::ReedDescription) => *value == Value::Choice(0),
            _ => ["reedh", "reedk", "reedc", "zeta"].contains(&parameter.id),
        });
        match other {
            Some(other) if measured.reed(REFERENCE_RADIUS_M).is_some() => Err(Failure::Usage(format!(
                "{} cannot be used with a reed as measured; give H, k and zeta, or stiffness, area, width and opening",
                other.typed
            ))),
            _ => Ok(measured),
        }
    }

    /// As the user plays: breath is what was chosen, played otherwise. A reed given in millimetres is measured against the
    /// instrument's nominal bore.
    pub fn played(&self, file: &InstrumentFile) -> Result<Settings, Failure> {
        let settings = self.over(Settings::default(), file)?;
        match settings.breath_response {
            BreathResponse::Played => Ok(settings),
            // The pitch of a pressure drifts unless it was asked not to.
            BreathResponse::Physical => self.over(Settings::physical(), file),
        }
    }

    /// What [`played`](Self::played) and [`blown_in_either`](Self::blown_in_either) begin with where there is no preset.
    pub fn usual(&self, is_blown_by_a_curve: bool) -> Result<Settings, Failure> {
        Ok(match self.response()? {
            Some((BreathResponse::Physical, _)) => Settings::physical(),
            None if is_blown_by_a_curve => Settings::physical(),
            _ => Settings::default(),
        })
    }

    /// The settings of a preset, and over them what was given.
    pub fn over_preset(&self, preset: &Settings, file: &InstrumentFile) -> Result<Settings, Failure> {
        self.over(*preset, file)
    }

    /// As a player plays at a dynamic, also a preset that a machine blows.
    pub fn with_dynamics(
        &self,
        preset: Option<&Settings>,
        file: &InstrumentFile,
    ) -> Result<Settings, Failure> {
        if let Some((BreathResponse::Physical, typed)) = self.response()? {
            return Err(Failure::Usage(format!(
                "{typed}: a physical breath has no dynamics; leave {typed} out, or give --gamma in place of a dynamic"
            )));
        }
        let played = |base: &Settings| Settings { breath_response: BreathResponse::Played, ..*base };
        preset.map_or_else(|| self.played(file), |base| self.over_preset(&played(base), file))
    }

    /// For a breath curve: of gamma, unless the preset or the user has chosen the played response; then of shares of full
    /// breath.
    pub fn blown_in_either(
        &self,
        preset: Option<&Settings>,
        curve: &BreathCurve,
        file: &InstrumentFile,
    ) -> Result<Settings, Failure> {
        let of_preset = preset.map(|preset| (preset.breath_response, "--preset".to_owned()));
        match self.response()?.or(of_preset) {
            Some((BreathResponse::Played, typed)) => {
                let most = curve.gamma_max();
                if most > 1.0 {
                    let instead = if typed == "--preset" {
                        "add --breath-response physical".to_owned()
                    } else {
                        format!("leave {typed} out")
                    };
                    return Err(Failure::Usage(format!(
                        "with {typed} breath is a share of full breath, 0..1, got {most}; {instead} to give gamma"
                    )));
                }
                preset.map_or_else(|| self.played(file), |preset| self.over_preset(preset, file))
            }
            _ => self.reaching(curve, self.over(*preset.unwrap_or(&Settings::physical()), file)?),
        }
    }

    /// For a curve of gamma, also on a preset that is played: breath is a pressure, and full breath reaches the largest gamma. It is raised for it unless the
    /// user has chosen it. A reed given in millimetres is measured against the instrument's nominal bore.
    pub fn blown_by(
        &self,
        preset: Option<&Settings>,
        curve: &BreathCurve,
        file: &InstrumentFile,
    ) -> Result<Settings, Failure> {
        if let Some((BreathResponse::Played, typed)) = self.response()? {
            return Err(Failure::Usage(format!(
                "{typed}: this command blows with a pressure, gamma; leave {typed} out"
            )));
        }
        let blown = |base: &Settings| Settings { breath_response: BreathResponse::Physical, ..*base };
        self.reaching(curve, self.over(preset.map_or_else(Settings::physical, blown), file)?)
    }

    /// Settings whose full breath reaches the largest gamma of a curve.
    fn reaching(&self, curve: &BreathCurve, mut settings: Settings) -> Result<Settings, Failure> {
        let gamma_max = curve.gamma_max();
        let closing_kpa = score::closing_kpa(&settings);
        // Less what single precision adds to a closing pressure of 6 kPa.
        let needed_kpa = gamma_max * closing_kpa * (1.0 - 4.0 * f32::EPSILON);
        if needed_kpa <= settings.breath_full_kpa {
            return Ok(settings);
        }
        // The end of the range, as the settings clamp it.
        let most_kpa = Settings { breath_full_kpa: f32::MAX, ..settings }.clamped().breath_full_kpa;
        let limit_kpa = if self.has("full") { settings.breath_full_kpa } else { most_kpa };
        if needed_kpa > limit_kpa {
            return Err(Failure::Usage(format!(
                "gamma {gamma_max} needs {needed_kpa:.1} kPa with this reed, but full breath is {limit_kpa} kPa; \
                 stay below gamma {:.2}, or take a softer reed or more --breath-full (up to {most_kpa})",
                limit_kpa / closing_kpa
            )));
        }
        settings.breath_full_kpa = needed_kpa;
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::parse;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        settings: SettingsArgs,
    }

    /// Settings of a command line, or what is said against it.
    fn read(words: &[&str]) -> Result<Settings, String> {
        let line = parse::<Line>(std::iter::once(&"program").chain(words)).map_err(|e| e.to_string())?;
        line.settings.played(&InstrumentFile::built_in()).map_err(|failure| failure.to_string())
    }

    fn said(words: &[&str]) -> String {
        read(words).expect_err("refused")
    }

    #[test]
    fn nothing_given_is_the_reference_clarinet() {
        assert_eq!(read(&[]), Ok(Settings::default()));
    }

    #[test]
    fn a_share_and_a_percentage_are_not_taken_for_each_other() {
        let growl = Ok(0.4);
        for words in [&["--growl", "0.4"][..], &["--growl", "40%"], &["--growl=40 %"], &["--set", "growl=40"]]
        {
            assert_eq!(read(words).map(|settings| settings.techniques.growl), growl, "{words:?}");
        }
        let doubted = said(&["--growl", "40"]);
        assert!(doubted.contains("0..1") && doubted.contains("0.4, or 40%"), "{doubted}");
        let doubted = said(&["--set", "growl=0.4"]);
        assert!(doubted.contains("growl=0.4% or growl=40%"), "{doubted}");
        assert!(said(&["--growl", "140%"]).contains("0..100 %"), "{}", said(&["--growl", "140%"]));
        let little = read(&["--set", "growl=0.5%"]).unwrap().techniques.growl;
        assert_eq!((little, read(&["--growl", "0.5%"]).unwrap().techniques.growl), (0.005, little));
        // What has another unit is not doubted.
        assert_eq!(read(&["--set", "gliss=0.4"]).unwrap().glissando_s, 0.4);
    }

    #[test]
    fn flags_and_assignments_set_the_same() {
        let mut given = 0;
        for (parameter, number) in flagged() {
            let end = if number.max == number.default { number.min } else { number.max };
            let text = number.text(end);
            let flag = format!("{}={end}", parameter.flag);
            let by_flag = read(&[&flag]).unwrap();
            assert_ne!(by_flag, Settings::default(), "{flag}");
            assert_eq!(read(&["--set", &format!("{}={text}{}", parameter.id, number.unit)]), Ok(by_flag));
            given += 1;
        }
        assert_eq!(given, 52, "all numbers of the settings have a flag");
        assert_eq!(read(&["--set", "tune=tempered"]), read(&["--tempered"]));
        assert_eq!(read(&["--set", "tune=natural"]), read(&["--natural"]));
        assert_eq!(read(&["--set", "resp=physical"]), Ok(Settings::physical()));
        assert_eq!(read(&["--breath-response", "physical"]), Ok(Settings::physical()));
        assert_eq!(read(&["--set", "noise=0 %"]), read(&["--no-noise"]));
        let several = read(&["--set", "vent=2.5", "--set", "temp=20 °C", "--set", "reedc=free"]).unwrap();
        let d = Settings::default();
        assert_eq!(several, Settings { vent_loss: 2.5, temperature_c: 20.0, coupled: false, ..d });
        assert!(!read(&["--k", "0.5"]).unwrap().coupled && !read(&["--set", "reedk=0.5"]).unwrap().coupled);
    }

    #[test]
    fn a_measured_reed_is_set_either_way() {
        let by_flag = read(&["--reed-stiffness", "2000"]).unwrap();
        assert_ne!(by_flag, Settings::default());
        assert_eq!(read(&["--set", "rstiff=2000 N/m"]), Ok(by_flag));
        assert_eq!(read(&["--set", "rstiff=2000", "--set", "rface=measured"]), Ok(by_flag));
        assert_eq!(
            read(&["--set", "rstiff=2000", "--set", "rface=Physical"]),
            Ok(by_flag),
            "its former name"
        );
        assert!(!read(&["--set", "rface=measured"]).unwrap().coupled);
        assert_eq!(read(&["--set", "rface=dimensionless"]), Ok(Settings::default()));
    }

    #[test]
    fn mistakes_are_told() {
        for (words, says) in [
            (
                &["--set", "vnt=2"][..],
                &["no parameter \"vnt\": did you mean vent (Vent loss)?", "chalumeau parameters"][..],
            ),
            (&["--set", "strength=3"], &["did you mean stren (Reed strength)?"]),
            (&["--set", "bfrom=keys"], &["bfrom (Breath from) belongs to a controller", "--controllers"]),
            (&["--set", "vent"], &["must be id=value"]),
            (&["--set", "vent=9"], &["vent (Vent loss) must lie in 0..4, got 9"]),
            (&["--set", "vent loss=9"], &["must lie in 0..4, got 9"]),
            (&["--set", "temp=50 °C"], &["temp (Temperature) must lie in 10..40 °C"]),
            (&["--set", "tune=just"], &["must be one of Natural, Tempered"]),
            (&["--set", "instr=bass"], &["instr (Instrument)", "the flag is --instrument"]),
            (&["--set", "arm=on"], &["arm (Arm knob) is only in the plugin"]),
            (&["--zeta", "0.4", "--set", "zeta=0.5"], &["--zeta and --set zeta both set Embouchure"]),
            (&["--set", "lip=1.1", "--set", "lip=1.2"], &["--set lip and --set lip both set"]),
            (&["--no-noise", "--set", "noise=3"], &["--no-noise and --set noise both set"]),
            (&["--tempered", "--set", "tune=natural"], &["--tempered and --set tune both set"]),
            (&["--breath-response", "loud"], &["must be one of Played, Physical"]),
            (
                &["--k", "0.5", "--set", "reedc=coupled"],
                &["--set reedc makes k follow H", "--k has no effect"],
            ),
            (&["--reed-area", "90", "--set", "rarea=90"], &["--reed-area and --set rarea both set"]),
            (&["--reed-area", "90", "--set", "zeta=0.4"], &["--set zeta cannot be used with"]),
            (&["--set", "rface=dimensionless", "--set", "rwidth=9"], &["--set rface cannot be used with"]),
            (&["--zeta", "1"], &["must lie in 0.05..0.9"]),
            (&["--gain-db", "loud"], &["must be a number in -60..24"]),
        ] {
            let said = said(words);
            assert!(says.iter().all(|say| said.contains(say)), "{words:?}: {said}");
        }
    }
}
