//! Checkpoints: a JSON header and named arrays in one file that is either whole or refused.
//!
//! Layout, all numbers little-endian:
//!
//! | bytes | content |
//! | --- | --- |
//! | 8 | magic |
//! | 4 | `u32` format version |
//! | 8 + 8 | `u64` length and checksum of the JSON that follows |
//! | ... | JSON: the caller's header, and name, type and number of values of each array |
//! | 4 + 8 + ... | for each block of up to 4 MiB of each array: `u32` compressed length, checksum, LZ4 block |
//!
//! Checksums are XXH3 (64 bit) of the bytes as stored, seeded with the number of the block, so that blocks cannot
//! change places.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Write};
use std::path::Path;

use bytemuck::Pod;
use lz4_flex::block::{compress, decompress_into, get_maximum_output_size};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::{Error, StateFault, atomic};

const MAGIC: [u8; 8] = *b"\x89TREMIE\n";
const VERSION: u32 = 1;
const BLOCK: usize = 1 << 22;
/// LZ4 shrinks by less than this: each further byte of a match costs at least 1/255 byte.
const MAX_COMPRESSION: u64 = 255;

/// The values of one array.
#[derive(Debug, Clone, PartialEq)]
pub enum Array {
    /// Bytes.
    U8(Vec<u8>),
    /// 32-bit unsigned integers.
    U32(Vec<u32>),
    /// 64-bit unsigned integers.
    U64(Vec<u64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// Everything that a simulation needs to go on.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// What is not an array; the caller's to define.
    pub header: serde_json::Value,
    /// Arrays by name, in the caller's order.
    pub arrays: Vec<(String, Array)>,
}

/// The JSON at the beginning of the file.
#[derive(Serialize, Deserialize)]
struct Contents<H> {
    header: H,
    arrays: Vec<Description>,
}

#[derive(Serialize, Deserialize)]
struct Description {
    name: String,
    kind: Kind,
    count: usize,
}

#[derive(Serialize, Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Kind {
    U8,
    U32,
    U64,
    F32,
    F64,
}

impl Array {
    fn describe(&self, name: &str) -> Description {
        let (kind, count) = match self {
            Self::U8(v) => (Kind::U8, v.len()),
            Self::U32(v) => (Kind::U32, v.len()),
            Self::U64(v) => (Kind::U64, v.len()),
            Self::F32(v) => (Kind::F32, v.len()),
            Self::F64(v) => (Kind::F64, v.len()),
        };
        Description { name: name.to_owned(), kind, count }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::U8(v) => v,
            Self::U32(v) => bytemuck::cast_slice(v),
            Self::U64(v) => bytemuck::cast_slice(v),
            Self::F32(v) => bytemuck::cast_slice(v),
            Self::F64(v) => bytemuck::cast_slice(v),
        }
    }
}

