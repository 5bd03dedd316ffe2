//! Writes a job as program files, reads them back and compares them with the job before they are
//! put in place. Also gives single blocks for controls that are fed over a remote protocol.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use claymill_toolpath::{Kind, MoveKind, Output};
use rayon::prelude::*;
use serde::{Serialize, Serializer};

use crate::compare::{Comparison, compare};
use crate::dialects::{Dialect, Grammar, Page, TAG};
use crate::job::{MachineJob, Section, Stroke};
use crate::lower::{Lowered, Rung, lower};
use crate::machine::Files;
use crate::placed::{TILTED, placed};
use crate::route::LIFT_MM;
use crate::tilt::Turn;
use crate::{Machine, PostError, Simulation};

/// What was written, and how well it stands for the job.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PostTotals {
    /// Version of claymill that wrote it.
    pub claymill_version: &'static str,
    /// The dialect.
    pub dialect: String,
    /// The machine's name.
    pub machine: String,
    /// What its header has to say of the job.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// How the tool gets out of the way before a stop, a tool change and the end.
    pub retreat: String,
    /// Files in the order in which they are run.
    pub files: Vec<WrittenFile>,
    /// Moves by what they became.
    pub rungs: BTreeMap<Rung, u64>,
    /// How far the program may be from the job before rounding, mm.
    pub tolerance_mm: f64,
    /// How far it may be with rounding, mm.
    pub stated_mm: f64,
    /// Largest distance measured while writing, mm.
    pub written_mm: f64,
    /// What reading back found.
    pub read_back: Comparison,
    /// What a virtual control makes of it, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulation: Option<Simulation>,
}

/// One file of a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WrittenFile {
    /// Its path.
    #[serde(serialize_with = "shown")]
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Its lines.
    pub lines: u64,
}

/// A path of any bytes, as far as it can be shown.
fn shown<S: Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&path.display())
}

/// Moves taken down the ladder at a time.
const BATCH: usize = 2048;
/// Stands in the header until the program has been read back; as long as what replaces it.
const UNKNOWN: &str = "?.??????";

/// Writes a job for a control, reads what was written, and puts it in place when it is the job.
///
/// `partial` is told what must be removed should the process be interrupted.
///
/// # Errors
/// The machine cannot do the job, a file cannot be written, or what was written is not the job.
pub fn post(
    job: &MachineJob,
    dialect: Dialect,
    machine: &Machine,
    out: &Path,
    partial: &dyn Fn(&Path),
) -> Result<PostTotals, PostError> {
    let output = Output::begin(out, Kind::Program, &[], false)?;
    output.leftovers().iter().for_each(|path| partial(path));
    let totals = post_to(job, dialect, machine, &output, out)?;
    let names = totals.files.iter().filter_map(|f| f.path.file_name());
    let files: Vec<_> = match output.is_stream() {
        true => vec![(output.name().to_owned(), Kind::Program)],
        false => names.map(|name| (name.to_owned(), Kind::Program)).collect(),
    };
    output.finish_all(&files)?;
    Ok(totals)
}

