//! Files that hand shards to engines. Each is short, so that it can be read before it is run.

use std::path::{Path, absolute};

use claymill_toolpath::write_whole;

use super::list::{ShardList, ranges};
use super::status::Standings;
use crate::args::Engine;
use crate::commands::Context;
use crate::console::outln;
use crate::failure::{Failure, MORE_MEMORY, TRY_AGAIN};
use crate::reuse::PROGRAM;

/// A shard may take so many times its estimate before an engine ends it, and at least so many minutes.
const TIME_FACTOR: f64 = 4.0;
const LEAST_MINUTES: f64 = 10.0;
/// An engine tries a shard so many times.
const ATTEMPTS: u32 = 5;

/// What a script is filled with.
struct Blanks {
    /// For a shell.
    claymill: String,
    work: String,
    out: String,
    /// The shards that are not done, as ranges.
    missing: String,
    numbers: Vec<usize>,
    cores: u32,
    minutes: u64,
    mb: u64,
}

/// Writes the file for an engine to the work folder.
pub(super) fn script(
    context: &Context,
    folder: &Path,
    engine: Engine,
    out: Option<&Path>,
    cores: u32,
) -> Result<(), Failure> {
    let list = ShardList::read(folder, PROGRAM)?;
    let numbers = Standings::of(&list, folder)?.missing();
    let whole = |path: &Path| absolute(path).map_err(Failure::at(path));
    let work = whole(folder)?;
    let out = out.map_or_else(|| Ok(work.join("job")), whole)?;
    let claymill = std::env::current_exe().map_err(Failure::at(Path::new("claymill")))?;
    let longest_s = list.shards.iter().map(|shard| shard.estimated_s).fold(0.0, f64::max) + list.prepare_s;
    let most_mb = list.shards.iter().map(|shard| shard.estimated_mb).fold(0.0, f64::max);
    let blanks = Blanks {
        claymill: shell(&claymill)?,
        work: shell(&work)?,
        out: shell(&out)?,
        missing: ranges(&numbers),
        numbers,
        cores,
        minutes: (TIME_FACTOR * longest_s / 60.0).max(LEAST_MINUTES).ceil() as u64,
        mb: most_mb.ceil() as u64,
    };
    let (name, text) = match engine {
        Engine::Slurm => ("slurm.sh", slurm(&blanks)),
        Engine::Hyperqueue => ("hyperqueue.sh", hyperqueue(&blanks)),
        Engine::Snakemake => ("Snakefile", snakemake(&blanks)),
        Engine::Openjd => ("openjd.yaml", openjd(&blanks)),
        Engine::Parallel => ("parallel.sh", parallel(&blanks)),
    };
    let path = work.join(name);
    write_whole(&path, text.as_bytes()).map_err(Failure::at(&path))?;
    if context.json {
        return context.print_json(&path);
    }
    outln!("script    {}", path.display());
    outln!("run       {}", command(engine, &path)?);
    Ok(())
}

/// How the file is handed to its engine.
fn command(engine: Engine, path: &Path) -> Result<String, Failure> {
    let file = shell(path)?;
    Ok(match engine {
        Engine::Slurm | Engine::Hyperqueue | Engine::Parallel => format!("bash {file}"),
        Engine::Snakemake => format!("snakemake --cores all --snakefile {file}"),
        Engine::Openjd => format!("openjd run {file} --step Join --run-dependencies"),
    })
}

/// A path as one word of a shell, which is also one of Python and YAML in what these scripts do with it.
fn shell(path: &Path) -> Result<String, Failure> {
    let text = path.to_str().filter(|text| !text.contains(|c: char| c.is_control() || "'\"\\{}".contains(c)));
    text.map(|text| format!("'{text}'")).ok_or_else(|| {
        Failure::problem(
            format!("{} cannot be written into a script", path.display()),
            "Work in a folder without quotation marks, braces, backslashes and control characters in its name.",
        )
    })
}

fn slurm(blanks: &Blanks) -> String {
    let Blanks { claymill, work, out, missing, cores, minutes, mb, .. } = blanks;
    format!(
        r#"#!/bin/bash
# Lays the shards of a plan as an array job of Slurm, then joins them. Run it where sbatch is.
set -euo pipefail
claymill={claymill}
work={work}
out={out}
export claymill work out
dependency=()

# A shard that ends with {TRY_AGAIN} is tried again; one that ends with {MORE_MEMORY} too, with twice the memory. Others stay as they are.
if [ -n "{missing}" ]; then
    shards=$(sbatch --parsable --job-name=claymill --array={missing} --cpus-per-task={cores} --mem={mb}M \
        --time={minutes} --requeue --open-mode=append --output="$work/shard-%a.log" <<'SHARD'
#!/bin/bash
"$claymill" --threads "$SLURM_CPUS_PER_TASK" --quiet shard run "$work" "$SLURM_ARRAY_TASK_ID"
code=$?
if [ "${{SLURM_RESTART_COUNT:-0}}" -lt {ATTEMPTS} ]; then
    case $code in
        {TRY_AGAIN}) scontrol requeue "$SLURM_JOB_ID" ;;
        {MORE_MEMORY}) scontrol requeuehold "$SLURM_JOB_ID" &&
            scontrol update JobId="$SLURM_JOB_ID" MinMemoryNode=$((2 * SLURM_MEM_PER_NODE)) &&
            scontrol release "$SLURM_JOB_ID" ;;
    esac
fi
exit $code
SHARD
    )
    echo "shards: job $shards"
    dependency=(--dependency="afterok:$shards" --kill-on-invalid-dep=yes)
