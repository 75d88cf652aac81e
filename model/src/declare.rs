//! The macros that make a component known: its object-safe view, and its entry in the registry.

/// Makes a [`Plant`](loopsight_core::Plant) available behind [`Dynamics`](loopsight_core::Dynamics) and
/// registers it: `[plant.<id>]` in TOML.
///
/// ```ignore
/// declare_plant!(Ddmr, "ddmr");
/// ```
#[macro_export]
macro_rules! declare_plant {
    ($plant:ident, $id:literal) => {
        $crate::__private::loopsight_core::declare_plant!($plant, $id);

        const _: () = {
            use $crate::__private::{inventory, serde, typetag};

            impl $crate::registry::DeclaredPlant for $plant {
                const META: &'static $crate::__private::loopsight_core::PlantMeta =
                    &<$plant as $crate::__private::loopsight_core::Plant>::META;
                const INSTANCE: &'static dyn $crate::registry::AnyDynamics = &$plant;
            }

            /// The plant as a file has it; typetag wants a type of this crate.
            #[derive(Clone, Debug)]
            struct Part($crate::registry::ConfiguredPlant<$plant>);

            impl serde::Serialize for Part {
                fn serialize<S: serde::Serializer>(
                    &self,
                    to: S,
                ) -> ::core::result::Result<S::Ok, S::Error> {
                    serde::Serialize::serialize(&self.0, to)
                }
            }

            impl<'de> serde::Deserialize<'de> for Part {
                fn deserialize<D: serde::Deserializer<'de>>(
                    from: D,
                ) -> ::core::result::Result<Self, D::Error> {
                    serde::Deserialize::deserialize(from).map(Part)
                }
            }

            #[typetag::serde(name = $id)]
            impl $crate::registry::PlantPart for Part {
                fn meta(&self) -> &'static $crate::__private::loopsight_core::PlantMeta {
                    <$plant as $crate::registry::DeclaredPlant>::META
                }
                fn values(&self) -> &$crate::registry::Values {
                    self.0.given()
                }
                fn dynamics(&self) -> &'static dyn $crate::registry::AnyDynamics {
                    <$plant as $crate::registry::DeclaredPlant>::INSTANCE
                }
            }

            inventory::submit! { $crate::registry::PlantEntry(
                <$plant as $crate::registry::DeclaredPlant>::META,
                <$plant as $crate::__private::loopsight_core::Plant>::DERIVED,
            ) }
        };
    };
}

/// Makes an [`Effect`](loopsight_core::Effect) available behind [`Physics`](loopsight_core::Physics) and
/// registers it: `[effect.<id>]` in an `[[effect]]` of the TOML.
///
/// ```ignore
/// declare_effect!(CoulombFriction, "coulomb_friction");
/// ```
#[macro_export]
macro_rules! declare_effect {
    ($effect:ident, $id:literal) => {
        $crate::__private::loopsight_core::declare_effect!($effect, $id);

        const _: () = {
            use $crate::__private::{inventory, serde, typetag};

            impl $crate::registry::DeclaredEffect for $effect {
                const META: &'static $crate::__private::loopsight_core::EffectMeta =
                    &<$effect as $crate::__private::loopsight_core::Effect>::META;
                const INSTANCE: &'static dyn $crate::registry::AnyPhysics = &$effect;
            }

            /// The effect as a file has it; typetag wants a type of this crate.
            #[derive(Clone, Debug)]
            struct Part($crate::registry::ConfiguredEffect<$effect>);

            impl serde::Serialize for Part {
                fn serialize<S: serde::Serializer>(
                    &self,
                    to: S,
                ) -> ::core::result::Result<S::Ok, S::Error> {
                    serde::Serialize::serialize(&self.0, to)
                }
            }

            impl<'de> serde::Deserialize<'de> for Part {
                fn deserialize<D: serde::Deserializer<'de>>(
                    from: D,
                ) -> ::core::result::Result<Self, D::Error> {
                    serde::Deserialize::deserialize(from).map(Part)
                }
            }

            #[typetag::serde(name = $id)]
            impl $crate::registry::EffectPart for Part {
                fn meta(&self) -> &'static $crate::__private::loopsight_core::EffectMeta {
                    <$effect as $crate::registry::DeclaredEffect>::META
                }
                fn at(&self) -> &[String] {
                    self.0.channels()
                }
                fn values(&self) -> &$crate::registry::Values {
                    self.0.given()
                }
                fn physics(&self) -> &'static dyn $crate::registry::AnyPhysics {
                    <$effect as $crate::registry::DeclaredEffect>::INSTANCE
                }
            }

            inventory::submit! { $crate::registry::EffectEntry(
                <$effect as $crate::registry::DeclaredEffect>::META,
                <$effect as $crate::registry::DeclaredEffect>::INSTANCE,
            ) }
        };
    };
}
