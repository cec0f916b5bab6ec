//! Tests of the shipped descriptions. If `framelock_formats` has the same format, both must have the same layout,
//! except that the longest frames of UBX differ.

use std::path::Path;

use framelock_description::{Description, SHIPPED, shipped};
use framelock_formats::layout::{Algorithm, Checksum, Table};
use framelock_formats::{
    CheckedLayout, Layout, crsf, ibus,
    mavlink::{self, ARDUPILOTMEGA},
    modbus,
    motion::{BIN, BIN_CRC8, SIX_AXES},
    nmea, rtcm, sbus, ubx,
};

/// Returns a layout without its CRC table, which does not affect the frames.
fn plain<'a>(layout: &CheckedLayout<'a>) -> Layout<'a> {
    let mut layout = layout.layout();
    if let Some(Checksum {
        algorithm: Algorithm::Crc(crc),
        ..
    }) = &mut layout.checksum
    {
        crc.table = Table::None;
    }
    layout
}

#[test]
fn a_frame_is_described_once() {
    let ubx = Layout {
        longest: 4096,
        ..ubx::LAYOUT.layout()
    }
    .checked();
    let (first, second) = (
        mavlink::layout_v1(ARDUPILOTMEGA),
        mavlink::layout_v2(ARDUPILOTMEGA),
    );
    for (name, layouts) in [
        ("bin", &[BIN][..]),
        ("bin-crc8", &[BIN_CRC8]),
        ("sbus", &[sbus::LAYOUT]),
        ("ibus", &[ibus::LAYOUT]),
        ("crsf", &[crsf::LAYOUT]),
        ("ubx", &[ubx]),
        ("nmea", &[nmea::LAYOUT]),
        ("rtcm", &[rtcm::LAYOUT]),
        ("gnss", &[ubx, nmea::LAYOUT, rtcm::LAYOUT]),
        ("mavlink", &[second, first]),
        ("mavlink1", &[first]),
        ("mavlink2", &[second]),
        ("six-axes", &[SIX_AXES]),
        ("six-axes-be", &[SIX_AXES]),
        ("modbus-rtu", &[modbus::LAYOUT]),
    ] {
        let (_, text) = SHIPPED
            .iter()
            .find(|(shipped, _)| *shipped == name)
            .unwrap();
        let described = Description::parse(name, text).unwrap();
        let described: Vec<_> = described.format().all().iter().map(plain).collect();
        let expected: Vec<_> = layouts.iter().map(plain).collect();
        assert_eq!(described, expected, "{name}");
    }
}

#[test]
fn every_file_is_shipped() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("frames");
    let files = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    let mut names: Vec<_> = SHIPPED
        .iter()
        .map(|(name, _)| format!("{name}.toml"))
        .collect();
    files.sort();
    names.sort();
    assert_eq!(files, names);
}

#[test]
fn every_message_of_the_dialects_has_one_name() {
    let mavlink2 = Description::parse("mavlink2", shipped("mavlink2").unwrap()).unwrap();
    let names = &mavlink2.kinds[0].message_names;
    let numbers = names.iter().map(|(number, _)| *number);
    let known = ARDUPILOTMEGA.iter();
    assert!(numbers.eq(known.map(|message| message.number)));
    let distinct: std::collections::HashSet<&str> = names.iter().map(|(_, name)| *name).collect();
    assert_eq!(distinct.len(), names.len());
}
