//! What a line may do to frames, and what must come of it.

#![allow(clippy::unwrap_used, reason = "a test")]

use heapless::{String, Vec};
use loopsight_link::*;
use proptest::prelude::*;

fn signals(values: &[f32]) -> Signals {
    Signals::from_slice(values).unwrap()
}

/// As large as a configuration can be: everything full, no number short.
fn largest() -> Configuration {
    let values: Values = (0..PARAMETERS).map(|i| -1.0 / (i as f32 + 3.0)).collect();
    let name: String<NAME> = (0..NAME).map(|_| 'm').collect();
    let full: Signals = (0..SIGNALS).map(|_| 1.0 / 3.0).collect();
    let gains: Vec<f64, SIGNALS> = (0..SIGNALS).map(|_| -1.0 / 3.0).collect();
    let attachment = Attachment {
        id: name.clone(),
        channels: (0..CHANNELS).map(|_| u8::MAX).collect(),
        values: values.clone(),
    };
    Configuration {
        plant: name,
        parameters: values.clone(),
        effects: (0..EFFECTS).map(|_| attachment.clone()).collect(),
        bands: full.clone(),
        means: true,
        learning: Some(Learning {
            forgetting: 0.999,
            initial_covariance: 1e6,
            covariance_limit: 1e7,
            low: values.clone(),
            high: values.clone(),
            scale: values,
            dead_zone: full.clone(),
            least_excitation: full,
            window: 200.0,
            certainty_equivalence: true,
        }),
        controller: ControllerGains {
            proportional: gains.clone(),
            integral: gains.clone(),
            limit: gains,
        },
        safety: Safety {
            watchdog_ticks: u16::MAX,
            stale_us: u32::MAX,
            stale_ticks: u16::MAX,
            least_supply: 9.6,
            encoder_ticks: u16::MAX,
            encoder_input: 3.3,
        },
    }
}

fn requests() -> [Request; 4] {
    let session = 0xdead_beef;
    [
        Request::Hello(Hello {
            version: VERSION,
            session,
        }),
        Request::Configure {
            session,
            configuration: largest(),
        },
        Request::Step(Measured {
            session,
            tick: 4711,
            age_us: 210,
            supply: 12.1,
            measured: signals(&[0.1, -0.7]),
            reference: signals(&[0.0, 1.3]),
        }),
        Request::Stop { session },
    ]
}

fn replies() -> [Reply; 5] {
    let session = 7;
    [
        Reply::Hello(Welcome {
            hello: Hello {
                version: VERSION,
                session,
            },
            period_us: 10_000,
            plant: "ddmr".try_into().unwrap(),
        }),
        Reply::Act(Act {
            session,
            tick: 4711,
            command: signals(&[12.0, -3.25]),
            parameters: (0..8).map(|i| i as f32 * 0.1).collect(),
            saturated: true,
            held: false,
            learned: 0b11,
            cost: 512,
            sensed: None,
        }),
        Reply::Act(Act {
            session,
            tick: 4712,
            command: signals(&[12.0, -3.25]),
            parameters: (0..8).map(|i| i as f32 * 0.1).collect(),
            saturated: false,
            held: false,
            learned: 0,
            cost: 512,
            sensed: Some(Sensed {
                supply: 11.9,
                measured: signals(&[0.1, -0.7]),
                reference: signals(&[0.0, 1.3]),
            }),
        }),
        Reply::Stopped {
            session,
            tick: 12,
            reason: Reason::OutOfOrder {
                expected: 12,
                found: 14,
            },
        },
        Reply::Log(Note::Dropped(3)),
    ]
}

fn frame<T: serde::Serialize>(message: &T) -> std::vec::Vec<u8> {
    let mut buffer = [0; LONGEST];
    let length = encode(message, &mut buffer).unwrap();
    buffer[..length].to_vec()
}

/// All that comes of `bytes`.
fn read<T: serde::de::DeserializeOwned>(
    decoder: &mut Decoder,
    bytes: &[u8],
) -> std::vec::Vec<Result<T, FrameError>> {
    bytes.iter().filter_map(|b| decoder.take(*b)).collect()
}

