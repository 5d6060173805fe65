//! How long a server is waited for, and how often it is asked again.

use std::time::Duration;

/// Time-outs and retries of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For a connection.
    pub connect: Duration,
    /// For the head of an answer.
    pub answer: Duration,
    /// For the next bytes.
    pub silence: Duration,
    /// Attempts that bring nothing new, before a server is given up.
    pub attempts: u32,
    /// Before the second attempt; each further one waits twice as long, up to a minute.
    pub first_wait: Duration,
}

impl Default for Patience {
    /// 20 s for a connection, 60 s for an answer and between bytes, five attempts, the second after a second.
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(20),
            answer: Duration::from_secs(60),
            silence: Duration::from_secs(60),
            attempts: 5,
            first_wait: Duration::from_secs(1),
        }
    }
}

/// Longest wait between two attempts, whatever a server asks for.
const LONGEST_WAIT: Duration = Duration::from_secs(60);

impl Patience {
    /// How long to wait after a number of attempts in vain, where the server asks for some time or for none.
    pub(super) fn wait(&self, failed: u32, asked: Option<Duration>) -> Duration {
        let doubled = self.first_wait.saturating_mul(1 << failed.saturating_sub(1).min(16));
        asked.unwrap_or(doubled).max(self.first_wait).min(LONGEST_WAIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_a_minute_and_a_server_may_ask_for_longer() {
        let patience = Patience::default();
        let waits: Vec<u64> = (1..9).map(|failed| patience.wait(failed, None).as_secs()).collect();
        assert_eq!(waits, [1, 2, 4, 8, 16, 32, 60, 60]);
        assert_eq!(patience.wait(1, Some(Duration::from_secs(20))).as_secs(), 20);
        assert_eq!(patience.wait(1, Some(Duration::from_secs(3600))).as_secs(), 60);
        assert_eq!(patience.wait(1, Some(Duration::ZERO)).as_secs(), 1);
        assert_eq!(patience.wait(u32::MAX, None).as_secs(), 60);
    }
}
