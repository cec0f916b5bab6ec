# The stages of `cargo xtask verify`, a function each. `cargo xtask verify` starts this script once for each stage, and
# counts the tests in its output: `sh tools/xtask/stages.sh FUNCTION`, in the root, with the folder for builds in the
# variable TARGET. A command that fails ends the stage.
set -eu
# Descriptor 3 is the standard output of the stage, also in functions whose own output is redirected.
exec 3>&1
target=${TARGET:-$PWD/target}
. tools/xtask/setup.sh

# Options with which cargo's commands run clippy too. Clippy's compiler is rustc with more lints. An environment
# variable could also select clippy, but programs that cargo runs would inherit it.
lint="--config build.rustc-workspace-wrapper='clippy-driver'"
export CLIPPY_ARGS=-Dwarnings
# All packages except the one whose browser driver takes long to compile. Most stages that run tests pass these packages
# to cargo, because the packages determine the features of common dependencies. With other packages, cargo would compile
# these dependencies again. Clippy compiles the tests, so that they need not be compiled again to run.
everything="--workspace --all-features --exclude framelock-web-browser $lint"
published="--package framelock --package framelock-formats"
documented="$published --package framelock-proofs --package framelock-receiving --package framelock-simulation"

# Announces a command that runs tests, and runs it. `cargo xtask verify` checks that at least one test runs after each
# announcement.
tests_of() { echo "tests: $*"; "$@"; }

#= format: the sources are formatted by rustfmt
format() {
    lints
    for folder in . firmware firmware/examples/rp2040 fuzz formats/benches/rivals proofs/template; do
        (cd $folder; cargo fmt --all --check)
    done
}

chip=thumbv7em-none-eabihf

# The targets include one without atomic compare-and-swap, one with a floating-point unit, and one that is not Arm.
# Subsets of the features between the empty and the full one are checked for one target only.
#= core: the core compiles for microcontrollers under every set of its features; the formats compile too
core() {
    chips="thumbv6m-none-eabi $chip riscv32imac-unknown-none-elf"
    bare_metal $chips
    export RUSTFLAGS=-Dwarnings
    check="cargo check --target-dir $target/microcontrollers --no-default-features --package framelock"
    for one in $chips; do $check --package framelock-formats --target $one; done
    # Each subset of the features. A subset begins with a comma.
    subsets=,
    for feature in $(sed -n '/^\[features\]/,/^$/s/^"\?\([^" #]*\)"\? = .*/\1/p' core/Cargo.toml); do
        for subset in $subsets; do subsets="$subsets $subset,$feature"; done
    done
    for subset in $subsets; do $check --target $chip --features "$subset"; done
    for one in $chips; do $check --target $one --features "$subset"; done
    note "$(echo $subsets | wc -w) sets of features"
}

#= prove: the theorems, by Kani or by the offline prover; harnesses of more than 20 s only if their sources have changed
prove() { cargo xtask prove; }

#= clippy: no warning from the compiler or clippy, in all targets
clippy() {
    lints
    cargo test $everything --all-targets --no-run
    prover="cargo run --quiet --package framelock-offline-prover -- clippy"
    $prover --package framelock --package framelock-proofs --package framelock-formats --package framelock-reception
    $prover --package framelock-c-proofs --c c/proofs
}

# The firmware's tests need the images, and have a stage of their own.
#= tests: unit and integration tests, and replay of the corpora
tests() {
    c_tools
    tests_of cargo test $everything --all-targets --no-fail-fast --exclude framelock-firmware-tests
}

# Builds documentation in a separate folder. In the common folder, cargo would compile all dependencies again, because
# RUSTC_BOOTSTRAP changes their build. A stable compiler accepts unstable options only with this variable.
document() { RUSTC_BOOTSTRAP=1 cargo doc --no-deps --all-features $documented --target-dir "$target/documented"; }

