//! Threads that work behind the window step back: the window draws first.

/// Niceness of threads that render or calibrate, 0 (the window's) to 19.
#[cfg(target_os = "linux")]
const NICE: i32 = 10;

/// Lowers the priority of the calling thread, and of those it starts from now on, below that of the window, which shares the
/// processors with them: a software adapter draws on them too. Elsewhere than on Linux, where priorities belong to
/// processes, nothing happens.
pub fn step_back() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{getpriority_process, setpriority_process};
        let thread = Some(rustix::thread::gettid());
        // A refusal costs smoothness, nothing else.
        if getpriority_process(thread).is_ok_and(|nice| nice < NICE) {
            let _ = setpriority_process(thread, NICE);
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use rustix::{process::getpriority_process, thread::gettid};

    #[test]
    fn a_thread_and_those_it_starts_step_back_and_others_do_not() {
        let nice = || getpriority_process(Some(gettid())).expect("a thread has a priority");
        let before = nice();
        let behind = std::thread::spawn(move || {
            step_back();
            (nice(), std::thread::spawn(nice).join().expect("joined"))
        });
        let wanted = before.max(NICE);
        assert_eq!(behind.join().expect("joined"), (wanted, wanted));
        assert_eq!(nice(), before);
    }
}