impl State {
    /// Writes the checkpoint; until it is complete, a previous one at `path` stays as it is.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        atomic::write_with(path, |file| self.write_to(file))
    }

    /// Reads and verifies a checkpoint.
    ///
    /// # Errors
    /// If the file system refuses, or the file is no checkpoint, of another version, truncated or damaged.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(Error::io(path))?;
        let length = file.metadata().map_err(Error::io(path))?.len();
        Self::read_from(&mut BufReader::new(file), length).map_err(|failure| match failure {
            Failure::Io(source) => Error::io(path)(source),
            Failure::Fault(fault) => Error::State { path: path.to_owned(), fault },
        })
    }

    fn write_to(&self, file: &mut dyn Write) -> io::Result<()> {
        let arrays = self.arrays.iter().map(|(name, array)| array.describe(name)).collect();
        let json = serde_json::to_vec(&Contents { header: &self.header, arrays })?;
        file.write_all(&MAGIC)?;
        file.write_all(&VERSION.to_le_bytes())?;
        file.write_all(&(json.len() as u64).to_le_bytes())?;
        file.write_all(&xxh3_64_with_seed(&json, 0).to_le_bytes())?;
        file.write_all(&json)?;
        let mut number = 0;
        // Some blocks at a time: all threads compress, and the copy in memory stays small.
        for (_, array) in &self.arrays {
            for blocks in array.bytes().chunks(32 * BLOCK) {
                let compressed: Vec<Vec<u8>> = blocks.par_chunks(BLOCK).map(compress).collect();
                for block in &compressed {
                    number += 1;
                    file.write_all(&(block.len() as u32).to_le_bytes())?;
                    file.write_all(&xxh3_64_with_seed(block, number).to_le_bytes())?;
                    file.write_all(block)?;
                }
            }
        }
        Ok(())
    }

    fn read_from(file: &mut impl Read, length: u64) -> Result<Self, Failure> {
        if read_bytes::<8>(file).ok() != Some(MAGIC) {
            return Err(StateFault::NotACheckpoint.into());
        }
        let found = u32::from_le_bytes(read_bytes(file)?);
        if found != VERSION {
            return Err(StateFault::Version { found, supported: VERSION }.into());
        }
        let json_length = u64::from_le_bytes(read_bytes(file)?);
        let checksum = u64::from_le_bytes(read_bytes(file)?);
        let mut json = Vec::new();
        if file.take(json_length).read_to_end(&mut json)? as u64 != json_length {
            return Err(StateFault::Truncated.into());
        }
        if xxh3_64_with_seed(&json, 0) != checksum {
            return Err(StateFault::Checksum.into());
        }
        let contents: Contents<serde_json::Value> =
            serde_json::from_slice(&json).map_err(|error| StateFault::Inconsistent(error.to_string()))?;

        let mut blocks = Blocks { file, length, number: 0, stored: Vec::new() };
        let mut arrays = Vec::new();
        for Description { name, kind, count } in contents.arrays {
            let array = match kind {
                Kind::U8 => Array::U8(blocks.read(count)?),
                Kind::U32 => Array::U32(blocks.read(count)?),
                Kind::U64 => Array::U64(blocks.read(count)?),
                Kind::F32 => Array::F32(blocks.read(count)?),
                Kind::F64 => Array::F64(blocks.read(count)?),
            };
            arrays.push((name, array));
        }
        if blocks.file.read(&mut [0])? != 0 {
            return Err(StateFault::Inconsistent("more data than arrays".into()).into());
        }
        Ok(Self { header: contents.header, arrays })
    }
}

/// The blocks of the arrays, one after the other.
struct Blocks<'a, R> {
    file: &'a mut R,
    /// Length of the whole file in bytes.
    length: u64,
    /// Blocks read so far.
    number: u64,
    /// The current block as stored.
    stored: Vec<u8>,
}

impl<R: Read> Blocks<'_, R> {
    fn read<T: Pod>(&mut self, count: usize) -> Result<Vec<T>, Failure> {
        let size = count as u64 as f64 * size_of::<T>() as f64;
        if size > (self.length * MAX_COMPRESSION) as f64 {
            return Err(StateFault::Truncated.into());
        }
        let mut values = vec![T::zeroed(); count];
        for block in bytemuck::cast_slice_mut(&mut values).chunks_mut(BLOCK) {
            self.read_block(block)?;
        }
        Ok(values)
    }

    fn read_block(&mut self, block: &mut [u8]) -> Result<(), Failure> {
        self.number += 1;
        let stored = u32::from_le_bytes(read_bytes(self.file)?) as usize;
        let checksum = u64::from_le_bytes(read_bytes(self.file)?);
        if stored > get_maximum_output_size(block.len()) {
            return Err(StateFault::Checksum.into());
        }
        self.stored.resize(stored, 0);
        self.file.read_exact(&mut self.stored)?;
        if xxh3_64_with_seed(&self.stored, self.number) != checksum {
            return Err(StateFault::Checksum.into());
        }
        match decompress_into(&self.stored, block) {
            Ok(length) if length == block.len() => Ok(()),
            _ => Err(StateFault::Inconsistent("a block has the wrong size".into()).into()),
        }
    }
}

fn read_bytes<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// What stopped the reading; the path is added where it is known.
#[derive(Debug)]
enum Failure {
    Io(io::Error),
    Fault(StateFault),
}

