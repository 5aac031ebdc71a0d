//! Files of other users that have names as ours have.

use bench_dragon_ipc::{Census, ForeignFile};

use super::{Check, Finding, Patient};

/// Foreign files.
pub(super) struct Foreign;

impl Check for Foreign {
    fn name(&self) -> &'static str {
        "foreign files"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        match patient.census() {
            Ok(census) => judge(census),
            Err(_) => Finding::not_known("the directory cannot be looked at"),
        }
    }
}

fn judge(census: &Census) -> Finding {
    let value = census.foreign.len().to_string();
    let Some(ForeignFile { path, owner }) = census.foreign.first() else { return Finding::ok(value, "none") };
    let noun = if census.foreign.len() == 1 { "file" } else { "files" };
    Finding::ok(
        &value,
        format!(
            "{value} {noun} of other users with this instance's prefix, in nobody's way: {:?} of user {owner} is one; its \
             owner or root can remove it",
            path.to_string_lossy()
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn a_foreign_file_is_named_with_its_owner_and_needs_no_remedy() {
        let foreign = vec![ForeignFile { path: "/dev/shm/bd_0_dragon_junk".into(), owner: 4711 }];
        let finding = judge(&Census { foreign, ..Census::default() });
        assert_eq!((finding.status, finding.remedy), (Verdict::Ok, None));
        assert!(finding.message.contains("\"/dev/shm/bd_0_dragon_junk\" of user 4711"), "{}", finding.message);
    }
}
