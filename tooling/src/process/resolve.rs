//! Values are inherited, each remembers where it is from, and contradictions are refused with both
//! origins.

use std::collections::BTreeMap;

use super::condition::Condition;
use super::files::{CutPattern, Material, StageKind, StageValues, StrategyName, Way};
use super::profiles::Profiles;
use super::sense::check_stage;
use super::stage::{Origin, Process, Resolved, Spacing, Stage, ToolChoice};
use crate::error::{Fault, ToolingError, one_line};

/// Values that somebody gives, the one that goes before first.
struct Layer<'p> {
    from: Origin,
    stages: &'p BTreeMap<StageKind, StageValues>,
}

impl Profiles {
    /// A process for a material with every value filled in. `asked` goes before all files.
    ///
    /// # Errors
    /// There is no such process or material; processes inherit in a circle; a value is missing or two contradict.
    pub fn resolve(
        &self,
        process: &str,
        material: &str,
        asked: &BTreeMap<StageKind, StageValues>,
    ) -> Result<Process, ToolingError> {
        let fail = |fault| ToolingError::Process { process: one_line(process), fault };
        for (kind, values) in asked {
            check_stage(*kind, values).map_err(fail)?;
        }
        let chain = self.chain(process).map_err(fail)?;
        let (material, file) = self.material_file(material).map_err(fail)?;
        let mut layers = vec![Layer { from: Origin::Asked, stages: asked }];
        let of_process = |name: &&str, general: bool| {
            self.processes.get(*name).filter(|(process, _)| process.general == general).map(
                |(process, file)| {
                    let from = Origin::Process { name: process.name.clone(), file: file.clone() };
                    Layer { from, stages: &process.stages }
                },
            )
        };
        layers.extend(chain.iter().filter_map(|name| of_process(name, false)));
        let from = Origin::Material { name: material.name.clone(), file: file.clone() };
        layers.push(Layer { from, stages: &material.stages });
        layers.extend(chain.iter().filter_map(|name| of_process(name, true)));
        let resolved = stages(&layers).map_err(fail)?;
        let process = Process {
            name: process.to_owned(),
            material: material.name.clone(),
            chain: chain.into_iter().map(str::to_owned).collect(),
            stages: resolved.0,
            skipped: resolved.1,
        };
        agree(&process, material).map_err(fail)?;
        Ok(process)
    }

    /// The process and those that it inherits from, in order.
    fn chain<'p>(&'p self, process: &str) -> Result<Vec<&'p str>, Fault> {
        let known = || self.process_names().collect::<Vec<_>>().join(", ");
        let mut chain: Vec<&str> = Vec::new();
        let mut next = Some(process);
        while let Some(name) = next {
            let Some((key, (file, path))) = self.processes.get_key_value(name) else {
                let what = match chain.last() {
                    Some(child) => format!("{child} inherits from `{}`, which is not there", one_line(name)),
                    None => "it is not there".to_owned(),
                };
                return Err(Fault::new(what, format!("There are {}. Add the missing file.", known())));
            };
            if let Some(first) = chain.iter().position(|c| c == key) {
                let mut circle = chain[first..].to_vec();
                circle.push(key);
                return Err(Fault::new(
                    format!("processes inherit in a circle: {}", circle.join(" <- ")),
                    format!("Take `inherits` out of one of them, for example out of {}.", path.display()),
                ));
            }
            chain.push(key);
            next = file.inherits.as_deref();
        }
        Ok(chain)
    }

    fn material_file(&self, name: &str) -> Result<(&Material, &std::path::PathBuf), Fault> {
        let found = self.material(name).and_then(|m| self.materials.get(&m.name));
        found.map(|(material, file)| (material, file)).ok_or_else(|| {
            let known: Vec<&str> = self.material_names().collect();
            Fault::new(
                format!("there is no material `{}`", one_line(name)),
                format!("There are {}. Add the file of yours.", known.join(", ")),
            )
        })
    }
}

/// The first layer that has a value of a stage.
fn first<T>(
    layers: &[Layer],
    kind: StageKind,
    get: impl Fn(&StageValues) -> Option<T>,
) -> Option<Resolved<T>> {
    layers.iter().find_map(|layer| {
        let value = get(layer.stages.get(&kind)?)?;
        Some(Resolved { value, from: layer.from.clone() })
    })
}

type Stages = (Vec<Stage>, Vec<(StageKind, Origin)>);

fn stages(layers: &[Layer]) -> Result<Stages, Fault> {
    let (mut stages, mut skipped) = (Vec::new(), Vec::new());
    for kind in StageKind::ALL {
        if !layers.iter().any(|layer| layer.stages.contains_key(&kind)) {
            continue;
        }
        match first(layers, kind, |v| v.skip) {
            Some(skip) if skip.value => skipped.push((kind, skip.from)),
            _ => stages.push(stage(layers, kind)?),
        }
    }
    Ok((stages, skipped))
}

