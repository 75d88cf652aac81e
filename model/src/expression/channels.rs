//! The channels of a plant that a model file defines: those it declares, and those that follow
//! from its signals.

use serde::{Deserialize, Serialize};

use super::keep;
use super::plant::PlantTable;
use super::table::check_unit;
use crate::config::{Mistake, PathSegment, nearest};
use loopsight_core::{Channel, Place, Reads, Role};

/// A channel of the model file: an effort, or one at an input, the rate of a state or an output.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChannelTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    input: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    output: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flow: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    position: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drive: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    heading: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    forward: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    yaw: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    load: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    armature: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    centrifugal: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shaft: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stall: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gravity: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    head: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    side: Option<i8>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    doc: Option<String>,
}

impl ChannelTable {
    fn role(&self, role: Role) -> Option<&str> {
        match role {
            Role::Flow => &self.flow,
            Role::Position => &self.position,
            Role::Drive => &self.drive,
            Role::Heading => &self.heading,
            Role::Forward => &self.forward,
            Role::Yaw => &self.yaw,
            Role::Load => &self.load,
            Role::Armature => &self.armature,
            Role::Centrifugal => &self.centrifugal,
            Role::Shaft => &self.shaft,
            Role::Stall => &self.stall,
            Role::Gravity => &self.gravity,
            Role::Head => &self.head,
        }
        .as_deref()
    }

    /// Without a place of another kind it is an effort.
    pub(crate) fn is_effort(&self) -> bool {
        self.input.is_none() && self.rate.is_none() && self.output.is_none()
    }
}

fn path(id: &str, key: &str) -> [PathSegment; 3] {
    ["channels".into(), id.into(), key.into()]
}

/// A name among those that are right here, or a mistake that points at it.
fn find<'n>(
    id: &str,
    key: &str,
    name: &str,
    what: &str,
    known: impl Iterator<Item = &'n str> + Clone,
) -> Result<usize, Mistake> {
    known.clone().position(|k| k == name).ok_or_else(|| {
        let all: Vec<&str> = known.clone().collect();
        let message = format!(
            "there is no {what} `{name}`, expected one of {}",
            all.join(", ")
        );
        let mistake = Mistake::value(path(id, key), message);
        match nearest(name, known) {
            Some(near) => mistake.help(format!("did you mean `{near}`?")),
            None => mistake,
        }
    })
}

/// The channel `id` as declared; efforts are numbered from 0.
pub(crate) fn declared(
    plant: &PlantTable,
    id: &str,
    table: &ChannelTable,
    effort: usize,
) -> Result<Channel, Mistake> {
    let mut reads = Vec::new();
    for role in Role::ALL {
        if let Some(name) = table.role(role) {
            find(id, role.id(), name, "signal", plant.signals().map(|s| s.0))?;
            reads.push(Reads(role, keep::text(name)));
        }
    }
    let (states, inputs) = (plant.states.ids(), plant.inputs.ids());
    let places = [
        ("input", &table.input),
        ("rate", &table.rate),
        ("output", &table.output),
    ];
    let mut given = places
        .into_iter()
        .filter_map(|(k, v)| Some((k, v.as_deref()?)));
    let first = given.next();
    if let Some((second, _)) = given.next() {
        let message = "a channel is at one place, found two";
        return Err(Mistake::key(path(id, second), message));
    }
    let (place, own_unit) = match first {
        None => (Place::Effort(effort), None),
        Some((key @ "input", name)) => {
            let i = find(id, key, name, "input", inputs)?;
            (Place::Input(i), Some(plant.unit_of(name).to_owned()))
        }
        Some((key @ "rate", name)) => {
            let i = find(id, key, name, "state", states)?;
            (Place::Rate(i), Some(per_second(plant.unit_of(name))))
        }
        Some((key, name)) => {
            let i = find(id, key, name, "signal", plant.signals().map(|s| s.0))?;
            (Place::Output(i), Some(plant.unit_of(name).to_owned()))
        }
    };
    let Some(unit) = table.unit.clone().or(own_unit) else {
        let message = format!("the channel `{id}` needs a `unit`: that of what is added there");
        return Err(Mistake::key(["channels".into(), id.into()], message));
    };
    check_unit(
        &path(id, "unit"),
        &unit,
        table.unit.as_deref().unwrap_or(""),
    )?;
    let side = table.side.unwrap_or(0);
    if !(-1..=1).contains(&side) {
        let message = format!("`side` is {side}, expected 1, -1 or 0");
        return Err(Mistake::value(path(id, "side"), message));
    }
    let size = table.size.unwrap_or(1.0);
    if !(size > 0.0 && size.is_finite()) {
        let message = format!("`size` is {size}, expected a number above 0");
        return Err(Mistake::value(path(id, "size"), message));
    }
    let doc = table
        .doc
        .as_deref()
        .unwrap_or("a channel of the model file");
    Ok(channel(id, place, &unit, &reads, side, size, doc, plant))
}

