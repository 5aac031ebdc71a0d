//! The alerts that are listed.

use bench_dragon_ipc::{Alert, AlertKind};

/// All alerts, all but those of near pairs, or those of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum AlertFilter {
    #[default]
    All,
    NotNear,
    Only(AlertKind),
}

impl AlertFilter {
    const IN_ORDER: [Self; 7] = [
        Self::All,
        Self::NotNear,
        Self::Only(AlertKind::Contact),
        Self::Only(AlertKind::Near),
        Self::Only(AlertKind::Held),
        Self::Only(AlertKind::Fault),
        Self::Only(AlertKind::Restarted),
    ];

    /// The next one; after the last one all alerts again.
    pub(super) fn next(self) -> Self {
        let at = Self::IN_ORDER.iter().position(|filter| *filter == self).unwrap_or_default();
        Self::IN_ORDER[(at + 1) % Self::IN_ORDER.len()]
    }

    pub(super) fn takes(self, alert: &Alert) -> bool {
        match self {
            Self::All => true,
            Self::NotNear => alert.alert_kind() != Some(AlertKind::Near),
            Self::Only(kind) => alert.alert_kind() == Some(kind),
        }
    }

    /// What is listed, behind the number of all; nothing where that is all of them.
    pub(super) fn words(self) -> String {
        match self {
            Self::All => String::new(),
            Self::NotNear => ", without near".to_owned(),
            Self::Only(kind) => format!(", {kind} only"),
        }
    }
}
