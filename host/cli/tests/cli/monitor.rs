//! Tests of `framelock monitor` as a process, with a pipe and a serial line.

use std::io::{BufRead, BufReader, Write};

use crate::process::{CLEAN, complaint, shown, start};
use crate::pseudo_terminal::line;

#[test]
fn a_stream_is_reported_at_its_end() {
    let report = shown(&["monitor", "-"], CLEAN.repeat(3));
    let (state, fields) = ("LOCKED ", "   pitch 127   roll 200   yaw  74\n");
    assert!(
        report.starts_with(state) && report.ends_with(fields),
        "{report}"
    );
    assert_eq!(report.lines().count(), 1);
}

#[test]
fn a_port_is_reported_each_second_until_it_is_gone() {
    let (mut far_end, _near_end, port) = line();
    let mut child = start(&["monitor", &port]);
    let mut reports = BufReader::new(child.stdout.take().unwrap()).lines();
    // The first report shows that the port is open.
    let silent = reports.next().unwrap().unwrap();
    assert!(
        silent.starts_with("SILENT ") && silent.ends_with("PARKED 128,128,128: no frames"),
        "{silent}"
    );
    far_end.write_all(&CLEAN).unwrap();
    assert!(reports.any(|report| report.unwrap().starts_with("LOCKED ")));
    drop(far_end);
    reports.for_each(drop);
    let error = complaint(child.wait_with_output().unwrap());
    let gone = format!("cannot read {port} after byte 7: the serial port is gone");
    assert!(error.contains(&gone), "{error}");
}