fi
joined=$(sbatch --parsable --job-name=claymill-join "${{dependency[@]}}" --cpus-per-task={cores} --mem={mb}M \
    --open-mode=append --output="$work/join.log" <<'JOIN'
#!/bin/bash
"$claymill" --threads "$SLURM_CPUS_PER_TASK" --quiet shard join "$work" -o "$out"
JOIN
)
echo "join:   job $joined, to $out"
echo "status: $claymill shard status $work"
"#
    )
}

fn hyperqueue(blanks: &Blanks) -> String {
    let Blanks { claymill, work, out, missing, cores, mb, .. } = blanks;
    format!(
        r#"#!/bin/bash
# Lays the shards of a plan as tasks of HyperQueue, waits for them, and joins them here. Run it where hq finds its server.
set -euo pipefail
claymill={claymill}
work={work}
out={out}
# Workers need about {mb} MB for each shard.
if [ -n "{missing}" ]; then
    hq submit --wait --name claymill --array={missing} --cpus={cores} --crash-limit={ATTEMPTS} \
        --stdout="$work/shard-%{{TASK_ID}}.log" --stderr="$work/shard-%{{TASK_ID}}.log" -- \
        "$claymill" --threads {cores} --quiet shard run "$work"
fi
"$claymill" --quiet shard join "$work" -o "$out"
"#
    )
}

fn snakemake(blanks: &Blanks) -> String {
    let Blanks { claymill, work, out, numbers, cores, minutes, mb, .. } = blanks;
    format!(
        r#"# Lays the shards of a plan and joins them. A failed shard comes back with more memory.
CLAYMILL = {claymill}
WORK = {work}
OUT = {out}
SHARDS = {numbers:?}

rule join:
    input: expand(WORK + "/done/{{shard}}", shard=SHARDS)
    threads: {cores}
    resources: mem_mb={mb}
    shell: "'{{CLAYMILL}}' --threads {{threads}} --quiet shard join '{{WORK}}' -o '{{OUT}}'"

rule shard:
    output: touch(WORK + "/done/{{shard}}")
    threads: {cores}
    retries: {retries}
    resources:
        mem_mb=lambda wildcards, attempt: {mb} * 2 ** (attempt - 1),
        runtime={minutes}
    shell: "'{{CLAYMILL}}' --threads {{threads}} --quiet shard run '{{WORK}}' {{wildcards.shard}}"
"#,
        retries = ATTEMPTS - 1
    )
}

fn openjd(blanks: &Blanks) -> String {
    let Blanks { claymill, work, out, missing, cores, mb, .. } = blanks;
    // Without a shard there is nothing to depend on.
    let (shards, depends) = if missing.is_empty() {
        (String::new(), "")
    } else {
        let text = format!(
            r#"  - name: Shards
    parameterSpace:
      taskParameterDefinitions:
        - {{ name: Shard, type: INT, range: "{missing}" }}
    hostRequirements:
      amounts:
        - {{ name: amount.worker.vcpu, min: {cores} }}
        - {{ name: amount.worker.memory, min: {mb} }}
    script:
      actions:
        onRun:
          command: {claymill}
          args: ["--threads", "{cores}", "--quiet", "shard", "run", {work}, "{{{{Task.Param.Shard}}}}"]
"#
        );
        (text, "    dependencies:\n      - dependsOn: Shards\n")
    };
    format!(
        r#"# Lays the shards of a plan on a render farm, and joins them.
specificationVersion: jobtemplate-2023-09
name: claymill
steps:
{shards}  - name: Join
{depends}    script:
      actions:
        onRun:
          command: {claymill}
          args: ["--quiet", "shard", "join", {work}, "-o", {out}]
"#
    )
}

fn parallel(blanks: &Blanks) -> String {
    let Blanks { claymill, work, out, numbers, cores, .. } = blanks;
    let all = numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    format!(
        r#"#!/bin/bash
# Lays the shards of a plan by GNU parallel, here or over ssh (add --sshloginfile), and joins them. Run again, it goes on.
set -euo pipefail
claymill={claymill}
work={work}
out={out}
cores=$(nproc)
jobs=$((cores / {cores} > 0 ? cores / {cores} : 1))
for shard in {all}; do echo "$shard"; done |
    parallel --jobs "$jobs" --retries {ATTEMPTS} "$claymill" --threads {cores} --quiet shard run "$work" {{}}
"$claymill" --quiet shard join "$work" -o "$out"
"#
    )
}
