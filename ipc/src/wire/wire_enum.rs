//! The enums of the wire.

/// Declares an enum of the wire: for each variant its number and its name. A variant may have limits, which are not in the
/// number.
///
/// The comments of the variants are texts of every language: the C header, the Python package and the ROS 2 messages get
/// them from here, so they name other variants by their words.
macro_rules! wire_enum {
    ($(#[doc = $about:literal])+ $(#[derive($($derived:ident),+)])? $name:ident { $(
        $(#[doc = $doc:literal])+
        $variant:ident $({ $($(#[$inner:meta])* $limit:ident),+ })? = $number:literal, $text:literal $(, $default:ident)?;
    )* }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq $($(, $derived)+)?)]
        #[repr(u32)]
        pub enum $name {
            $($(#[doc = $doc])+ $(#[$default])? $variant $({ $($(#[$inner])* $limit: f64),+ })? = $number,)*
        }

        impl $name {
            /// All variants, by their numbers.
            pub const ALL: [Self; [$($number),*].len()] = [$(Self::$variant $({ $($limit: 0.0),+ })?),*];

            /// What the enum is, from which its forms in other languages are generated.
            #[doc(hidden)]
            pub const ABOUT: &str = concat!($($about),+);

            /// Identifier, number and meaning of each variant, likewise.
            #[doc(hidden)]
            pub const MEANINGS: [(&'static str, u32, &'static str); Self::ALL.len()] =
                [$((stringify!($variant), $number, concat!($($doc),+))),*];

            /// The variant of a number on the wire, or `None` for a number that this version does not support.
            pub fn from_wire(number: u32) -> Option<Self> {
                Self::ALL.into_iter().find(|variant| variant.to_wire() == number)
            }

            /// The number on the wire.
            pub fn to_wire(self) -> u32 {
                match self {
                    $(Self::$variant $({ $($limit: _),+ })? => $number,)*
                }
            }

            /// Name in words, as the commands print it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant $({ $($limit: _),+ })? => $text,)*
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                formatter.pad(self.name())
            }
        }
    };
}

pub(super) use wire_enum;
