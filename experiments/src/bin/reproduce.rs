//! `reproduce`: lists and runs experiments. Status 0 when every experiment ran and no verdict got worse than the recorded one, 1
//! when one did, 2 when the program could not run.

#[path = "reproduce/claims.rs"]
mod claims;
#[path = "reproduce/rays.rs"]
mod rays;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;
use terrain_experiments::experiment::{Expected, Experiment, Profile};
use terrain_experiments::genevaux2015::ablations::count_pixels;
use terrain_experiments::model::throughput::count_scalar;
use terrain_experiments::report::words::{bytes, duration, results};
use terrain_experiments::runner::{Settings, Shard, regressions, run};
use terrain_experiments::{experiments, select};

/// Reproduces the tables, figures and claims of four terrain papers, and writes a report of it.
///
/// Without a subcommand it runs `all --quick`. It is safe to run twice: a later run replaces the folders of the experiments it
/// runs, and no others.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Verb>,
    #[command(flatten)]
    options: Options,
}

#[derive(Subcommand)]
enum Verb {
    /// Lists the experiments, with what each costs
    List,
    /// Runs some experiments
    Run {
        /// Ids as `list` prints them, or a paper for all of its experiments
        #[arg(required = true, value_name = "ID")]
        ids: Vec<String>,
    },
    /// Runs every experiment
    All,
    /// Compares the tracers with the certified one on many rays, and keeps what it counts
    ///
    /// Rays come in blocks. A run goes on where the record ends, so it can be stopped at any time; `--shard i/n` counts every
    /// n-th block, and the records of all shards, one after the other, are the whole.
    Rays {
        /// A scene of Table 1, as `fig3`; all of them when absent
        scene: Option<String>,
        /// How many rays
        #[arg(long, default_value_t = 1_000_000)]
        rays: u64,
        /// The record; the committed one of the scene when absent
        #[arg(long, value_name = "FILE", requires = "scene")]
        record: Option<PathBuf>,
        /// Counts one recorded block again, drawn by the clock, and compares
        #[arg(long)]
        check: bool,
    },
    /// Judges the rows of the ledger again: every statement of a paper with what shows it
    Claims {
        /// A paper's folder, as `genevaux2015`
        #[arg(long, value_name = "PAPER")]
        paper: Option<String>,
        /// One row, with its witness, proofs and plot
        #[arg(long, value_name = "ID")]
        id: Option<String>,
        /// Looks for violations: random points, gradient ascent, intervals
        #[arg(long)]
        hunt: bool,
    },
    /// Checks the proofs of the papers with `coqc`
    Proofs {
        /// A missing `coqc` is a failure
        #[arg(long)]
        strict: bool,
    },
    /// Evaluates the scene of `model/throughput` and nothing else: what is run to count instructions
    #[command(hide = true)]
    CountScalar {
        /// Evaluations
        count: u32,
    },
    /// Traces pixels of a scene of Table 1 and nothing else: what is run to count instructions
    #[command(hide = true)]
    CountPixels {
        /// As `fig3`
        scene: String,
        /// As `segment`
        tracer: String,
        /// Pixels
        count: u32,
    },
}

#[derive(Args)]
struct Options {
    /// Small sizes, the same code: minutes on two cores (the default)
    #[arg(long, global = true, conflicts_with = "full")]
    quick: bool,
    /// The papers' sizes
    #[arg(long, global = true)]
    full: bool,
    /// Chooses the random rays, cameras and cases
    #[arg(long, global = true, default_value_t = 2015, value_name = "N")]
    seed: u64,
    /// Where the report goes
    #[arg(long, global = true, default_value = "target/reproduce", value_name = "DIR")]
    out: PathBuf,
    /// Runs one of n parts of the list
    #[arg(long, global = true, value_name = "I/N")]
    shard: Option<Shard>,
}

fn main() -> ExitCode {
    match start(Cli::parse()) {
        Ok(code) => code,
        Err(line) => {
            eprintln!("reproduce: {line}");
            ExitCode::from(2)
        }
    }
}

fn start(cli: Cli) -> Result<ExitCode, String> {
    let options = cli.options;
    let profile = if options.full { Profile::Full } else { Profile::Quick };
    let chosen = match cli.command {
        Some(Verb::List) => {
            list();
            return Ok(ExitCode::SUCCESS);
        }
        Some(Verb::Run { ids }) => select(&experiments(), &ids)?,
        Some(Verb::Rays { scene, rays, record, check }) => {
            let run = rays::Run { scene, rays, record, seed: options.seed, shard: options.shard };
            return if check { run.check() } else { run.extend() };
        }
        Some(Verb::Claims { paper, id, hunt }) => {
            return claims::Run { paper, id, hunt, profile, seed: options.seed, out: options.out }.run();
        }
        Some(Verb::Proofs { strict }) => return claims::proofs(strict),
        Some(Verb::CountPixels { scene, tracer, count }) => {
            return count_pixels(&scene, &tracer, count).map(|_| ExitCode::SUCCESS).map_err(|error| error.to_string());
        }
        Some(Verb::CountScalar { count }) => {
            return count_scalar(count).map(|_| ExitCode::SUCCESS).map_err(|error| error.to_string());
        }
        Some(Verb::All) | None => experiments(),
    };
    let chosen = options.shard.map_or(chosen.clone(), |shard| shard.of(chosen));
    let recorded = terrain_papers::verdicts::recorded().map_err(|error| error.to_string())?;
    announce(&chosen, profile);

    let settings = Settings { profile, seed: options.seed, out: options.out };
    let report = run(&chosen, &settings).map_err(|error| error.to_string())?;
    println!("\n{}\n{}", results(&report), settings.out.join("index.html").display());
    let worse = regressions(&report, &recorded);
    for line in &worse {
        eprintln!("reproduce: {line}");
    }
    Ok(ExitCode::from(u8::from(!worse.is_empty())))
}

fn list() {
    for experiment in experiments() {
        println!("{}  {} ({})", experiment.id, experiment.title, experiment.section);
        for profile in [Profile::Quick, Profile::Full] {
            println!("    {profile:5}  {}", cost((experiment.expected)(profile)));
        }
    }
}

fn announce(chosen: &[&'static Experiment], profile: Profile) {
    let costs: Vec<Expected> = chosen.iter().map(|experiment| (experiment.expected)(profile)).collect();
    let width = chosen.iter().map(|experiment| experiment.id.len()).max().unwrap_or(0);
    println!("Expected on two cores, {profile} profile:");
    for (experiment, expected) in chosen.iter().zip(&costs) {
        println!("  {:width$}  {}", experiment.id, cost(*expected));
    }
    let total = Expected {
        seconds: costs.iter().map(|cost| cost.seconds).sum(),
        memory_bytes: costs.iter().map(|cost| cost.memory_bytes).max().unwrap_or(0),
        disk_bytes: costs.iter().map(|cost| cost.disk_bytes).sum(),
    };
    println!("  {:width$}  {}", "together", cost(total));
}

fn cost(expected: Expected) -> String {
    let Expected { seconds, memory_bytes, disk_bytes } = expected;
    format!("{:>8}, {:>9} of memory, {:>9} of disk", duration(seconds), bytes(memory_bytes), bytes(disk_bytes))
}
