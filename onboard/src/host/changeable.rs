//! What another program may change of a robot that drives.

use std::collections::BTreeMap;

use loopsight_link::{Configuration, Unusable};
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use serde::{Deserialize, Serialize};

/// `[controller.aboard.changeable]`: what a run passes on to its robot when somebody asks at the door. What is not
/// declared here stays as the run began; the plant, limits and safety always do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Changeable {
    /// By parameter of the plant, `[low, high]` within which another value is taken, in its unit.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, [f64; 2]>,
    /// Effects that may come, go, and have other values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<String>,
    /// Whether the gains of the law may change.
    pub gains: bool,
}

/// The same with the parameters in the order of the plant.
#[derive(Clone, Debug, Default)]
pub(super) struct Allowed {
    ranges: Vec<Option<[f64; 2]>>,
    effects: Vec<String>,
    gains: bool,
}

impl Changeable {
    /// Checks names and ranges; the key of an error is the path within `[controller.aboard]`.
    pub(super) fn of(&self, model: &Model) -> Result<Allowed, BuildError> {
        let declared = model.plant.parameters;
        for (id, [low, high]) in &self.parameters {
            let at = |message| BuildError::at(&format!("changeable.parameters.{id}"), message);
            if !declared.iter().any(|p| p.id == id) {
                let ids: Vec<&str> = declared.iter().map(|p| p.id).collect();
                let plant = model.plant.id;
                let message = format!(
                    "`{plant}` has no parameter `{id}`, expected one of {}",
                    ids.join(", ")
                );
                return Err(at(message));
            }
            if !(low < high && low.is_finite() && high.is_finite()) {
                let message = format!("`{id}` is [{low}, {high}], expected finite [low, high]");
                return Err(at(message));
            }
        }
        let range = |id: &str| self.parameters.get(id).copied();
        Ok(Allowed {
            ranges: declared.iter().map(|p| range(p.id)).collect(),
            effects: self.effects.clone(),
            gains: self.gains,
        })
    }
}

impl Allowed {
    /// The configuration that a robot which drives with `now` gets where `next` is asked for.
    ///
    /// # Errors
    ///
    /// What of it may not change.
    pub(super) fn change(
        &self,
        now: &Configuration,
        mut next: Configuration,
    ) -> Result<Configuration, Unusable> {
        if next.plant != now.plant {
            return Err(Unusable::Plant);
        }
        if next.controller.limit != now.controller.limit {
            return Err(Unusable::Controller);
        }
        if next.safety != now.safety {
            return Err(Unusable::Safety);
        }
        if !self.gains && next.controller != now.controller {
            return Err(Unusable::NotChangeable);
        }
        if next.parameters.len() != now.parameters.len() || next.means != now.means {
            return Err(Unusable::Parameters);
        }
        for (i, (value, was)) in next.parameters.iter().zip(&now.parameters).enumerate() {
            if value == was {
                continue;
            }
            let Some([low, high]) = self.ranges.get(i).copied().flatten() else {
                return Err(Unusable::NotChangeable);
            };
            let learned = now.learning.as_ref().is_none_or(|learning| {
                let low = learning.low.get(i).is_none_or(|low| value >= low);
                low && learning.high.get(i).is_none_or(|high| value <= high)
            });
            if !learned || !(low..=high).contains(&f64::from(*value)) {
                return Err(Unusable::Parameters);
            }
        }
        let fixed = |of: &Configuration| -> Vec<_> {
            let all = of.effects.iter();
            all.filter(|e| !self.effects.iter().any(|id| id == e.id.as_str()))
                .cloned()
                .collect()
        };
        if fixed(now) != fixed(&next) || next.effects == now.effects && next.bands != now.bands {
            return Err(Unusable::NotChangeable);
        }
        // How far it may learn follows from the values; those of the run stand.
        match (&now.learning, &mut next.learning) {
            (None, None) => {}
            (Some(now), Some(next)) => {
                next.low.clone_from(&now.low);
                next.high.clone_from(&now.high);
                if next != now {
                    return Err(Unusable::Learning);
                }
            }
            _ => return Err(Unusable::Learning),
        }
        Ok(next)
    }
}

#[cfg(test)]
mod tests {
    use loopsight_link::{Attachment, ControllerGains, Learning, Safety};

    use super::*;

