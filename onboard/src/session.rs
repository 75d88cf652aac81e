//! The conversation of a robot with its host.

use loopsight_core::{Array, Plant};
use loopsight_link::{
    Act, Configuration, Decoder, Frame, Hello, Measured, Note, PARAMETERS, Reason, Reply, Request,
    SIGNALS, Sensed, Unusable, VERSION, Welcome,
};

use crate::Robot;
use crate::parts::{Parts, PerInput, PerParameter};
use crate::watch::Watch;

/// Measures what a tick costs, in a unit of the board's own.
pub trait Meter {
    /// Called before a tick.
    fn start(&mut self);
    /// Called after it; the cost.
    fn stop(&mut self) -> u32;
}

/// Nothing is measured.
impl Meter for () {
    fn start(&mut self) {}
    fn stop(&mut self) -> u32 {
        0
    }
}

/// What a robot's own sensors say, once per period; `A` is the array `[f32; N]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors<A> {
    /// The controlled states.
    pub measured: A,
    /// Voltage of the supply, V.
    pub supply: f32,
}

/// The robot's end of the conversation with its host: greeted, configured, running, at rest.
///
/// `R` lists what is compiled in ([`Parts`]), `M` measures what a tick costs ([`Meter`]).
///
/// A robot without sensors ([`Session::new`]) is measured by its host and answers each step with a command.
/// Its board calls [`Session::elapsed`] once per period. A robot with motors and encoders of its own
/// ([`Session::with_sensors`]) ticks by its own timer. Its board calls [`Session::sensed`] instead, and then
/// hands [`Session::output`] to the motors. The host's steps bring the reference.
///
/// At any end of a run the motors are released and the robot reports why. Only a new configuration lets it move
/// again. A run ends ([`Reason`]) when
///
/// * no valid step came for longer than the watchdog allows, whatever else came over the line;
/// * a message belongs to another session, or a step is out of order: one side was restarted;
/// * measurements are too old, are not finite, or do not move while the motors are driven;
/// * the supply is too low.
pub struct Session<R: Parts, M> {
    meter: M,
    period_us: u32,
    decoder: Decoder,
    own_sensors: bool,
    session: u32,
    greeted: bool,
    run: Option<Run<R>>,
    tick: u32,
    dropped: u32,
    cost: u32,
}

struct Run<R: Parts> {
    robot: Robot<R>,
    watch: Watch,
    /// A step has come since the configuration was taken.
    begun: bool,
    /// The reference of the last step, for a robot with sensors of its own.
    wanted: PerInput<R>,
}

impl<R: Parts<Scalar = f32>, M: Meter> Session<R, M> {
    /// A robot that was just switched on.
    pub fn new(period_us: u32, meter: M) -> Self {
        const {
            assert!(
                PerInput::<R>::LENGTH <= SIGNALS && PerParameter::<R>::LENGTH <= PARAMETERS,
                "a message has no room for this plant's inputs or parameters"
            );
        }
        Self {
            meter,
            period_us,
            decoder: Decoder::default(),
            own_sensors: false,
            session: 0,
            greeted: false,
            run: None,
            tick: 0,
            dropped: 0,
            cost: 0,
        }
    }

    /// A robot that was just switched on, with motors and encoders of its own.
    pub fn with_sensors(period_us: u32, meter: M) -> Self {
        Self {
            own_sensors: true,
            ..Self::new(period_us, meter)
        }
    }

    fn period(&self) -> f64 {
        f64::from(self.period_us) * 1e-6
    }

    /// What the motors get; `None`: they are at rest.
    pub fn output(&self) -> Option<&PerInput<R>> {
        self.run
            .as_ref()
            .filter(|run| run.begun)
            .map(|run| run.robot.applied())
    }

    /// Takes one byte of the line. Broken frames are counted and not answered: the host notices that no
    /// answer comes.
    pub fn take(&mut self, byte: u8, say: &mut dyn FnMut(&Reply)) {
        let Some(whole) = self.decoder.whole(byte) else {
            return;
        };
        if let Some(step) = whole.ok().and_then(Frame::step) {
            return self.told(step.session, say, |this, say| this.step(&step, say));
        }
        match whole.and_then(Frame::message) {
            Ok(request) => self.answer(request, say),
            Err(_) => self.dropped = self.dropped.saturating_add(1),
        }
    }

