//! Long work, done while other Python threads run and ended when the user interrupts.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors;

/// How often Python is asked whether the user interrupted.
const PATIENCE: Duration = Duration::from_millis(50);
/// Stack of the thread that works, as large as that of a program's first thread.
const STACK_BYTES: usize = 8 << 20;

/// The process that loaded this library.
static LOADED_BY: OnceLock<u32> = OnceLock::new();

/// Remembers the process that loads this library.
pub(crate) fn loaded() {
    LOADED_BY.get_or_init(process::id);
}

/// Does work where it finds threads.
///
/// A process that was forked, as loaders of data are, has none of the threads that its parent's work was shared among, and
/// would wait for them for ever; there work has a thread of its own, and leaves the cores to the processes beside it.
pub(crate) fn among_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if LOADED_BY.get().is_none_or(|process| *process == process::id()) {
        return work();
    }
    match rayon::ThreadPoolBuilder::new().num_threads(1).stack_size(STACK_BYTES).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

/// Tells work that it is no longer wanted.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    interrupted: AtomicBool,
}

/// What work unwinds with that nobody wants any more.
struct Interrupted;

impl Watch {
    /// Whether the work is still wanted.
    pub(crate) fn goes_on(&self) -> bool {
        !self.interrupted.load(Ordering::Relaxed)
    }

    /// Leaves work that is no longer wanted, from wherever it tells its progress: what it was making is dropped on the way.
    pub(crate) fn progress(&self) {
        if !self.goes_on() {
            // Not a panic: no hook runs, and `run` expects it.
            resume_unwind(Box::new(Interrupted));
        }
    }
}

/// Does work on a thread of its own, without the interpreter's lock.
///
/// An interrupt (Ctrl-C) raises `KeyboardInterrupt` as soon as the work looks at its watch. A panic becomes an
/// `open_structure.InternalError`.
pub(crate) fn run<T: Send, E: Send>(
    py: Python<'_>,
    raise: impl FnOnce(E) -> PyErr,
    work: impl FnOnce(&Watch) -> Result<T, E> + Send,
) -> PyResult<T> {
    let watch = Watch::default();
    let (result, interrupt) = py.detach(|| side_by_side(&watch, work));
    if let Some(interrupt) = interrupt {
        return Err(interrupt);
    }
    match result {
        Ok(result) => result.map_err(raise),
        Err(panic) => Err(errors::internal(&message(panic.as_ref()))),
    }
}

type Joined<T> = Result<T, Box<dyn Any + Send>>;

/// What the work gave, and what Python raised meanwhile.
fn side_by_side<T: Send, E: Send>(
    watch: &Watch,
    work: impl FnOnce(&Watch) -> Result<T, E> + Send,
) -> (Joined<Result<T, E>>, Option<PyErr>) {
    let (done, wait) = sync_channel::<()>(0);
    thread::scope(|scope| {
        let worker = move || {
            let _done = done;
            catch_unwind(AssertUnwindSafe(|| among_threads(|| work(watch))))
        };
        let worker = match thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, worker) {
            Ok(worker) => worker,
            Err(cause) => {
                let panic: Box<dyn Any + Send> = Box::new(format!("no thread: {cause}"));
                return (Err(panic), None);
            }
        };
        let mut interrupt = None;
        while wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            // Once is enough: the work is left as soon as it can be.
            if interrupt.is_none() {
                interrupt = Python::attach(|py| py.check_signals().err());
                watch.interrupted.store(interrupt.is_some(), Ordering::Relaxed);
            }
        }
        (worker.join().and_then(|result| result), interrupt)
    })
}

/// The words of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
    words
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned())
}
