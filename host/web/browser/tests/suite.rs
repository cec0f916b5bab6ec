//! Tests in a browser of the behaviour that users of the page rely on.
//!
//! `FRAMELOCK_PICTURES=docs cargo xtask verify --only web` also takes the README's pictures of the
//! page.

use std::fs;
use std::path::Path;
use std::process::Command;

use framelock_limited::RunToEnd as _;
use framelock_web_browser::{GO, Page, built};
use serde_json::{Value, json};

/// The address of the page's first preset, the deaf machine.
const DEAF: &str = "frame=bin&payload=00414200&edits=21d";

/// Opens each preset by clicking its button, and calls `check` with the preset's name.
fn each_preset(page: &Page, mut check: impl FnMut(&str)) {
    let names = page.run(
        "[...document.querySelectorAll('#presets button')].map((button) => button.textContent)",
    );
    let names = names.as_array().expect("a list");
    assert!(names.len() >= 7, "{names:?}");
    for (nth, name) in names.iter().enumerate() {
        let button = format!("document.querySelectorAll('#presets button')[{nth}]");
        page.run(&format!("{button}.click()"));
        page.wait_for(&format!("{button}.ariaPressed === 'true'"));
        // The preset is playing, or playback has already stopped at the first fault.
        page.run("if (JSON.parse(framelock()).playing) document.getElementById('play').click()");
        check(name.as_str().expect("a name"));
    }
}

/// Returns the bytes that arrive. The page shows only a part of the line at a time, so the script
/// collects the parts.
fn received(page: &Page) -> Vec<u8> {
    let bytes = page.run(&format!(
        "{{ {GO}
        const cells = new Map();
        const {{ bytes }} = JSON.parse(framelock());
        while (cells.size < bytes) for (const cell of go(cells.size).cells) cells.set(cell.place, cell.received);
        [...cells.values()].filter((byte) => byte !== null) }}"
    ));
    serde_json::from_value(bytes).expect("bytes")
}

fn number(value: &Value) -> u64 {
    value
        .as_u64()
        .unwrap_or_else(|| panic!("{value} is not a number"))
}

fn list(value: &Value) -> &[Value] {
    value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is not a list"))
}

/// Runs the command line with these bytes as its input. Returns its output.
fn output(arguments: &[&str], bytes: &[u8]) -> String {
    let mut command = Command::new(built("FRAMELOCK"));
    let output = command.args(arguments).run_to_end(bytes);
    let output = output.expect("the command ends");
    assert!(output.status.success(), "{arguments:?}: {}", output.status);
    String::from_utf8(output.stdout).expect("the output is text")
}

/// Returns the last line of the command line's output, as JSON.
fn last_object(arguments: &[&str], bytes: &[u8]) -> Value {
    let text = output(arguments, bytes);
    let last = text.lines().last().unwrap_or("null");
    serde_json::from_str(last).unwrap_or_else(|error| panic!("{last}: {error}"))
}

/// Returns the value for the command line's option `--frame` that selects the frames in the page's
/// address. The user's own frames are described in a file.
fn described(state: &Value) -> String {
    let address = state["address"].as_str().expect("an address");
    let mut pairs = address.split('&');
    let frame = pairs.find_map(|pair| pair.strip_prefix("frame="));
    match frame.expect("the address has the frames") {
        "own" => concat!(env!("CARGO_MANIFEST_DIR"), "/../page/motor.toml").to_owned(),
        name => name.to_owned(),
    }
}

/// Returns the command line's name of a machine on the page.
fn policy(machine: &Value) -> &'static str {
    if machine["state"].is_null() {
        "framelock"
    } else {
        "lecture"
    }
}

/// Compares the counts of bytes and frames on the page with the output of `decode --summary`.
fn compare_counts(name: &str, state: &Value, bytes: &[u8]) {
    for machine in list(&state["machines"]) {
        let policy = policy(machine);
        let decode = ["decode", "--format", "none", "--summary=-"];
        let frames = described(state);
        let which = ["--frame", &frames, "--policy", policy];
        let summary = last_object(&[decode, which].concat(), bytes);
        // When the command line's input ends, the pending bytes belong to no frame.
        let mut counters = machine["counters"].clone();
        counters["discarded"]["end_of_input"] = machine["pending"].clone();
        for (counted, expected) in [
            (&counters["bytes"], &summary["bytes"]),
            (&counters["frames"], &summary["frames"]),
            (&counters["discarded"], &summary["discarded_by"]),
        ] {
            assert_eq!(counted, expected, "{name}, {policy}: {counters} {summary}");
        }
        let slots = list(&machine["window"]).iter();
        let held = slots.take_while(|slot| !slot["byte"].is_null()).count();
        assert_eq!(machine["pending"], held, "{name}, {policy}");
    }
}

