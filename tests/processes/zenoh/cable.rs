//! Two network namespaces with a cable between them, which takes root and iproute2.

use std::process::Command;

/// Both namespaces, which go when this does.
#[derive(Debug)]
pub(crate) struct Cable {
    /// Name of the namespace at the near end.
    pub(crate) near: String,
    /// Name of the one at the far end.
    pub(crate) far: String,
}

impl Cable {
    /// Where the near end is reached.
    pub(crate) const ENDPOINT: &str = "tcp/10.99.0.1:7447";

    /// `None` where this machine does not allow it.
    pub(crate) fn lay() -> Option<Self> {
        let name = |side: &str| format!("bd-{}-{side}", std::process::id());
        let cable = Self { near: name("near"), far: name("far") };
        let (near, far) = (&cable.near, &cable.far);
        let laid = [
            format!("netns add {near}"),
            format!("netns add {far}"),
            format!("-netns {near} link add cable type veth peer name cable netns {far}"),
            format!("-netns {near} address add 10.99.0.1/24 dev cable"),
            format!("-netns {far} address add 10.99.0.2/24 dev cable"),
            format!("-netns {near} link set cable up"),
            format!("-netns {far} link set cable up"),
        ];
        laid.iter().all(|line| ip(line)).then_some(cable)
    }

    /// Cuts it ("down") or joins it again ("up").
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
