//! Processors of the machine, with the numbers of the kernel.

use std::fmt;
use std::io;

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// A set of processors. Prints in the form of the kernel's tools: `0-3,6`.
#[derive(Clone, Copy)]
pub struct Processors(CpuSet);

impl Processors {
    /// Returns the processors on which this thread may run.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn of_this_process() -> io::Result<Self> {
        Ok(Self(sched_getaffinity(None)?))
    }

    /// Whether the set contains a processor.
    pub fn contains(&self, cpu: u32) -> bool {
        (cpu as usize) < CpuSet::MAX_CPU && self.0.is_set(cpu as usize)
    }
}

/// Binds this thread to one processor. Does not bind other threads of the process.
///
/// # Errors
/// The error of the operating system: the processor does not exist, or this process may not use it.
pub fn keep_on(cpu: u32) -> io::Result<()> {
    if cpu as usize >= CpuSet::MAX_CPU {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut only = CpuSet::new();
    only.set(cpu as usize);
    Ok(sched_setaffinity(None, &only)?)
}

impl fmt::Display for Processors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        let mut next = 0;
        while let Some(first) = (next..CpuSet::MAX_CPU).find(|&cpu| self.0.is_set(cpu)) {
            next = (first..CpuSet::MAX_CPU).find(|&cpu| !self.0.is_set(cpu)).unwrap_or(CpuSet::MAX_CPU);
            write!(f, "{separator}{first}")?;
            if next - first > 1 {
                write!(f, "-{}", next - 1)?;
            }
            separator = ",";
        }
        Ok(())
    }
}

impl fmt::Debug for Processors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Processors({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(cpus: &[usize]) -> Processors {
        let mut set = CpuSet::new();
        for &cpu in cpus {
            set.set(cpu);
        }
        Processors(set)
    }

    #[test]
    fn consecutive_processors_print_as_a_range() {
        assert_eq!(set(&[0, 1, 2, 3, 6, 1022, 1023]).to_string(), "0-3,6,1022-1023");
        assert_eq!(set(&[5]).to_string(), "5");
    }

    #[test]
    fn numbers_beyond_the_greatest_processor_are_in_no_set() {
        let all: Vec<usize> = (0..CpuSet::MAX_CPU).collect();
        assert!(set(&all).contains(1023) && !set(&all).contains(1024) && !set(&[1]).contains(0));
    }
}
