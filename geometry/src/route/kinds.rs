//! Enums whose variants are kinds of one thing, and calls that each variant answers for itself.

/// Defines an enum with a variant for each kind, and a macro of the name behind `as`, which calls the kind that a value has.
/// The call is a `match`, so each kind is inlined. A new kind is one line of the enum.
///
/// The first token is a dollar sign: it writes the parameters of the defined macro.
macro_rules! kinds {
    (
        $d:tt as $call:ident;
        $(#[$outer:meta])*
        $vis:vis enum $name:ident { $($(#[$inner:meta])* $kind:ident($type:ty),)+ }
    ) => {
        $(#[$outer])*
        $vis enum $name {
            $($(#[$inner])* $kind($type),)+
        }

        macro_rules! $call {
            ($d value:expr, $d it:ident => $d result:expr) => {
                match $d value { $($name::$kind($d it) => $d result,)+ }
            };
        }
    };
}

pub(super) use kinds;