/// Writes a job for a control and reads what was written; the files lie in the folder of `output`, under their names, until it
/// is finished. `out` is the destination as it was told.
///
/// # Errors
/// The machine cannot do the job, a file cannot be written, or what was written is not the job.
pub fn post_to(
    job: &MachineJob,
    dialect: Dialect,
    machine: &Machine,
    output: &Output,
    out: &Path,
) -> Result<PostTotals, PostError> {
    let on_machine = placed(job, dialect, machine, machine.tilt.by)?;
    let job = &*on_machine;
    crate::limits::check(job, dialect, machine)?;
    let name = if output.is_stream() { "PROGRAM".into() } else { output.name().to_string_lossy() };
    let folder = output.folder();
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| PostError::Io { path, source }
    };
    let format = dialect.format(machine);
    let mut writer = Writer {
        grammar: dialect.grammar(),
        page: Page {
            machine,
            format,
            name: program_name(&name),
            number: 0,
            header: Vec::new(),
            retreats: true,
            speed_rpm: 0.0,
        },
        dialect,
        job,
        folder: folder.to_owned(),
        sheets: Vec::new(),
        rungs: BTreeMap::new(),
        written_mm: 0.0,
        first_id: 0,
        groups: Vec::new(),
    };
    writer.all()?;
    let retreat = writer.retreat();
    let Writer { sheets, rungs, written_mm, .. } = writer;
    let paths: Vec<PathBuf> = sheets.iter().map(|s| s.path.clone()).collect();
    let read_back = compare(job, &paths, dialect, machine)?;
    let stated_mm = machine.tolerance_mm + 0.87 * format.step_mm();
    judge(&read_back, job, stated_mm)?;
    let mut files = Vec::new();
    for (i, sheet) in sheets.iter().enumerate() {
        let text = format!("{:.6}", read_back.largest_mm);
        if text.len() == UNKNOWN.len() {
            patch(&sheet.path, sheet.unknown_at, &text).map_err(io(&sheet.path))?;
        }
        let single = sheets.len() == 1 && machine.files == Files::One;
        let name = match single {
            true => output.name().to_owned(),
            false => part_name(output.name(), i + 1, &sheet.setup),
        };
        fs::rename(&sheet.path, folder.join(&name)).map_err(io(out))?;
        let path = if output.is_stream() { out.to_owned() } else { out.with_file_name(name) };
        files.push(WrittenFile { path, bytes: sheet.bytes, lines: sheet.lines });
    }
    Ok(PostTotals {
        claymill_version: env!("CARGO_PKG_VERSION"),
        dialect: dialect.name().into(),
        machine: machine.name.clone(),
        notes: job.notes.clone(),
        retreat,
        files,
        rungs,
        tolerance_mm: machine.tolerance_mm,
        stated_mm,
        written_mm,
        read_back,
        simulation: None,
    })
}

/// The blocks of a whole program, one by one and without what only a file needs, for a control that is fed
/// through its remote protocol.
///
/// # Errors
/// The machine cannot do the job.
pub fn blocks_of(job: &MachineJob, dialect: Dialect, machine: &Machine) -> Result<Vec<String>, PostError> {
    let grammar = dialect.grammar();
    let format = dialect.format(machine);
    let mut page = Page {
        machine,
        format,
        name: "STREAM".into(),
        number: 1,
        header: Vec::new(),
        retreats: false,
        speed_rpm: 0.0,
    };
    let mut text = String::new();
    grammar.begin(&mut text, &page);
    let mut id = 0;
    for section in &job.sections {
        let Some(first) = section.strokes.first() else { continue };
        page.speed_rpm = section.speed_rpm;
        grammar.section(&mut text, &page, section, &format.snap_point(&first.curve.start()));
        for stroke in &section.strokes {
            let abilities = grammar.abilities(machine);
            let lowered = lower(&stroke.curve, &abilities, &format, machine.tolerance_mm)
                .map_err(|refusal| PostError::Refused { seq: stroke.seq, refusal })?;
            grammar.stroke(&mut text, &page, stroke, &lowered, id);
            id += 1;
        }
        let end = section.strokes.last().map_or(first.curve.end(), |s| s.curve.end());
        grammar.leave(&mut text, &page, section, &format.snap_point(&end), None, 0..0);
    }
    let moves = |l: &&str| !(l.is_empty() || l.starts_with(['%', '(']));
    Ok(text.lines().filter(moves).map(str::to_owned).collect())
}

