//! Tests in a browser of the behaviour that users of the page rely on.
//!
//! `FRAMELOCK_PICTURES=docs cargo xtask verify --only web` also takes the README's pictures of the
//! page.

use std::fs;
use std::path::Path;
use std::process::Command;

use framelock_limited::RunToEnd as _;
use framelock_web_browser::{Page, built};
use serde_json::{Value, json};

/// The address of the page's first preset, the deaf machine.
const DEAF: &str = "frame=bin&payload=00414200&edits=21d";

/// Opens each preset by clicking its button, and calls `check` with the preset's name.
fn each_preset(page: &Page, mut check: impl FnMut(&str)) {
    let names: Vec<String> = page.read(
        "[...document.querySelectorAll('#presets button')].map((button) => button.textContent)",
    );
    assert!(names.len() >= 7, "{names:?}");
    for (nth, name) in names.iter().enumerate() {
        let button = format!("document.querySelectorAll('#presets button')[{nth}]");
        page.run(&format!("{button}.click()"));
        page.wait_for(&format!("{button}.ariaPressed === 'true'"));
        // The preset may be playing.
        page.run("if (JSON.parse(framelock()).playing) document.getElementById('play').click()");
        check(name);
    }
}

/// Waits until the page has updated its address, which takes a moment. Returns the part of the address after the #.
fn address(page: &Page) -> String {
    page.wait_for("location.hash.slice(1) === JSON.parse(framelock()).address");
    page.read("location.hash.slice(1)")
}

/// Compares the page's state with the views that the same code returns outside the browser, except their cells. Goes
/// from the last position to the first, in steps of 31.
#[test]
fn each_preset_shows_what_the_machines_do() {
    for page in Page::in_each(DEAF) {
        each_preset(&page, |name| {
            let views = Command::new(built("FRAMELOCK_VIEWS"))
                .arg(address(&page))
                .run_to_end(b"")
                .expect("the command ends");
            let views = String::from_utf8(views.stdout).expect("text");
            let views: Vec<&str> = views.lines().collect();
            assert!(views.len() > 32, "{name}");
            for (position, view) in views.into_iter().enumerate().rev().step_by(31) {
                let state = page.go(position);
                // Read the view through JavaScript too, which writes 1.0 as 1.
                let view: Value = page.read(&format!("({view})"));
                for (key, expected) in view.as_object().expect("an object") {
                    if key != "cells" {
                        assert_eq!(state[key], *expected, "{name}: {key} at {position}");
                    }
                }
            }
        });
    }
}

#[test]
fn an_address_shows_exactly_that_moment() {
    let (page, other) = (Page::at(DEAF), Page::none());
    for (scenario, position) in [
        (DEAF, 0),
        (DEAF, 150),
        (
            "frame=bin&bytes=4142007FC84A0D41420082C44A0D&edits=3d.4d",
            9,
        ),
        ("frame=bin-crc8&edits=22d.90f04&idle=on", 222),
        ("frame=crsf&edits=22d.30i41.31i0D.33f04", 330),
    ] {
        page.open(scenario);
        let before = page.go(position);
        assert_eq!(before["error"], "", "{scenario}");
        let address = address(&page);
        other.open(&address);
        assert_eq!(other.state(), before, "{address}");
        assert_eq!(before["position"], position);
    }
}