    /// A period of the board's timer has gone by. `sensors` is what the board measured, `None` if motors or
    /// sensors failed.
    pub fn sensed(&mut self, sensors: Option<Sensors<PerInput<R>>>, say: &mut dyn FnMut(&Reply)) {
        self.elapsed(say);
        if self.run.as_ref().is_none_or(|run| !run.begun) {
            return;
        }
        let done = match sensors {
            Some(sensors) => self.go(&sensors, say),
            None => Err(Reason::Hardware),
        };
        if let Err(reason) = done {
            self.rest(reason, say);
        }
    }

    /// A tick by the board's own timer.
    fn go(
        &mut self,
        sensors: &Sensors<PerInput<R>>,
        say: &mut dyn FnMut(&Reply),
    ) -> Result<(), Reason> {
        let run = self.run.as_mut().ok_or(Reason::NotConfigured)?;
        let fresh = run.watch.measured(0, sensors.supply)?;
        // A bridge gives no more than its supply, and the law, what is learned and the log must know.
        if R::Plant::META.inputs.iter().all(|input| input.unit == "V") {
            run.robot.give_at_most(sensors.supply.max(0.0));
        }
        let wanted = run.wanted;
        let mut act = self.act(sensors.measured, fresh, &wanted)?;
        act.sensed = Some(Sensed {
            supply: sensors.supply,
            measured: sensors.measured.into_iter().collect(),
            reference: wanted.into_iter().collect(),
        });
        say(&Reply::Act(act));
        Ok(())
    }

    /// A period of the board's timer has gone by.
    pub fn elapsed(&mut self, say: &mut dyn FnMut(&Reply)) {
        let dropped = core::mem::take(&mut self.dropped);
        if dropped > 0 {
            say(&Reply::Log(Note::Dropped(dropped)));
        }
        if let Some(run) = self.run.as_mut().filter(|run| run.begun)
            && let Err(reason) = run.watch.elapsed()
        {
            self.rest(reason, say);
        }
    }

    /// Releases the motors, and reports why.
    fn rest(&mut self, reason: Reason, say: &mut dyn FnMut(&Reply)) {
        self.run = None;
        say(&Reply::Stopped {
            session: self.session,
            tick: self.tick,
            reason,
        });
    }

    /// A function of its own: a request is as large as a configuration, and steps have no use for that.
    #[inline(never)]
    fn answer(&mut self, request: Request, say: &mut dyn FnMut(&Reply)) {
        match request {
            Request::Hello(hello) => self.greet(hello, say),
            Request::Configure {
                session,
                configuration,
            } => self.told(session, say, |this, say| {
                this.configure(&configuration, say)
            }),
            Request::Step(step) => {
                self.told(step.session, say, |this, say| this.step(&step, say));
            }
            Request::Stop { session } => self.told(session, say, |_, _| Err(Reason::Asked)),
        }
    }

    /// Does what a message of this `session` asks for, or comes to rest.
    fn told(
        &mut self,
        session: u32,
        say: &mut dyn FnMut(&Reply),
        ask: impl FnOnce(&mut Self, &mut dyn FnMut(&Reply)) -> Result<(), Reason>,
    ) {
        let done = if self.greeted && session == self.session {
            ask(self, say)
        } else {
            Err(Reason::OtherSession)
        };
        if let Err(reason) = done {
            self.rest(reason, say);
        }
    }