/// Blocks that take a tool, which may stand in a cut at height `z_mm` of the work, straight up to the clearance height of
/// the job's first section: `lift_mm` at the feed of leads, the rest at once.
#[must_use]
pub fn retreat_of(
    job: &MachineJob,
    dialect: Dialect,
    machine: &Machine,
    z_mm: f64,
    lift_mm: Option<f64>,
) -> Vec<String> {
    let Some(section) = job.sections.first() else { return Vec::new() };
    let top = section.clearance_mm;
    if z_mm >= top {
        return Vec::new();
    }
    let format = dialect.format(machine);
    let unit = if machine.units == crate::Units::Mm { "G21" } else { "G20" };
    let lead = section.strokes.iter().find(|s| s.kind == MoveKind::LeadIn);
    let feed = lead.map_or(0.5 * machine.feed.max_mm_per_min, |s| s.feed) / machine.units.mm();
    let lifted = (z_mm + lift_mm.unwrap_or(LIFT_MM)).min(top);
    vec![
        format!("G90 G94 {unit}"),
        format!("G1 Z{} F{}", format.text(lifted), crate::number::decimal(feed, 3)),
        format!("G0 Z{}", format.text(top)),
    ]
}

/// Slack of the comparison's own arithmetic, mm.
const ARITHMETIC_MM: f64 = 2e-6;

fn judge(found: &Comparison, job: &MachineJob, stated_mm: f64) -> Result<(), PostError> {
    if found.largest_mm > stated_mm + ARITHMETIC_MM {
        let (found_mm, seq) = (found.largest_mm, found.largest_seq);
        return Err(PostError::Differs { found_mm, stated_mm, seq });
    }
    let lost =
        |what: &str, seq: Option<u64>| Err(PostError::Lost { what: what.into(), seq: seq.unwrap_or(0) });
    if found.missing > 0 || found.moves != job.strokes() as u64 {
        return lost("is not in the program", found.first_missing);
    }
    if found.feed_differs > 0 {
        return lost("has another feed", found.first_feed_differs);
    }
    Ok(())
}

/// Overwrites a few bytes of a file.
fn patch(path: &Path, at: u64, text: &str) -> io::Result<()> {
    let mut file = File::options().write(true).open(path)?;
    file.seek(SeekFrom::Start(at))?;
    file.write_all(text.as_bytes())
}

/// Letters, digits and underscores of a file's stem.
fn program_name(file: &str) -> String {
    let stem = file.split('.').next().unwrap_or("");
    let name: String = stem
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
        .take(32)
        .collect();
    if name.is_empty() { "CLAYMILL".into() } else { name }
}

/// `body-02-top.nc`
fn part_name(file: &OsStr, number: usize, setup: &str) -> OsString {
    let file = Path::new(file);
    let setup: String = setup.chars().filter(char::is_ascii_alphanumeric).collect();
    let mut name = file.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:02}-{setup}"));
    if let Some(extension) = file.extension() {
        name.push(".");
        name.push(extension);
    }
    name
}

/// A finished file.
struct Sheet {
    path: PathBuf,
    setup: String,
    bytes: u64,
    lines: u64,
    unknown_at: u64,
}

struct Writer<'a> {
    grammar: &'static dyn Grammar,
    page: Page<'a>,
    dialect: Dialect,
    job: &'a MachineJob,
    folder: PathBuf,
    sheets: Vec<Sheet>,
    rungs: BTreeMap<Rung, u64>,
    written_mm: f64,
    /// Id of the first move of the section that is being written.
    first_id: u64,
    groups: Vec<u64>,
}

/// A file that is being written.
struct Open {
    out: BufWriter<File>,
    sheet: Sheet,
    number: u64,
}

