//! How does one make bytes that are nearly right? Changes that readers meet in practice: flipped bits, cuts, repeated and
//! missing parts, lengths that claim too much, numbers in texts, and parts of two sound files put together.

/// The same numbers in every run: `SplitMix64` (Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below another; 0 below 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % (end as u64).max(1)) as usize
    }
}

/// Whatever lies on the border of something.
const CLAIMS: [u64; 12] = [
    0,
    1,
    2,
    0x7f,
    0xff,
    0x100,
    0x7fff,
    0xffff,
    0x1_0000,
    0x7fff_ffff,
    0xffff_ffff,
    u64::MAX,
];
const TEXTS: [&str; 14] = [
    "0",
    "-1",
    "4294967295",
    "4294967296",
    "1e308",
    "1e999",
    "-0.0",
    "9007199254740993",
    "null",
    "[]",
    "{}",
    "\"\"",
    "NaN",
    "((((((((",
];
/// No input becomes longer than so many times the longest example.
const LONGEST: usize = 4;

/// Some example, changed in one to five places.
#[must_use]
pub fn mutated(examples: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = examples[random.below(examples.len())].clone();
    for _ in 0..=random.below(5) {
        change(&mut bytes, examples, random);
    }
    let longest = examples.iter().map(Vec::len).max().unwrap_or(0);
    bytes.truncate(LONGEST * longest + 64);
    bytes
}

fn change(bytes: &mut Vec<u8>, examples: &[Vec<u8>], random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let reach = if random.below(4) == 0 { bytes.len() } else { 16 };
    let end = bytes.len().min(at + 1 + random.below(reach));
    match random.below(10) {
        0 | 1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        2 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = random.bits() as u8;
            }
        }
        3 => bytes.truncate(at),
        4 => drop(bytes.drain(at..end)),
        5 => {
            let part = bytes[at..end].to_vec();
            let to = random.below(bytes.len() + 1);
            bytes.splice(to..to, part);
        }
        6 => {
            // What is near the length of something is likelier to be believed.
            let near = (bytes.len() as u64).wrapping_add(random.bits() % 5).wrapping_sub(2);
            let claim = if random.below(3) == 0 {
                near
            } else {
                CLAIMS[random.below(CLAIMS.len())]
            };
            let size = [1, 2, 4, 8][random.below(4)];
            for (byte, new) in bytes
                .iter_mut()
                .skip(at)
                .zip(claim.to_le_bytes().into_iter().take(size))
            {
                *byte = new;
            }
        }
        7 => {
            let other = &examples[random.below(examples.len())];
            let from = random.below(other.len() + 1);
            bytes.truncate(at);
            bytes.extend_from_slice(&other[from..]);
        }
        8 => change_number(bytes, at, random),
        _ => {
            let noise: Vec<u8> = (0..=random.below(12)).map(|_| random.bits() as u8).collect();
            bytes.splice(at..at, noise);
        }
    }
}

/// Puts something else in the place of the next number of a text.
fn change_number(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let is_digit = |byte: &u8| byte.is_ascii_digit();
    if let Some(first) = bytes.iter().skip(at).position(is_digit).map(|i| at + i) {
        let length = bytes[first..].iter().take_while(|byte| is_digit(byte)).count();
        let text = TEXTS[random.below(TEXTS.len())].bytes();
        bytes.splice(first..first + length, text);
    }
}
