//! Long comparisons, kept: rays are cut into blocks, and a record holds what was counted in each, with the commit that
//! counted it. A run goes on where the record ends, and any block can be drawn and counted again.

use super::rays::{Family, Tally, Trial, compare, total};
use super::scenes::TableScene;
use crate::environment::Environment;
use crate::experiment::ExperimentError;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;
use std::path::Path;
use terrain_model::io::atomic::atomic_write_bytes;
use terrain_model::trace::{Surface, Tracer};

/// Rays in a block.
pub const BLOCK: u64 = 2_000;

/// What was counted in one block of rays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Rays on which the certified tracer found the surface, a wall, and could not decide.
    pub truth: [u64; 3],
    /// Missed, false and given-up rays of each of [`Tracer::ALL`].
    pub wrong: [[u64; 3]; Tracer::ALL.len()],
}

impl Block {
    /// Nothing counted.
    pub fn none() -> Block {
        Block { truth: [0; 3], wrong: [[0; 3]; Tracer::ALL.len()] }
    }
    /// Both counts together.
    #[must_use]
    pub fn plus(mut self, other: &Block) -> Block {
        for (total, count) in self.truth.iter_mut().zip(other.truth) {
            *total += count;
        }
        for (total, count) in self.wrong.iter_mut().flatten().zip(other.wrong.iter().flatten()) {
            *total += count;
        }
        self
    }
}

/// Counts one block by its index.
pub type Counter<'a> = dyn Fn(u64) -> Block + 'a;

/// A scene whose rays are recorded.
pub trait Recorded {
    /// Its name, and that of its record.
    fn name(&self) -> &str;
    /// The committed record; empty without one.
    fn record(&self) -> &str;
    /// Of all that rays and their counts depend on.
    fn fingerprint(&self) -> String;
    /// Calls `body` with what counts the blocks of a seed.
    ///
    /// # Errors
    /// A scene that cannot be traced, and what `body` says.
    fn count(
        &self,
        seed: u64,
        body: &mut dyn FnMut(&Counter<'_>) -> Result<(), ExperimentError>,
    ) -> Result<(), ExperimentError>;
}

impl Recorded for TableScene {
    fn name(&self) -> &str {
        self.name
    }
    fn record(&self) -> &str {
        self.record
    }
    fn fingerprint(&self) -> String {
        fingerprint(self)
    }
    fn count(
        &self,
        seed: u64,
        body: &mut dyn FnMut(&Counter<'_>) -> Result<(), ExperimentError>,
    ) -> Result<(), ExperimentError> {
        let surface = Surface::new(&self.program);
        let trial = Trial::new(self, &surface, self.extent)?;
        body(&|index| count(&trial, &surface, seed, index))
    }
}

/// The record of one scene and seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    seed: u64,
    /// Fingerprint of the compiled scene and of the rays' settings: blocks of another terrain are not kept.
    terrain: String,
    blocks: BTreeMap<u64, (String, Block)>,
}

impl Record {
    /// A record with nothing counted.
    pub fn empty(scene: &dyn Recorded, seed: u64) -> Record {
        Record { seed, terrain: scene.fingerprint(), blocks: BTreeMap::new() }
    }
    /// Reads what [`Record::text`] wrote.
    ///
    /// # Errors
    /// The line that is wrong, and what was expected.
    pub fn read(text: &str) -> Result<Record, String> {
        let entry = |name: &str| {
            let found = text.lines().find_map(|line| line.strip_prefix(&format!("# {name}: ")));
            found.ok_or_else(|| format!("expected a line `# {name}: …`"))
        };
        let seed = entry("seed")?.parse().map_err(|_| "the seed is not a number".to_owned())?;
        let terrain = entry("terrain")?.to_owned();
        let mut blocks = BTreeMap::new();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.starts_with('#')).skip(1) {
            let wrong = || format!("line {}: expected {}", number + 1, header());
            let mut cells = line.split(',');
            let index = cells.next().and_then(|cell| cell.parse().ok()).ok_or_else(wrong)?;
            let commit = cells.next().ok_or_else(wrong)?.to_owned();
            let counts: Vec<u64> = cells.map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
            let (truth, rest) = counts.split_first_chunk::<3>().ok_or_else(wrong)?;
            let triples: Vec<[u64; 3]> = rest.as_chunks::<3>().0.to_vec();
            let wrong = triples.try_into().map_err(|_| wrong())?;
            blocks.insert(index, (commit, Block { truth: *truth, wrong }));
        }
        Ok(Record { seed, terrain, blocks })
    }
    /// The record as a file: comments that say how it came about, a header, a line for each block.
    pub fn text(&self, scene: &str) -> String {
        let mut text = format!(
            "# command: reproduce rays {scene} --seed {}\n# seed: {}\n# terrain: {}\n# rays in a block: {BLOCK}\n{}\n",
            self.seed,
            self.seed,
            self.terrain,
            header()
        );
        for (index, (commit, block)) in &self.blocks {
            let counts = block.truth.iter().chain(block.wrong.iter().flatten());
            let cells: Vec<String> = counts.map(u64::to_string).collect();
            let _ = writeln!(text, "{index},{commit},{}", cells.join(","));
        }
        text
    }
    /// Whether it was counted on this terrain.
    pub fn is_of(&self, scene: &dyn Recorded) -> bool {
        self.terrain == scene.fingerprint()
    }
    /// Rays counted.
    pub fn rays(&self) -> u64 {
        self.blocks.len() as u64 * BLOCK
    }
    /// The seed of the rays.
    pub fn seed(&self) -> u64 {
        self.seed
    }
    /// Everything counted.
    pub fn total(&self) -> Block {
        self.blocks.values().fold(Block::none(), |sum, (_, block)| sum.plus(block))
    }
    /// The commits that counted, in order of their first block.
    pub fn commits(&self) -> Vec<&str> {
        let mut commits: Vec<&str> = Vec::new();
        for (commit, _) in self.blocks.values() {
            if !commits.contains(&commit.as_str()) {
                commits.push(commit);
            }
        }
        commits
    }
    /// The `draw`-th block that is recorded, counted from 0 and around.
    pub fn drawn(&self, draw: u64) -> Option<(u64, &Block)> {
        let count = self.blocks.len() as u64;
        let at = draw.checked_rem(count)?;
        self.blocks.iter().nth(at as usize).map(|(index, (_, block))| (*index, block))
    }
    /// Counts the blocks below `rays` that `chosen` picks and the record lacks; after each the file is written.
    ///
    /// # Errors
    /// A scene without a camera, or a file that cannot be written.
    pub fn extend(
        &mut self,
        scene: &dyn Recorded,
        rays: u64,
        chosen: impl Fn(u64) -> bool,
        file: &Path,
        advance: impl Fn(u64),
    ) -> Result<(), ExperimentError> {
        let environment = Environment::gather();
        let commit = environment.commit.get(..12).unwrap_or("unknown").to_owned();
        let commit = if environment.dirty == Some(true) { format!("{commit}+") } else { commit };
        scene.count(self.seed, &mut |count| {
            for index in (0..rays.div_ceil(BLOCK)).filter(|index| chosen(*index)) {
                if let Entry::Vacant(block) = self.blocks.entry(index) {
                    block.insert((commit.clone(), count(index)));
                    atomic_write_bytes(file, self.text(scene.name()).as_bytes())
                        .map_err(|error| ExperimentError::failed(format!("{}: {error}", file.display())))?;
                }
                advance(BLOCK);
            }
            Ok(())
        })
    }
}

