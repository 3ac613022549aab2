//! Random numbers by counter: the number wanted is computed from where it is wanted.
//!
//! There is no generator to carry along. The n-th number of a stream is a hash of n, so that
//! particle i starts at the same place whichever thread releases it, and in whatever order.

/// The odd integer nearest to 2^64 divided by the golden ratio: the increment of SplitMix64.
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// A stream of random numbers in [0, 1) that can be read at any place.
///
/// It is SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators",
/// OOPSLA 2014): the n-th output is a mix of `start + n * INCREMENT`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream {
    start: u64,
}

impl Stream {
    /// The stream that belongs to a seed and a purpose. Different purposes give unrelated
    /// streams for the same seed.
    pub(super) fn new(seed: u64, purpose: u64) -> Self {
        let start = mix(mix(seed.wrapping_add(INCREMENT)) ^ purpose.wrapping_mul(INCREMENT));
        Stream { start }
    }

    /// The number at `place`: a multiple of 2^-53 in [0, 1).
    pub(super) fn unit(&self, place: u64) -> f64 {
        let counter = place.wrapping_add(1).wrapping_mul(INCREMENT);
        let bits = mix(self.start.wrapping_add(counter)) >> 11;
        bits as f64 * (1.0 / (1_u64 << 53) as f64)
    }
}

/// The output function of SplitMix64 (Stafford's variant 13 of the MurmurHash3 finalizer).
fn mix(state: u64) -> u64 {
    let state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    state ^ (state >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mixer_gives_the_published_numbers_of_splitmix64() {
        // The first outputs of SplitMix64 with seed 1234567, as published with the reference
        // implementation's test vectors.
        let outputs: Vec<u64> = (1..=3)
            .map(|n: u64| mix(1_234_567_u64.wrapping_add(n.wrapping_mul(INCREMENT))))
            .collect();
        assert_eq!(
            outputs,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423
            ]
        );
    }

    #[test]
    fn numbers_fill_the_unit_interval_evenly() {
        let stream = Stream::new(0, 0);
        let count = 10_000;
        let mut bins = [0_u32; 10];
        for place in 0..count {
            let number = stream.unit(place);
            assert!((0.0..1.0).contains(&number));
            bins[(number * 10.0) as usize] += 1;
        }
        // Binomial with mean 1,000 and standard deviation 30: five deviations.
        assert!(
            bins.iter().all(|&bin| bin.abs_diff(1_000) < 150),
            "{bins:?}"
        );
    }

    #[test]
    fn seeds_and_purposes_give_different_streams() {
        let first = |seed, purpose| Stream::new(seed, purpose).unit(0);
        assert_ne!(first(0, 0), first(1, 0));
        assert_ne!(first(0, 0), first(0, 1));
        assert_ne!(first(0, 1), first(1, 0));
    }
}