    fn configuration() -> Configuration {
        let two = |value: f32| heapless::Vec::from_slice(&[value, value]).unwrap();
        let gains = |value: f64| heapless::Vec::from_slice(&[value, value]).unwrap();
        Configuration {
            plant: heapless::String::try_from("ddmr").unwrap(),
            parameters: heapless::Vec::from_slice(&[-15.0, 0.005]).unwrap(),
            effects: heapless::Vec::new(),
            bands: two(0.0),
            means: true,
            learning: Some(Learning {
                forgetting: 1.0,
                initial_covariance: 1.0,
                covariance_limit: 1.0,
                low: heapless::Vec::from_slice(&[-25.0, 0.0]).unwrap(),
                high: heapless::Vec::from_slice(&[-5.0, 1.0]).unwrap(),
                scale: heapless::Vec::from_slice(&[1.0, 1.0]).unwrap(),
                dead_zone: two(0.0),
                least_excitation: two(0.0),
                window: 2.0,
                certainty_equivalence: true,
            }),
            controller: ControllerGains {
                proportional: gains(17.0),
                integral: gains(79.0),
                limit: gains(12.0),
            },
            safety: Safety {
                watchdog_ticks: 10,
                stale_us: 5000,
                stale_ticks: 20,
                least_supply: 0.0,
                encoder_ticks: 50,
                encoder_input: 4.0,
            },
        }
    }

    fn friction() -> Attachment {
        Attachment {
            id: heapless::String::try_from("coulomb_friction").unwrap(),
            channels: heapless::Vec::from_slice(&[0, 1]).unwrap(),
            values: heapless::Vec::from_slice(&[1.0, 0.1]).unwrap(),
        }
    }

    fn allowed() -> Allowed {
        Allowed {
            ranges: vec![Some([-30.0, -10.0]), None],
            effects: vec!["coulomb_friction".to_owned()],
            gains: false,
        }
    }

    fn asked(by: &Allowed, change: impl Fn(&mut Configuration)) -> Result<(), Unusable> {
        let now = configuration();
        let mut next = configuration();
        change(&mut next);
        by.change(&now, next).map(|taken| {
            assert_eq!(taken.safety, now.safety);
            assert_eq!(taken.controller.limit, now.controller.limit);
            assert_eq!(taken.learning, now.learning, "how far it may learn stays");
        })
    }

    #[test]
    fn nothing_but_what_is_declared_changes() {
        let nothing = Allowed::default();
        let a = |value: f32| move |c: &mut Configuration| c.parameters[0] = value;
        let befriend = |c: &mut Configuration| c.effects.push(friction()).unwrap();
        let faster = |c: &mut Configuration| c.controller.proportional[0] = 20.0;
        let refused = Err(Unusable::NotChangeable);
        assert_eq!(asked(&nothing, |_| {}), Ok(()));
        assert_eq!(asked(&nothing, a(-14.0)), refused);
        assert_eq!(asked(&nothing, befriend), refused);
        assert_eq!(asked(&nothing, faster), refused);

        let some = allowed();
        assert_eq!(asked(&some, a(-14.0)), Ok(()));
        // Beyond what is declared, beyond what may be learned, and no number at all.
        for value in [-9.0, -26.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(asked(&some, a(value)), Err(Unusable::Parameters), "{value}");
        }
        assert_eq!(asked(&some, |c| c.parameters[1] = 0.006), refused);
        assert_eq!(asked(&some, befriend), Ok(()));
        assert_eq!(asked(&some, faster), refused);
        let gains = Allowed {
            gains: true,
            ..allowed()
        };
        assert_eq!(asked(&gains, faster), Ok(()));
    }

    #[test]
    fn limits_safety_plant_and_learning_never_do() {
        let all = Allowed {
            gains: true,
            ..allowed()
        };
        let limit = |c: &mut Configuration| c.controller.limit[0] = 1e6;
        assert_eq!(asked(&all, limit), Err(Unusable::Controller));
        let watchdog = |c: &mut Configuration| c.safety.watchdog_ticks = u16::MAX;
        assert_eq!(asked(&all, watchdog), Err(Unusable::Safety));
        let plant = |c: &mut Configuration| c.plant.clear();
        assert_eq!(asked(&all, plant), Err(Unusable::Plant));
        let none = |c: &mut Configuration| c.learning = None;
        assert_eq!(asked(&all, none), Err(Unusable::Learning));
        let trusting = |c: &mut Configuration| {
            c.learning.as_mut().unwrap().initial_covariance = 1e9;
        };
        assert_eq!(asked(&all, trusting), Err(Unusable::Learning));
        let wider = |c: &mut Configuration| c.learning.as_mut().unwrap().high[0] = 1e9;
        assert_eq!(asked(&all, wider), Ok(()), "the range of the run stands");
    }
}