#[test]
fn the_keyboard_is_enough() {
    for page in Page::in_each("frame=bin&frames=20") {
        let position = || page.read::<u64>("JSON.parse(framelock()).position");
        let focus = || {
            page.read::<String>(
                "document.activeElement.ariaLabel || document.activeElement.textContent",
            )
        };
        page.press(" ");
        page.wait_for("JSON.parse(framelock()).position > 3");
        page.press(" ");
        assert_eq!(page.state()["playing"], false);
        let was = position();
        page.press("ArrowRight");
        page.press("ArrowRight");
        page.press("ArrowLeft");
        assert_eq!(position(), was + 1);
        page.press("Home");
        assert_eq!(position(), 0);

        let mut passed = Vec::new();
        while !focus().starts_with("byte ") {
            passed.push(focus());
            assert!(
                passed.len() < 50,
                "Tab never reached the bytes, only: {passed:?}"
            );
            page.press("Tab");
        }
        page.press("ArrowRight");
        page.press("ArrowRight");
        assert!(focus().starts_with("byte 3: 00"), "{}", focus());
        let was = page.state();
        page.press("Delete");
        page.wait_for("JSON.parse(framelock()).address.endsWith('&edits=2d')");
        page.wait_for("document.activeElement.ariaLabel?.startsWith('byte 3: ')");
        assert!(focus().contains("lost"), "{}", focus());

        page.press("Enter");
        assert_eq!(focus(), "Do not drop");
        page.press("Enter");
        page.wait_for("document.activeElement.ariaLabel?.startsWith('byte 3: 00, as sent')");
        let mut is = page.state();
        // Do not compare the addresses, because the new address contains both edits.
        is["address"] = was["address"].clone();
        assert_eq!(is, was);
    }
}

#[test]
fn a_deaf_machine_says_that_it_has_no_frames() {
    for page in Page::in_each(&format!("{DEAF}&at=312")) {
        let reasons: [String; 2] =
            page.read("[...document.querySelectorAll('.reason')].map((it) => it.textContent)");
        assert_eq!(reasons, ["Parked: no frames"; 2]);
    }
}

#[test]
fn bytes_are_played_when_they_are_sent() {
    for page in Page::in_each(DEAF) {
        page.run(
            "document.getElementById('own').value = '0x41,0x42,0x00,0x7F,0xC8,0x4A,0x0D';
            document.getElementById('send').click()",
        );
        page.wait_for("JSON.parse(framelock()).position === 7");
        assert_eq!(page.state()["machines"][0]["tally"]["delivered"], 1);
    }
}

#[test]
fn the_actuators_are_visible_on_a_laptop() {
    for page in Page::in_each(DEAF) {
        page.resize(1280, 900);
        let bottoms: [u32; 2] = page.read(
            "[...document.querySelectorAll('.axes svg')].map((svg) => Math.ceil(svg.getBoundingClientRect().bottom))",
        );
        assert!(bottoms.iter().all(|bottom| *bottom <= 900), "{bottoms:?}");
    }
}

#[test]
fn every_control_has_a_name() {
    let page = Page::at(&format!("{DEAF}&at=60"));
    page.run("document.querySelector('.cell:not(:disabled)').click()");
    let controls: usize = page.read(
        "[...document.querySelectorAll('button, input, select, textarea, summary')]
            .filter((control) => control.checkVisibility()).length",
    );
    let is_control = |role: &str| {
        #[rustfmt::skip]
        let controls = [
            "button", "checkbox", "combobox", "searchbox", "slider", "spinbutton", "textbox", "disclosuretriangle",
        ];
        controls.contains(&role.to_lowercase().as_str())
    };
    let accessible = page.accessible();
    let named = accessible
        .iter()
        .filter(|(role, name)| is_control(role) && !name.trim().is_empty());
    assert_eq!(named.count(), controls, "{accessible:?}");
}

/// Replaces a text in the description by typing, as a user does.
fn describe(page: &Page, from: &str, to: &str) {
    let [from, to] = [from, to].map(|text| json!(text));
    page.run(&format!(
        "{{ const area = document.getElementById('description');
        area.focus();
        const at = area.value.indexOf({from});
        area.setSelectionRange(at, at + {from}.length);
        document.execCommand('insertText', false, {to}); }}"
    ));
}

