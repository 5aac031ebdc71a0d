//! Observing the bus beside whatever shows it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::anyhow;

use crate::display::observe::{Observer, Scene};
use crate::system::clock::monotonic_ns;

/// Observes on a thread of its own and shows scene after scene, while this thread serves until the flag is set.
///
/// When the observing ends, also by a panic, the flag is set: a process that shows what nobody sees any more had better be
/// started again, by `show` or by a service manager. The first scene, of nothing, is shown before anything is served.
///
/// # Errors
/// What the serving failed with, or that the observer panicked.
pub(crate) fn observe_while(
    observer: &Observer,
    stop: &AtomicBool,
    mut show: impl FnMut(Scene) + Send,
    serve: impl FnOnce() -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    show(Scene::of_nothing(monotonic_ns()));
    thread::scope(|scope| {
        let observe = || {
            let _ends = SetAtEnd(stop);
            observer.run(stop, show);
        };
        let observing = thread::Builder::new().name("observer".to_owned()).spawn_scoped(scope, observe)?;
        let ends = SetAtEnd(stop);
        let served = serve();
        drop(ends);
        observing.join().map_err(|_| anyhow!("the observer panicked"))?;
        served
    })
}

/// Sets a flag when it is dropped, however that comes.
struct SetAtEnd<'a>(&'a AtomicBool);

impl Drop for SetAtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;
    use std::time::{Duration, Instant};

    use anyhow::{bail, ensure};
    use bench_dragon_ipc::{Domain, Instance};

    use super::*;

    /// An observer of an instance that nobody serves.
    fn observer() -> Observer {
        let instance = Instance::new("nobody-serves-this").expect("the name has only allowed characters");
        Observer::new(Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset"), "test", 1000)
    }

    /// Serves until the flag is set.
    fn wait_for(stop: &AtomicBool) -> anyhow::Result<()> {
        let patience = Instant::now() + Duration::from_mins(1);
        while !stop.load(Ordering::Relaxed) {
            ensure!(Instant::now() < patience, "nothing has ended the process");
            thread::yield_now();
        }
        Ok(())
    }

    #[test]
    fn an_observer_that_panics_ends_the_process_as_failed() {
        let stop = AtomicBool::new(false);
        let mut scenes = 0;
        let show = |_| {
            scenes += 1;
            assert!(scenes < 3, "this panic is part of a test");
        };
        let error = observe_while(&observer(), &stop, show, || wait_for(&stop)).expect_err("it panicked");
        assert_eq!(error.to_string(), "the observer panicked");
    }

    #[test]
    fn a_process_that_serves_no_more_observes_no_more() {
        let (stop, scenes) = (AtomicBool::new(false), AtomicU32::new(0));
        let show = |scene: Scene| {
            assert!(scene.seen_ns > 0);
            scenes.fetch_add(1, Ordering::Relaxed);
        };
        let serve = || {
            assert!(scenes.load(Ordering::Relaxed) > 0, "there is something to show at once");
            bail!("no socket can be had")
        };
        let error = observe_while(&observer(), &stop, show, serve).expect_err("serving failed");
        assert_eq!(error.to_string(), "no socket can be had");
    }
}
