//! Checks at compile time that a C struct and a wire type have the same layout.

/// Fails to compile unless every named field has the same offset in both types, and both have the same size and
/// alignment.
macro_rules! same_layout {
    ($c:ty, $wire:ty { $($field:ident),+ $(,)? }) => {
        const _: () = {
            assert!(size_of::<$c>() == size_of::<$wire>() && align_of::<$c>() == align_of::<$wire>());
            $(assert!(core::mem::offset_of!($c, $field) == core::mem::offset_of!($wire, $field));)+
        };
    };
}

pub(crate) use same_layout;