#[allow(
    clippy::too_many_arguments,
    reason = "a channel has as many properties"
)]
fn channel(
    id: &str,
    place: Place,
    unit: &str,
    reads: &[Reads],
    side: i8,
    size: f64,
    doc: &str,
    plant: &PlantTable,
) -> Channel {
    let name = |i: usize| plant.signals().nth(i).map_or("", |s| s.0);
    let n_states = plant.states.len();
    let equation = match place {
        Place::Effort(_) => format!("{id} -> {id} + w"),
        Place::Input(i) => {
            let input = name(n_states + i);
            format!("{input} -> {input} + w")
        }
        Place::Rate(i) => format!("{0}' -> {0}' + w", name(i)),
        Place::Output(i) => format!("{0}_measured = {0} + w", name(i)),
    };
    Channel {
        id: keep::text(id),
        place,
        unit: keep::text(unit),
        equation: keep::text(&equation),
        reads: keep::reads(reads),
        side,
        size,
        doc: keep::text(doc),
    }
}

/// `rad/s` becomes `rad/s^2`.
pub(crate) fn per_second(unit: &str) -> String {
    match unit.strip_suffix("/s") {
        Some(_) => format!("{unit}^2"),
        None if unit == "1" => "1/s".to_owned(),
        None => format!("{unit}/s"),
    }
}

/// Channels that need no declaration: every input, the rate of every state that is more than the
/// integral of a signal, every sensor; and an effort on each of those rates where the file
/// declares no effort.
pub(crate) fn implied(
    plant: &PlantTable,
    integrals: &[(&str, &str)],
    declared: &[Channel],
) -> Vec<Channel> {
    let only_input = match plant.inputs.0.as_slice() {
        [(id, _)] => Some(id.as_str()),
        _ => None,
    };
    // A declared effort knows more of the signals than can be guessed.
    let of_effort = |role: Role, id: &str| {
        declared
            .iter()
            .find(|c| matches!(c.place, Place::Effort(_)) && c.read(role) == Some(id))
            .map(|c| c.reads.to_vec())
    };
    let guessed = |flow: Option<&'static str>| {
        let integral = |f: &str| integrals.iter().find(|(rate, _)| *rate == f);
        let mut reads = Vec::new();
        if let Some(flow) = flow
            && let Some((_, position)) = integral(flow)
        {
            reads.push(Reads(Role::Flow, flow));
            reads.push(Reads(Role::Position, keep::text(position)));
        }
        if let Some(input) = only_input {
            reads.push(Reads(Role::Drive, keep::text(input)));
        }
        reads
    };
    let reads_of = |id: &str| {
        of_effort(Role::Flow, id)
            .or_else(|| of_effort(Role::Position, id))
            .unwrap_or_else(|| {
                let rate = integrals.iter().find(|(_, integral)| *integral == id);
                guessed(Some(keep::text(rate.map_or(id, |(rate, _)| rate))))
            })
    };
    let taken = |place: Place, id: &str| declared.iter().any(|c| c.place == place || c.id == id);
    let bodies = plant
        .states
        .ids()
        .enumerate()
        .filter(|(_, id)| !integrals.iter().any(|(_, integral)| integral == id));
    let mut channels = Vec::new();
    let mut add = |id: String, place, unit: &str, reads: &[Reads], doc: &str| {
        if !taken(place, &id) {
            channels.push(channel(&id, place, unit, reads, 0, 1.0, doc, plant));
        }
    };
    if !declared.iter().any(|c| matches!(c.place, Place::Effort(_))) {
        for (effort, (_, id)) in bodies.clone().enumerate() {
            let unit = per_second(plant.unit_of(id));
            let doc = "what is added to the rate of the state";
            let name = format!("effort.{id}");
            add(name, Place::Effort(effort), &unit, &reads_of(id), doc);
        }
    }
    for (i, id) in bodies {
        let unit = per_second(plant.unit_of(id));
        let doc = "the rate of the state itself: where inertia acts";
        add(
            format!("body.{id}"),
            Place::Rate(i),
            &unit,
            &reads_of(id),
            doc,
        );
    }
    for (i, id) in plant.inputs.ids().enumerate() {
        let name = match only_input {
            Some(_) => "input".to_owned(),
            None => format!("input.{id}"),
        };
        let mut reads = of_effort(Role::Drive, id).unwrap_or_else(|| guessed(None));
        if !reads.iter().any(|r| r.0 == Role::Drive) {
            reads.push(Reads(Role::Drive, keep::text(id)));
        }
        let doc = "between the commanded and the effective input";
        add(name, Place::Input(i), plant.unit_of(id), &reads, doc);
    }
    for (i, (id, unit)) in plant.signals().enumerate() {
        if plant.inputs.position(id).is_some() {
            continue;
        }
        let doc = "measurement of the signal";
        add(
            format!("sensor.{id}"),
            Place::Output(i),
            unit,
            &reads_of(id),
            doc,
        );
    }
    channels
}
