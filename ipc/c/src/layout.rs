//! Proof, while compiling, that a C struct and a wire type are the same memory.

/// Fails to compile unless every named field lies at the same place in both types, and both are as large and as aligned.
macro_rules! same_layout {
    ($c:ty, $wire:ty { $($field:ident),+ $(,)? }) => {
        const _: () = {
            assert!(size_of::<$c>() == size_of::<$wire>() && align_of::<$c>() == align_of::<$wire>());
            $(assert!(core::mem::offset_of!($c, $field) == core::mem::offset_of!($wire, $field));)+
        };
    };
}

pub(crate) use same_layout;