impl<'a> Writer<'a> {
    fn all(&mut self) -> Result<(), PostError> {
        let (job, machine) = (self.job, self.page.machine);
        let mut open: Option<Open> = None;
        let mut id = 0;
        for (i, section) in job.sections.iter().enumerate() {
            let next = job.sections.get(i + 1);
            let mut file = match open.take() {
                Some(file) => file,
                None => self.begin(section)?,
            };
            let mut rest = &section.strokes[..];
            while !rest.is_empty() {
                let written = self.part(&mut file, section, rest, &mut id)?;
                rest = &rest[written..];
                let last = rest.is_empty();
                let same_file = last
                    && next.is_some_and(|n| match machine.files {
                        Files::One => true,
                        Files::Setup => n.setup == section.setup,
                        Files::Tool => n.setup == section.setup && n.tool == section.tool,
                    });
                let turn = next.filter(|n| same_file && n.setup != section.setup && !n.stands_as(section));
                let stop = turn.map(|n| {
                    // The tool's length is not what it was: whoever sets the machine up must know before it goes on.
                    let again = n.stick_out_mm.filter(|_| n.stick_out_mm != section.stick_out_mm).map(|mm| {
                        let mm = self.page.format.text(mm);
                        format!(", tool T{} sticks out {mm}: measure its length anew", n.tool_number)
                    });
                    format!("turn the part: setup {}{}", n.setup, again.unwrap_or_default())
                });
                let stroke = &section.strokes[section.strokes.len() - rest.len() - 1];
                let end = self.page.format.snap_point(&stroke.curve.end());
                let mut text = String::new();
                self.grammar.leave(&mut text, &self.page, section, &end, stop.as_deref(), self.first_id..id);
                self.lines(&mut file, &text)?;
                self.groups.push(self.first_id);
                if same_file {
                    open = Some(file);
                    break;
                }
                self.end(file)?;
                if last {
                    break;
                }
                file = self.begin(section)?;
            }
        }
        if let Some(file) = open {
            self.end(file)?;
        }
        Ok(())
    }

    /// Writes strokes of one section until it ends or the file is full; returns how many.
    fn part(
        &mut self,
        file: &mut Open,
        section: &Section,
        strokes: &[Stroke],
        id: &mut u64,
    ) -> Result<usize, PostError> {
        self.first_id = *id;
        self.page.speed_rpm = section.speed_rpm;
        let start = self.page.format.snap_point(&strokes[0].curve.start());
        let mut text = String::new();
        self.grammar.section(&mut text, &self.page, section, &start);
        self.lines(file, &text)?;
        let mut written = 0;
        for batch in strokes.chunks(BATCH) {
            let first = *id;
            let made: Vec<Result<(String, Lowered), PostError>> = batch
                .par_iter()
                .enumerate()
                .map(|(i, stroke)| self.stroke(section, stroke, first + i as u64))
                .collect();
            for (stroke, made) in batch.iter().zip(made) {
                let full = self.page.machine.max_bytes.is_some_and(|max| file.sheet.bytes >= max);
                // Behind a rapid that goes up, not before it: the next file would go down there first.
                let rises = strokes.get(written + 1).is_some_and(|n| n.kind == MoveKind::Rapid)
                    && stroke.curve.end().z > stroke.curve.start().z;
                if full && written > 0 && stroke.kind == MoveKind::Rapid && !rises {
                    return Ok(written);
                }
                let (text, lowered) = made?;
                *self.rungs.entry(lowered.rung).or_default() += 1;
                self.written_mm = self.written_mm.max(lowered.error_mm);
                self.lines(file, &text)?;
                *id += 1;
                written += 1;
            }
        }
        Ok(written)
    }

    fn stroke(&self, section: &Section, stroke: &Stroke, id: u64) -> Result<(String, Lowered), PostError> {
        let machine = self.page.machine;
        let refused = |refusal| PostError::Refused { seq: stroke.seq, refusal };
        let mut abilities = self.grammar.abilities(machine);
        if self.dialect == Dialect::Fanuc && section.placed.is_some() {
            // Whether G06.2 is taken under G68.2 is not known.
            abilities.splines.clear();
        }
        let lowered =
            lower(&stroke.curve, &abilities, &self.page.format, machine.tolerance_mm).map_err(refused)?;
        let mut text = String::new();
        self.grammar.stroke(&mut text, &self.page, stroke, &lowered, id);
        Ok((text, lowered))
    }

    /// How the tool gets out of the way, in words.
    fn retreat(&self) -> String {
        let machine = self.page.machine;
        if machine.home.is_some() { "the machine's own blocks".into() } else { self.grammar.retreat(machine) }
    }