    fn greet(&mut self, hello: Hello, say: &mut dyn FnMut(&Reply)) {
        if self.run.as_ref().is_some_and(|run| run.begun) {
            self.rest(Reason::HostRestarted, say);
        }
        self.run = None;
        self.session = hello.session;
        self.greeted = hello.version == VERSION;
        self.tick = 0;
        let mut plant = heapless::String::new();
        // An identifier that is too long for a message is one that no host asks for.
        let _ = plant.push_str(R::Plant::META.id);
        say(&Reply::Hello(Welcome {
            hello: Hello {
                version: VERSION,
                session: hello.session,
            },
            period_us: self.period_us,
            plant,
        }));
        if !self.greeted {
            let (expected, found) = (VERSION, hello.version);
            self.rest(Reason::Version { expected, found }, say);
        }
    }

    /// A configuration that cannot be used stops a running robot: otherwise it would run something else than
    /// its host believes.
    fn configure(
        &mut self,
        configuration: &Configuration,
        say: &mut dyn FnMut(&Reply),
    ) -> Result<(), Reason> {
        let period = self.period();
        let unusable = |what: Unusable| Reason::Configuration(what);
        let watch = Watch::new::<R::Plant>(&configuration.safety).map_err(unusable)?;
        match self.run.as_mut().filter(|run| run.begun) {
            Some(run) => {
                run.robot.improve(configuration, period).map_err(unusable)?;
                run.watch = watch;
            }
            None => {
                self.run = Some(Run {
                    robot: Robot::new(configuration, period).map_err(unusable)?,
                    watch,
                    begun: false,
                    wanted: PerInput::<R>::filled(0.0),
                });
                self.tick = 0;
            }
        }
        say(&Reply::Configured {
            session: self.session,
        });
        Ok(())
    }

    fn step(&mut self, step: &Measured, say: &mut dyn FnMut(&Reply)) -> Result<(), Reason> {
        let own_sensors = self.own_sensors;
        let run = self.run.as_mut().ok_or(Reason::NotConfigured)?;
        let reference = PerInput::<R>::from_slice(&step.reference);
        let reference = reference.filter(|r| r.as_ref().iter().all(|v| v.is_finite()));
        let reference = *reference.ok_or(Reason::NotFinite)?;
        match (own_sensors, step.measured.is_empty()) {
            (true, true) => {
                run.watch.heard();
                run.wanted = reference;
                run.begun = true;
                return Ok(());
            }
            (true, false) => return Err(Reason::OwnSensors),
            (false, true) => return Err(Reason::NoSensors),
            (false, false) => {}
        }
        if step.tick != self.tick {
            let (expected, found) = (self.tick, step.tick);
            return Err(Reason::OutOfOrder { expected, found });
        }
        run.watch.heard();
        let fresh = run.watch.measured(step.age_us, step.supply)?;
        let measured = PerInput::<R>::from_slice(&step.measured).copied();
        let act = self.act(measured.ok_or(Reason::NotFinite)?, fresh, &reference)?;
        say(&Reply::Act(act));
        Ok(())
    }

    /// One tick of the loop, and its report. A function of its own: inlined into the conversation, a tick costs
    /// some 200 instructions more, because registers run out.
    #[inline(never)]
    fn act(
        &mut self,
        measured: PerInput<R>,
        fresh: bool,
        reference: &PerInput<R>,
    ) -> Result<Act, Reason> {
        let run = self.run.as_mut().ok_or(Reason::NotConfigured)?;
        if !measured.as_ref().iter().all(|v| v.is_finite()) {
            return Err(Reason::NotFinite);
        }
        let (applied, parameters) = (run.robot.applied(), run.robot.parameters());
        run.watch
            .turned::<R::Plant>(applied, &measured, parameters)?;
        self.meter.start();
        let outcome = run.robot.tick(measured, fresh, reference.as_ref());
        let cost = core::mem::replace(&mut self.cost, self.meter.stop());
        let outcome = outcome.ok_or(Reason::NoCommand)?;
        run.begun = true;
        let tick = self.tick;
        self.tick = tick.wrapping_add(1);
        Ok(Act {
            session: self.session,
            tick,
            command: run.robot.applied().into_iter().collect(),
            parameters: run.robot.parameters().into_iter().collect(),
            saturated: outcome.saturated,
            held: outcome.held,
            learned: run.robot.learned(),
            cost,
            sensed: None,
        })
    }
}
