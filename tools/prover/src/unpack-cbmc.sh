# Unpacks Debian's CBMC into the folder $1. Installs nothing in the system.
set -eu
release=trixie # This release contains CBMC 6.x, on which Kani is built.
if [ "$(uname -sm)" != "Linux x86_64" ]; then
    echo "Debian's packages work only on x86-64 Linux" >&2
    exit 1
fi
work=$1.new
rm -rf "$work"
mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/packages" "$work/unpacked"

# Use this machine's mirror, or else Debian's own. apt checks downloads against Debian's signatures.
mirror=$(sed -n 's|^URIs: *\([^ ]*/debian\)/*$|\1|p' /etc/apt/sources.list.d/* 2>/dev/null | head -n 1)
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
signed=
if [ -e "$keyring" ]; then
    signed="[signed-by=$keyring]"
fi
echo "deb $signed ${mirror:-http://deb.debian.org/debian} $release main" > "$work/sources.list"
apt() {
    apt-get --quiet=2 \
        -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=- \
        -o Dir::State::Lists="$work/lists" -o Dir::Cache="$work/cache" \
        -o APT::Sandbox::User=root -o Acquire::Languages=none "$@"
}
apt update
cd "$work/packages"
# The checker, its solver, and the libraries from this release that both need.
apt download cbmc minisat libc6 libstdc++6 libgcc-s1
for package in *.deb; do
    dpkg-deb --extract "$package" "$work/unpacked"
done

# The script starts CBMC with the loader and the libraries of its own release.
libraries=$1/usr/lib/x86_64-linux-gnu
cat > "$work/unpacked/cbmc" <<END
#!/bin/sh
exec "$libraries/ld-linux-x86-64.so.2" --library-path "$libraries:$1/usr/lib" "$1/usr/bin/cbmc" "\$@"
END
chmod +x "$work/unpacked/cbmc"

# Rename the folder last, because an incomplete folder would be mistaken for a complete one.
mv "$work/unpacked" "$1"
rm -rf "$work"
