//! Services that a server began to make when it was killed.

use bench_dragon_ipc::Census;

use super::{Check, Finding, Patient};

/// Half-made services.
pub(super) struct HalfMade;

impl Check for HalfMade {
    fn name(&self) -> &'static str {
        "half-made services"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        match patient.census() {
            Ok(census) => judge(census, &patient.fix()),
            Err(_) => Finding::not_known("the directory cannot be looked at"),
        }
    }
}

fn judge(census: &Census, fix: &str) -> Finding {
    let Census { half_made, source, .. } = census;
    let value = half_made.len().to_string();
    match (half_made.as_slice(), source) {
        ([], _) => Finding::ok(value, "none"),
        (_, Some(pid)) => Finding::ok(value, format!("the server, pid {pid}, is making its services")),
        ([first, ..], None) => Finding::problem(
            value,
            format!("a server was killed while it made {}: clients fail at it", first.display()),
            format!("{fix}, or start a server, which removes it"),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn a_half_made_service_is_a_problem_unless_its_maker_lives() {
        let mut census = Census { half_made: vec!["/run/a.service".into()], ..Census::default() };
        let finding = judge(&census, "fix it");
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(finding.remedy.as_deref(), Some("fix it, or start a server, which removes it"));
        census.source = Some(5);
        assert_eq!(judge(&census, "fix it").status, Verdict::Ok);
    }
}
