//! The library's own layouts: those of `framelock_formats`.
#![allow(non_upper_case_globals, reason = "the names are for C")]

use framelock_formats::{
    crsf, ibus,
    mavlink::{self, ARDUPILOTMEGA, COMMON},
    motion::{BIN, BIN_CRC8, SIX_AXES},
    nmea, rtcm, sbus, ubx,
};

use crate::layout::{framelock_layout, framelock_shipped_layout as Shipped};

/// BIN: 'A' 'B' reserved pitch roll yaw CR.
#[unsafe(no_mangle)]
pub static framelock_bin_layout: framelock_layout = shipped(&Shipped(BIN));
/// BIN-CRC8: 'A' 'B' reserved pitch roll yaw crc CR.
#[unsafe(no_mangle)]
pub static framelock_bin_crc8_layout: framelock_layout = shipped(&Shipped(BIN_CRC8));
/// Six axes of 16 bits, in either byte order.
#[unsafe(no_mangle)]
pub static framelock_six_axes_layout: framelock_layout = shipped(&Shipped(SIX_AXES));
/// Futaba's sbus::LAYOUT.
#[unsafe(no_mangle)]
pub static framelock_sbus_layout: framelock_layout = shipped(&Shipped(sbus::LAYOUT));
/// FlySky's iBUS, the frames for servos.
#[unsafe(no_mangle)]
pub static framelock_ibus_layout: framelock_layout = shipped(&Shipped(ibus::LAYOUT));
/// crsf::LAYOUT, of TBS and ExpressLRS.
#[unsafe(no_mangle)]
pub static framelock_crsf_layout: framelock_layout = shipped(&Shipped(crsf::LAYOUT));
/// u-blox's ubx::LAYOUT. `longest` is the protocol's, 65543: make it what the messages need that you switch on.
#[unsafe(no_mangle)]
pub static framelock_ubx_layout: framelock_layout = shipped(&Shipped(ubx::LAYOUT));
/// nmea::LAYOUT 0183.
#[unsafe(no_mangle)]
pub static framelock_nmea_layout: framelock_layout = shipped(&Shipped(nmea::LAYOUT));
/// rtcm::LAYOUT 3.
#[unsafe(no_mangle)]
pub static framelock_rtcm_layout: framelock_layout = shipped(&Shipped(rtcm::LAYOUT));
/// MAVLink 1, with the messages of the dialect `common`.
#[unsafe(no_mangle)]
pub static framelock_mavlink1_common_layout: framelock_layout =
    shipped(&Shipped(mavlink::layout_v1(COMMON)));
/// MAVLink 1, with the messages of the dialects `common` and `ardupilotmega`.
#[unsafe(no_mangle)]
pub static framelock_mavlink1_ardupilotmega_layout: framelock_layout =
    shipped(&Shipped(mavlink::layout_v1(ARDUPILOTMEGA)));
/// MAVLink 2, with the messages of the dialect `common`.
#[unsafe(no_mangle)]
pub static framelock_mavlink2_common_layout: framelock_layout =
    shipped(&Shipped(mavlink::layout_v2(COMMON)));
/// MAVLink 2, with the messages of the dialects `common` and `ardupilotmega`.
#[unsafe(no_mangle)]
pub static framelock_mavlink2_ardupilotmega_layout: framelock_layout =
    shipped(&Shipped(mavlink::layout_v2(ARDUPILOTMEGA)));

const fn shipped(layout: &'static Shipped) -> framelock_layout {
    framelock_layout {
        longest: layout.0.longest(),
        shipped: Some(layout),
        ..framelock_layout::NONE
    }
}
