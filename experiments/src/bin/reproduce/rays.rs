//! `reproduce rays`: long comparisons of the tracers, block by block.

use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};
use terrain_experiments::genevaux2015::record::{BLOCK, Record, Recorded};
use terrain_experiments::genevaux2015::scenes::table_scenes;
use terrain_experiments::paris2019::tracing::Carved;
use terrain_experiments::runner::Shard;

/// What to count.
pub struct Run {
    /// One scene, or all.
    pub scene: Option<String>,
    /// How many rays.
    pub rays: u64,
    /// Where the record is kept.
    pub record: Option<PathBuf>,
    /// Chooses the rays.
    pub seed: u64,
    /// Which part of the blocks.
    pub shard: Option<Shard>,
}

impl Run {
    /// Counts what the record lacks.
    pub fn extend(&self) -> Result<ExitCode, String> {
        for scene in self.scenes()? {
            let scene = scene.as_ref();
            let file = self.file(scene);
            let text = match std::fs::read_to_string(&file) {
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
                other => other.map_err(|error| format!("{}: {error}", file.display()))?,
            };
            let fresh = Record::empty(scene, self.seed);
            let mut record = if text.is_empty() { fresh.clone() } else { self.read(scene, &text)? };
            if !record.is_of(scene) {
                eprintln!("{}: the scene has changed since; the record starts anew", file.display());
                record = fresh;
            } else if record.seed() != self.seed {
                let (file, seed) = (file.display(), record.seed());
                return Err(format!("{file}: recorded with --seed {seed}; use it, or another --record"));
            }
            let style = ProgressStyle::with_template("{prefix} {bar:30} {human_pos}/{human_len} rays, {eta} left");
            let bar = ProgressBar::new(self.rays.div_ceil(BLOCK) * BLOCK).with_prefix(scene.name().to_owned());
            bar.set_style(style.map_err(|error| error.to_string())?);
            let chosen = |index| self.shard.is_none_or(|shard| shard.holds(index));
            record.extend(scene, self.rays, chosen, &file, |n| bar.inc(n)).map_err(|error| error.to_string())?;
            bar.finish_and_clear();
            println!("{}: {} rays, {:?}", file.display(), record.rays(), record.total());
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Counts one recorded block of each scene again. Status 1 when it differs.
    pub fn check(&self) -> Result<ExitCode, String> {
        let draw = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
        let mut differ = false;
        for scene in self.scenes()? {
            let scene = scene.as_ref();
            let text = match &self.record {
                Some(file) => std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?,
                None => scene.record().to_owned(),
            };
            if text.is_empty() {
                println!("{}: nothing is recorded", scene.name());
                continue;
            }
            let record = self.read(scene, &text)?;
            if !record.is_of(scene) {
                return Err(format!(
                    "{}: recorded for another terrain; run `reproduce rays {}`",
                    scene.name(),
                    scene.name()
                ));
            }
            let Some((index, block)) = record.drawn(draw) else { continue };
            let mut again = None;
            scene
                .count(record.seed(), &mut |count| {
                    again = Some(count(index));
                    Ok(())
                })
                .map_err(|error| error.to_string())?;
            let same = again.as_ref() == Some(block);
            println!("{}: block {index} {}", scene.name(), if same { "counts the same" } else { "differs" });
            if !same {
                eprintln!("recorded {block:?}\ncounted  {again:?}");
                differ = true;
            }
        }
        Ok(ExitCode::from(u8::from(differ)))
    }

    fn scenes(&self) -> Result<Vec<Box<dyn Recorded>>, String> {
        let mut all: Vec<Box<dyn Recorded>> = Vec::new();
        for scene in table_scenes()? {
            all.push(Box::new(scene));
        }
        all.push(Box::new(Carved::new(self.seed).map_err(|error| error.to_string())?));
        if let Some(name) = &self.scene {
            let names: Vec<&str> = all.iter().map(|scene| scene.name()).collect();
            if !names.contains(&name.as_str()) {
                return Err(format!("no scene `{name}` is recorded; there are {}", names.join(", ")));
            }
            all.retain(|scene| scene.name() == name);
        }
        Ok(all)
    }
    fn file(&self, scene: &dyn Recorded) -> PathBuf {
        let committed = || PathBuf::from(format!("experiments/records/{}.csv", scene.name()));
        self.record.clone().unwrap_or_else(committed)
    }
    fn read(&self, scene: &dyn Recorded, text: &str) -> Result<Record, String> {
        Record::read(text).map_err(|problem| format!("{}: {problem}", self.file(scene).display()))
    }
}
