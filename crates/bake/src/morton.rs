//! Which comes first along a Z-order curve? Morton codes: what is near in space is mostly near in their order.

/// Interleaves the lowest 21 bits of three numbers; x is the lowest bit of each digit.
pub(crate) fn code(cell: [u64; 3]) -> u64 {
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}

/// Moves bit i to bit 3i.
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bit_goes_to_its_digit() {
        let bits = (0..21).map(|bit| 1u64 << bit);
        for number in bits.chain([0, 0x15_5555, 0x1f_ffff]) {
            let alone = (0..21).fold(0, |code, bit| code | (number >> bit & 1) << (3 * bit));
            assert_eq!(code([number, 0, 0]), alone);
            assert_eq!(code([0, number, 0]), alone << 1);
            assert_eq!(code([0, 0, number]), alone << 2);
        }
    }
}