/// Compares the last frame's values and the machine's state on the page with `decode` and `trace`.
fn compare_values(name: &str, state: &Value, bytes: &[u8]) {
    let axes = ["pitch", "roll", "yaw"];
    let frames = described(state);
    for machine in list(&state["machines"]) {
        let policy = policy(machine);
        let last = last_object(&["decode", "--frame", &frames, "--policy", policy], bytes);
        let fields = list(&machine["fields"]);
        assert_eq!(fields.is_empty(), last.is_null(), "{name}, {policy}");
        for field in fields {
            let [key, value] = [0, 1].map(|at| field[at].as_str().expect("text"));
            let told = last[key]
                .as_str()
                .map_or(last[key].to_string(), str::to_owned);
            assert_eq!(value, told, "{name}, {policy}: {key}");
        }
        if machine["axes"].is_null() {
            continue;
        }
        let expected = axes.map(|axis| last[axis].clone());
        let shown = axes.map(|axis| machine["axes"]["setpoint"][axis].clone());
        assert_eq!(shown, expected, "{name}, {policy}");
        if policy == "lecture" {
            let (state, temporary, traced) = traced(bytes);
            assert_eq!(machine["state"], state, "{name}");
            assert_eq!(machine["axes"]["temporary"], temporary, "{name}");
            assert_eq!(json!(shown), traced, "{name}");
        }
    }
}

/// Traces the lecture's machine. Returns its state, its temporary values and its setpoint after the last byte.
fn traced(bytes: &[u8]) -> (String, Value, Value) {
    let text = output(&["trace", "--policy", "lecture", "-"], bytes);
    let (rows, _) = text.split_once("\n\n").expect("rows and the account");
    // The names of the events follow the columns `A -> B   7F C8 4A  7F C8 4A`.
    let (_, columns) = rows.rsplit_once(" -> ").expect("a row");
    let words: Vec<&str> = columns.split_whitespace().collect();
    let values = |words: &[&str]| {
        json!(
            words
                .iter()
                .map(|word| u8::from_str_radix(word, 16).ok())
                .collect::<Vec<_>>()
        )
    };
    (
        words[0].to_owned(),
        values(&words[1..4]),
        values(&words[4..7]),
    )
}

#[test]
fn each_preset_ends_as_the_command_line_says() {
    for page in Page::in_each(DEAF) {
        each_preset(&page, |name| {
            let bytes = received(&page);
            assert!(bytes.len() >= 7, "{name}");
            page.press("End");
            compare_counts(name, &page.state(), &bytes);
            compare_values(name, &page.state(), &bytes);
        });
    }
}

#[test]
fn back_and_forth_ends_where_it_was() {
    let page = Page::at(DEAF);
    each_preset(&page, |name| {
        let different = page.run(&format!(
            "{{ {GO}
            const {{ positions }} = JSON.parse(framelock());
            const places = [];
            for (let place = 0; place < positions; place += 10) places.push(place);
            const there = new Map(places.map((place) => [place, JSON.stringify(go(place))]));
            const onAndBack = () => (step.click(), back.click(), framelock());
            places.reverse().filter((place) =>
                JSON.stringify(go(place)) !== there.get(place) || onAndBack() !== there.get(place)) }}"
        ));
        assert_eq!(different, json!([]), "{name}");
    });
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
        ("frame=bin-crc8&seed=9&edits=22d.90f04&idle=on", 222),
        ("frame=crsf&edits=22d.30i41.31i0D.33f04", 330),
    ] {
        page.open(scenario);
        let _ = page.go(position);
        let before = page.state();
        assert_eq!(before["error"], "", "{scenario}");
        // The page writes its address after a short delay.
        page.wait_for("location.hash.slice(1) === JSON.parse(framelock()).address");
        let address = page.run("location.hash.slice(1)");
        other.open(address.as_str().expect("an address"));
        assert_eq!(other.state(), before, "{address}");
        assert_eq!(before["position"], position);
    }
}