#= docs: the documentation builds without warnings, and its examples run
docs() {
    tests_of cargo test $everything --doc
    export RUSTDOCFLAGS=-Dwarnings
    document
}

# Compares the public interface with the committed one. If SNAPSHOTS is `overwrite`, overwrites the committed one
# instead.
#= interface: the public interface of each published package equals the committed one
interface() {
    # docs.rs sets `docsrs`, too.
    export RUSTDOCFLAGS="-Dwarnings --cfg=docsrs -Zunstable-options --output-format=json"
    document
    echo "After an intended change, run: SNAPSHOTS=overwrite cargo xtask verify --only interface"
    for package in core:framelock formats:framelock_formats; do
        name=${package#*:}
        cargo xtask interface "$target/documented/doc/$name.json" >"$target/documented/$name.txt"
        [ "${SNAPSHOTS-}" != overwrite ] || cp "$target/documented/$name.txt" "${package%:*}/PUBLIC-API.txt"
        git diff --no-index --unified=0 "${package%:*}/PUBLIC-API.txt" "$target/documented/$name.txt"
    done
    note "compiled by $(rustc --version)"
}

# Prints the options of cargo that select an image's program and features.
options_of() {
    case $1 in
    default) echo --bin framelock-firmware ;;
    small) echo --bin framelock-firmware --no-default-features ;;
    megabaud | lecture | write-uicr | bin-crc8) echo --bin framelock-firmware --features="$1" ;;
    self-test) echo --bin self-test ;;
    self-test-megabaud) echo --bin self-test --features=megabaud ;;
    # Single steps of the parsers, to measure their costs.
    parser-steps) echo --bin parser-steps --no-default-features ;;
    *) return 1 ;;
    esac
}
every_image="default megabaud lecture write-uicr small bin-crc8 self-test self-test-megabaud parser-steps"

