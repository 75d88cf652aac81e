//! Channels: the places of a plant where physics can be added.

/// Where in the equations a channel sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A generalised effort `w[i]` added to what drives the plant; its flow is a speed.
    Effort(usize),
    /// The `i`-th input, between the command in the log and the plant.
    Input(usize),
    /// The rate of the `i`-th state, after everything else: mass and inertia act here.
    Rate(usize),
    /// A signal on its way to the sensor, by index into states, inputs, outputs in that order.
    Output(usize),
}

impl Place {
    /// The kind of place, as effects declare it.
    pub const fn kind(self) -> PlaceKind {
        match self {
            Place::Effort(_) => PlaceKind::Effort,
            Place::Input(_) => PlaceKind::Input,
            Place::Rate(_) => PlaceKind::Body,
            Place::Output(_) => PlaceKind::Output,
        }
    }
}

/// A kind of place; an effect names those it attaches to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceKind {
    /// See [`Place::Effort`].
    Effort,
    /// See [`Place::Input`].
    Input,
    /// See [`Place::Rate`].
    Body,
    /// See [`Place::Output`].
    Output,
}

impl PlaceKind {
    /// All of them.
    pub const ALL: [PlaceKind; 4] = [
        PlaceKind::Effort,
        PlaceKind::Input,
        PlaceKind::Body,
        PlaceKind::Output,
    ];

    /// Name used in listings and messages.
    pub const fn name(self) -> &'static str {
        match self {
            PlaceKind::Effort => "effort",
            PlaceKind::Input => "input",
            PlaceKind::Body => "body",
            PlaceKind::Output => "output",
        }
    }
}

/// What an effect may read at its channel. A channel binds each role it can offer to a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Role {
    /// Speed conjugate to the effort at this channel: shaft speed, joint speed, flow.
    Flow = 0,
    /// Integral of the flow: shaft angle, joint angle, level.
    Position,
    /// The input that drives this channel, after the effects on that input.
    Drive,
    /// Heading of a vehicle.
    Heading,
    /// Forward speed of a vehicle, where the channel acts along its heading.
    Forward,
    /// Yaw rate of a vehicle, where the channel acts about the vertical.
    Yaw,
    /// Load on the common supply: the sum over the motors of command times voltage over the winding,
    /// V². Over winding resistance and supply voltage it is the current drawn.
    Load,
    /// Voltage over the winding of this channel's motor, proportional to its current.
    Armature,
    /// Acceleration by turning, per unit of the centre of mass's offset.
    Centrifugal,
    /// Angle of a shaft with a motor or an encoder: what is uneven there repeats with its turns.
    Shaft,
    /// What [`Role::Load`] would be with the motors at rest: the sum of the squares of the commands.
    Stall,
    /// Gravity that the plant itself has at this place.
    Gravity,
    /// Head of a liquid over its outlet, or of heat over its surroundings: no solids rub on each other here.
    Head,
}

impl Role {
    /// Number of roles.
    pub const COUNT: usize = 13;
    /// All of them, in order.
    pub const ALL: [Role; Role::COUNT] = [
        Role::Flow,
        Role::Position,
        Role::Drive,
        Role::Heading,
        Role::Forward,
        Role::Yaw,
        Role::Load,
        Role::Armature,
        Role::Centrifugal,
        Role::Shaft,
        Role::Stall,
        Role::Gravity,
        Role::Head,
    ];

    /// Name in files and expressions.
    pub const fn id(self) -> &'static str {
        match self {
            Role::Flow => "flow",
            Role::Position => "position",
            Role::Drive => "drive",
            Role::Heading => "heading",
            Role::Forward => "forward",
            Role::Yaw => "yaw",
            Role::Load => "load",
            Role::Armature => "armature",
            Role::Centrifugal => "centrifugal",
            Role::Shaft => "shaft",
            Role::Stall => "stall",
            Role::Gravity => "gravity",
            Role::Head => "head",
        }
    }

    /// Name used in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Role::Flow => "flow",
            Role::Position => "position",
            Role::Drive => "drive",
            Role::Heading => "heading",
            Role::Forward => "forward speed",
            Role::Yaw => "yaw rate",
            Role::Load => "supply load",
            Role::Armature => "armature voltage",
            Role::Centrifugal => "acceleration by turning",
            Role::Shaft => "shaft angle",
            Role::Stall => "supply load at rest",
            Role::Gravity => "gravity of its own",
            Role::Head => "head of a liquid",
        }
    }
}

/// One reading a channel offers: the role and the signal that plays it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reads(pub Role, pub &'static str);

/// A place of a plant where effects attach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Identifier, e.g. `wheel.right`.
    pub id: &'static str,
    /// Where in the equations.
    pub place: Place,
    /// Unit of what is added here.
    pub unit: &'static str,
    /// How it enters, e.g. `dv/dt += K_C w`.
    pub equation: &'static str,
    /// Signals an effect can read here.
    pub reads: &'static [Reads],
    /// `+1` or `-1` where channels come in pairs (right, left), else 0: effects that act
    /// oppositely on the two sides multiply by it.
    pub side: i8,
    /// Size of what matters here, in its unit: about what 1 V or 1 rad/s at a shaft comes to.
    /// Defaults, scales and starts of effect parameters count in it, so that one declaration
    /// serves volts at a wheel and m/s² at a body.
    pub size: f64,
    /// One sentence.
    pub doc: &'static str,
}

impl Channel {
    /// The signal that plays `role` here, if any.
    pub fn read(&self, role: Role) -> Option<&'static str> {
        self.reads.iter().find(|r| r.0 == role).map(|r| r.1)
    }
}
