//! Enums of the JSON answers, one for each enum of the engine.

/// An enum of the answers with the variants of one of the engine. A new variant there does not compile here, so the
/// schema is always complete.
macro_rules! mirror {
    (
        $(#[$meta:meta])*
        $name:ident of $engine:ty { $($(#[$doc:meta])* $variant:ident,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(rename_all = "snake_case")]
        #[non_exhaustive]
        pub enum $name {
            $($(#[$doc])* $variant,)*
        }

        impl From<$engine> for $name {
            fn from(engine: $engine) -> Self {
                match engine {
                    $(<$engine>::$variant => Self::$variant,)*
                }
            }
        }

        impl From<$name> for $engine {
            fn from(answer: $name) -> Self {
                match answer {
                    $($name::$variant => <$engine>::$variant,)*
                }
            }
        }
    };
}

mirror! {
    /// What a diagnosis concludes.
    Verdict of loopsight_diagnosis::Conclusion {
        /// An effect of the library explains what the model does not.
        EffectMissing,
        /// The model explains the measurements down to their noise.
        NothingMissing,
        /// Something is missing, and no effect of the library explains it.
        UnknownEffect,
        /// The recording does not say enough: it is too short, has no motion, or lacks what the test recording shows.
        DataInsufficient,
        /// The recording is at fault.
        LogFaulty,
        /// From every start the model leaves as much as a constant would, and no effect of the library changes that.
        /// Nothing can be concluded.
        NotFitted,
        /// The work was cancelled. What was found until then is reported, without a conclusion.
        Cancelled,
    }
}

mirror! {
    /// What the data say of a parameter.
    ParameterVerdict of loopsight_diagnosis::ParameterVerdict {
        /// Determined by the data.
        Good,
        /// Not estimated: it keeps the value of the file.
        #[serde(rename = "held")]
        Frozen,
        /// Without influence on what is measured in this recording.
        Dead,
        /// Only a combination with other parameters is determined.
        Flat,
        /// The interval is wider than the value.
        NotPinned,
        /// Not shown by this recording: it follows from others, as the plant says.
        Tied,
        /// Rests on the end of its admissible range.
        AtBound,
        /// The fit was cancelled before it could say.
        Unfinished,
    }
}

mirror! {
    /// Why a model cannot be simulated from the inputs alone.
    Because of loopsight_diagnosis::Because {
        /// Errors of the state grow exponentially.
        Unstable,
        /// Errors of the state add up over time.
        Integrating,
    }
}

mirror! {
    /// What an experiment promises.
    Promise of loopsight_diagnosis::Promise {
        /// It answers the question.
        Answers,
        /// It would have to be longer.
        TooShort,
        /// No inputs answer the question.
        CannotBeSeparated,
    }
}

mirror! {
    /// Kinds of faults a log can have.
    FaultKind of loopsight_recordings::FaultKind {
        /// Time stamps that go backwards; the rows were left out.
        NonMonotoneTime,
        /// Rows with the time stamp of the row before; they were left out.
        DuplicateTime,
        /// A hole in the time stamps; the run was split there.
        Gap,
        /// Time stamps far from equidistant.
        IrregularTime,
        /// Missing samples.
        NotANumber,
        /// Samples of an impossible magnitude; they count as missing.
        AbsurdValue,
        /// A sensor that never moves although it should.
        DeadSensor,
        /// A sensor that stands still in part of the log, or in all of it for a known reason.
        ConstantSensor,
        /// An input that never changes.
        ConstantInput,
        /// Nothing moves.
        Motionless,
        /// A signal with the wrong sign.
        ReversedSign,
        /// A rate that is not the derivative of its angle, by the factor between degrees and radians.
        GyroScale,
        /// A rate that is not the derivative of its position, by another factor.
        RateScale,
        /// A run too short to learn from.
        ShortRun,
        /// A run without rows.
        EmptyRun,
        /// A run that is not of the same machine in the same state as the others.
        BrokenRun,
        /// A run that rests before it moves; the rest was left out.
        RestingStart,
        /// Voltages logged as magnitudes; their signs were reconstructed.
        UnsignedVoltage,
        /// An angle that begins anew after each turn, or a counter that runs over; it was taken as going on.
        Wrapped,
        /// A column that does not say its unit; SI was assumed.
        UnitAssumed,
        /// A column whose `scale` does once more what its unit does already.
        ScaledTwice,
        /// A file that ends too early; what is before the cut was read.
        CutLog,
        /// A length that cannot be.
        Implausible,
    }
}

mirror! {
    /// How much a fault matters to a fit.
    Severity of loopsight_recordings::Severity {
        /// Good to know.
        Note,
        /// A part of the log is lost or doubtful; the rest can be used.
        Warning,
        /// A fit to this log would mean nothing.
        Fatal,
    }
}

impl ParameterVerdict {
    /// In words.
    pub fn text(self) -> &'static str {
        loopsight_diagnosis::ParameterVerdict::from(self).text()
    }
}

impl FaultKind {
    /// Name as in JSON.
    pub fn name(self) -> &'static str {
        loopsight_recordings::FaultKind::from(self).name()
    }
}
