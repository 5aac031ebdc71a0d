//! Whether this program can read what is on the bus.

use bench_dragon_ipc::ServiceLayout;

use super::{Check, Finding, Patient};

/// The services' layouts.
pub(super) struct Services;

impl Check for Services {
    fn name(&self) -> &'static str {
        "services"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        match patient.census() {
            Ok(census) => judge(&census.services),
            Err(_) => Finding::not_known("the directory cannot be looked at"),
        }
    }
}

fn judge(services: &[ServiceLayout]) -> Finding {
    let value = services.len().to_string();
    if services.is_empty() {
        return Finding::ok(value, "none are there");
    }
    let differing =
        services.iter().filter(|service| !service.agrees()).map(|ServiceLayout { service, found, expected }| {
            let found = found.as_ref().unwrap_or_else(|reason| reason);
            format!("{service} is {found}, this program's is {expected}")
        });
    match differing.collect::<Vec<_>>().join("; ") {
        none if none.is_empty() => Finding::ok(value, "all have this program's layouts"),
        differing => Finding::problem(
            value,
            differing,
            "run the same version of bench-dragon on both sides: `bench-dragon ctl stop`, then start it again",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn another_layout_is_named_beside_ours() {
        let service = ServiceLayout {
            service: "bench-dragon/status",
            found: Ok("Status.v9 of 8 bytes".to_owned()),
            expected: "Status.v1 of 80 bytes".to_owned(),
        };
        let finding = judge(&[service]);
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(
            finding.message,
            "bench-dragon/status is Status.v9 of 8 bytes, this program's is Status.v1 of 80 bytes"
        );
    }
}
