//! Two network namespaces with a cable between them.

use std::process::Command;

/// Both namespaces, which go when this does.
#[derive(Debug)]
pub(crate) struct Cable {
    pub(crate) near: String,
    pub(crate) far: String,
}

impl Cable {
    /// Where the near end is reached.
    pub(crate) const ENDPOINT: &str = "tcp/10.99.1.1:7447";

    /// `None` where this machine does not allow it.
    #[allow(clippy::print_stdout, reason = "a bench prints")]
    pub(crate) fn lay() -> Option<Self> {
        let name = |side: &str| format!("bd-bench-{}-{side}", std::process::id());
        let cable = Self { near: name("near"), far: name("far") };
        let (near, far) = (&cable.near, &cable.far);
        let laid = [
            format!("netns add {near}"),
            format!("netns add {far}"),
            format!("-netns {near} link add cable type veth peer name cable netns {far}"),
            format!("-netns {near} address add 10.99.1.1/24 dev cable"),
            format!("-netns {far} address add 10.99.1.2/24 dev cable"),
            format!("-netns {near} link set cable up"),
            format!("-netns {far} link set cable up"),
        ];
        if laid.iter().all(|line| ip(line)) {
            return Some(cable);
        }
        println!("no network namespaces here, they take root and iproute2: nothing is measured over a cable");
        None
    }

    pub(crate) fn set(&self, state: &str) {
        assert!(ip(&format!("-netns {} link set cable {state}", self.near)), "the cable is ours");
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for namespace in [&self.near, &self.far] {
            ip(&format!("netns delete {namespace}"));
        }
    }
}

fn ip(line: &str) -> bool {
    Command::new("ip").args(line.split(' ')).output().is_ok_and(|output| output.status.success())
}