impl From<StateFault> for Failure {
    fn from(fault: StateFault) -> Self {
        Self::Fault(fault)
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            ErrorKind::UnexpectedEof => Self::Fault(StateFault::Truncated),
            _ => Self::Io(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::json;

    fn example() -> State {
        State {
            header: json!({ "method": "lbm", "time": 0.1 + 0.2, "step": u64::MAX, "name": "Würfel" }),
            arrays: vec![
                ("flags".into(), Array::U8((0..100).collect())),
                ("empty".into(), Array::F32(Vec::new())),
                ("blocks".into(), Array::U32(vec![7; 300])),
                ("ids".into(), Array::U64(vec![0, u64::MAX, 42])),
                ("f".into(), Array::F32((0..200).map(|n| (n as f32).sin()).collect())),
                ("mass".into(), Array::F64(vec![-0.0, 1e-308, f64::INFINITY, f64::MAX])),
            ],
        }
    }

    fn encoded(state: &State) -> Vec<u8> {
        let mut bytes = Vec::new();
        state.write_to(&mut bytes).unwrap();
        bytes
    }

    fn decoded(bytes: &[u8]) -> Result<State, StateFault> {
        State::read_from(&mut &bytes[..], bytes.len() as u64).map_err(|failure| match failure {
            Failure::Fault(fault) => fault,
            Failure::Io(error) => panic!("memory does not fail: {error}"),
        })
    }

    #[test]
    fn a_state_comes_back_bit_by_bit_and_replaces_the_previous_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint");
        let state = example();
        state.write(&path).unwrap();
        assert_eq!(State::read(&path).unwrap(), state);
        // More than one block, compressible and not.
        let mut seed = 1u64;
        let noise = (0..700_000).map(|_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            f64::from_bits(seed >> 2)
        });
        let big = State {
            header: json!(null),
            arrays: vec![
                ("noise".into(), Array::F64(noise.collect())),
                ("zero".into(), Array::F32(vec![0.0; 3 << 20])),
            ],
        };
        big.write(&path).unwrap();
        assert_eq!(State::read(&path).unwrap(), big);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn faults_are_told_apart() {
        let bytes = encoded(&example());
        assert_eq!(decoded(b""), Err(StateFault::NotACheckpoint));
        assert_eq!(decoded(b"time_s,spread_m\n"), Err(StateFault::NotACheckpoint));
        let mut newer = bytes.clone();
        newer[8] = 2;
        assert_eq!(decoded(&newer), Err(StateFault::Version { found: 2, supported: 1 }));
        let mut changed = bytes.clone();
        *changed.last_mut().unwrap() ^= 1;
        assert_eq!(decoded(&changed), Err(StateFault::Checksum));
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(matches!(decoded(&longer), Err(StateFault::Inconsistent(_))));
        let missing = State::read(Path::new("/no/such/checkpoint"));
        assert!(matches!(missing, Err(Error::Io { .. })));
    }

    #[test]
    fn every_truncation_is_noticed() {
        let bytes = encoded(&example());
        for length in 0..bytes.len() {
            let fault = decoded(&bytes[..length]).unwrap_err();
            let expected = if length < 8 { StateFault::NotACheckpoint } else { StateFault::Truncated };
            assert_eq!(fault, expected, "after {length} bytes");
        }
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let bytes = encoded(&example());
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(decoded(&damaged).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_count_beyond_the_file_allocates_nothing() {
        for count in [u64::MAX, 1 << 60, 1 << 40] {
            let json = json!({ "header": null, "arrays": [{ "name": "a", "kind": "f64", "count": count }] })
                .to_string();
            let mut bytes = MAGIC.to_vec();
            bytes.extend(VERSION.to_le_bytes());
            bytes.extend((json.len() as u64).to_le_bytes());
            bytes.extend(xxh3_64_with_seed(json.as_bytes(), 0).to_le_bytes());
            bytes.extend(json.bytes());
            assert_eq!(decoded(&bytes), Err(StateFault::Truncated));
        }
    }

    proptest! {
        #[test]
        fn damage_never_panics(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
            cut in any::<prop::sample::Index>(),
        ) {
            let original = encoded(&example());
            let mut bytes = original.clone();
            for (at, value) in changes {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            bytes.truncate(cut.index(bytes.len() + 1));
            prop_assume!(bytes != original);
            prop_assert!(decoded(&bytes).is_err());
        }
    }
}