#[test]
fn the_keyboard_is_enough() {
    for page in Page::in_each("frame=bin&frames=20") {
        let position = || number(&page.state()["position"]);
        let focus = || {
            let label =
                page.run("document.activeElement.ariaLabel || document.activeElement.textContent");
            label.as_str().unwrap_or_default().to_owned()
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
fn playing_holds_the_fault_and_the_missed_frame_until_the_user_continues() {
    for page in Page::in_each(DEAF) {
        page.run("document.getElementById('speed').value = '3000'; 0");
        let held = page.state()["holds"].clone();
        assert_eq!(list(&held).len(), 2, "{held}");
        for position in list(&held) {
            page.press(" ");
            page.wait_for(&format!("JSON.parse(framelock()).position >= {position}"));
            page.wait_for("!JSON.parse(framelock()).playing");
            assert_eq!(page.state()["position"], *position);
            assert_eq!(
                page.run("document.getElementById('play').textContent"),
                "Continue"
            );
        }
        // The lost byte is still on the page.
        let lost = page.run("document.querySelectorAll('#cells .lost').length");
        assert_eq!(lost, 1);
        page.press(" ");
        page.wait_for("JSON.parse(framelock()).position === JSON.parse(framelock()).bytes");
    }
}

#[test]
fn a_deaf_machine_says_that_it_has_no_frames() {
    for page in Page::in_each(&format!("{DEAF}&at=312")) {
        let reasons =
            page.run("[...document.querySelectorAll('.reason')].map((it) => it.textContent)");
        assert_eq!(reasons, json!(["Parked: no frames", "Parked: no frames"]));
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
        let bottoms = page.run(
            "[...document.querySelectorAll('.axes svg')].map((svg) => Math.ceil(svg.getBoundingClientRect().bottom))",
        );
        assert_eq!(list(&bottoms).len(), 2);
        for bottom in list(&bottoms) {
            assert!(number(bottom) <= 900, "{bottoms}");
        }
    }
}

#[test]
fn every_control_has_a_name() {
    let page = Page::at(&format!("{DEAF}&at=60"));
    page.run("document.querySelector('.cell:not(:disabled)').click()");
    let controls = page.run(
        "[...document.querySelectorAll('button, input, select, textarea, summary')]
            .filter((control) => control.checkVisibility()).length",
    );
    let mut named = 0;
    for (role, name) in page.accessible() {
        let is_control = [
            "button",
            "checkbox",
            "combobox",
            "searchbox",
            "slider",
            "spinbutton",
            "textbox",
            "disclosuretriangle",
        ];
        if is_control.contains(&role.to_lowercase().as_str()) {
            assert!(
                !name.trim().is_empty(),
                "a {role} has no name, after {named} others"
            );
            named += 1;
        }
    }
    assert_eq!(json!(named), controls);
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
        let problem = page.state()["problem"].clone();
        assert!(
            problem
                .as_str()
                .is_some_and(|text| text.starts_with("Line 12, column ")),
            "{problem}"
        );
        assert_eq!(field(1), json!(["position", "10.00", "deg"]));

        describe(&page, "'much'", "0.1");
        page.wait_for("document.querySelector('#description[aria-invalid=false]')");
        assert_eq!(field(1), json!(["position", "100.0", "deg"]));
        let focus = page.run("document.activeElement.id");
        assert_eq!(focus, "description", "the description keeps the focus");

        // The address contains the description, and keeps it while other frames are shown.
        page.wait_for("location.hash.slice(1) === JSON.parse(framelock()).address");
        let address = page.run("location.hash.slice(1)");
        let other = Page::at(address.as_str().expect("an address"));
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
        let values = page.run(
            "[...document.querySelector('[data-key=frame]').options].map((option) => option.value)",
        );
        assert!(list(&values).len() >= 15, "{values}");
        for value in list(&values) {
            page.run(&format!(
                "{{ const select = document.querySelector('[data-key=frame]');
            select.value = {value};
            select.dispatchEvent(new Event('change')); }}"
            ));
            page.press("End");
            let state = page.state();
            assert_eq!(state["error"], "", "{value}");
            let address = state["address"].as_str().expect("an address");
            assert!(address.starts_with(&format!("frame={}", value.as_str().expect("a name"))));
            let last = list(&state["machines"]).last().expect("a receiver");
            assert_eq!(last["status"], "LISTENING", "{value}");
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
            let widest = page.run("document.documentElement.scrollWidth");
            assert!(number(&widest) <= 360, "{name}: {widest}");
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
        // Playback may already have stopped at the first fault.
        let state = page.state();
        let has_begun = state["playing"] == true || number(&state["position"]) > 0;
        assert_eq!(has_begun, moves, "{wish}");
        assert_eq!(page.run(moving), moves, "{wish}");
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
            let colour = page.run(&format!(
                "getComputedStyle(document.body).{of}.match(/\\d+/g).slice(0, 3).map(Number)"
            ));
            list(&colour).iter().map(number).sum::<u64>()
        };
        (brightness("color"), brightness("backgroundColor"))
    });
    let [(ink, paper), (light_ink, dark_paper)] = colours;
    assert!(
        paper > ink + 300 && light_ink > dark_paper + 300,
        "{colours:?}"
    );
}
