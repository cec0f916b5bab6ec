//! Checks every state and every byte: the lecture's machine follows the lecture's table.

use framelock::lecture::{Lecture, State};
use framelock::motion::Setpoint;

/// A row of the table: state, byte (`None`: any other), next state, index of the temporary setpoint that is stored (0
/// pitch, 1 roll, 2 yaw), and whether the setpoints are committed (the lecture says implemented).
type Row = (State, Option<u8>, State, Option<usize>, bool);

/// The lecture's table.
#[rustfmt::skip]
const TABLE: [Row; 10] = [
    //  state             byte         next               stored   implemented
    (State::SyncA,      Some(0x41), State::SyncB,      None,    false),
    (State::SyncA,      None,       State::SyncA,      None,    false),
    (State::SyncB,      Some(0x42), State::Reserved,   None,    false),
    (State::SyncB,      None,       State::SyncA,      None,    false),
    (State::Reserved,   None,       State::Pitch,      None,    false),
    (State::Pitch,      None,       State::Roll,       Some(0), false),
    (State::Roll,       None,       State::Yaw,        Some(1), false),
    (State::Yaw,        None,       State::Terminator, Some(2), false),
    (State::Terminator, Some(0x0D), State::SyncA,      None,    true),
    (State::Terminator, None,       State::SyncA,      None,    false),
];

#[test]
fn every_row_of_the_lectures_table() {
    let mut rows_used = [false; TABLE.len()];
    for temp in [
        Setpoint::default(),
        Setpoint::from([0x7F, 0xC8, 0x4A]),
        Setpoint::from(*b"AB\r"),
    ] {
        for state in State::ALL {
            for byte in 0..=u8::MAX {
                let row = TABLE
                    .iter()
                    .position(|row| row.0 == state && row.1.is_none_or(|wanted| wanted == byte))
                    .expect("the table is total");
                rows_used[row] = true;
                let (_, _, next, stored, implemented) = TABLE[row];
                let mut expected: [u8; 3] = temp.into();
                if let Some(axis) = stored {
                    expected[axis] = byte;
                }
                let mut machine = Lecture { state, temp };
                let setpoint = machine.push(byte);
                assert_eq!(machine.state, next, "{state} {byte:02X}");
                assert_eq!(machine.temp, expected.into(), "{state} {byte:02X}");
                assert_eq!(setpoint, implemented.then_some(temp), "{state} {byte:02X}");
            }
        }
    }
    assert_eq!(rows_used, [true; TABLE.len()]);
}

#[test]
fn states_are_named_and_ordered_as_in_the_lecture() {
    let names = State::ALL.map(|state| state.to_string());
    assert_eq!(names, ["A", "B", "1", "2", "3", "4", "CR"]);
    assert_eq!(
        State::ALL.map(|state| state as usize),
        [0, 1, 2, 3, 4, 5, 6]
    );
    assert_eq!(format!("{:>3}", State::Terminator), " CR");
    assert_eq!(Lecture::default(), Lecture::new());
}

/// A reset makes the machine forget the incomplete frame and the temporary setpoints.
#[test]
fn a_reset_leads_to_the_state_at_reset_from_every_state() {
    for state in State::ALL {
        let mut machine = Lecture {
            state,
            temp: Setpoint::from([0x7F, 0xC8, 0x4A]),
        };
        machine.reset();
        assert_eq!(machine, Lecture::new(), "{state}");
    }
}