# Builds the images with these names, or all, from the sources in a folder, into a folder. All images have the same
# dependencies, so each further image takes only a second or two. Copies each image, because the next build would
# overwrite it.
images() (
    sources=$1 built=$2
    shift 2
    [ $# -gt 0 ] || set -- $every_image
    bare_metal $chip
    mkdir -p "$built/images"
    for image; do
        options=$(options_of "$image")
        build="cargo build --locked --release --target $chip --target-dir $built $options"
        # An image is built twice, because clippy's build is less optimised.
        [ -z "${with_lint-}" ] || [ -n "${debians-}" ] || (cd "$sources/firmware"; $build $lint)
        (cd "$sources/firmware"; $build)
        program=${options#--bin }
        cp "$built/$chip/release/${program%% *}" "$built/images/$image.elf"
    done
)

# Builds the images with these names, or all, writes them as Intel HEX, and prints their sizes.
hex_images() {
    binutils
    images . "$target/firmware" "$@"
    [ $# -gt 0 ] || set -- $every_image
    for image; do
        file=$target/firmware/images/$image
        hex=$target/firmware/images/framelock-nrf52840-$image.hex
        "$binutils-size" "$file.elf" | awk -v "name=$file.elf" 'NR == 2 { print name ": " $1 + $2 " bytes of flash" }'
        "$binutils-objcopy" -O ihex "$file.elf" "$hex"
        echo "$hex"
    done
}

# Makes a package with a format of your own and its theorems in a new folder.
own_proof() {
    mkdir -p "$(dirname "$1")"
    mkdir "$1"
    cp -r proofs/template/src "$1"
    sed "s|\.\./\.\.|$PWD|" proofs/template/Cargo.toml > "$1/Cargo.toml"
    echo "Change src/lib.rs and src/proofs.rs to your frame. Then run: cd $(realpath "$1") && cargo kani"
    echo "or without Kani: cargo run --manifest-path $PWD/Cargo.toml -p framelock-offline-prover -- --package own-frame"
    echo "Add --harness NAME to either command to check one theorem."
}

# Makes the archives for C and for Arduino, which contain the same headers.
archives() {
    archives=$target/archives
    rm -rf "$archives"
    mkdir -p "$archives"
    cp -r c/arduino "$archives/framelock"
    cp -r c/headers "$archives/framelock/src"
    (cd c; python3 -m zipfile -c "$archives/framelock-c.zip" headers CMakeLists.txt)
    (cd "$archives"; python3 -m zipfile -c framelock-arduino.zip framelock)
    rm -r "$archives/framelock"
    ls "$archives"/*
}

# Builds the firmware from the sources in a folder. Uses the dependencies that were built for the images.
build_settings() (
    bare_metal $chip
    cd "$1/firmware"
    cargo build --locked --release --target $chip --target-dir "$target/firmware" --bin framelock-firmware
)

#= firmware: the firmware builds for the nRF52840 without warnings, with each set of features
firmware() {
    with_lint=yes images . "$target/firmware"
    cargo xtask contradictions
}

# Tests the images in a folder. Further arguments are options for the tests.
emulated_in() {
    export FRAMELOCK_IMAGES="$1"
    shift
    tests_of cargo test $everything --test firmware -- "$@"
}

#= emulated: the firmware's release images in the emulator
emulated() {
    images . "$target/firmware"
    emulated_in "$target/firmware/images"
}

# The examples are built into the folder in which the guide's commands expect them. The RP2040 has no emulator.
#= examples (--all): the examples for Embassy and RTIC build without warnings and run in the emulator; the example for the RP2040 builds
examples() {
    # The guide's commands call plain `cargo`, which does not use Debian's compiler.
    without=$(
        exec 4>&1 >&3
        bare_metal $chip thumbv6m-none-eabi
        build="cargo build --locked --release"
        for options in "$lint" ""; do
            # Debian's compiler has no clippy.
            [ -z "$options" ] || [ -z "${debians-}" ] || continue
            (cd firmware; $build --target-dir target --package framelock-embassy --package framelock-rtic $options)
            (cd firmware/examples/rp2040; $build --target-dir "$target/rp2040" $options)
        done
        [ -z "${debians-}" ] || echo "--skip the_guides_commands" >&4
    )
    export FRAMELOCK_EXAMPLES="$PWD/firmware/target/$chip/release"
    tests_of cargo test $everything --test examples -- $without
}

# Checks the answers of the compared crates, and the formats' costs on the chip.
#= rivals (--all): the answers of framelock and of other crates on faulty streams, and the formats' cost on the chip
rivals() {
    (bare_metal $chip)
    cd formats/benches/rivals
    cargo clippy --locked --release --target-dir "$target/rivals" -- -Dwarnings
    cargo run --locked --release --target-dir "$target/rivals" -- check
}

#= tables (--all): pandas and polars read the tables that `decode` writes, and `encode` reads them back; MAVLink's messages have the names and values of pymavlink
tables() {
    python_with pandas==3.1.1 polars==2.1.0 pymavlink==2.4.50
    cargo build --package framelock-host
    "$python" host/cli/tests/tables.py "$target/debug/framelock" host/cli/tests/recordings.txt
    "$python" host/description/tests/message_names.py host/description/src/message_names.txt formats/src/dialects.rs
    "$python" host/cli/tests/mavlink.py "$target/debug/framelock" formats/src/dialects.rs
}

#= generated (--all): code generated from two hundred random descriptions
generated() {
    c_tools
    tests_of cargo test $everything --test c -- --ignored
}

#= slow-proofs (--all): the harnesses that take more than 20 s
slow_proofs() { cargo xtask prove --slow; }

#= c-proofs (--all): the receivers in C do the same as those in Rust, without undefined behaviour, by the offline prover
c_proofs() { cargo xtask prove --c; }

#= prover (--all): the offline prover refutes what must fail, and leaves no process running
prover() { tests_of cargo test --package framelock-offline-prover -- --ignored; }

# Builds the images with these names from the sources in a folder, into a folder. Then proves the receiver's step in the
# machine code of these images.
machine_code_of() {
    python_with $(sed '/^#/d' proofs/machine-code/requirements.txt)
    sources=$1 built=$2
    shift 2
    images "$sources" "$built" "$@"
    tests_of "$python" -B proofs/machine-code/prove.py $(printf "$built/images/%s.elf " "$@")
}

#= machine-code (--all): the receiver's step is proved in the machine code of the images, and seeded bugs in it are noticed
machine_code() {
    machine_code_of . "$target/firmware" default megabaud lecture small
    cargo xtask bugs machine-code
}

# Fuzzes without a sanitizer, because the core and the oracles forbid `unsafe`, and without tracing comparisons, because
# that would take more than half of the time. The dictionaries and seeds contain the values that are compared.
#= fuzz (--all): every fuzz target, for a minute
fuzz() {
    nightly
    cargo_tool cargo-fuzz 0.13.2
    # These variables of `cargo xtask`'s toolchain would confuse the nightly one.
    unset CARGO RUSTC RUSTUP_TOOLCHAIN LD_LIBRARY_PATH
    for name in $(cargo +nightly fuzz list); do
        mkdir -p "fuzz/corpus-found/$name"
        dictionary=
        [ ! -e "fuzz/$name.dict" ] || dictionary=-dict=fuzz/$name.dict
        cargo +nightly fuzz run --sanitizer=none --no-trace-compares "$name" "fuzz/corpus-found/$name" \
            "fuzz/corpus/$name" -- -max_total_time=60 -max_len=256 $dictionary
    done
}

#= systems (--all): the command line compiles for Windows and macOS
systems() {
    rustup target add x86_64-pc-windows-msvc aarch64-apple-darwin
    export RUSTFLAGS=-Dwarnings
    cargo check --package framelock-host --all-targets --target x86_64-pc-windows-msvc
    cargo check --package framelock-host --package xtask --all-targets --target aarch64-apple-darwin
}

#= minimum (--all): the core and the formats compile with the oldest Rust that their manifests promise
minimum() {
    oldest=1.85
    rustup toolchain install $oldest --profile minimal
    for package in core formats; do
        grep -q "^rust-version = \"$oldest\"" $package/Cargo.toml
        CARGO_TARGET_DIR=$target/$oldest cargo +$oldest check --manifest-path $package/Cargo.toml --all-features \
            --ignore-rust-version
    done
}

#= semver (--all): the public interface is compatible with that of the commit `semver-baseline`
semver() {
    cargo_tool cargo-semver-checks 0.51.0
    baseline=$(sed -n 's/^semver-baseline = "\(.*\)"/\1/p' Cargo.toml)
    # A shallow clone lacks the baseline. Fetch only this commit, without its history.
    git cat-file -e "$baseline^{commit}" || git fetch --quiet --no-tags --depth=1 origin "$baseline"
    echo "If a break is intended, see CONTRIBUTING.md, section To change the public interface"
    cargo semver-checks --baseline-rev "$baseline" $published
}

#= publish (--all): each published package can be published, without a warning
publish() {
    # A clone without symbolic links has files here that contain only a path.
    for folder in core formats; do
        cmp LICENSE-MIT $folder/LICENSE-MIT
        cmp LICENSE-APACHE $folder/LICENSE-APACHE
    done
    cargo publish --dry-run $published 2>"$target/publish" || { cat "$target/publish"; return 1; }
    cat "$target/publish"
    if grep '^warning' "$target/publish" | grep -v 'due to dry run'; then return 1; fi
}

#= wheel (--all): the Python package, built, installed into a new environment and run there
wheel() {
    python_with maturin==1.16.0
    folder=$target/wheel
    rm -rf "$folder"
    "$python" -m maturin build --release --locked --manifest-path host/cli/Cargo.toml --out "$folder"
    python3 -m venv "$folder/environment"
    "$folder/environment/bin/pip" install --quiet --no-index "$folder"/*.whl
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml)
    framelock=$folder/environment/bin/framelock
    [ "$("$framelock" --version)" = "framelock $version" ]
    grep -qx "version=$version" c/arduino/library.properties
    # From a file to a file, and from a pipe to a pipe. Noise follows each frame.
    cd "$folder"
    printf 'AB\0\1\2\3\rAB\0\4\5\6\rAB\0\7\10\11\r' >frames
    printf 'AB\0\1\2\3\r??AB\0\4\5\6\r??AB\0\7\10\11\r??' >noisy
    "$framelock" decode noisy --format csv --output table
    [ "$(wc -l <table)" = 4 ]
    "$framelock" decode --format csv <noisy | cmp - table
    "$framelock" encode <table | cmp - frames
}

# The nightly workflow also checks for security advisories, which change without a commit.
#= licences (--all): the licences, duplicates and sources of all dependencies, by cargo-deny
licences() {
    cargo_tool cargo-deny 0.20.2
    for folder in . firmware fuzz formats/benches/rivals; do
        cargo deny --manifest-path $folder/Cargo.toml --all-features --config deny.toml check licenses bans sources
    done
}

# Compiles the page's machines, generates the script that calls them, and writes the page. The version of
# wasm-bindgen-cli must equal the version of wasm-bindgen in host/web/Cargo.toml.
page() {
    wasm=wasm32-unknown-unknown
    echo "Compiles the page to WebAssembly, in about a minute. The first build also downloads a target (20 MB) and"
    echo "compiles wasm-bindgen into $target/tools, in three to five more minutes on two idle cores."
    rustup target add $wasm
    cargo_tool wasm-bindgen-cli 0.2.129
    cargo rustc --locked --package framelock-web --lib --crate-type cdylib --profile wasm --target $wasm
    wasm-bindgen --target no-modules --no-typescript --out-name machines --out-dir "$target/$wasm/wasm/bound" \
        "$target/$wasm/wasm/framelock_web.wasm"
    python3 tools/xtask/page.py "$target" "$@"
}

#= web (--all): the page works in browsers
web() {
    browsers
    page
    cargo build --package framelock-web --example views
    # The tests run in another folder, so the paths are absolute.
    export FRAMELOCK_PAGE="$target/web/index.html" FRAMELOCK_VIEWS="$target/debug/examples/views"
    [ -z "${FRAMELOCK_PICTURES-}" ] || export FRAMELOCK_PICTURES="$PWD/$FRAMELOCK_PICTURES"
    tests_of cargo test --package framelock-web-browser $lint -- --show-output
}

# First runs every case of all tests, with many more random streams, also under random combinations of assumptions about
# the chip. Then runs the tests as at each commit, but under each single assumption.
#= random (--all): the firmware with many more random streams, and under each assumption about the chip
random() {
    images . "$target/firmware"
    export FRAMELOCK_RANDOM_RUNS="${FRAMELOCK_RANDOM_RUNS:-20000}" FRAMELOCK_ALL_CASES=1
    emulated_in "$target/firmware/images"
    unset FRAMELOCK_RANDOM_RUNS FRAMELOCK_ALL_CASES
    emulated_in "$target/firmware/images" --ignored
}

#= bugs (--all): seeded bugs break every harness and every rule of the firmware, and planted mistakes their checks
bugs() { cargo xtask bugs; }

# Checks the changes with the tests of the core and of the formats, also those against the reference. With the
# harnesses, the check takes most of a day: see proofs/README.md.
#= mutants (--all): some test notices each small change of the core, layouts and checksums (hours)
mutants() {
    cargo_tool cargo-mutants 27.1.0
    # Exit code 3: some change made the tests run into their time limit. Such a change counts as noticed.
    cargo mutants --workspace --test-package framelock --test-package framelock-formats \
        --test-package framelock-oracles --output "$target/mutants-by-tests" || [ $? = 3 ]
}

"$@"