#[test]
fn a_message_arrives_as_it_was_sent() {
    let mut decoder = Decoder::default();
    for request in requests() {
        let bytes = frame(&request);
        assert_eq!(bytes.iter().filter(|b| **b == 0).count(), 1);
        assert_eq!(read(&mut decoder, &bytes), [Ok(request)]);
    }
    for reply in replies() {
        assert_eq!(read(&mut decoder, &frame(&reply)), [Ok(reply)]);
    }
    // Every bit of a number, also of those that are none.
    let odd = [f32::NAN, f32::NEG_INFINITY, -0.0, f32::MIN_POSITIVE / 8.0];
    let Request::Step(mut step) = requests()[2].clone() else {
        panic!("the third is a step")
    };
    step.measured = signals(&odd);
    let told: Request = decoder_of(&frame(&Request::Step(step)));
    let Request::Step(step) = told else {
        panic!("{told:?}")
    };
    for (sent, arrived) in odd.iter().zip(&step.measured) {
        assert_eq!(sent.to_bits(), arrived.to_bits());
    }
}

fn decoder_of<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> T {
    read(&mut Decoder::default(), bytes).pop().unwrap().unwrap()
}

/// The largest message is within what [`MESSAGE`] says, and that is no more than a half too much.
#[test]
fn the_largest_message_fits() {
    let longest = requests().iter().map(|r| frame(r).len()).max().unwrap();
    assert!(
        longest <= LONGEST && 2 * longest > LONGEST,
        "{longest} of {LONGEST}"
    );
}

/// Every bit of every frame, its zero included: nothing is taken for a message that was not sent, and
/// the message after the next zero arrives.
#[test]
fn no_flipped_bit_is_accepted() {
    let mut tried = 0;
    let after = Request::Stop { session: 99 };
    for request in requests() {
        let good = frame(&request);
        for bit in 0..8 * good.len() {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes.extend(frame(&after));
            bytes.extend(frame(&after));
            let mut told = read::<Request>(&mut Decoder::default(), &bytes);
            assert_eq!(told.pop(), Some(Ok(after.clone())), "bit {bit}");
            for one in told {
                assert!(
                    one.is_err() || one == Ok(after.clone()),
                    "bit {bit}: {one:?}"
                );
            }
            tried += 1;
        }
    }
    assert!(tried > 4000, "{tried}");
}

/// Two flipped bits anywhere in a step.
#[test]
fn no_two_flipped_bits_are_accepted() {
    let good = frame(&requests()[2]);
    let bits = 8 * (good.len() - 1);
    for first in 0..bits {
        for second in first + 1..bits {
            let mut bytes = good.clone();
            bytes[first / 8] ^= 1 << (first % 8);
            bytes[second / 8] ^= 1 << (second % 8);
            let told = read::<Request>(&mut Decoder::default(), &bytes);
            assert!(
                told.iter().all(Result::is_err),
                "{first}, {second}: {told:?}"
            );
        }
    }
}

/// A frame cut anywhere, and the next one: the piece is no message, nor is what the two make together.
#[test]
fn half_a_frame_costs_one_frame() {
    for request in requests() {
        let good = frame(&request);
        for cut in 1..good.len() {
            let mut decoder = Decoder::default();
            assert!(read::<Request>(&mut decoder, &good[..cut]).is_empty() || cut == good.len());
            let told = read::<Request>(&mut decoder, &good);
            // Cut before its zero it only lacked that: then the next one runs on.
            assert!(told.iter().all(Result::is_err), "cut at {cut}: {told:?}");
            assert_eq!(read(&mut decoder, &good), [Ok(request.clone())]);
            // Whoever joins in the middle: the end of a frame is none.
            let told = read::<Request>(&mut Decoder::default(), &good[cut..]);
            assert!(told.iter().all(Result::is_err), "from {cut}: {told:?}");
        }
    }
}

#[test]
fn what_is_too_long_is_dropped_up_to_its_end() {
    let mut decoder = Decoder::default();
    let mut bytes = vec![0x55; 3 * LONGEST];
    bytes.push(0);
    assert_eq!(
        read::<Request>(&mut decoder, &bytes),
        [Err(FrameError::TooLong)]
    );
    assert!(!decoder.is_open());
    let request = requests()[0].clone();
    assert_eq!(read(&mut decoder, &frame(&request)), [Ok(request)]);
}

/// A message with something after it, its sum being right.
#[test]
fn a_message_with_something_after_it_is_none() {
    let two = frame(&(requests()[0].clone(), 5u8));
    assert_eq!(
        read::<Request>(&mut Decoder::default(), &two),
        [Err(FrameError::Broken)]
    );
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(6), ..ProptestConfig::with_cases(4000) })]

    /// Noise is never a message, and after it a message is one.
    #[test]
    fn noise_is_no_message(noise in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut decoder = Decoder::default();
        let told = read::<Request>(&mut decoder, &noise);
        prop_assert!(told.iter().all(Result::is_err));
        read::<Request>(&mut decoder, &[0]);
        let request = requests()[2].clone();
        prop_assert_eq!(read(&mut decoder, &frame(&request)), [Ok(request)]);
    }
}
