//! Two network namespaces with a virtual cable. They need root and iproute2.

use std::process::Command;

/// The two namespaces. They are deleted when this is dropped.
#[derive(Debug)]
pub(crate) struct Cable {
    /// Name of the namespace at the near end.
    pub(crate) near: String,
    /// Name of the namespace at the far end.
    pub(crate) far: String,
}

impl Cable {
    /// Endpoint of the near end.
    pub(crate) const ENDPOINT: &str = "tcp/10.99.0.1:7447";

    /// Creates the namespaces and the cable; `None` if this machine does not allow it.
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

    /// Cuts the cable ("down") or connects it again ("up").
    pub(crate) fn set(&self, state: &str) {
        assert!(ip(&format!("-netns {} link set cable {state}", self.near)), "the cable can be switched");
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
