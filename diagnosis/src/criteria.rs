//! Every threshold that decides a verdict, in one place.
//!
//! [`Criteria`] has them in groups. Each has a default, a unit and a reason. It is *derived* from something
//! that can be computed, it is a *convention* of the field, or it is a *judgement*, made on recordings whose
//! truth was known. `docs/criteria.md` shows how the verdicts change when one of them is a fifth larger or
//! smaller.
//!
//! Numbers that decide how something is computed (iterations, step sizes, grids) stand beside the code that
//! computes it.

mod table;

use serde::{Deserialize, Serialize};

pub use table::*;

/// Why a criterion has the value it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// It follows from something that can be computed.
    Derived,
    /// It is what the field uses.
    Convention,
    /// It was chosen by what it does to recordings whose truth is known.
    Judgement,
}

/// The description of one criterion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Criterion {
    /// Its group and its name: `missing.beats`.
    pub id: &'static str,
    /// What it decides.
    pub decides: &'static str,
    /// Its default.
    pub default: f64,
    /// Its unit; `1` for a ratio or a count.
    pub unit: &'static str,
    /// The kind of reason it has.
    pub reason: Reason,
    /// The reason.
    pub because: &'static str,
}

impl Criteria {
    /// The criterion `id` a `factor` times as large; counts are rounded, and change by one at least. `None`
    /// where there is no such criterion.
    pub fn scaled(&self, id: &str, factor: f64) -> Option<Self> {
        let mut scaled = *self;
        let value = self.get(id)?;
        scaled.set(id, value * factor);
        if scaled == *self {
            scaled.set(id, value + (factor - 1.0).signum());
        }
        Some(scaled)
    }
}

impl Criteria {
    /// The criteria for a machine that takes `scale` s for what takes a robot a second.
    pub(crate) fn at_time_scale(&self, scale: f64) -> Self {
        let mut scaled = *self;
        let times = [
            &mut scaled.log.motion_s,
            &mut scaled.log.run_s,
            &mut scaled.start.late_s,
            &mut scaled.start.rest_s,
            &mut scaled.holdout.shortest_s,
            &mut scaled.holdout.longest_s,
            &mut scaled.search.rests_s,
            &mut scaled.fails.after_change_s,
        ];
        for time in times {
            *time *= scale;
        }
        scaled
    }
}

impl ChoiceCriteria {
    /// Ratio of errors up to which an effect with `few` parameters takes the place of one with `many` that contains it.
    pub(crate) fn allowance(&self, many: usize, few: usize) -> f64 {
        self.simpler.powi(many.saturating_sub(few) as i32)
    }
}

/// What a criterion may be: a number, or a count.
trait Number: Copy {
    fn number(self) -> f64;
    fn of(value: f64) -> Self;
}

impl Number for f64 {
    fn number(self) -> f64 {
        self
    }
    fn of(value: f64) -> Self {
        value
    }
}

impl Number for usize {
    fn number(self) -> f64 {
        self as f64
    }
    fn of(value: f64) -> Self {
        value.round() as usize
    }
}

/// Declares the groups, [`Criteria`] and its table from one list: name, kind, default, unit, reason.
macro_rules! criteria {
    ($(
        $(#[doc = $about:literal])+
        $group:ident: $Group:ident {
            $(
                $(#[doc = $doc:literal])+
                $name:ident: $kind:ident = $default:literal $unit:literal, $reason:ident: $because:literal;
            )+
        }
    )+) => {
        $(
            $(#[doc = $about])+
            #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
            #[serde(default, deny_unknown_fields)]
            pub struct $Group {
                $(
                    $(#[doc = $doc])+
                    #[doc = ""]
                    #[doc = concat!(
                        "Default ", stringify!($default), ", unit ", $unit, ". ",
                        stringify!($reason), ": ", $because, "."
                    )]
                    pub $name: $kind,
                )+
            }

            impl $Group {
                /// The defaults.
                pub const DEFAULT: Self = Self { $($name: $default),+ };
            }

            impl Default for $Group {
                fn default() -> Self {
                    Self::DEFAULT
                }
            }
        )+

        /// Every threshold that decides a verdict.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[non_exhaustive]
        pub struct Criteria {
            $(
                $(#[doc = $about])+
                pub $group: $Group,
            )+
        }

        impl Default for Criteria {
            fn default() -> Self {
                Self::DEFAULT
            }
        }

        impl Criteria {
            /// The defaults.
            pub const DEFAULT: Self = Self { $($group: $Group::DEFAULT),+ };

            /// All of them.
            pub const LIST: &'static [Criterion] = &[$($(
                Criterion {
                    id: concat!(stringify!($group), ".", stringify!($name)),
                    decides: concat!($($doc),+),
                    default: $default as f64,
                    unit: $unit,
                    reason: Reason::$reason,
                    because: $because,
                },
            )+)+];

            /// The value of the criterion `id`.
            pub fn get(&self, id: &str) -> Option<f64> {
                $($(
                    if id == concat!(stringify!($group), ".", stringify!($name)) {
                        return Some(self.$group.$name.number());
                    }
                )+)+
                None
            }

            /// Gives the criterion `id` another value; whether there is one.
            pub fn set(&mut self, id: &str, value: f64) -> bool {
                $($(
                    if id == concat!(stringify!($group), ".", stringify!($name)) {
                        self.$group.$name = Number::of(value);
                        return true;
                    }
                )+)+
                false
            }
        }
    };
}
use criteria;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_criterion_is_read_and_set_by_its_id() {
        for criterion in Criteria::LIST {
            let mut criteria = Criteria::default();
            assert_eq!(criteria.get(criterion.id), Some(criterion.default));
            assert!(criteria.set(criterion.id, 2.0 * criterion.default + 1.0));
            assert_eq!(
                criteria.get(criterion.id),
                Some(2.0 * criterion.default + 1.0)
            );
            let [more, less] = [1.2, 0.8].map(|f| Criteria::DEFAULT.scaled(criterion.id, f));
            assert!(more.is_some() && more != less && more != Some(Criteria::DEFAULT));
            assert!(!criterion.because.is_empty() && !criterion.because.ends_with('.'));
            assert!(criterion.decides.ends_with('.'), "{}", criterion.id);
        }
        assert_eq!(Criteria::DEFAULT.scaled("missing.nothing", 1.2), None);
    }

    #[test]
    fn criteria_are_written_and_read() {
        let changed = Criteria::DEFAULT.scaled("missing.beats", 1.2).unwrap();
        let text = serde_json::to_string(&changed).unwrap();
        assert_eq!(serde_json::from_str::<Criteria>(&text).unwrap(), changed);
        let one: Criteria = serde_json::from_str(r#"{"missing": {"beats": 5}}"#).unwrap();
        assert_eq!(one.missing.beats, 5.0);
        assert_eq!(
            one.missing.significant,
            Criteria::DEFAULT.missing.significant
        );
        assert!(serde_json::from_str::<Criteria>(r#"{"missing": {"beat": 5}}"#).is_err());
    }
}
