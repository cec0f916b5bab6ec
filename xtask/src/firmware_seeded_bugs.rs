//! Bugs put into a copy of the firmware, to see that the tests find them: each is a rule of the
//! receive path left out, and names the test that is to fail.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};

use crate::bare_metal::Source;
use crate::firmware::{BUILDS, TARGET, build_image, images};
use crate::firmware_tests::run_tests;
use crate::source_copy::copy_workspace;
use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// A rule left out.
struct SeededBug {
    rule: &'static str,
    file: &'static str,
    /// This text, which is there once, is replaced by that.
    replace: [&'static str; 2],
    /// The test that finds it.
    found_by: &'static str,
}

const BUGS: &[SeededBug] = &[
    SeededBug {
        rule: "the UARTE goes on with the other half by itself",
        file: "receive.rs",
        replace: [
            "self.uarte.shorts.write(|w| w.endrx_startrx().enabled());",
            "",
        ],
        found_by: "nothing_of_a_flood_at_1_mbaud_is_lost",
    },
    SeededBug {
        rule: "a late handler is noticed",
        file: "receive.rs",
        replace: ["halves > u32::from(ended)", "halves == u32::MAX"],
        found_by: "beyond_that_losses_are_counted_and_nothing_wrong_is_put_in_force",
    },
    SeededBug {
        rule: "a tick that has just come is not slept through",
        file: "main.rs",
        replace: [" && !tick_is_due", ""],
        found_by: "a_tick_is_not_slept_through_whenever_it_comes",
    },
    SeededBug {
        rule: "an error's cause is cleared",
        file: "receive.rs",
        replace: ["w.bits(causes.bits())", "w.bits(0)"],
        found_by: "each_cause_is_counted_once",
    },
    SeededBug {
        rule: "the count is not trusted after an error",
        file: "receive.rs",
        replace: ["        self.in_doubt = true;\n", ""],
        found_by: "bytes_that_were_never_stored_are_never_taken",
    },
    SeededBug {
        rule: "the count is not trusted at an overrun",
        file: "receive.rs",
        replace: ["errors.causes.overrun().bit_is_set()", "false"],
        found_by: "bytes_in_front_of_an_overrun_are_not_taken",
    },
    SeededBug {
        rule: "a spoilt byte that was counted is not taken",
        file: "line_timers.rs",
        replace: ["since_byte < BYTE_TIME / 2", "since_byte == u32::MAX"],
        found_by: "an_error_in_a_flood_costs_one_frame",
    },
    SeededBug {
        rule: "the main loop sets the time of the next tick",
        file: "main.rs",
        replace: ["            clock.wake_at(now.wrapping_add(TICK));\n", ""],
        found_by: "a_stuck_main_loop_is_reset_by_the_watchdog_and_that_is_logged",
    },
    SeededBug {
        rule: "the watchdog is fed only if the receiver's handler runs",
        file: "watchdog.rs",
        replace: ["!due || receiver == last_receiver", "!due"],
        found_by: "a_dead_receiver_is_reset_by_the_watchdog",
    },
    SeededBug {
        rule: "a handler passes over a cell that is in use, and does not panic",
        file: "receive.rs",
        replace: [
            "if let Ok(mut reception) = RECEPTION.borrow(token).try_borrow_mut()
            && let Some(reception) = reception.as_mut()
        {",
            "if let Some(reception) = RECEPTION.borrow(token).borrow_mut().as_mut() {",
        ],
        found_by: "no_handler_can_panic",
    },
];

/// Each bug, in a copy of the sources.
pub(crate) fn run_all(workspace: &Workspace) -> Result<()> {
    let source = Source::of(&[TARGET])?;
    let copy = workspace.target_directory.join("seeded-bugs");
    let mut missed = Vec::new();
    for bug in BUGS {
        println!("\n=== Left out: {} ===", bug.rule);
        let images = build_with(workspace, &copy, &source, bug)?;
        let mut count = TestCount::default();
        let outcome = run_tests(workspace, &images, &["--exact", bug.found_by], &mut count);
        ensure!(count.executed() == 1, "there is no test `{}`", bug.found_by);
        if outcome.is_ok() {
            missed.push(format!("`{}` did not notice: {}", bug.found_by, bug.rule));
        }
    }
    if !missed.is_empty() {
        bail!("{}", missed.join("\n"));
    }
    println!("\nAll {} seeded bugs were found", BUGS.len());
    Ok(())
}

/// Images of the firmware with the bug; returns their folder.
fn build_with(
    workspace: &Workspace,
    copy: &Path,
    source: &Source,
    bug: &SeededBug,
) -> Result<PathBuf> {
    // The firmware is a workspace of its own.
    copy_workspace(&workspace.root, copy, &["core", "firmware"], &["core"])?;

    let file = copy.join("firmware/src").join(bug.file);
    let text = std::fs::read_to_string(&file)?;
    let [original, changed] = bug.replace;
    ensure!(
        text.matches(original).count() == 1,
        "{} has changed: {original:?} is not there once",
        bug.file
    );
    std::fs::write(&file, text.replace(original, changed))?;
    for build in BUILDS.iter().filter(|build| build.tested_for_bugs) {
        build_image(workspace, copy, source, build)?;
    }
    Ok(images(workspace, copy))
}