fn header() -> String {
    let tracers =
        Tracer::ALL.map(|tracer| ["missed", "false", "gave_up"].map(|what| format!("{}.{what}", tracer.name())));
    format!("block,commit,hits,walls,undecided,{}", tracers.as_flattened().join(","))
}

/// Counts one block.
fn count(trial: &Trial<'_>, surface: &Surface<'_>, seed: u64, index: u64) -> Block {
    let tracers = Tracer::ALL.map(|tracer| (tracer, surface));
    let rays = index * BLOCK..(index + 1) * BLOCK;
    let tallies = compare(&trial.ground, &tracers, &trial.settings, &trial.effort, seed, rays, &|_| {});
    let all: Vec<Tally> = tallies.iter().map(total).collect();
    let wrong = std::array::from_fn(|k| [all[k].missed_hits, all[k].false_hits, all[k].gave_up]);
    Block { truth: [all[0].hits, all[0].walls, all[0].undecided], wrong }
}

/// Of what is traced, which is the compiled ground and the camera whose rays are drawn, and of the number of ray families: the
/// first 16 digits of a SHA-256. Other layers and cameras change no ray.
fn fingerprint(scene: &TableScene) -> String {
    let mut hash = Sha256::new();
    hash.update(format!("{:?} {:?} {}", scene.program.code(), scene.scene.cameras.get("main"), Family::ALL.len()));
    for k in 0..scene.program.parameter_count() {
        hash.update(scene.program.parameter(k).to_bits().to_le_bytes());
    }
    hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::genevaux2015::scenes::table_scenes;

    #[test]
    fn no_layer_and_no_second_camera_changes_what_a_record_is_of() {
        for mut scene in table_scenes().unwrap() {
            // Whether a committed record is still of its scene is for `rays --check` to say.
            let record = Record::empty(&scene, 1);
            scene.scene.layers.retain(|name, _| name == "bedrock");
            scene.scene.cameras.retain(|name, _| name == "main");
            assert!(record.is_of(&scene), "{}", scene.name);
            // Control: another main camera draws other rays.
            scene.scene.cameras.get_mut("main").unwrap().field_of_view *= 1.01;
            assert!(!record.is_of(&scene), "{}", scene.name);
        }
        let scenes = table_scenes().unwrap();
        assert!(!Record::empty(&scenes[0], 1).is_of(&scenes[1]));
    }

    #[test]
    fn a_record_goes_on_where_it_ended_and_reads_what_it_wrote() {
        let scene = table_scenes().unwrap().into_iter().find(|scene| scene.name == "fig19").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("fig19.csv");
        let mut record = Record::empty(&scene, 5);
        record.blocks.insert(0, ("earlier".into(), Block { truth: [1, 2, 3], wrong: [[0, 1, 0]; 3] }));
        record.extend(&scene, BLOCK, |_| true, &file, |_| {}).unwrap();
        assert!(!file.exists(), "nothing was missing, so nothing was counted");
        let text = record.text("fig19");
        assert_eq!(Record::read(&text).unwrap(), record);
        assert!(record.is_of(&scene) && record.rays() == BLOCK);
        // Control: a line with a count too few is refused with its number.
        let short = text.trim_end().rsplit_once(',').unwrap().0;
        assert!(Record::read(short).unwrap_err().starts_with("line 6"), "{:?}", Record::read(short));
    }
}
