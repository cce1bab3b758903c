//! `terrain`: evaluates, describes, samples, meshes and draws scenes, diffuses feature curves, makes solids and amplifies
//! heightfields, and converts rasters. Status 0 when it did, 1 when a file could not be read, used or written, 2 when the command line could not be
//! understood.

use clap::{Parser, Subcommand};
use miette::{GraphicalReportHandler, GraphicalTheme};
use std::io::IsTerminal;
use std::process::ExitCode;
use terrain_experiments::scenes::SceneFileError;
use terrain_experiments::verbs::{
    VerbError, amplify::Amplify, bake::Bake, convert::Convert, diffuse::Diffuse, eval::Eval, generate::Generate,
    implicit::Implicit, info::Info, mesh::Mesh, render::Render, tessellate::Tessellate,
};

/// Evaluates, describes, samples, meshes and draws terrain scenes, diffuses feature curves, makes solids, and converts
/// rasters.
///
/// Lengths are metres: x east, y north, z up. Exit status: 0 done; 1 a file could not be read, used or written, with one
/// line that says which, where and how to mend it; 2 the command line could not be understood.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Threads [default: one for each core]; the result does not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Subcommand)]
enum Verb {
    Eval(Eval),
    Info(Info),
    Bake(Bake),
    Mesh(Mesh),
    Render(Render),
    Convert(Convert),
    Generate(Generate),
    Diffuse(Diffuse),
    Implicit(Implicit),
    Amplify(Amplify),
    Tessellate(Tessellate),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let run = || match &cli.verb {
        Verb::Eval(verb) => verb.run(),
        Verb::Info(verb) => verb.run(),
        Verb::Bake(verb) => verb.run(),
        Verb::Mesh(verb) => verb.run(),
        Verb::Render(verb) => verb.run(),
        Verb::Convert(verb) => verb.run(),
        Verb::Generate(verb) => verb.run(),
        Verb::Diffuse(verb) => verb.run(),
        Verb::Implicit(verb) => verb.run(),
        Verb::Amplify(verb) => verb.run(),
        Verb::Tessellate(verb) => verb.run(),
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(cli.threads.map_or(0, usize::from)).build();
    let result = match pool {
        Ok(pool) => pool.install(run),
        Err(error) => Err(VerbError::Other(format!("--threads: {error}; use fewer"))),
    };
    match result {
        Ok(()) | Err(VerbError::Closed) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("terrain: {error}");
            if let VerbError::Scene(syntax @ SceneFileError::Syntax { .. }) = &error {
                show_source(syntax);
            }
            ExitCode::FAILURE
        }
    }
}

/// The line of the scene that is wrong, below the message.
fn show_source(error: &SceneFileError) {
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let theme = if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut shown = String::new();
    if GraphicalReportHandler::new_themed(theme).with_links(false).render_report(&mut shown, error).is_ok() {
        // The message stands above already.
        let snippet = shown.lines().skip_while(|line| !line.contains("╭─"));
        eprintln!("{}", snippet.collect::<Vec<_>>().join("\n"));
    }
}