    fn begin(&mut self, section: &Section) -> Result<Open, PostError> {
        let path = self.folder.join(format!("{:05}", self.sheets.len()));
        let out = File::create(&path).map_err(|source| PostError::Io { path: path.clone(), source })?;
        let machine = self.page.machine;
        let unit = if machine.units == crate::Units::Mm { "mm" } else { "inch" };
        let model = Path::new(&self.job.job.model.path);
        let model = model.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        self.page.number = self.sheets.len() + 1;
        self.page.header = vec![
            format!("{TAG} {}", self.dialect),
            format!("version {}, machine {}", env!("CARGO_PKG_VERSION"), machine.name),
            format!("model {model}, unit {unit}"),
            format!("file {}, setup {}", self.sheets.len() + 1, section.setup),
            format!(
                "tolerance {} mm, with rounding {:.6} mm",
                machine.tolerance_mm,
                machine.tolerance_mm + 0.87 * self.page.format.step_mm()
            ),
            format!("largest difference from the job, read back: {UNKNOWN} mm"),
            format!("before a stop, a tool change and the end: {}", self.retreat()),
        ];
        let plane = |s: &Section| matches!(s.placed.map(|p| p.by), Some(Turn::Plane { .. }));
        if self.job.sections.iter().any(plane) {
            self.page.header.push(TILTED.into());
        }
        if self.dialect.lacks_plane(self.job, machine) {
            self.page
                .header
                .push("no tilted planes for this control: the part is turned for each setup".into());
        }
        if self.job.sections.iter().any(|s| s.speed_rpm == 0.0) {
            self.page.header.push("no spindle speed is known: start the spindle by hand".into());
        }
        self.page.header.splice(1..1, self.job.notes.iter().cloned());
        if let Some(mm) = self.job.job.tolerances.get("clearance_mm") {
            self.page.header.push(format!("rapids clear the finished model by {mm} mm along the tool axis"));
            self.page.header.push(format!("stock is not known: it must not stand out more than {mm} mm"));
        }
        for line in &mut self.page.header {
            line.retain(|c| !c.is_control());
        }
        let sheet = Sheet { path, setup: section.setup.clone(), bytes: 0, lines: 0, unknown_at: 0 };
        let number = machine.line_numbers.map_or(0, |n| n.first);
        let mut file = Open { out: BufWriter::with_capacity(1 << 18, out), sheet, number };
        let mut text = String::new();
        self.grammar.begin(&mut text, &self.page);
        self.lines(&mut file, &text)?;
        Ok(file)
    }

    fn end(&mut self, mut file: Open) -> Result<(), PostError> {
        let mut text = String::new();
        let groups = std::mem::take(&mut self.groups);
        self.grammar.end(&mut text, &self.page, &groups);
        self.lines(&mut file, &text)?;
        let path = file.sheet.path.clone();
        file.out.flush().map_err(|source| PostError::Io { path, source })?;
        self.sheets.push(file.sheet);
        Ok(())
    }

    /// Writes lines, with their numbers where the machine wants them.
    fn lines(&self, file: &mut Open, text: &str) -> Result<(), PostError> {
        let always = self.grammar.always_numbered();
        let put = |file: &mut Open, bytes: &str| {
            file.sheet.bytes += bytes.len() as u64;
            file.out.write_all(bytes.as_bytes())
        };
        let mut all = || -> io::Result<()> {
            for line in text.split_inclusive('\n') {
                if self.grammar.numbered(line) {
                    if always {
                        put(file, &format!("{} ", file.number))?;
                        file.number += self.page.machine.line_numbers.map_or(1, |n| n.step);
                    } else if let Some(numbers) = self.page.machine.line_numbers {
                        put(file, &format!("N{} ", file.number))?;
                        file.number += numbers.step;
                    }
                }
                if let Some(at) = line.find(UNKNOWN).filter(|_| file.sheet.unknown_at == 0) {
                    file.sheet.unknown_at = file.sheet.bytes + at as u64;
                }
                file.sheet.lines += 1;
                put(file, line)?;
            }
            Ok(())
        };
        all().map_err(|source| PostError::Io { path: file.sheet.path.clone(), source })
    }
}