fn stage(layers: &[Layer], kind: StageKind) -> Result<Stage, Fault> {
    let or_default = |value| Resolved { value, from: Origin::Default };
    // The three exclude each other: the first layer that gives one of them decides.
    let spacing = first(layers, kind, |v| {
        let scallop = v.scallop_mm.map(Spacing::ScallopMm);
        scallop.or(v.step_mm.map(Spacing::StepMm)).or(v.step_radii.map(Spacing::StepRadii))
    });
    let spacing = spacing.ok_or_else(|| {
        Fault::new(
            format!("stage {kind} has neither a scallop height nor a step-over"),
            format!("Give [stages.{kind}] one of scallop_mm, step_mm and step_radii."),
        )
    })?;
    let when = first(layers, kind, |v| v.when.clone()).map(|when| {
        let parsed = Condition::parse(&when.value).map_err(|e| Fault::new(e.to_string(), "Correct `when`."));
        parsed.map(|value| Resolved { value, from: when.from })
    });
    Ok(Stage {
        kind,
        allowance_mm: first(layers, kind, |v| v.allowance_mm).unwrap_or_else(|| or_default(0.0)),
        band_mm: first(layers, kind, |v| v.band_mm),
        spacing,
        depth_mm: first(layers, kind, |v| v.depth_mm),
        cut: first(layers, kind, |v| v.cut).or_else(|| {
            (kind == StageKind::Rough)
                .then_some(Resolved { value: CutPattern::Layers, from: Origin::Default })
        }),
        way: first(layers, kind, |v| v.way).unwrap_or(Resolved { value: Way::Lace, from: Origin::Default }),
        strategy: first(layers, kind, |v| v.strategy)
            .unwrap_or(Resolved { value: StrategyName::Auto, from: Origin::Default }),
        tool: tool(layers, kind),
        engagement_deg: first(layers, kind, |v| v.engagement_deg),
        feed_mm_per_min: first(layers, kind, |v| v.feed_mm_per_min),
        when: when.transpose()?,
    })
}

/// The first layer with a tool or radii decides. Below a layer that says `auto`, radii are still inherited.
fn tool(layers: &[Layer], kind: StageKind) -> Resolved<ToolChoice> {
    let radii = first(layers, kind, |v| v.radius_mm);
    let auto = |from| ToolChoice::Auto { radius_mm: radii.as_ref().map(|r| r.value) }.from(from);
    let decides = first(layers, kind, |v| match (&v.tool, v.radius_mm) {
        (None, None) => None,
        (tool, _) => Some(tool.clone().filter(|t| t != "auto")),
    });
    match decides {
        Some(Resolved { value: Some(id), from }) => ToolChoice::Id(id).from(from),
        Some(Resolved { value: None, from }) => auto(radii.as_ref().map_or(from, |r| r.from.clone())),
        None => auto(Origin::Default),
    }
}

impl ToolChoice {
    fn from(self, from: Origin) -> Resolved<Self> {
        Resolved { value: self, from }
    }
}

/// Refuses values that contradict each other, with where they are from.
fn agree(process: &Process, material: &Material) -> Result<(), Fault> {
    if process.stages.is_empty() {
        return Err(Fault::new("no stage is left", "Give it stages, or let it inherit from `general`."));
    }
    for pair in process.stages.windows(2) {
        let (before, after) = (&pair[0].allowance_mm, &pair[1].allowance_mm);
        if after.value > before.value {
            let (first, second) = (pair[0].kind, pair[1].kind);
            return Err(Fault::new(
                format!(
                    "{second} leaves {} mm ({}), more than {first}, which comes before it and leaves {} mm ({})",
                    after.value, after.from, before.value, before.from
                ),
                format!("Lower the allowance of {second}, or raise that of {first}."),
            ));
        }
    }
    for kind in [StageKind::Rest, StageKind::Pencil] {
        if process.stage(kind).is_some() && process.stage(StageKind::Finish).is_none() {
            return Err(Fault::new(
                format!("there is a stage {kind} without a finish, whose rest it cuts"),
                format!("Give it [stages.finish], or set skip = true in [stages.{kind}]."),
            ));
        }
    }
    for stage in &process.stages {
        let Some(feed) = &stage.feed_mm_per_min else { continue };
        let Some([low, high]) = material.feed_mm_per_min else { continue };
        if !(low..=high).contains(&feed.value) && feed.from != Origin::Asked {
            return Err(Fault::new(
                format!(
                    "{}: a feed of {} mm/min ({}) is not between {low} and {high}, as {} has it",
                    stage.kind, feed.value, feed.from, material.name
                ),
                "Change the feed, or the material's `feed_mm_per_min`.",
            ));
        }
    }
    Ok(())
}
