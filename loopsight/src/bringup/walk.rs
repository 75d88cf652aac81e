//! The steps of a bring-up.

use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::sensor::Sensor;
use nalgebra::DMatrix;

use super::bench::{Bench, Motion};
use super::judge::{SEEN, judge, looks};
use super::person::{Person, answer, answer_at, choose_at};
use crate::error::{Error, Result};
use crate::watch::CancelToken;
use crate::words::{number, percent};

/// No motion may reach this multiple of what the model expects at the limit.
const MOST: f64 = 3.0;

/// Share of the expected motion that a robot at rest may seem to have.
const REST: f64 = 0.05;

/// Largest error of the scale.
const SCALE: f64 = 0.02;

/// What is walked through.
pub(super) struct Walk<'m> {
    pub(super) model: &'m Model,
    pub(super) ids: Vec<&'static str>,
    pub(super) limits: Vec<f64>,
    pub(super) volts: f64,
    /// How long the robot is pushed at a time.
    pub(super) seconds: f64,
    pub(super) bench: Bench<'m>,
    pub(super) person: &'m mut dyn Person,
    pub(super) cancel: CancelToken,
}

/// A voltage at one input that rises, stays and falls again.
#[derive(Clone, Copy)]
struct Push {
    inputs: usize,
    input: usize,
    volts: f64,
    seconds: f64,
}

impl Push {
    fn at(&self, time: f64) -> Vec<f64> {
        let edge = self.seconds / 4.0;
        let share = (time / edge).min((self.seconds - time) / edge);
        let mut command = vec![0.0; self.inputs];
        command[self.input] = self.volts * share.clamp(0.0, 1.0);
        command
    }
}