#[test]
fn users_can_type_their_own_frame() {
    for page in Page::in_each("frame=own&bytes=AA550601E8032C01151D14&at=11") {
        let field = |nth: usize| page.state()["machines"][0]["fields"][nth].clone();
        assert_eq!(field(1), json!(["position", "10.00", "deg"]));

        // A mistake is reported while the user types, and the page keeps the last valid frames.
        describe(&page, "0.01", "'much'");
        page.wait_for("document.querySelector('#description[aria-invalid=true]')");
        let problem: String = page.read("JSON.parse(framelock()).problem");
        assert!(problem.starts_with("Line 12, column "), "{problem}");
        assert_eq!(field(1), json!(["position", "10.00", "deg"]));

        describe(&page, "'much'", "0.1");
        page.wait_for("document.querySelector('#description[aria-invalid=false]')");
        assert_eq!(field(1), json!(["position", "100.0", "deg"]));
        let focus: String = page.read("document.activeElement.id");
        assert_eq!(focus, "description", "the description keeps the focus");

        // The address contains the description.
        let other = Page::at(&address(&page));
        assert_eq!(other.state()["machines"], page.state()["machines"]);

        // A shipped description can be changed too. It then becomes the user's own.
        page.open("frame=crsf&at=20");
        page.run("document.querySelector('summary').click()");
        describe(&page, "longest = 64", "longest = 32");
        page.wait_for("JSON.parse(framelock()).address.includes('frame=own')");
        assert_eq!(page.state()["problem"], "The description is valid.");
    }
}

#[test]
fn every_frame_format_can_be_chosen() {
    for page in Page::in_each(DEAF) {
        let names: Vec<String> = page.read(
            "[...document.querySelector('[data-key=frame]').options].map((option) => option.value)",
        );
        assert!(names.len() >= 15, "{names:?}");
        for name in names {
            page.run(&format!(
                "{{ const select = document.querySelector('[data-key=frame]');
                select.value = '{name}';
                select.dispatchEvent(new Event('change')); }}"
            ));
            page.press("End");
            let state = page.state();
            assert_eq!(state["error"], "", "{name}");
            assert!(address(&page).starts_with(&format!("frame={name}")));
            let machines = state["machines"].as_array().expect("a list");
            assert_eq!(
                machines[machines.len() - 1]["status"],
                "LISTENING",
                "{name}"
            );
        }
    }
}

#[test]
fn nothing_scrolls_sideways_on_a_small_screen() {
    for page in Page::in_each(DEAF) {
        page.resize(360, 740);
        each_preset(&page, |name| {
            page.press("End");
            page.run("document.querySelector('.cell:not(:disabled)').click()");
            let widest: u32 = page.read("document.documentElement.scrollWidth");
            assert!(widest <= 360, "{name}: {widest}");
        });
    }
}

#[test]
fn reduced_motion_stops_playback_and_animation() {
    let page = Page::none();
    let moving = "getComputedStyle(document.querySelector('.leg')).transitionDuration !== '0s'";
    for (wish, moves) in [("no-preference", true), ("reduce", false)] {
        page.prefer("prefers-reduced-motion", wish);
        page.open("");
        let state = page.state();
        let has_begun = state["playing"] == true || state["position"] != 0;
        assert_eq!(has_begun, moves, "{wish}");
        assert_eq!(page.read::<bool>(moving), moves, "{wish}");
    }
}

#[test]
fn the_page_follows_the_systems_colour_scheme() {
    let page = Page::at(&format!("{DEAF}&at=48"));
    page.resize(1200, 826);
    let colours = ["light", "dark"].map(|scheme| {
        page.prefer("prefers-color-scheme", scheme);
        if let Some(folder) = std::env::var_os("FRAMELOCK_PICTURES") {
            let file = Path::new(&folder).join(format!("page-{scheme}.png"));
            fs::write(file, page.picture()).expect("the picture is writable");
        }
        let brightness = |of: &str| {
            let colour: [u32; 3] = page.read(&format!(
                "getComputedStyle(document.body).{of}.match(/\\d+/g).slice(0, 3).map(Number)"
            ));
            colour.into_iter().sum::<u32>()
        };
        (brightness("color"), brightness("backgroundColor"))
    });
    let [(ink, paper), (light_ink, dark_paper)] = colours;
    assert!(
        paper > ink + 300 && light_ink > dark_paper + 300,
        "{colours:?}"
    );
}
