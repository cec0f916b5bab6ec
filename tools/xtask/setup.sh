# Installs what the stages in `stages.sh` need, with rustup, cargo, pip or Debian's packages. Each function does nothing
# if everything is there, and fails if something cannot be installed. Tools are installed into $target/tools.

# Prints a remark, such as which tool was chosen. `cargo xtask verify` repeats the remark in its summary.
note() { echo "remark: $*" >&3; }

have() { for command; do command -v "$command" >/dev/null || return 1; done; }

# Installs these packages of Debian. Only root can do this. With `--no-remove`, apt-get fails rather than remove a
# package.
debian() {
    dpkg-query --show --showformat='${db:Status-Status}\n' "$@" 2>&1 | grep -qvx installed || return 0
    apt-get -o DPkg::Lock::Timeout=120 update
    DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 install --yes --no-install-recommends --no-remove "$@"
}

# The compilers, build system and simulators for C.
c_tools() {
    have ccache clang cmake arm-none-eabi-gcc avr-gcc simavr && [ -d /usr/share/arduino/hardware/arduino/avr ] &&
        [ -d /usr/include/simavr ] && return
    debian ccache clang cmake gcc-arm-none-eabi gcc-avr avr-libc simavr libsimavr-dev arduino-core-avr
}

# Sets `binutils` to the beginning of the paths of objcopy and size for Arm.
binutils() {
    binutils=arm-none-eabi
    have $binutils-objcopy && return
    rustup component add llvm-tools
    binutils=$(rustc --print target-libdir)/../bin/llvm
}

browsers() {
    have chromium || have chromium-browser || have google-chrome || have google-chrome-stable || debian chromium
    have firefox-esr || have firefox || debian firefox-esr
}

# Sets `python` to an interpreter with these packages of PyPI.
python_with() {
    environment=$target/tools/python/$(echo "$@" | tr ' /' '__')
    python=$environment/bin/python
    [ -e "$environment/installed" ] && return
    python3 -c 'import ensurepip' || debian python3 python3-venv
    python3 -m venv --clear "$environment"
    "$python" -m pip install --quiet --only-binary :all: "$@"
    touch "$environment/installed"
}

# Puts this version of a cargo command into PATH.
cargo_tool() {
    folder=$target/tools/$1
    if [ ! -e "$folder/$2" ]; then
        cargo install --locked --force --version "$2" --root "$folder" --target-dir "$folder/build" "$1"
        rm -r "$folder/build"
        touch "$folder/$2"
    fi
    PATH=$folder/bin:$PATH
}

lints() { cargo clippy --version && cargo fmt --version || rustup component add clippy rustfmt; }

nightly() { rustup run nightly rustc --version || rustup toolchain install nightly --profile minimal; }

# Returns whether the toolchain has `core` for the target. An interrupted installation may leave an empty folder behind.
has_core() { ls "$(rustc --print target-libdir --target "$1")"/libcore-*; }

# Chooses the compiler for these targets without an operating system: the toolchain in PATH if it has the targets or
# rustup can add them, otherwise the compiler with which Debian builds its browsers. Debian has the source of `core`,
# which cargo then builds. Sets `debians` if the compiler is Debian's. The compiler is chosen for the whole shell, so
# use a subshell.
bare_metal() {
    unset RUSTFLAGS
    for chip; do has_core "$chip" >/dev/null 2>&1 || missing=$chip; done
    # Do not retry an unreachable server, because there is another compiler.
    if [ -z "${missing-}" ] || RUSTUP_MAX_RETRIES=0 RUSTUP_DOWNLOAD_TIMEOUT=60 rustup target add "$@"; then
        note "compiled by $(rustc --version)"
        return
    fi
    linker=$(rustc --print target-libdir)/../bin/rust-lld
    # `cargo xtask` puts the libraries of rustup's toolchain into this path, but Debian's compiler must not use them.
    unset LD_LIBRARY_PATH
    debian rustc-web rust-web-src
    debians=yes
    # Building `core` is an unstable feature, which a stable cargo accepts only with the second variable.
    export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=core
    # Debian's compiler has no linker for these targets.
    [ ! -e "$linker" ] ||
        export CARGO_TARGET_THUMBV6M_NONE_EABI_LINKER="$linker" CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER="$linker"
    note "compiled by Debian's $(/usr/bin/rustc --version), because rustup cannot add $*; core is built from source"
}