impl Walk<'_> {
    /// The result of a step, for the person.
    fn passed(&mut self, step: &str, what: &str) {
        self.person.tell(&format!("{step:<8}ok    {what}"));
    }

    /// `volts` at one input, as a pulse.
    fn push(&self, input: usize, volts: f64) -> Push {
        Push {
            inputs: self.ids.len(),
            input,
            volts,
            seconds: self.seconds,
        }
    }

    /// What the model makes of that: integrals and largest magnitudes of the measured signals.
    fn expect(&self, push: Push) -> (Vec<f64>, Vec<f64>) {
        self.bench.expect(2.0 * self.seconds, |t| push.at(t))
    }

    /// Drives the robot with that, and waits until it has come to rest.
    fn drive(&mut self, push: Push) -> Result<Motion> {
        self.bench.drive(2.0 * self.seconds, |t| Some(push.at(t)))
    }

    /// A step that failed: the robot is stopped first.
    fn wrong(&mut self, step: &str, why: &str) -> Error {
        match self.bench.stop() {
            Ok(()) => Error::work(format!("{step}: {why}")),
            Err(stop) => stop,
        }
    }

    /// What the model expects of each input with the first voltage.
    fn expected(&self) -> Vec<Vec<f64>> {
        let inputs = 0..self.ids.len();
        inputs
            .map(|i| self.expect(self.push(i, self.volts)).0)
            .collect()
    }

    /// Nothing moves at 0 V; from here on no motion may be far beyond what the model expects.
    pub(super) fn at_rest(&mut self) -> Result<()> {
        let mut most = vec![0.0; self.model.measured.len()];
        let mut usual = most.clone();
        for (input, limit) in self.limits.clone().into_iter().enumerate() {
            let (_, full) = self.expect(self.push(input, limit));
            let (_, first) = self.expect(self.push(input, self.volts));
            for j in 0..most.len() {
                most[j] += MOST * full[j];
                usual[j] += first[j];
            }
        }
        // A signal that no input moves has no size to compare with.
        self.bench.most = most
            .into_iter()
            .map(|m| if m > 0.0 { m } else { f64::INFINITY })
            .collect();
        let zero = vec![0.0; self.ids.len()];
        let rest = self.bench.drive(1.0, move |_| Some(zero.clone()))?;
        for (j, m) in self.model.measured.iter().enumerate() {
            if usual[j] > 0.0 && rest.largest[j] > REST * usual[j] {
                let why = format!(
                    "{} comes to {} {} at 0 V: look for a motor that creeps, or an encoder that picks up noise",
                    m.signal.id,
                    number(rest.largest[j]),
                    m.signal.unit
                );
                return Err(self.wrong("rest", &why));
            }
        }
        self.passed("rest", "nothing moves at 0 V, samples are fresh");
        Ok(())
    }

    /// Each input drives its own motor, forwards, and the encoders count it so.
    pub(super) fn signs(&mut self) -> Result<()> {
        let expected = self.expected();
        for input in 0..self.ids.len() {
            let id = self.ids[input];
            let volts = number(self.volts);
            let question = format!("Watch the motor of `{id}`. Enter drives it with +{volts} V.");
            answer_at(self.person, &mut self.bench, &question)?;
            let motion = self.drive(self.push(input, self.volts))?;
            let seen = choose_at(
                self.person,
                &mut self.bench,
                "What turned, and which way? (forwards: as the robot drives ahead; another: not this motor)",
                &SEEN,
            )?;
            let looks = looks(&motion.moved, &expected, input);
            if let Err(why) = judge(seen, looks, input, &self.ids) {
                return Err(self.wrong("signs", &why));
            }
            self.passed("signs", &format!("`{id}`: motor and encoder turn forwards"));
        }
        Ok(())
    }

    /// The limits are reached, in both directions, and what happens there is what the model expects.
    pub(super) fn limits(&mut self) -> Result<()> {
        answer_at(
            self.person,
            &mut self.bench,
            "Now up to the limits, one motor after the other. Enter goes on.",
        )?;
        for input in 0..self.ids.len() {
            let (id, limit) = (self.ids[input], self.limits[input]);
            let mut reached = f64::INFINITY;
            let mut share = Vec::new();
            for sign in [1.0, -1.0] {
                let motion = self.drive(self.push(input, sign * limit))?;
                reached = reached.min(motion.applied[input]);
                share.push(along(&motion));
            }
            if share.iter().any(|s| s.is_nan() || *s <= 0.0) {
                let why = format!("`{id}` does not turn forwards and backwards at its limit");
                return Err(self.wrong("limits", &why));
            }
            self.passed(
                "limits",
                &format!(
                    "`{id}`: {} V of {} V applied; moves {} and {} of what the model expects",
                    number(reached),
                    number(limit),
                    percent(share[0]),
                    percent(share[1])
                ),
            );
        }
        Ok(())
    }

    /// The signal whose integral a person can measure: its index, what a person calls a unit of it, and
    /// how much that is.
    fn metered(&self) -> Option<(usize, &'static str, f64)> {
        let of = |unit: &str| {
            let mut measured = self.model.measured.iter();
            measured.position(|m| m.signal.unit == unit)
        };
        of("m/s").map(|j| (j, "m", 1.0)).or_else(|| {
            let turn = std::f64::consts::TAU;
            of("rad/s").map(|j| (j, "turns", turn))
        })
    }

    /// A slow drive straight on that ends with a safe stop: how far it was, by hand and by counts.
    pub(super) fn scale_and_stop(&mut self) -> Result<()> {
        let n = self.ids.len();
        let metered = self.metered();
        let straight = metered.and_then(|(row, _, _)| self.straight(row));
        let command = straight.unwrap_or_else(|| vec![self.volts; n]);
        let seconds = 4.0 * self.seconds;
        let push = |t: f64| -> Vec<f64> {
            let share = (4.0 * t / seconds).min(1.0);
            command.iter().map(|u| u * share).collect()
        };
        let (expected, _) = self.bench.expect(seconds, push);
        let mut asked = None;
        if let Some((row, name, unit)) = metered {
            let far = number((2.0 * expected[row] / unit * 10.0).ceil() / 10.0);
            let question = format!(
                "To check the scale, put the robot on the ground with {far} {name} free ahead, and mark its place. It drives straight \
                 and stops by itself."
            );
            let answer = choose_at(self.person, &mut self.bench, &question, &["go", "skip"])?;
            asked = (answer == "go").then_some((row, name, unit));
        }
        let driven = self.bench.drive(seconds, |t| Some(push(t)))?;
        self.bench.stop()?;
        let after = self.bench.drive(2.0 * self.seconds, |_| None)?;
        for (j, m) in self.model.measured.iter().enumerate() {
            if after.last[j].is_nan() || after.last[j].abs() > REST * driven.largest[j] {
                return Err(Error::work(format!(
                    "stop: {} is still {} {} after a safe stop: cut the power, and check enable and brake pins",
                    m.signal.id,
                    number(after.last[j]),
                    m.signal.unit
                )));
            }
        }
        self.passed("stop", "a safe stop brings the robot to rest");
        let Some((row, name, unit)) = asked else {
            self.person.tell("scale   left out");
            return Ok(());
        };
        let counted = (driven.moved[row] + after.moved[row]) / unit;
        self.scale(row, name, counted)
    }

    /// The command of at most `volts` that moves, of all measured signals, this one only.
    fn straight(&self, row: usize) -> Option<Vec<f64>> {
        let (n, columns) = (self.ids.len(), self.expected());
        let rows = self.model.measured.len();
        let moved = DMatrix::from_fn(rows, n, |j, i| columns[i][j]);
        let inverse = pseudo_inverse(&moved)?;
        let command: Vec<f64> = inverse.column(row).iter().copied().collect();
        let largest = command.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        (largest > 0.0).then(|| command.iter().map(|u| u * self.volts / largest).collect())
    }

    fn scale(&mut self, row: usize, name: &str, counted: f64) -> Result<()> {
        let question = format!("How far did it go, in {name}?");
        let gone = loop {
            let answer = answer(self.person, &self.cancel, &question)?;
            match answer.parse::<f64>() {
                Ok(gone) if gone > 0.0 && gone.is_finite() => break gone,
                _ => self
                    .person
                    .ask(&format!("found `{answer}`, expected a number above 0")),
            }
        };
        let ratio = counted / gone;
        let said = format!(
            "{} {name} by hand, {} {name} by counts",
            number(gone),
            number(counted)
        );
        let per = self.counts_per(row, name);
        let per = per.map_or_else(String::new, |file| {
            format!(
                "; {} counts per {} by hand, {} in the model file",
                number(file * ratio),
                name.trim_end_matches('s'),
                number(file)
            )
        });
        if (ratio - 1.0).abs() <= SCALE {
            self.passed("scale", &format!("{said}{per}"));
            return Ok(());
        }
        Err(Error::work(format!(
            "scale: {said}{per}. Where the file's counts per turn are right (a factor of 2 or 4 is another kind of \
             quadrature), multiply the gains (`of`: the wheel radius) by {}",
            number(1.0 / ratio)
        )))
    }

    /// Counts of each encoder per metre, or turn, of a signal while all of its shafts turn alike.
    fn counts_per(&self, row: usize, name: &str) -> Option<f64> {
        let Sensor::EncoderCounts(encoder) = &self.model.measured[row].sensor else {
            return None;
        };
        let gain: f64 = if encoder.of.is_empty() {
            1.0
        } else {
            encoder.of.values().sum()
        };
        let per_radian = 1.0 / (encoder.resolution() * gain);
        (gain > 0.0).then_some(match name {
            "turns" => per_radian * std::f64::consts::TAU,
            _ => per_radian,
        })
    }
}

/// How much of the expected motion there was, by least squares over the signals.
fn along(motion: &Motion) -> f64 {
    let pairs = || motion.moved.iter().zip(&motion.expected);
    let dot: f64 = pairs().map(|(m, e)| m * e).sum();
    let square: f64 = pairs().map(|(_, e)| e * e).sum();
    dot / square
}
